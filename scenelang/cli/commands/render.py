"""``scenelang render``: scenes and compiled programs to pictures and animations."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import click

from scenelang.cli import inputs
from scenelang.cli.main import Trouble
from scenelang.cli.say import Bar, Clock

if TYPE_CHECKING:
    from collections.abc import Callable

    from scenelang.cli.inputs import Input, Request
    from scenelang.drawing.how import How
    from scenelang.drawing.image import Image, Output, Outputs


_SECTIONS: Final = {
    "Animations": "--frame --frames --fps --jobs --cluster --palette --dither",
    "How it is drawn": "--model --backend --samples --max-ms --max-flip --originals --device --threads",
    "More than a picture": "--output --prove --redraw --verbose",
}


@click.command("render", cls=inputs.Sectioned, sections=_SECTIONS)
@click.argument("files", nargs=-1, required=True, metavar="FILE…")
@click.option(
    "-o",
    "--out",
    required=True,
    metavar="OUT",
    help="Picture, animation, numbered pictures or folder to write.",
)
@inputs.request
@inputs.frames
@inputs.fps
@inputs.jobs
@inputs.cluster
@inputs.choice(
    "--palette", words="auto global frame", help="Colours of a GIF: 255 for all frames or for each."
)
@click.option("--dither", is_flag=True, help="Dither colours that a GIF's palette lacks.")
@inputs.drawing()
@click.option(
    "--output",
    "outputs",
    multiple=True,
    type=click.Choice(("depth", "normal", "object", "alpha", "proof")),
    help="Output to write beside the picture, to STEM.depth.png and so on, or into an .exr; may be "
    "given several times.",
)
@click.option("--prove", is_flag=True, help="Prove how far pixels are from the exact picture at most (2D).")
@click.option("--redraw", is_flag=True, help="With a proof: draw again what is not proved right to 1/255.")
@click.option(
    "--max-ms",
    type=inputs.Real(0, min_open=True),
    metavar="N",
    help="Choose the most exact way to draw that takes at most N milliseconds on one thread.",
)
@click.option(
    "--max-flip",
    type=inputs.Real(0, 1),
    metavar="E",
    help="Choose the fastest way to draw whose promised FLIP error is at most E.",
)
@inputs.originals
@inputs.strict
@inputs.verbose
@click.pass_context
def command(
    ctx: click.Context,
    files: tuple[str, ...],
    out: str,
    request: Request,
    how: How,
    frames: str | None,
    fps: float | None,
    jobs: int | None,
    cluster: str | None,
    palette: Literal["auto", "global", "frame"],
    dither: bool,
    outputs: tuple[Output, ...],
    prove: bool,
    redraw: bool,
    max_ms: float | None,
    max_flip: float | None,
    strict: bool,
    verbose: bool,
) -> None:
    """Draw scenes.

    FILE is a scene, - for standard input, or a program that `scenelang compile` made (.safetensors). OUT is
    a picture whose suffix names the format; several scenes are drawn into a folder, each as STEM.png.
    Scenes with errors are reported and left out. Exits with 1 if there are any, 2 if a file cannot be read
    or written.

    \b
    A scene with animate(…) is drawn as an animation where OUT is
      FILE.gif .webp .apng          animated pictures
      FILE.mp4 .mov .mkv .webm      video, by ffmpeg
      frame-%04d.png                numbered pictures
      FOLDER/                       FOLDER/STEM-0000.png and so on
    A run that was interrupted goes on where it stopped.

    With --output, PNG files have 16 bits and say what they hold in a text `scenelang`; an .exr holds the
    picture and all outputs as layers of floats.

    With --prove, --redraw or --output proof, the share of pixels that are proved right is told, and the
    largest bound of the others. The output has each pixel's.

    With --max-ms or --max-flip each scene is drawn by what was measured to suffice, model and samples; -v
    says which, why, and what was next.
    """
    from scenelang.cli.animation import Film, animate, moves
    from scenelang.cli.inputs import read_input, unused_defines
    from scenelang.cli.jobs import PROGRAM, check_outputs, choose_all, prepare_all, targets
    from scenelang.output.frontier import Limits

    outputs = tuple(dict.fromkeys(outputs))
    more = _More(outputs, prove or redraw or "proof" in outputs, redraw)
    film, limits = Film(frames, fps, jobs, cluster, palette, dither), Limits(max_ms, max_flip)
    _ = film.frames
    if request.frame is not None and film.certain:
        raise click.UsageError("--frame asks for a picture, --frames and --fps for an animation.")
    if film.certain and len(files) > 1:
        raise click.UsageError("--frames and --fps take one scene.")
    if more.prove and (limits or how.backend != "neural"):
        other = "--max-ms and --max-flip" if limits else f"--backend {how.backend}, whose pictures are exact"
        raise click.UsageError(f"A proof is of what the scene's model draws; leave out {other}.")
    request = replace(request, source=replace(request.source, fps=fps))
    clock, result = Clock(), None
    if len(files) == 1 and request.frame is None and not files[0].endswith(PROGRAM):
        target = film.target(files[0], out)
        if target is not None:
            result = read_input(files[0], request, clock, how)
            if moves(result, target, film, out):
                if limits or more.prove:
                    what = "a proof is" if more.prove else "--max-ms and --max-flip are"
                    raise click.UsageError(f"{what} for single pictures; --frame draws one of an animation.")
                result.diagnostics.items += unused_defines(request)
                ctx.exit(animate(result, target, film, how, out, outputs, strict, verbose))
    elif film.certain:
        raise click.UsageError("A compiled program is a single frame; --frames and --fps take a scene.")
    if cluster is not None:
        raise click.UsageError("--cluster draws the frames of an animation; sweep draws many pictures.")
    paths = targets(files, out)
    check_outputs(paths, outputs)
    refused = None
    if more.prove or how.backend == "reference":
        does = "a proof is of a scene" if more.prove else "the reference draws scenes"
        refused = f"{does}; a program keeps only what the network needs"
    every, code = prepare_all(
        files, request, clock, how, strict=strict, graphs=more.prove, stored=refused, first=result
    )
    able = [(job, path) for job, path in zip(every, paths, strict=True) if job and not job.failed(strict)]
    if limits and able:
        chosen = choose_all([job for job, _ in able], limits, request.source.model, clock)
        code = code if len(chosen) == len(able) else 2
        able = [(job, path) for job, path in able if job in chosen]
    told: list[str] = []
    with Bar() as bar:
        for index, (job, path) in enumerate(able):
            told += _draw(job, path, more, clock, partial(_part, bar, index, len(able)))
            if verbose:
                lines = "".join(f"\n  {note}" for note in job.notes)
                click.echo(f"{job.name} -> {path}{lines}", err=True)
    for line in told:
        click.echo(line, err=True)
    if verbose and able:
        click.echo(clock.report(), err=True)
    ctx.exit(code)


class _More(NamedTuple):
    """Wishes besides a picture."""

    outputs: tuple[Output, ...]
    prove: bool
    redraw: bool


def _draw(job: Input, path: Path, more: _More, clock: Clock, progress: Callable[[float], None]) -> list[str]:
    """Draw a job to a file; lines about it."""
    from scenelang.cli.jobs import blank, draw_job
    from scenelang.drawing.image import Outputs
    from scenelang.drawing.render import outputs_of, prove_drawn

    result, drawn, proof = Outputs(), job.scene if job.how.backend == "reference" else job.program, None
    if more.outputs and drawn is not None:  # before the picture: what it lacks is said at once
        with clock("outputs"):
            result = outputs_of(drawn, more.outputs, job.how, spans=job.spans)
    if more.prove and job.program is not None:
        with clock("prove"):
            image, proof = prove_drawn(
                job.graphs, job.program.model, lambda: draw_job(job, clock, progress), more.redraw
            )
    else:
        image = draw_job(job, clock, progress)
    told = [] if (why := blank(job, image)) is None else [f"{path}: {why}"]
    if proof is not None:
        told.append(f"{path}: {proof.told()}")
        result = replace(result, proof=proof) if "proof" in more.outputs else result
    with clock("save"):
        return told + _saved(image, result, path)


def _saved(image: Image, outputs: Outputs, path: Path) -> list[str]:
    """Write a picture and its outputs; a line about each of these."""
    from scenelang.drawing.image import save_outputs

    try:
        files = save_outputs(image, outputs, path)
    except ValueError as error:
        raise Trouble(f"cannot write `{path}`: {error}") from None
    return [f"{file}: {outputs.told(name)}" for file, name in zip(files, outputs.names, strict=True)]


def _part(bar: Bar, index: int, count: int, share: float) -> None:
    bar("drawing", index + share, count)
