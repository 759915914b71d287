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
from scenelang.output.frontier import (
    Choice,
    Frontier,
    Limits,
    NothingFits,
    Point,
    choose,
    load_frontier,
    machine_scale,
    offers,
    refusal,
    yardstick,
)


def choose_all(jobs: list[Input], limits: Limits, model: str | None) -> list[Input]:
    """Choose how to draw, by ``model`` alone where it is given; return the jobs that fit and report others.

    Raises `click.UsageError` where an option says what the frontier decides.
    """
    for job in jobs:
        if job.how._replace(threads=None, device="auto") != DEFAULT or job.how.device == "cuda":
            asked = "--max-ms" if limits.ms is not None else "--max-flip"
            other = "--device cuda" if job.how.device == "cuda" else "--backend and --samples"
            raise click.UsageError(f"{asked} chooses how to draw on processors; leave out {other}.")
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
