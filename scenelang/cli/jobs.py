"""From an input of the command line to pictures in files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from scenelang.cli.inputs import Input, Request, merged, read_input, stem_of, unused_defines
from scenelang.cli.main import describe
from scenelang.cli.say import Clock, say_diagnostics, say_trouble
from scenelang.compiler.compile import compile_scene, why_chosen
from scenelang.drawing.how import DEFAULT, How, threads_for
from scenelang.language.diagnostics import Diagnostics, plural
from scenelang.language.reports import SceneError
from scenelang.language.words import COMBINE
from scenelang.output.frames import is_animation

if TYPE_CHECKING:
    from scenelang.compiler.program import Program
    from scenelang.drawing.how import Device
    from scenelang.drawing.image import Image, Output
    from scenelang.output.frontier import Choice, Frontier, Limits, Point


PROGRAM = ".safetensors"


def compile_input(job: Input, request: Request, clock: Clock, graphs: bool = False) -> None:
    """Compile a scene, if it is one without errors that is not drawn by the reference; ``graphs`` are kept.

    Raises:
        OSError: a model has no weights.
    """
    if job.scene is None or job.how.backend == "reference":
        return
    with suppress(SceneError), clock("compile"):  # its diagnostics are the input's
        job.program = compile_scene(
            job.scene,
            spans=job.spans,
            diagnostics=job.diagnostics,
            after=job.graphs.__setitem__ if graphs else None,
        )
        why = why_chosen(job.scene, request.source.model is not None)
        job.notes = program_notes(job.program, why)


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
                result = _stored(name, request, clock, how)
                result.trouble = stored or result.trouble
            else:
                result = first or read_input(name, request, clock, how)
                compile_input(result, request, clock, graphs)
        except OSError as error:
            say_trouble(describe(error))
            inputs.append(None)
            code = 2
            continue
        if result.trouble is not None:
            say_trouble(f"{name}: {result.trouble}")
        inputs.append(result)
    read = [result for result in inputs if result is not None]
    unused = unused_defines(request) if read else []
    say_diagnostics(merged([*(result.diagnostics.items for result in read), unused]))
    if unused:
        return [None] * len(inputs), max(code, 1)
    return inputs, max(code, int(any(result.failed(strict) for result in read)))


def prepare_scene(name: str, request: Request, clock: Clock | None = None) -> Input:
    """Compile the one scene of a command, keep its graphs and report its mistakes.

    Raises:
        OSError: it cannot be read, or a model has no weights.
        click.UsageError: it is a compiled program.
    """
    if name.endswith(PROGRAM):
        raise click.UsageError(f"`{name}` is a compiled program already.")
    clock = clock or Clock()
    result = read_input(name, request, clock)
    compile_input(result, request, clock, graphs=True)
    result.diagnostics.items.extend(unused_defines(request))
    say_diagnostics(result.diagnostics)
    return result


def _stored(name: str, request: Request, clock: Clock, how: How) -> Input:
    from scenelang.compiler.program import ProgramError, load_program

    result, size, model = Input(name, how), request.source.size, request.source.model
    try:
        with clock("load program"):
            program = load_program(Path(name))
    except ProgramError as error:
        result.trouble = str(error)
        return result
    if model not in (None, program.model):
        result.trouble = f"compiled for model `{program.model}`, not `{model}`"
    elif request.frame:
        result.trouble = f"a program is a single frame, and --frame asks for {request.frame}"
    elif size is not None:
        (width, height), (old_width, old_height) = size, program.canvas
        if width * old_height != height * old_width:
            old = f"the {old_width}x{old_height} it was compiled for"
            advice = "objects outside it are gone: compile the scene again"
            result.trouble = f"{width}x{height} has another shape than {old}; {advice}"
        program = replace(program, canvas=size)
    result.program, result.notes = program, program_notes(program, "named by the program")
    return result


def program_notes(program: Program, why: str) -> list[str]:
    """Lines about a compiled scene."""
    from scenelang.compiler.groups import OPERATOR

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


PAGE: Final = ".html"


def targets(names: Sequence[str], out: str, suffix: str = ".png") -> list[Path]:
    """The file that each scene is written to: ``out`` itself for one scene, else one in the folder ``out``.

    The folder is created if need be; for one scene ``out`` is a folder that exists or ends in a slash.

    Args:
        suffix: of files in a folder: of a picture or of a page.

    Raises:
        click.UsageError: no format has the suffix, two scenes have one name, or a file or link is in the way.
        OSError: the folder cannot be created.
    """
    path = Path(out)
    what, fits = ("a page", page_format) if suffix == PAGE else ("a picture", _picture_format)
    if len(names) == 1 and not path.is_dir() and not out.endswith(("/", "\\")):
        try:
            fits(path)
        except ValueError as error:
            advice = f"{what} has a suffix such as {suffix}, a folder ends in a slash"
            raise click.UsageError(f"cannot write `{out}`: {error if path.suffix else advice}.") from None
        if not path.parent.is_dir():
            raise click.UsageError(f"cannot write `{out}`: there is no folder `{path.parent}`.")
        return [path]
    if path.exists() and not path.is_dir():
        raise click.UsageError(f"`{out}` is a file; {len(names)} scenes need a folder.")
    if not path.exists() and not out.endswith(("/", "\\")):
        with suppress(ValueError):  # no format has the suffix
            what = "an animation" if is_animation(out) else what
            if what != "an animation":
                fits(path)
            raise click.UsageError(f"`{out}` names {what}; {len(names)} scenes need a folder.")
    files = [composed(path / f"{stem_of(name)}{suffix}") for name in names]
    owner: dict[str, str] = {}
    for name, file in zip(names, files, strict=True):
        first = owner.setdefault(file.name.casefold(), name)
        if first is not name:
            raise click.UsageError(f"`{first}` and `{name}` would both be written to `{file}`.")
    path.mkdir(parents=True, exist_ok=True)
    return files


def page_format(path: Path) -> None:
    """Raise `ValueError` where a file is not called like a page."""
    if path.suffix.lower() not in (PAGE, ".htm"):
        raise ValueError(f"a page's file ends in {PAGE}")


def _picture_format(path: Path) -> None:
    from scenelang.drawing.image import image_format

    image_format(path)


def check_outputs(paths: Sequence[Path], wanted: Sequence[Output]) -> None:
    """Raise `click.UsageError` where outputs of pictures have no place, or a link is in it."""
    from scenelang.drawing.image import output_file

    try:
        for path in paths:
            for file in (output_file(path, name) for name in wanted):
                _ = file == path or composed(file)
    except ValueError as error:
        raise click.UsageError(f"{error}.") from None


def composed(file: Path) -> Path:
    """A file whose name no user wrote; raises `click.UsageError` for a link, which may lead anywhere."""
    if file.is_symlink():
        raise click.UsageError(f"`{file}` is a link; it is followed only where -o names it.")
    return file


def draw_job(job: Input, clock: Clock, progress: Callable[[float], None]) -> Image:
    """Draw a job with its options and add its notes; ``progress`` gets the share done, in [0, 1]."""
    from scenelang.drawing.render import draw, draw_exact

    how, program = job.how, job.program
    if how.backend == "reference":
        assert job.scene is not None
        with clock("draw"):
            image = draw_exact(job.scene, spans=job.spans, progress=progress)
        job.notes.append("drew the exact picture, four samples a pixel")
        return image
    from scenelang.drawing.small import choose_drawer

    assert program is not None
    library, why = choose_drawer(program, how.device, how.samples, exact=how.backend == "exact")
    if library == "numpy":
        cores = how.threads or threads_for(program.canvas) if program.stage else 1
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
        f"drawn by {library} on {place}: {why}",
        f"drew {plural(once, 'pixel')} by one sample and {drawing.refined:,} by four",
        f"{plural(drawing.pairs, 'meeting')} of a sample and an object",
    ]
    return drawing.image


def blank(job: Input, image: Image) -> str | None:
    """The reason why a picture shows nothing, unless a warning has given it."""
    if any(d.code == "W0402" for d in job.diagnostics):
        return None
    if job.program is not None and not len(job.program.tokens):
        return "no objects to draw: a module draws where it is called, as in part();"
    if not all(bool((abs(row - image[0, 0]) < 0.5 / 255).all()) for row in image):
        return None
    if (image[0, 0] > 1 - 0.5 / 255).all():
        return "one colour throughout; flat objects are white without a colour, and so is the background"
    return "one colour throughout: objects in the background's colour, cut away, or smaller than a pixel"


# ---------------------------------------------------------------- by the frontier


def choose_all(jobs: list[Input], limits: Limits, model: str | None, clock: Clock) -> list[Input]:
    """Choose by the frontier how to draw; return the jobs that fit the limits and report the others.

    Args:
        model: the only one to choose, where it is given.

    Raises:
        click.UsageError: an option says what the frontier decides.
    """
    from scenelang.output.frontier import NothingFits, yardstick

    for job in jobs:
        if job.how._replace(threads=None, device="auto") != DEFAULT or job.how.device == "cuda":
            asked = "--max-ms" if limits.ms is not None else "--max-flip"
            other = "--device cuda" if job.how.device == "cuda" else "--backend and --samples"
            raise click.UsageError(f"{asked} chooses how to draw on processors; leave out {other}.")
    with clock("choose"):
        here_ms, able = yardstick(), []
        for job in jobs:
            try:
                _choose(job, limits, model, here_ms)
                able.append(job)
            except NothingFits as error:
                say_trouble(f"{job.name}: {error}")
    return able


def _choose(job: Input, limits: Limits, model: str | None, here_ms: float) -> None:
    """Choose how to draw a job and compile it for the chosen model; raises `NothingFits`."""
    from scenelang.output.frontier import NothingFits, load_frontier, machine_scale

    assert job.program is not None
    name = job.program.model
    try:
        frontier = load_frontier(name)
    except ValueError as error:
        raise NothingFits(f"the frontier of `{name}` is damaged: {error}") from None
    if frontier is None:
        raise NothingFits(f"model `{name}` ships no frontier to choose from")
    scale = machine_scale(frontier, here_ms)
    choice, job.program = _chosen(frontier, job, job.program, limits, model, scale)
    point = choice.offer.point
    # as it was measured
    device: Device = "cpu" if job.program.stage is None and point.backend == "neural" else "auto"
    samples = point.samples if point.backend == "neural" else "adaptive"
    job.how = How(point.backend, device, job.how.threads, samples)
    speed = f"this machine takes {scale:.2f} times as long as the one that was measured"
    like = f"errors are promised for scenes like those of the set `{frontier.set}`"
    like += ", which have no elements" if job.scene is not None and job.scene.elements else ""
    refused = [f"not in question: {name}: {why}" for name, why in choice.refused.items()]
    notes = program_notes(job.program, "chosen by the frontier") if point.backend == "neural" else []
    job.notes = [*choice.notes, f"times are for one thread; {speed}", like, *refused, *notes]


def _chosen(
    frontier: Frontier, job: Input, program: Program, limits: Limits, model: str | None, scale: float
) -> tuple[Choice, Program]:
    """The best choice whose model draws the scene without further warnings, and its Program."""
    from scenelang.drawing.small import load_of
    from scenelang.output.frontier import choose, offers, refusal

    refused: dict[str, str] = {}
    able = []
    for point in frontier.points:
        why = refusal(point, job.scene, program, model)
        if why is None:
            able.append(point)
        elif point.offered:  # the others are for charts only
            refused[point.name] = why
    result = offers(able, load_of(program), program.canvas, scale)
    while True:
        choice = choose(result, limits, refused)
        point = choice.offer.point
        compiled = _compiled(job, program, point)
        if not isinstance(compiled, str):
            return choice, compiled
        refused |= {o.point.name: compiled for o in result if o.point.model == point.model}
        result = [offer for offer in result if offer.point.model != point.model]


def _compiled(job: Input, program: Program, point: Point) -> Program | str:
    """The Program for a point's model; the reason where it cannot draw the scene as promised."""
    if point.model in (None, program.model):
        return program
    assert job.scene is not None
    result = Diagnostics()
    try:
        compiled = compile_scene(job.scene, spans=job.spans, diagnostics=result, model=point.model)
    except SceneError:
        return result.errors[0].message
    known = {d.code for d in job.diagnostics}
    # a warning that the scene's own model does not give: this one is outside what it was trained on
    return next((d.message for d in result.items if d.code not in known), compiled)
