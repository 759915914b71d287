"""``scenelang render``: scenes and compiled programs to picture files, in one process."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from scenelang.cli import options

if TYPE_CHECKING:
    from collections.abc import Callable

    from scenelang.cli.clock import Clock
    from scenelang.cli.inputs import Request
    from scenelang.cli.jobs import Job
    from scenelang.image import Image
    from scenelang.scene.params import Defines

    Draw = Callable[[Job, Callable[[float], None]], Image]


@click.command("render")
@click.argument("files", nargs=-1, required=True, metavar="FILE…")
@click.option("-o", "--out", required=True, metavar="OUT", help="A picture, or for several scenes a folder.")
@options.size
@options.define
@options.frame
@options.model
@click.option(
    "--backend",
    type=click.Choice(["neural", "reference"]),
    default="neural",
    show_default=True,
    help="Draw with the trained network, or by the exact definition.",
)
@options.device
@options.threads
@options.strict
@options.root
@options.verbose
@click.pass_context
def command(
    ctx: click.Context,
    files: tuple[str, ...],
    out: str,
    size: tuple[int, int] | None,
    defines: Defines,
    frame: int,
    model: str | None,
    backend: Literal["neural", "reference"],
    device: str,
    threads: int | None,
    strict: bool,
    root: str | None,
    verbose: bool,
) -> None:
    """Draw scenes.

    FILE is a scene, - for standard input, or a program that `scenelang compile` made (.safetensors). OUT is
    a picture whose suffix names the format; several scenes are drawn into a folder, each as STEM.png.
    Scenes with errors are reported and left out. Exits with 1 if there are any, 2 if a file cannot be read
    or written.
    """
    from scenelang.cli.clock import Clock
    from scenelang.cli.inputs import Request
    from scenelang.cli.outputs import targets
    from scenelang.cli.progress import Bar

    paths = targets(files, out)
    clock = Clock()
    request = Request(defines, model, root, frame, size)
    jobs, code = _prepared(files, request, clock, strict, backend, verbose)
    ready = [(job, path) for job, path in zip(jobs, paths, strict=True) if job and not job.failed(strict)]
    if not ready:
        ctx.exit(code)
    draw = _exact(request, clock) if backend == "reference" else _neural(clock, device, threads)
    with Bar("drawing", len(ready)) as bar:
        for index, (job, path) in enumerate(ready):
            image = draw(job, partial(bar.part, index))
            with clock("save"):
                _save(image, path)
            if verbose:
                _tell(job, path)
            bar.to(index + 1)
    if verbose:
        click.echo(clock.report(), err=True)
    ctx.exit(code)


def _prepared(
    files: tuple[str, ...], request: Request, clock: Clock, strict: bool, backend: str, verbose: bool
) -> tuple[list[Job | None], int]:
    """Every input read and compiled, None where it cannot be read; reports mistakes; the exit code so far."""
    from scenelang.cli.inputs import merged, unused_defines
    from scenelang.cli.jobs import prepare
    from scenelang.cli.main import describe
    from scenelang.cli.say import say_diagnostics, say_trouble

    jobs: list[Job | None] = []
    code = 0
    for name in files:
        try:
            job = prepare(name, request, clock, compiled=backend == "neural", verbose=verbose)
        except OSError as error:
            say_trouble(describe(error))
            jobs.append(None)
            code = 2
            continue
        if backend == "reference" and job.program is not None:
            job.trouble = "the reference draws scenes; a program keeps only what the network needs"
        if job.trouble is not None:
            say_trouble(f"{name}: {job.trouble}")
        jobs.append(job)
    read = [job for job in jobs if job is not None]
    unused = unused_defines(request) if read else []
    say_diagnostics(merged([*(job.diagnostics for job in read), unused]))
    if unused:
        return [None] * len(jobs), max(code, 1)
    return jobs, max(code, int(any(job.failed(strict) for job in read)))


def _neural(clock: Clock, device: str, threads: int | None) -> Draw:
    with clock("load torch"):
        from scenelang.backend.neural import choose_device, draw_program, open_model
    place = choose_device(device)

    def draw(job: Job, progress: Callable[[float], None]) -> Image:
        assert job.program is not None
        with clock("load model"):
            model = open_model(job.program.model, place)
        with clock("draw"):
            drawing = draw_program(job.program, model, threads=threads, progress=progress)
        width, height = job.program.canvas
        once = width * height - drawing.refined
        job.notes.append(f"drew {once:,} pixels by one sample and {drawing.refined:,} by four, on {place}")
        job.notes.append(f"{drawing.pairs:,} meetings of a sample and an object")
        return drawing.image

    return draw


def _exact(request: Request, clock: Clock) -> Draw:
    from scenelang.backend.exact import draw_exact

    def draw(job: Job, progress: Callable[[float], None]) -> Image:
        assert job.source is not None
        assert job.source.scene is not None
        with clock("draw"):
            image = draw_exact(job.source.scene, spans=job.source.spans, model=request.model)
        job.notes.append("drew the exact picture, four samples a pixel")
        return image

    return draw


def _save(image: Image, path: Path) -> None:
    from scenelang.cli.main import Trouble

    try:
        image.save(path)
    except OSError as error:  # it names the temporary file
        raise Trouble(f"cannot write '{path}': {(error.strerror or str(error)).lower()}") from None


def _tell(job: Job, path: Path) -> None:
    lines = "".join(f"\n  {note}" for note in job.notes)
    click.echo(f"{job.name} -> {path}{lines}", err=True)
