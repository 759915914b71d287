"""``scenelang compile``: a scene to a program in a file; imports no torch."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenelang.cli import options

if TYPE_CHECKING:
    from scenelang.graph.nodes import Graph
    from scenelang.program.program import Program
    from scenelang.scene.params import Defines


@click.command("compile")
@click.argument("file", metavar="FILE")
@click.option("-o", "--out", metavar="OUT", help="The program's file, .safetensors.")
@click.option(
    "--dump-after",
    "dumps",
    multiple=True,
    metavar="PASS",
    help="Print the graph after a pass, or after 'lower' as written; may be given several times.",
)
@options.size
@options.define
@options.frame
@options.model
@options.strict
@options.root
@options.verbose
@click.pass_context
def command(
    ctx: click.Context,
    file: str,
    out: str | None,
    dumps: tuple[str, ...],
    size: tuple[int, int] | None,
    defines: Defines,
    frame: int,
    model: str | None,
    strict: bool,
    root: str | None,
    verbose: bool,
) -> None:
    """Compile a scene to a program that `scenelang render` draws and other software can read.

    FILE is a scene, or - for standard input. Without OUT the scene is compiled and only what
    --dump-after asks for is printed.
    """
    from scenelang.cli.clock import Clock
    from scenelang.cli.inputs import Request, unused_defines
    from scenelang.cli.jobs import PROGRAM, prepare
    from scenelang.cli.say import say_diagnostics

    if out is None and not dumps:
        raise click.UsageError("Give -o OUT, --dump-after PASS, or both.")
    if file.endswith(PROGRAM):
        raise click.UsageError(f"'{file}' is a compiled program already.")
    if out is not None and not out.endswith(PROGRAM):
        raise click.UsageError(f"A program's file ends in {PROGRAM}, '{out}' does not.")
    _check_passes(dumps)

    def after(name: str, graph: Graph) -> None:
        from scenelang.graph.dump import dump

        if name in dumps:
            click.echo(f"after {name}:\n{dump(graph)}")

    clock = Clock()
    request = Request(defines, model, root, frame, size)
    job = prepare(file, request, clock, verbose=verbose, after=after if dumps else None)
    job.diagnostics = [*job.diagnostics, *unused_defines(request)]
    say_diagnostics(job.diagnostics)
    if job.failed(strict) or job.program is None:
        ctx.exit(1)
    if out is not None:
        with clock("save"):
            _save(job.program, out)
    if verbose:
        lines = "".join(f"\n  {note}" for note in job.notes)
        click.echo(f"{file}{f' -> {out}' if out else ''}{lines}\n{clock.report()}", err=True)


def _check_passes(names: tuple[str, ...]) -> None:
    from scenelang.passes import PASSES

    known = ["lower", *(step.name for step in PASSES)]
    for name in names:
        if name not in known:
            raise click.UsageError(f"No pass '{name}'; there are {', '.join(known)}.")


def _save(program: Program, out: str) -> None:
    from scenelang.cli.main import Trouble

    try:
        program.save(Path(out))
    except OSError as error:  # it names the temporary file
        raise Trouble(f"cannot write '{out}': {(error.strerror or str(error)).lower()}") from None
