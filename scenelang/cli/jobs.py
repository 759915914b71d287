"""From an input of the command line to something a backend draws."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenelang.backend.options import DEFAULT, How
from scenelang.cli.inputs import Input, Request, merged, read_input, unused_defines
from scenelang.cli.main import describe
from scenelang.cli.progress import Clock
from scenelang.cli.say import say_diagnostics, say_trouble
from scenelang.diagnostics.error import SceneError
from scenelang.models.choose import why_chosen
from scenelang.program.compile import compile_scene

if TYPE_CHECKING:
    from scenelang.program.program import Program

PROGRAM = ".safetensors"


def compile_input(found: Input, request: Request, clock: Clock, graphs: bool = False) -> None:
    """Compile a scene, if it is one without errors that is not drawn by the reference; ``graphs`` are kept.

    Raises:
        OSError: a model has no weights.
    """
    if found.scene is None or found.how.backend == "reference":
        return
    with suppress(SceneError), clock("compile"):  # its diagnostics are the input's
        found.program = compile_scene(
            found.scene,
            spans=found.spans,
            diagnostics=found.diagnostics,
            after=found.graphs.__setitem__ if graphs else None,
        )
        why = why_chosen(found.scene, request.source.model is not None)
        found.notes = program_notes(found.program, why)


def prepare_all(
    files: Sequence[str],
    request: Request,
    clock: Clock,
    how: How = DEFAULT,
    *,
    strict: bool = False,
    graphs: bool = False,
    stored: str | None = None,
    first: Input | None = None,
) -> tuple[list[Input | None], int]:
    """Every input read and compiled, None where it cannot be read; reports mistakes.

    Args:
        how: how they are drawn.
        strict: warnings count as errors.
        graphs: keep the graph after each pass.
        stored: why compiled programs are refused, if they are.
        first: the only one, where it was read before.

    Returns:
        The inputs, and the exit code so far: 1 where a scene has mistakes, 2 where a file cannot be read.
    """
    inputs: list[Input | None] = []
    code = 0
    for name in files:
        try:
            if name.endswith(PROGRAM):
                found = _stored(name, request, clock, how)
                found.trouble = stored or found.trouble
            else:
                found = first or read_input(name, request, clock, how)
                compile_input(found, request, clock, graphs)
        except OSError as error:
            say_trouble(describe(error))
            inputs.append(None)
            code = 2
            continue
        if found.trouble is not None:
            say_trouble(f"{name}: {found.trouble}")
        inputs.append(found)
    read = [found for found in inputs if found is not None]
    unused = unused_defines(request) if read else []
    say_diagnostics(merged([*(found.diagnostics.items for found in read), unused]))
    if unused:
        return [None] * len(inputs), max(code, 1)
    return inputs, max(code, int(any(found.failed(strict) for found in read)))


def prepare_scene(name: str, request: Request, clock: Clock | None = None) -> Input:
    """Compile the one scene of a command, keep its graphs and report its mistakes.

    Raises:
        OSError: it cannot be read, or a model has no weights.
        click.UsageError: it is a compiled program.
    """
    if name.endswith(PROGRAM):
        raise click.UsageError(f"`{name}` is a compiled program already.")
    clock = clock or Clock()
    found = read_input(name, request, clock)
    compile_input(found, request, clock, graphs=True)
    found.diagnostics.items.extend(unused_defines(request))
    say_diagnostics(found.diagnostics)
    return found


def _stored(name: str, request: Request, clock: Clock, how: How) -> Input:
    from scenelang.program.program import ProgramError
    from scenelang.program.reading import load_program

    found, size, model = Input(name, how), request.source.size, request.source.model
    try:
        with clock("load program"):
            program = load_program(Path(name))
    except ProgramError as error:
        found.trouble = str(error)
        return found
    if model not in (None, program.model):
        found.trouble = f"compiled for model `{program.model}`, not `{model}`"
    elif request.frame:
        found.trouble = f"a program is a single frame, and --frame asks for {request.frame}"
    elif size is not None:
        (width, height), (old_width, old_height) = size, program.canvas
        if width * old_height != height * old_width:
            old = f"the {old_width}x{old_height} it was compiled for"
            advice = "objects outside it are gone: compile the scene again"
            found.trouble = f"{width}x{height} has another shape than {old}; {advice}"
        program = replace(program, canvas=size)
    found.program, found.notes = program, program_notes(program, "named by the program")
    return found


def program_notes(program: Program, why: str) -> list[str]:
    """Lines about a compiled scene."""
    from scenelang.program.groups import OPERATOR
    from scenelang.words import COMBINE

    shapes = Counter(program.objects)
    words = Counter((program.tokens & OPERATOR).tolist())
    width, height = program.canvas
    return [
        f"{width} x {height} pixels, model {program.model} ({why}), weights {program.weights[:12]}",
        f"objects: {len(program)}" + _counts(shapes),
        "tokens: " + (_counts({COMBINE[t]: n for t, n in sorted(words.items())})[2:-1] or "none"),
    ]


def _counts(counts: dict[str, int]) -> str:
    """`` (2 star, 1 square)``, or nothing."""
    listed = ", ".join(f"{number} {name}" for name, number in counts.items())
    return f" ({listed})" if listed else ""
