"""``scenelang check``: what is wrong with scenes; imports neither numpy nor torch."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Literal

import click

from scenelang.cli import options

if TYPE_CHECKING:
    from scenelang.diagnostics.diagnostic import Diagnostic, Diagnostics
    from scenelang.scene.params import Defines

Format = Literal["human", "json", "sarif", "github", "concise"]


@click.command("check")
@click.argument("files", nargs=-1, required=True, metavar="FILE…")
@options.define
@options.model
@options.strict
@click.option(
    "--format",
    "kind",
    type=click.Choice(["human", "json", "sarif", "github", "concise"]),
    default="human",
    show_default=True,
    help="How diagnostics are written.",
)
@options.frame
@options.root
@click.pass_context
def command(
    ctx: click.Context,
    files: tuple[str, ...],
    defines: Defines,
    model: str | None,
    strict: bool,
    kind: Format,
    frame: int,
    root: str | None,
) -> None:
    """Report what is wrong with scenes, without drawing them.

    FILE is a scene, or - for standard input. Exits with 0 where there are no errors, 1 where there are,
    2 where a file cannot be read.
    """
    from scenelang.cli.clock import Clock
    from scenelang.cli.inputs import Request, merged, read_input, unused_defines
    from scenelang.cli.main import describe
    from scenelang.cli.say import say_trouble
    from scenelang.passes import check_scene
    from scenelang.program.compile import find_model

    request = Request(defines, model, root, frame)
    parts: list[list[Diagnostic]] = []
    unreadable = False
    for name in files:
        try:
            found = read_input(name, request, Clock())
        except OSError as error:
            say_trouble(describe(error))
            unreadable = True
            continue
        if found.scene is not None:
            manifest = find_model(found.scene, found.diagnostics, model=model, spans=found.spans)
            if manifest is not None:
                check_scene(found.scene, found.spans, found.diagnostics, manifest)
        parts.append(found.diagnostics.items)
    read = len(parts)
    if read:
        parts.append(unused_defines(request))
    everything = merged(parts)
    _write(everything, kind, read)
    wrong = everything.items if strict else everything.errors
    ctx.exit(2 if unreadable else int(bool(wrong)))


def _write(found: Diagnostics, kind: Format, scenes: int) -> None:
    """Print the diagnostics of some scenes to standard output."""
    from scenelang.cli.say import wants_color
    from scenelang.diagnostics.render_text import plural, render_text

    if kind != "human":
        click.echo(_for_machines(found, kind), nl=False)
    elif found.items:
        click.echo(render_text(found, wants_color(sys.stdout)), nl=False, color=True)
    elif scenes:
        click.echo(f"no mistakes in {plural(scenes, 'scene')}")


def _for_machines(found: Diagnostics, kind: Format) -> str:
    from importlib.metadata import version

    from scenelang.diagnostics import render_machine

    if kind == "sarif":
        return render_machine.render_sarif(found, version("scenelang"))
    if kind == "json":
        return render_machine.render_json(found)
    return render_machine.render_github(found) if kind == "github" else render_machine.render_concise(found)
