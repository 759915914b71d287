"""Jobs to pictures: by the network, by the exact definition, or by what the frontier chooses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from scenelang.cli.clock import Clock
from scenelang.cli.inputs import Request
from scenelang.cli.jobs import Job
from scenelang.cli.say import say_trouble

if TYPE_CHECKING:
    from scenelang.backend.options import Device, Samples
    from scenelang.image import Image
    from scenelang.measure.frontier import Limits

Draw = Callable[[Job, Callable[[float], None]], "Image"]


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

    Args:
        limits: what a picture may take.
        request: what the command line says about every scene.
        clock: takes the time.
        threads: for drawing.
        ready: compiled scenes and where their pictures go.
        code: the exit code so far.
    """
    from scenelang.cli.choosing import choose_point
    from scenelang.measure.cost import yardstick

    with clock("choose"):
        here_ms = yardstick()
        points = {id(job): choose_point(job, limits, request.model, here_ms) for job, _ in ready}
    for job, _ in ready:
        if points[id(job)] is None:
            say_trouble(f"{job.name}: {job.trouble}")
            code = 2

    def draw(job: Job, progress: Callable[[float], None]) -> Image:
        point = points[id(job)]
        assert point is not None
        if point.backend == "reference":
            return exact(request, clock)(job, progress)
        return neural(clock, "cpu", threads, point.samples)(job, progress)

    return draw, [(job, path) for job, path in ready if points[id(job)] is not None], code


def neural(clock: Clock, device: Device, threads: int | None, samples: Samples) -> Draw:
    """Draw with trained networks."""
    from scenelang.backend.small import choose_drawer, draw_small

    def draw(job: Job, progress: Callable[[float], None]) -> Image:
        assert job.program is not None
        library, why = choose_drawer(job.program, device, samples)
        if library == "numpy":
            place = "one core" if job.program.stage is None else "all cores"
            with clock("draw"):
                drawing = draw_small(job.program, samples=samples, progress=progress, threads=threads)
        else:
            with clock("load torch"):
                from scenelang.backend.neural import choose_device, draw_program, open_model
            place = choose_device(device)
            with clock("load model"):
                model = open_model(job.program.model, place)
            with clock("draw"):
                drawing = draw_program(
                    job.program, model, threads=threads, samples=samples, progress=progress
                )
        job.notes.append(f"drawn by {library} on {place}: {why}")
        width, height = job.program.canvas
        once = width * height - drawing.refined
        job.notes.append(f"drew {once:,} pixels by one sample and {drawing.refined:,} by four")
        job.notes.append(f"{drawing.pairs:,} meetings of a sample and an object")
        return drawing.image

    return draw


def exact(request: Request, clock: Clock) -> Draw:
    """Draw by the exact definition."""
    from scenelang.backend.exact import draw_exact

    def draw(job: Job, progress: Callable[[float], None]) -> Image:
        assert job.source is not None
        assert job.source.scene is not None
        with clock("draw"):
            image = draw_exact(job.source.scene, spans=job.source.spans, model=request.model)
        job.notes.append("drew the exact picture, four samples a pixel")
        return image

    return draw
