"""``scenelang render``: scenes and compiled programs to pictures and animations."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click
from click.core import ParameterSource

from scenelang.assets.files import write_output
from scenelang.cli import options
from scenelang.cli.files import DRAWING, PROGRAM, SHAPES, check_outputs, shown, targets
from scenelang.cli.main import Trouble, describe
from scenelang.cli.say import Bar, Clock, say_diagnostics
from scenelang.drawing.how import How, threads_for
from scenelang.language.diagnostics import listing, plural
from scenelang.language.reports import SceneError

if TYPE_CHECKING:
    from collections.abc import Callable

    from scenelang.cli.inputs import Input
    from scenelang.cli.options import FilmOptions
    from scenelang.drawing.image import Image, Output
    from scenelang.output.frames import Target
    from scenelang.output.mesh import Up

_SECTIONS: Final = {
    "Animations": "--frame --frames --fps --jobs --cluster --palette --dither",
    "How it is drawn": "--model --backend --samples --patient --max-ms --max-flip --originals "
    "--device --threads",
    "More than a picture": "--output --prove --redraw --verbose",
    "Meshes": "--resolution --up",
}

_OF_SHAPES: Final = (
    "files", "out", "format", "defines", "frame", "model", "root", "backend", "strict", "verbose"
)  # fmt: skip
"""Parameters that shapes have too."""

_OF_MESHES: Final = ("resolution", "up")


@click.command("render", cls=options.Sectioned, sections=_SECTIONS)
@click.argument("files", nargs=-1, required=True, metavar="FILE…")
@options.writes(
    "OUT", "Picture, animation, numbered pictures or folder to write; - is standard output.", ".png"
)
@options.text(
    "--format", "SUFFIX", "Format of what goes to standard output, a suffix such as png, jpg, gif, svg or "
    "stl; by default png.", is_eager=True, callback=lambda _, __, value: value and value.lower().lstrip("."),
)  # fmt: skip
@options.request()
@options.film()
@options.drawing()
@options.several(
    "--output", "outputs", of=("depth", "normal", "object", "alpha", "proof"),
    help="Output to write beside the picture, to STEM.depth.png and so on, or into an .exr",
)  # fmt: skip
@click.option("--prove", is_flag=True, help="Prove how far pixels are from the exact picture at most (2D).")
@click.option("--redraw", is_flag=True, help="With a proof: draw again what is not proved right to 1/255.")
@options.positive(
    "--max-ms", "N", "Choose the most exact way to draw that takes at most N milliseconds on one thread."
)
@options.text(
    "--max-flip", "E", "Choose the fastest way to draw whose promised FLIP error is at most E.",
    type=options.Real(0, 1),
)  # fmt: skip
@options.count("--resolution", low=8, high=512, default=320, help="Cells of a mesh along its longest side.")
@options.choice("--up", words="y z", help="Axis of a mesh that points up; slicers take z, a .glb has y.")
@options.originals
@options.strict
@options.verbose
@click.pass_context
def command(
    ctx: click.Context,
    files: tuple[str, ...],
    out: str,
    format: str | None,
    request: options.Request,
    film: options.FilmOptions,
    how: How,
    outputs: tuple[Output, ...],
    prove: bool,
    redraw: bool,
    max_ms: float | None,
    max_flip: float | None,
    resolution: int,
    up: Up,
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

    OUT may hold shapes in place of pixels: curves of a flat scene (.svg), or the solids of a scene as one
    closed mesh with colours (.glb .ply .obj) or without (.stl), wherever the camera looks. Scenes are y up,
    and so are meshes; slicers lay them as they stand with --up z.

    With --output, PNG files have 16 bits and say what they hold in a text `scenelang`; an .exr holds the
    picture and all outputs as layers of floats.

    With --prove, --redraw or --output proof, the share of pixels that are proved right is told, and the
    largest bound of the others. The output has each pixel's.

    With --max-ms or --max-flip each scene is drawn by what was measured to suffice, model and samples; -v
    says which, why, and what was next.
    """
    from scenelang.cli.inputs import prepare_all, read_input, unused_defines

    shape = Path(out).suffix.lower() in SHAPES and not Path(out).is_dir()
    for name in _OF_MESHES:
        given = ctx.get_parameter_source(name) == ParameterSource.COMMANDLINE
        if given and not (shape and Path(out).suffix.lower() != DRAWING):
            raise click.UsageError(f"--{name} is of meshes: .stl, .glb, .ply and .obj.")
    if shape:
        _shape(ctx, files, out, request, how, resolution, up, strict, verbose)
        return
    outputs, limits = tuple(dict.fromkeys(outputs)), max_ms is not None or max_flip is not None
    prove |= redraw or "proof" in outputs
    if request.frame is not None and film.certain:
        raise click.UsageError("--frame asks for a picture, --frames and --fps for an animation.")
    if film.certain and len(files) > 1:
        raise click.UsageError("--frames and --fps take one scene.")
    if prove and (limits or how.backend != "neural"):
        other = "--max-ms and --max-flip" if limits else f"--backend {how.backend}, whose pictures are exact"
        raise click.UsageError(f"A proof is of what the scene's model draws; leave out {other}.")
    request = replace(request, source=replace(request.source, fps=film.fps))
    clock, result = Clock(), None
    if len(files) == 1 and request.frame is None and not files[0].endswith(PROGRAM):
        if (target := film.target(files[0], out)) is not None:
            result = read_input(files[0], request, clock, how)
            if _moves(result, target, film, out):
                if limits or prove:
                    what = "a proof is" if prove else "--max-ms and --max-flip are"
                    raise click.UsageError(f"{what} for single pictures; --frame draws one of an animation.")
                result.diagnostics.items += unused_defines(request)
                _animate(result, target, film, out, outputs, strict, verbose)
                return
    elif film.certain:
        raise click.UsageError("A compiled program is a single frame; --frames and --fps take a scene.")
    if film.cluster is not None:
        raise click.UsageError("--cluster draws the frames of an animation; sweep draws many pictures.")
    if outputs and shown(out) != out and not out.endswith(".exr"):
        raise click.UsageError(f"--output writes files beside the picture; {shown(out)} takes them as exr.")
    paths = targets(files, out)
    check_outputs(paths, outputs)
    refused = None
    if prove or how.backend == "reference":
        does = "a proof is of a scene" if prove else "the reference draws scenes"
        refused = f"{does}; a program keeps only what the network needs"
    every, code = prepare_all(
        files, request, clock, how, strict=strict, graphs=prove, stored=refused, first=result
    )
    able = [(job, path) for job, path in zip(every, paths, strict=True) if job and not job.failed(strict)]
    if limits and able:
        from scenelang.cli.inputs import choose_all
        from scenelang.output.frontier import Limits

        with clock("choose"):
            chosen = choose_all([job for job, _ in able], Limits(max_ms, max_flip), request.source.model)
        code = code if len(chosen) == len(able) else 2
        able = [(job, path) for job, path in able if job in chosen]
    told: list[str] = []
    with Bar() as bar:
        for index, (job, path) in enumerate(able):

            def progress(share: float, done: int = index) -> None:
                bar("drawing", done + share, len(able))

            progress(0.0)
            told += _save(job, path, outputs, prove, redraw, clock, progress)
            if job.evaluation is not None and job.evaluation.frames > 1 and request.frame is None:
                count = job.evaluation.frames
                told.append(
                    f"note: {job.name}: frame 0 of {count}; `-o NAME.webp` or `frame-%04d.png` has all"
                )
            if verbose:
                if job.program is not None and job.program.stage is not None:
                    from scenelang.drawing.work import work_ms

                    ms = work_ms(job.program, job.how.care["samples"])
                    job.notes.append(f"about {ms:,.0f} ms of work for the network were foretold")
                click.echo("\n  ".join([f"{job.name} -> {shown(path)}", *job.notes]), err=True)
    for line in told:
        click.echo(line, err=True)
    if verbose and able:
        click.echo(clock.report(), err=True)
    ctx.exit(code)


def _shape(
    ctx: click.Context,
    files: tuple[str, ...],
    out: str,
    request: options.Request,
    how: How,
    resolution: int,
    up: Up,
    strict: bool,
    verbose: bool,
) -> None:
    """Write the outlines or the surface of one scene."""
    from scenelang.cli.inputs import prepare_all
    from scenelang.compiler.compile import compile_scene
    from scenelang.language.diagnostics import Diagnostics
    from scenelang.output.shapes import UNSEEN, refuse_animation, to_mesh, to_svg

    curves = Path(out).suffix.lower() == DRAWING
    known = {*_OF_SHAPES, *(["size"] if curves else _OF_MESHES)}
    for param in ctx.command.params:
        given = ctx.get_parameter_source(param.name or "") == ParameterSource.COMMANDLINE
        if given and param.name not in known:
            raise click.UsageError(f"{param.opts[0]} is of pictures, and `{shown(out)}` holds no pixels.")
    if len(files) > 1:
        raise click.UsageError(f"`{shown(out)}` is one file, and holds one scene.")
    if how.backend == "reference":
        raise click.UsageError("--backend reference draws pictures; shapes are those of the model's field.")
    path = Path(out)
    if up == "z" and path.suffix.lower() == ".glb":
        raise click.UsageError("--up z is of .stl, .ply and .obj: a .glb is y up.")
    if not path.parent.is_dir():
        raise click.UsageError(f"cannot write `{out}`: there is no folder `{path.parent}`.")
    clock, result = Clock(), Diagnostics()
    (job,), code = prepare_all(files, request, clock, how, strict=strict)
    if job is None or job.failed(strict) or job.program is None:
        ctx.exit(code)
    if job.evaluation is not None and job.evaluation.animates and request.frame is None:
        refuse_animation(files[0], result)
        raise SceneError(result)
    with clock("curves" if curves else "mesh"):
        if curves:
            data = to_svg(job.program, backend=how.backend, diagnostics=result).encode()
        else:
            program = job.program
            if job.scene is not None:
                program = compile_scene(job.scene, spans=job.spans, without=UNSEEN)
            mesh = to_mesh(program, resolution=resolution, backend=how.backend, diagnostics=result)
            job.notes.append(f"{len(mesh.vertices):,} vertices, {len(mesh.triangles):,} triangles")
            data = mesh.encode(path.suffix.lower(), up)
    say_diagnostics(result)
    if strict and result.items:
        ctx.exit(1)
    try:
        write_output(path, data)
    except OSError as error:
        raise Trouble(f"cannot write `{out}`: {describe(error)}") from None
    if verbose:
        lines = "".join(f"\n  {note}" for note in (*job.notes, f"{len(data):,} bytes"))
        click.echo(f"{job.name} -> {shown(path)}{lines}\n{clock.report()}", err=True)


def _moves(job: Input, target: Target, film: FilmOptions, out: str) -> bool:
    """True where a scene is drawn as an animation, or has errors; refuses ``out`` that holds no picture."""
    from scenelang.output.frames import PICTURES

    if job.diagnostics.errors or (job.evaluation is not None and job.evaluation.animates):
        return True
    if film.certain:
        which = "--frames" if film.frames is not None else "--fps"
        job.diagnostics.add("E0337", f"{which} for a scene without animate(…)", None)
        return True
    if target.kind == "sequence":
        return "%" in out
    if target.path.suffix.lower() in PICTURES:
        return True
    fact = f"`{shown(out)}` is for animations, and the scene has no animate(…)"
    raise click.UsageError(f"{fact}; {listing(sorted(PICTURES))} hold a picture too.")


def _animate(
    job: Input,
    target: Target,
    film: FilmOptions,
    out: str,
    outputs: tuple[Output, ...],
    strict: bool,
    verbose: bool,
) -> None:
    """Draw an animation and report what was written; ``out`` is the target as the user wrote it."""
    from rich.filesize import decimal

    from scenelang.output.animate import make
    from scenelang.output.frames import Clip, FrameRange
    from scenelang.output.painting import Painter

    started, diagnostics = time.perf_counter(), job.diagnostics
    drawn = job.evaluation or ((job.scene,) if job.scene is not None else ())
    if diagnostics.errors or not drawn:
        raise SceneError(diagnostics)
    clip = Clip(drawn, diagnostics)
    numbers = clip.numbers(film.frames or FrameRange())
    if strict and diagnostics.items:
        raise SceneError(diagnostics)
    if outputs and target.kind != "sequence":
        what = f"`{shown(out)}` is one file; numbered pictures such as frame-%04d.png have outputs"
        raise click.UsageError(f"{what}.")
    check_outputs([target.file(number) for number in numbers], outputs)
    try:
        with Bar() as bar:
            result = make(
                Painter(clip, job.how, outputs=outputs), target, numbers, jobs=film.jobs,
                cluster=film.cluster, palette=film.palette, dither=film.dither, strict=strict,
                progress=lambda now: bar(now.told, now.done, now.total),
            )  # fmt: skip
    except KeyboardInterrupt:
        if target.work.exists() and shown(out) == out:
            note = f"\nframes are kept in `{target.work}`; the same command goes on with the rest"
            click.echo(note, err=True)
        raise
    except OSError as error:
        raise Trouble(f"cannot write `{out}`: {describe(error)}") from None
    say_diagnostics(diagnostics)
    first, last = result.files[0], result.files[-1]
    name = f"{first} … {last.name}" if len(result.files) > 1 else shown(first)
    parts = [plural(result.frames, "frame"), decimal(sum(file.stat().st_size for file in result.files))]
    if result.resumed:
        parts.append(f"{result.resumed} kept from a run before")
    if same := result.frames - result.drawn - result.resumed:
        parts.append(f"{same} the same as others")
    click.echo(f"{name}: {', '.join(parts)}, {time.perf_counter() - started:.1f} s", err=True)
    strays = {path.name for path in target.there()} if target.kind == "sequence" else set()
    if strays := strays - {file.name for file in result.files}:
        count, among = plural(len(strays), "such file"), " among them" if len(strays) > 1 else ""
        found = f"{count} of another run, `{min(strays)}`{among}"
        click.echo(f"note: `{target.path}` also holds {found}", err=True)
    for line in result.lines() if verbose else ():
        click.echo(f"  {line}", err=True)


def _save(
    job: Input,
    path: Path,
    outputs: tuple[Output, ...],
    prove: bool,
    redraw: bool,
    clock: Clock,
    progress: Callable[[float], None],
) -> list[str]:
    """Draw a job to a file, with a proof and what is not proved drawn again if need be; lines about it."""
    from scenelang.drawing.image import Outputs, save_outputs
    from scenelang.drawing.render import outputs_of, prove_drawn

    proof, result = None, Outputs()
    drawn = job.scene if job.how.backend == "reference" else job.program
    if outputs and drawn is not None:  # before the picture: what it lacks is said at once
        with clock("outputs"):
            result = outputs_of(drawn, outputs, job.how, spans=job.spans)
    if prove and job.program is not None:
        with clock("prove"):
            image, proof = prove_drawn(
                job.graphs, job.program.model, lambda: _draw(job, clock, progress), redraw, job.how
            )
    else:
        image = _draw(job, clock, progress)
    told = [] if (why := _blank(job, image)) is None else [f"{shown(path)}: {why}"]
    if proof is not None:
        told.append(f"{shown(path)}: {proof.told()}")
        result = replace(result, proof=proof) if "proof" in outputs else result
    with clock("save"):
        try:
            saved = save_outputs(image, result, path)
        except ValueError as error:
            raise Trouble(f"cannot write `{shown(path)}`: {error}") from None
    return told + [
        f"{shown(file)}: {result.told(name)}" for file, name in zip(saved, result.names, strict=True)
    ]


def _draw(job: Input, clock: Clock, progress: Callable[[float], None]) -> Image:
    """Draw a job and add its notes; ``progress`` gets the share done, in [0, 1]."""
    from scenelang.drawing.render import draw, draw_exact

    how, program = job.how, job.program
    if how.backend == "reference":
        assert job.scene is not None
        with clock("draw"):
            scene = how.sampled(job.scene)
            image = draw_exact(scene, spans=job.spans, patient=how.patient, progress=progress)
        chance = f", standard error {image.noise:.2g}" if image.noise else ""
        job.notes.append(f"drew the exact picture, {scene.samples} samples a pixel{chance}")
        return image
    assert program is not None
    from scenelang.drawing.small import choose_drawer

    library, why = choose_drawer(program, how.device, exact=how.backend == "exact")
    if library == "numpy":
        cores = how.threads or threads_for(program.canvas)
        device, place = "numpy", "one core" if cores == 1 else f"{cores} cores"
    else:
        with clock("load torch"):
            from scenelang.drawing.torch_backend import choose_device, open_model
        device = place = choose_device(how.device)
        with clock("load model"):
            open_model(program.model, device, program.weights)
    with clock("draw"):
        drawing = draw(program, how, place=device, progress=progress)
    if drawing.work is not None and drawing.work.lost:
        lost = f"{drawing.work.lost:,} rays took too many steps"
        click.echo(f"Warning: {job.name}: the picture is incomplete: {lost}", err=True)
    width, height = program.canvas
    once = width * height - drawing.refined
    job.notes += [
        f"drawn on {place} by {why if library == 'numpy' else f'torch: {why}'}",
        f"drew {plural(once, 'pixel')} by one sample and {drawing.refined:,} by four",
        f"{plural(drawing.pairs, 'meeting')} of a sample and an object",
    ]
    return drawing.image


def _blank(job: Input, image: Image) -> str | None:
    """The reason why a picture shows nothing, unless a warning has given it."""
    if any(d.code == "W0402" for d in job.diagnostics):
        return None
    if job.program is not None and not len(job.program.tokens):
        return (
            "no objects to draw: a module draws where it is called, as in part(), and a shape of some extent"
        )
    if not all(bool((abs(row - image[0, 0]) < 0.5 / 255).all()) for row in image):
        return None
    if (image[0, 0] > 1 - 0.5 / 255).all():
        return "one colour throughout; flat objects are white without a colour, and so is the background"
    stage = job.program.stage if job.program is not None else None
    lit = job.scene.sky != "default" if job.scene is not None else stage is not None and stage.sky is not None
    if lit and (image[0, 0, :3] < 0.5 / 255).all():
        return "black throughout: no light reaches what the eye sees, or what it sees is black"
    return "one colour throughout: objects in the background's colour, cut away, or smaller than a pixel"
