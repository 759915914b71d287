"""``scenelang compile``: a scene to a program in a file; imports no torch."""

from __future__ import annotations

import click

from scenelang.cli import options
from scenelang.cli.files import PROGRAM, shown
from scenelang.cli.say import Clock


@click.command("compile")
@click.argument("file", metavar="FILE")
@options.writes("OUT", "Program to write, .safetensors; - is standard output.", PROGRAM)
@options.request()
@options.strict
@options.verbose
@click.pass_context
def command(
    ctx: click.Context, file: str, out: str, request: options.Request, strict: bool, verbose: bool
) -> None:
    """Compile a scene to a program that `scenelang render` draws and other software can read.

    FILE is a scene, or - for standard input. `scenelang dump` shows what the compiler made of it.
    """
    from scenelang.cli.inputs import prepare_scene

    if not out.endswith(PROGRAM):
        raise click.UsageError(f"A program's file ends in {PROGRAM}, `{out}` does not.")
    clock = Clock()
    job = prepare_scene(file, request, clock)
    if job.failed(strict) or job.program is None:
        ctx.exit(1)
    with clock("save"):
        job.program.save(out)
    if verbose:
        click.echo("\n  ".join([f"{file} -> {shown(out)}", *job.notes]) + f"\n{clock.report()}", err=True)
