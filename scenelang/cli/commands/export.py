"""``scenelang export``: scenes to pages that draw themselves."""

from __future__ import annotations

import click

from scenelang.assets.files import write_output
from scenelang.cli import options
from scenelang.cli.files import PAGE, shown, stem_of, targets
from scenelang.cli.say import Clock, say_diagnostics, say_trouble


@click.command("export")
@click.argument("files", nargs=-1, required=True, metavar="FILE…")
@options.writes("OUT", "Page (.html) or folder to write; - is standard output.", PAGE)
@click.option("--title", metavar="TEXT", help="Title of the page; by default the name of the file.")
@options.request()
@options.strict
@options.verbose
@click.pass_context
def command(
    ctx: click.Context,
    files: tuple[str, ...],
    out: str,
    title: str | None,
    request: options.Request,
    strict: bool,
    verbose: bool,
) -> None:
    """Write scenes as web pages that draw themselves.

    FILE is a scene, - for standard input, or a program that `scenelang compile` made (.safetensors). OUT is
    a page; several scenes go into a folder, each as STEM.html. A page is one file and asks for nothing: send
    it or put it anywhere. The scene runs in it by WebGL2: its params are sliders, its animation plays, and
    the camera of a 3D scene can be moved.

    Scenes with errors are reported and left out. Exits with 1 if there are any, 2 if a file cannot be read
    or written.
    """
    from scenelang.cli.inputs import prepare_all
    from scenelang.compiler.program import ProgramError
    from scenelang.language.reports import SceneError
    from scenelang.web.export import page, scene_view, still

    if title is not None and len(files) > 1:
        raise click.UsageError("--title is of one page; several have the names of their files.")
    clock = Clock()
    paths = targets(files, out, PAGE)
    jobs, code = prepare_all(files, request, clock, strict=strict)
    for job, path in zip(jobs, paths, strict=True):
        if job is None or job.failed(strict) or job.program is None:
            continue
        try:
            with clock("view"):
                view = scene_view(job.program, job.scene, job.evaluation, title=title or stem_of(job.name))
        except SceneError as error:
            say_diagnostics(error.diagnostics)
            code = max(code, 1)
            continue
        except ProgramError as error:
            say_trouble(f"{job.name}: {error}")
            code = 2
            continue
        with clock("still picture"):
            picture = still(job.program)
        with clock("save"):
            text = page(view, still=picture).encode()
            write_output(path, text)
        if verbose:
            click.echo(
                "\n  ".join([f"{job.name} -> {shown(path)}", *job.notes, f"{len(text):,} bytes"]), err=True
            )
    if verbose:
        click.echo(clock.report(), err=True)
    ctx.exit(code)
