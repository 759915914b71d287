"""Jobs to pictures: by the network, by the exact definition, or by what the frontier chooses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenelang.cli.inputs import Request
from scenelang.cli.jobs import Job, program_notes
from scenelang.cli.progress import Clock
from scenelang.cli.say import say_trouble
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.suggest import plural

if TYPE_CHECKING:
    from scenelang.backend.options import Device, Samples, Still
    from scenelang.image import Image
    from scenelang.measure.choose import Choice
    from scenelang.measure.frontier import Frontier, Limits, Point
    from scenelang.outputs import Output, Outputs, Proof
    from scenelang.program.program import Program
    from scenelang.scene.schema import Scene

Draw = Callable[[Job, Callable[[float], None]], "Image"]


def neural(
    clock: Clock, device: Device, threads: int | None, samples: Samples, *, exactly: bool = False
) -> Draw:
    """Draw with trained networks, or with formulas in their place."""
    from scenelang.backend.options import threads_for
    from scenelang.backend.small import choose_drawer, draw_small

    def draw(job: Job, progress: Callable[[float], None]) -> Image:
        assert job.program is not None
        library, why = choose_drawer(job.program, device, samples)
        if exactly:
            library, why = "numpy", "formulas in the network's place"
        if library == "numpy":
            cores = threads or threads_for(job.program.canvas) if job.program.stage else 1
            place = "one core" if cores == 1 else f"{cores} cores"
            with clock("draw"):
                drawing = draw_small(
                    job.program, samples=samples, progress=progress, threads=threads, exact=exactly
                )
        else:
            with clock("load torch"):
                from scenelang.backend.neural import choose_device, draw_program, open_model
            place = choose_device(device)
            with clock("load model"):
                model = open_model(job.program.model, place, job.program.weights)
            with clock("draw"):
                drawing = draw_program(
                    job.program, model, threads=threads, samples=samples, progress=progress
                )
        if drawing.work is not None and drawing.work.lost:
            lost = f"{drawing.work.lost:,} rays took too many steps"
            click.echo(f"Warning: {job.name}: the picture is incomplete: {lost}", err=True)
        job.notes.append(f"drawn by {library} on {place}: {why}")
        width, height = job.program.canvas
        once = width * height - drawing.refined
        job.notes.append(f"drew {plural(once, 'pixel')} by one sample and {drawing.refined:,} by four")
        job.notes.append(f"{plural(drawing.pairs, 'meeting')} of a sample and an object")
        return drawing.image

    return draw


def exact(request: Request, clock: Clock) -> Draw:
    """Draw by the exact definition."""
    from scenelang.backend.render import draw_exact

    def draw(job: Job, progress: Callable[[float], None]) -> Image:
        assert job.source is not None
        assert job.source.scene is not None
        with clock("draw"):
            image = draw_exact(
                job.source.scene, spans=job.source.spans, model=request.model, progress=progress
            )
        job.notes.append("drew the exact picture, four samples a pixel")
        return image

    return draw


def blank(job: Job, image: Image) -> str | None:
    """The reason why a picture has nothing to see, where no warning has said so."""
    if any(d.code == "W0402" for d in job.diagnostics):
        return None
    if job.program is not None and not len(job.program.tokens):
        return "no objects to draw: a module draws where it is called, as in part();"
    if not all(bool((abs(row - image[0, 0]) < 0.5 / 255).all()) for row in image):
        return None
    if (image[0, 0] > 1 - 0.5 / 255).all():
        return "one colour throughout; flat objects are white without a colour, and so is the background"
    return "one colour throughout: objects in the background's colour, cut away, or smaller than a pixel"


def job_outputs(
    job: Job, wanted: tuple[Output, ...], model: str | None, threads: int | None, backend: Still
) -> Outputs:
    """What is known beside the picture by what draws it, its proof aside."""
    from scenelang.backend.outputs import exact_outputs, neural_outputs
    from scenelang.outputs import Outputs

    wanted = tuple([name for name in wanted if name != "proof"])
    if not wanted:
        return Outputs()
    if backend != "reference":
        assert job.program is not None
        return neural_outputs(job.program, wanted, threads, exact=backend == "exact")
    assert job.source is not None
    assert job.source.scene is not None
    return exact_outputs(job.source.scene, wanted, spans=job.source.spans, model=model)


def check_proof(limits: Limits, backend: str) -> None:
    """Raise `click.UsageError` where a proof is asked for with what it does not go with."""
    if limits or backend != "neural":
        other = "--max-ms and --max-flip" if limits else f"--backend {backend}, whose pictures are exact"
        raise click.UsageError(f"A proof is of what the scene's model draws; leave out {other}.")


def proved(draw: Draw, clock: Clock, redraw: bool, proofs: list[Proof]) -> Draw:
    """Draw, perhaps again where it is not proved right, and append a proof of each picture."""
    from scenelang.backend.prove import prove_drawn

    def both(job: Job, progress: Callable[[float], None]) -> Image:
        assert job.program is not None
        with clock("prove"):
            image, proof = prove_drawn(job.graphs, job.program.model, lambda: draw(job, progress), redraw)
        proofs.append(proof)
        return image

    return both


# ---------------------------------------------------------------- by the frontier


def check_options(ctx: click.Context, limits: Limits, device: str) -> None:
    """Raise `click.UsageError` where an option that the frontier decides is given beside a limit."""
    from click.core import ParameterSource

    asked = "--max-ms" if limits.ms is not None else "--max-flip"
    for name in ("backend", "samples"):
        if limits and ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            raise click.UsageError(f"{asked} chooses the {name} itself; leave out --{name}.")
    if limits and device == "cuda":
        raise click.UsageError(f"{asked} knows processors only; leave out --device cuda.")


def chosen(
    limits: Limits,
    request: Request,
    clock: Clock,
    threads: int | None,
    ready: list[tuple[Job, Path]],
    code: int,
) -> tuple[Draw, list[tuple[Job, Path]], int]:
    """How to draw by the frontier, the scenes that it draws, and the exit code.

    Scenes that nothing on the frontier draws well or fast enough are reported and left out.
    """
    from scenelang.measure.choose import NothingFits, yardstick

    points: dict[int, Point] = {}
    with clock("choose"):
        here_ms = yardstick()
        for job, _ in ready:
            try:
                points[id(job)] = choose_point(job, limits, request.model, here_ms)
            except NothingFits as error:
                say_trouble(f"{job.name}: {error}")
                code = 2

    def draw(job: Job, progress: Callable[[float], None]) -> Image:
        point = points[id(job)]
        if point.backend == "reference":
            return exact(request, clock)(job, progress)
        assert job.program is not None
        place: Device = "cpu" if job.program.stage is None else "auto"  # as they were measured
        return neural(clock, place, threads, point.samples)(job, progress)

    return draw, [(job, path) for job, path in ready if id(job) in points], code


def choose_point(job: Job, limits: Limits, model: str | None, here_ms: float) -> Point:
    """Choose how to draw a job, and compile it for the model that does; raises `NothingFits`.

    ``model`` is the only one to choose where it is given; ``here_ms`` the yardstick's time on this machine.
    """
    from scenelang.measure.choose import NothingFits, machine_scale
    from scenelang.measure.frontier import load_frontier

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
    notes = program_notes(job.program, "chosen by the frontier") if point.backend == "neural" else []
    told = f"this machine takes {scale:.2f} times as long as the one that was measured"
    refused = [f"not in question: {name}: {why}" for name, why in choice.refused.items()]
    scene = job.source.scene if job.source is not None else None
    like = f"errors are promised for scenes like those of the set `{frontier.set}`"
    like += ", which have no elements" if scene is not None and scene.elements else ""
    job.notes = [*choice.notes, f"times are for one thread; {told}", like, *refused, *notes]
    return point


def _chosen(
    frontier: Frontier, job: Job, program: Program, limits: Limits, model: str | None, scale: float
) -> tuple[Choice, Program]:
    """The best choice whose model draws the scene without further warnings, and its Program."""
    from scenelang.backend.load import load_of
    from scenelang.measure.choose import choose, offers

    refused: dict[str, str] = {}
    able = []
    for point in frontier.points:
        why = _refusal(point, job, program, model)
        if why is None:
            able.append(point)
        elif point.offered:  # the others are for charts only
            refused[point.name] = why
    found = offers(able, load_of(program), program.canvas, scale)
    while True:
        choice = choose(found, limits, refused)
        point = choice.offer.point
        compiled = _compiled(job, program, point)
        if not isinstance(compiled, str):
            return choice, compiled
        refused |= {o.point.name: compiled for o in found if o.point.model == point.model}
        found = [offer for offer in found if offer.point.model != point.model]


def _refusal(point: Point, job: Job, program: Program, model: str | None) -> str | None:
    """Why a point is not in question."""
    from scenelang.measure.choose import refusal
    from scenelang.models.manifest import available, load_manifest

    if model is not None and point.model != model:
        return f"--model {model}"
    if point.model is not None and point.model not in available():
        return "not installed"
    manifest = load_manifest(point.model) if point.model is not None else None
    scene = job.source.scene if job.source is not None else None
    if point.backend == "reference" and scene is not None and (missing := _missing(scene, program.model)):
        return missing
    return refusal(point, manifest, scene, program.model if scene is None else None)


def _missing(scene: Scene, model: str) -> str | None:
    """Why the exact picture of a scene's elements cannot be drawn; None if it can."""
    if not scene.elements:
        return None
    from scenelang.diagnostics.diagnostic import Diagnostics
    from scenelang.fitting.mesh import FitError
    from scenelang.fitting.originals import originals_of
    from scenelang.graph.lower import lower
    from scenelang.models.manifest import load_manifest

    try:
        originals_of(scene, lower(scene, load_manifest(model), None, Diagnostics()))
    except (FitError, OSError) as error:
        return str(error)
    return None


def _compiled(job: Job, program: Program, point: Point) -> Program | str:
    """The Program for a point's model; the reason where it cannot draw the scene as promised."""
    if point.model in (None, program.model):
        return program
    from scenelang.diagnostics.diagnostic import Diagnostics
    from scenelang.program.compile import compile_scene

    source = job.source
    assert source is not None
    assert source.scene is not None
    found = Diagnostics()
    try:
        made = compile_scene(source.scene, spans=source.spans, diagnostics=found, model=point.model)
    except SceneError:
        return found.errors[0].message
    told = {d.code for d in job.diagnostics}
    # a warning that the scene's own model does not give: this one is outside what it was trained on
    return next((d.message for d in found.items if d.code not in told), made)
