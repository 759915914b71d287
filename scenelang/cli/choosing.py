"""A way to draw for each scene, chosen by the frontier of its model."""

from __future__ import annotations

import click

from scenelang.cli.inputs import Input, program_notes
from scenelang.cli.say import say_trouble
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Program
from scenelang.drawing.how import DEFAULT, Device, How
from scenelang.drawing.small import load_of
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.reports import SceneError
from scenelang.output import frontier
from scenelang.output.frontier import Limits, NothingFits, Point


def choose_all(jobs: list[Input], limits: Limits, model: str | None) -> list[Input]:
    """Choose how to draw, by ``model`` alone where it is given; return the jobs that fit and report others.

    Raises `click.UsageError` where an option says what the frontier decides.
    """
    for job in jobs:
        if job.how._replace(threads=None, device="auto") != DEFAULT or job.how.device == "cuda":
            asked = "--max-ms" if limits.ms is not None else "--max-flip"
            other = "--device cuda" if job.how.device == "cuda" else "--backend and --samples"
            raise click.UsageError(f"{asked} chooses how to draw on processors; leave out {other}.")
    here_ms, able = frontier.yardstick(), []
    for job in jobs:
        try:
            _choose(job, limits, model, here_ms)
            able.append(job)
        except NothingFits as error:
            say_trouble(f"{job.name}: {error}")
    return able


def _choose(job: Input, limits: Limits, model: str | None, here_ms: float) -> None:
    """The best choice whose model draws a job's scene without further warnings; raises `NothingFits`."""
    program = job.program
    assert program is not None
    try:
        measured = frontier.load_frontier(program.model)
    except ValueError as error:
        raise NothingFits(f"the frontier of `{program.model}` is damaged: {error}") from None
    if measured is None:
        raise NothingFits(f"model `{program.model}` ships no frontier to choose from")
    reasons = {point.name: frontier.refusal(point, job.scene, program, model) for point in measured.points}
    # those that are not offered are for charts only
    refused = {p.name: why for p in measured.points if (why := reasons[p.name]) is not None and p.offered}
    able = [point for point in measured.points if reasons[point.name] is None]
    scale = frontier.machine_scale(measured, here_ms)
    result = frontier.offers(able, load_of(program), program.canvas, scale)
    while True:
        offer, notes = frontier.choose(result, limits, refused)
        point, compiled = offer.point, _compiled(job, program, offer.point)
        if not isinstance(compiled, str):
            break
        refused |= {o.point.name: compiled for o in result if o.point.model == point.model}
        result = [offer for offer in result if offer.point.model != point.model]
    # as it was measured
    device: Device = "cpu" if compiled.stage is None and point.backend == "neural" else "auto"
    samples = point.samples if point.backend == "neural" else "adaptive"
    job.program, job.how = compiled, How(point.backend, device, job.how.threads, samples)
    speed = f"this machine takes {scale:.2f} times as long as the one that was measured"
    like = f"errors are promised for scenes like those of the set `{measured.set}`"
    like += ", which have no elements" if job.scene is not None and job.scene.elements else ""
    others = [f"not in question: {name}: {why}" for name, why in refused.items()]
    own = program_notes(compiled, "chosen by the frontier") if point.backend == "neural" else []
    job.notes = [*notes, f"times are for one thread; {speed}", like, *others, *own]


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
