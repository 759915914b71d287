"""Jobs to pictures: as the command line says, or as the frontier chooses."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import click

from scenelang.backend.options import DEFAULT, How
from scenelang.cli.inputs import Input
from scenelang.cli.jobs import program_notes
from scenelang.cli.progress import Clock
from scenelang.cli.say import say_trouble
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.suggest import plural

if TYPE_CHECKING:
    from scenelang.backend.options import Device
    from scenelang.image import Image
    from scenelang.measure.choose import Choice
    from scenelang.measure.frontier import Frontier, Limits, Point
    from scenelang.program.program import Program


def draw_job(job: Input, clock: Clock, progress: Callable[[float], None]) -> Image:
    """Draw a job as it says, and note what it took; ``progress`` is called with the share done, in [0, 1]."""
    from scenelang.backend.options import threads_for
    from scenelang.backend.render import draw, draw_exact

    how, program = job.how, job.program
    if how.backend == "reference":
        assert job.scene is not None
        with clock("draw"):
            image = draw_exact(job.scene, spans=job.spans, progress=progress)
        job.notes.append("drew the exact picture, four samples a pixel")
        return image
    from scenelang.backend.small import choose_drawer

    assert program is not None
    library, why = choose_drawer(program, how.device, how.samples, exact=how.backend == "exact")
    if library == "numpy":
        cores = how.threads or threads_for(program.canvas) if program.stage else 1
        device, place = "numpy", "one core" if cores == 1 else f"{cores} cores"
    else:
        with clock("load torch"):
            from scenelang.backend.neural import choose_device, open_model
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


# ---------------------------------------------------------------- by the frontier


def choose_all(jobs: list[Input], limits: Limits, model: str | None, clock: Clock) -> list[Input]:
    """Have the frontier choose how to draw; return the jobs that it draws as asked and report the others.

    Args:
        model: the only one to choose, where it is given.

    Raises:
        click.UsageError: an option says what the frontier decides.
    """
    from scenelang.measure.choose import NothingFits, yardstick

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
    """Choose how to draw a job, and compile it for the model that does; raises `NothingFits`."""
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
    # as it was measured
    device: Device = "cpu" if job.program.stage is None and point.backend == "neural" else "auto"
    samples = point.samples if point.backend == "neural" else "adaptive"
    job.how = How(point.backend, device, job.how.threads, samples)
    told = f"this machine takes {scale:.2f} times as long as the one that was measured"
    like = f"errors are promised for scenes like those of the set `{frontier.set}`"
    like += ", which have no elements" if job.scene is not None and job.scene.elements else ""
    refused = [f"not in question: {name}: {why}" for name, why in choice.refused.items()]
    notes = program_notes(job.program, "chosen by the frontier") if point.backend == "neural" else []
    job.notes = [*choice.notes, f"times are for one thread; {told}", like, *refused, *notes]


def _chosen(
    frontier: Frontier, job: Input, program: Program, limits: Limits, model: str | None, scale: float
) -> tuple[Choice, Program]:
    """The best choice whose model draws the scene without further warnings, and its Program."""
    from scenelang.backend.load import load_of
    from scenelang.measure.choose import choose, offers, refusal

    refused: dict[str, str] = {}
    able = []
    for point in frontier.points:
        why = refusal(point, job.scene, program, model)
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


def _compiled(job: Input, program: Program, point: Point) -> Program | str:
    """The Program for a point's model; the reason where it cannot draw the scene as promised."""
    if point.model in (None, program.model):
        return program
    from scenelang.diagnostics.diagnostic import Diagnostics
    from scenelang.program.compile import compile_scene

    assert job.scene is not None
    found = Diagnostics()
    try:
        made = compile_scene(job.scene, spans=job.spans, diagnostics=found, model=point.model)
    except SceneError:
        return found.errors[0].message
    told = {d.code for d in job.diagnostics}
    # a warning that the scene's own model does not give: this one is outside what it was trained on
    return next((d.message for d in found.items if d.code not in told), made)
