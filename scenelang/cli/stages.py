"""What a scene is after each stage of the compiler, for the commands that show it."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import click

from scenelang.cli.inputs import Input, Request, read_scene
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.graph.nodes import Graph

if TYPE_CHECKING:
    from scenelang.program.program import Program


@dataclass(slots=True)
class Stages:
    """Everything that was made of a scene; what comes after a mistake may be missing.

    Args:
        source: the tree and the scene.
        graphs: the graph after ``lower`` and each pass, in order.
        program: what is drawn.
    """

    source: Input
    graphs: dict[str, Graph] = field(default_factory=dict)
    program: Program | None = None

    @property
    def diagnostics(self) -> Diagnostics:
        """What was found on the way."""
        return self.source.diagnostics


def stage_names() -> list[str]:
    """The stages in order: the syntax tree, the scene, the graph after each pass, the program."""
    from scenelang.passes import PASSES

    return ["syntax", "scene", "lower", *(step.name for step in PASSES), "program"]


def known_stages(wanted: tuple[str, ...], *, without: tuple[str, ...] = ()) -> tuple[str, ...]:
    """The stages that were asked for, all of them known.

    Raises:
        click.UsageError: one is not.
    """
    from difflib import get_close_matches

    names = [name for name in stage_names() if name not in without]
    for name in wanted:
        if name not in names:
            near = get_close_matches(name, names, 1)
            advice = f" Did you mean `{near[0]}`?" if near else ""
            raise click.UsageError(f"No stage `{name}`.{advice} There are {', '.join(names)}.")
    return wanted


def run_stages(file: str, request: Request) -> Stages:
    """Read a scene and take it through all stages that its mistakes allow.

    Raises:
        OSError: it cannot be read.
    """
    from scenelang.program.compile import compile_scene

    made = Stages(read_scene(file, request))
    scene = made.source.scene
    if scene is not None:
        with suppress(SceneError):  # its diagnostics are the input's
            made.program = compile_scene(
                scene,
                spans=made.source.spans,
                diagnostics=made.diagnostics,
                model=request.model,
                after=made.graphs.__setitem__,
            )
    return made
