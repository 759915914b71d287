"""``scenelang render``: scenes and compiled programs to pictures and animations."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import click

from scenelang.cli import options
from scenelang.cli.main import Trouble
from scenelang.cli.progress import Bar, Clock

if TYPE_CHECKING:
    from scenelang.backend.options import Samples
    from scenelang.cli.jobs import Job
    from scenelang.evaluate.session import Defines
    from scenelang.image import Image
    from scenelang.measure.frontier import Limits
    from scenelang.outputs import Output, Outputs, Proof


_SECTIONS: Final = {
    "Animations": "--frame --frames --fps --jobs --cluster --palette --dither",
    "How it is drawn": "--model --backend --samples --max-ms --max-flip --originals --device --threads",
    "More than a picture": "--output --prove --redraw --verbose",
}


@click.command("render", cls=options.Sectioned, sections=_SECTIONS)
@click.argument("files", nargs=-1, required=True, metavar="FILE…")
@click.option(
    "-o",
    "--out",
    required=True,
    metavar="OUT",
    help="Picture, animation, numbered pictures or folder to write.",
)
@options.size
@options.define
@options.still
@options.frames
@options.fps
@options.jobs
@options.cluster
@options.choice(
    "--palette", words="auto global frame", help="Colours of a GIF: 255 for all frames or for each."
)
@click.option("--dither", is_flag=True, help="Dither colours that a GIF's palette lacks.")
@options.model
@options.choice(
    "--backend",
    words="neural exact reference",
    help="Draw with the trained network, with formulas of the shapes in its place (exact), or by the exact "
    "definition, which is slow (reference).",
)
@options.choice(
    "--samples",
    words="adaptive four quick one draft",
    help="Samples of a pixel: four near outlines, four everywhere, four near strong outlines (solids), one, "
    "with hard edges, or one for each 2 x 2 pixels.",
)
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
    type=options.Real(0, min_open=True),
    metavar="N",
    help="Choose the most exact way to draw that takes at most N milliseconds on one thread.",
)
@click.option(
    "--max-flip",
    type=options.Real(0, 1),
    metavar="E",
    help="Choose the fastest way to draw whose promised FLIP error is at most E.",
)
@options.originals
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
    frame: int | None,
    frames: str | None,
    fps: float | None,
    jobs: int | None,
    cluster: str | None,
    palette: Literal["auto", "global", "frame"],
    dither: bool,
    model: str | None,
    backend: options.Still,
    samples: Samples,
    outputs: tuple[Output, ...],
    prove: bool,
    redraw: bool,
    max_ms: float | None,
    max_flip: float | None,
    device: Literal["auto", "cpu", "cuda"],
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
    from scenelang.cli.animation import Requested, animate, wanted_target
    from scenelang.cli.drawing import (
        blank,
        check_options,
        check_proof,
        chosen,
        exact,
        job_outputs,
        neural,
        proved,
    )
    from scenelang.cli.inputs import Request
    from scenelang.cli.jobs import PROGRAM, prepare_all
    from scenelang.cli.outputs import check_outputs, targets
    from scenelang.measure.frontier import Limits

    outputs = tuple(dict.fromkeys(outputs))
    prove = prove or redraw or "proof" in outputs
    clock = Clock()
    if backend == "exact" and device == "cuda":
        raise click.UsageError("--backend exact draws on processors only; leave out --device cuda.")
    moving: options.Backend = "neural" if backend == "exact" else backend  # which animations refuse below
    wanted = Requested(
        frames, fps, jobs, cluster, palette, dither, moving, device, threads, strict, verbose, outputs
    )
    _ = wanted.frames
    if frame is not None and wanted.certain:
        raise click.UsageError("--frame asks for a picture, --frames and --fps for an animation.")
    if len(files) > 1 and wanted.certain:
        raise click.UsageError("--frames and --fps take one scene.")
    limits = Limits(max_ms, max_flip)
    check_options(ctx, limits, device)
    if prove:
        check_proof(limits, backend)
    request = Request(defines, model, root, frame or 0, size)
    source = None
    if len(files) == 1 and frame is None and not files[0].endswith(PROGRAM):
        target = wanted_target(files[0], out, wanted)
        if target is not None:
            _only_stills(limits, samples, prove, backend)
            done = animate(files[0], out, target, request, wanted)
            if isinstance(done, int):
                ctx.exit(done)
            source = done
    elif wanted.certain:
        raise click.UsageError("A compiled program is a single frame; --frames and --fps take a scene.")
    if cluster is not None:
        raise click.UsageError("--cluster draws the frames of an animation; sweep draws many pictures.")
    paths = targets(files, out)
    check_outputs(paths, outputs)

    def refusal(job: Job) -> str | None:
        if not (prove or backend == "reference") or job.program is None or job.source is not None:
            return None
        does = "a proof is of a scene" if prove else "the reference draws scenes"
        return f"{does}; a program keeps only what the network needs"

    inputs, code = prepare_all(
        files,
        request,
        clock,
        strict=strict,
        compiled=backend != "reference",
        verbose=verbose or prove,
        source=source,
        refusal=refusal,
    )
    ready = [(job, path) for job, path in zip(inputs, paths, strict=True) if job and not job.failed(strict)]
    if not ready:
        ctx.exit(code)
    if limits:
        draw, ready, code = chosen(limits, request, clock, threads, ready, code)
    elif backend == "reference":
        if samples != "adaptive":
            raise click.UsageError("--samples is for the network, not for the reference.")
        draw = exact(request, clock)
    else:
        draw = neural(clock, device, threads, samples, exactly=backend == "exact")
    proofs: list[Proof] = []
    if prove:
        draw = proved(draw, clock, redraw, proofs)
    told: list[str] = []
    with Bar() as bar:
        for index, (job, path) in enumerate(ready):
            if outputs:  # before the picture: what it lacks is said at once
                with clock("outputs"):
                    found = job_outputs(job, outputs, request.model, threads, backend)
            image = draw(job, partial(_part, bar, index, len(ready)))
            if (why := blank(job, image)) is not None:
                told.append(f"{path}: {why}")
            if proofs:
                told.append(f"{path}: {proofs[-1].told()}")
            if "proof" in outputs:
                found = replace(found, proof=proofs[-1])
            with clock("save"):
                if outputs:
                    told += _saved(image, found, path)
                else:
                    image.save(path)
            if verbose:
                lines = "".join(f"\n  {note}" for note in job.notes)
                click.echo(f"{job.name} -> {path}{lines}", err=True)
    for line in told:
        click.echo(line, err=True)
    if verbose:
        click.echo(clock.report(), err=True)
    ctx.exit(code)


def _saved(image: Image, outputs: Outputs, path: Path) -> list[str]:
    """Write a picture and its outputs; a line about each of these."""
    from scenelang.image import save_outputs

    try:
        files = save_outputs(image, outputs, path)
    except ValueError as error:
        raise Trouble(f"cannot write `{path}`: {error}") from None
    return [f"{file}: {outputs.told(name)}" for file, name in zip(files, outputs.names, strict=True)]


def _part(bar: Bar, index: int, count: int, share: float) -> None:
    bar("drawing", index + share, count)


def _only_stills(limits: Limits, samples: str, prove: bool, backend: str) -> None:
    """Refuse for animations what chooses or changes how one picture is drawn."""
    if limits or samples != "adaptive" or prove or backend == "exact":
        what = "--max-ms and --max-flip are" if limits else "a proof is" if prove else "--samples is"
        what = "--backend exact is" if backend == "exact" else what
        raise click.UsageError(f"{what} for single pictures; --frame draws one of an animation.")
