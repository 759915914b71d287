"""``--max-ms`` and ``--max-flip`` of ``scenelang render``: which way of the frontier draws each scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from scenelang.cli.jobs import Job, program_notes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scenelang.backend.options import Samples
    from scenelang.measure.choose import Choice, Offer
    from scenelang.measure.frontier import Frontier, Limits, Point
    from scenelang.program.program import Program


def check_options(ctx: click.Context, limits: Limits, device: str) -> None:
    """Refuse options that the frontier decides.

    Raises:
        click.UsageError: one of them is given beside a limit.
    """
    from click.core import ParameterSource

    asked = "--max-ms" if limits.ms is not None else "--max-flip"
    for name in ("backend", "samples"):
        if limits and ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            raise click.UsageError(f"{asked} chooses the {name} itself; leave out --{name}.")
    if limits and device == "cuda":
        raise click.UsageError(f"{asked} knows processors only; leave out --device cuda.")


@dataclass(frozen=True, slots=True)
class Way:
    """How one job is drawn.

    Args:
        exact: by the reference.
        samples: of the network.
    """

    exact: bool
    samples: Samples


class Chooser:
    """Chooses for one scene after the other.

    Args:
        limits: what a picture may take.
        model: the only model to choose, where the command line names one.
    """

    def __init__(self, limits: Limits, model: str | None) -> None:
        self.limits, self.model = limits, model
        self._scale: float | None = None

    def choose(self, job: Job) -> Way | None:
        """Choose how to draw a job, and compile it for the model that does; None leaves a trouble in it.

        Args:
            job: compiled, without errors.
        """
        from scenelang.measure.choose import NothingFits
        from scenelang.measure.frontier import load_frontier

        program = job.program
        assert program is not None
        try:
            frontier = load_frontier(program.model)
        except ValueError as error:
            job.trouble = f"the frontier of `{program.model}` is damaged: {error}"
            return None
        if frontier is None:
            job.trouble = f"model `{program.model}` ships no frontier to choose from"
            return None
        try:
            choice, drawn = self._chosen(frontier, job, program)
        except NothingFits as error:
            job.trouble = str(error)
            return None
        point = choice.offer.point
        job.program = drawn
        notes = program_notes(drawn, "chosen by the frontier") if point.backend == "neural" else []
        scale = f"this machine takes {self._machine(frontier):.2f} times as long as the one that was measured"
        refused = [f"not in question: {name}: {why}" for name, why in choice.refused.items()]
        job.notes = [*choice.notes, f"times are for one thread; {scale}", *refused, *notes]
        return Way(point.backend == "reference", point.samples)

    def _chosen(self, frontier: Frontier, job: Job, program: Program) -> tuple[Choice, Program]:
        """The best choice whose model draws the scene without further warnings, and its Program."""
        from scenelang.measure.choose import choose

        refused: dict[str, str] = {}
        found = list(self._offers(frontier, job, program, refused))
        while True:
            choice = choose(found, self.limits, refused)
            point = choice.offer.point
            compiled = _compiled(job, program, point)
            if not isinstance(compiled, str):
                return choice, compiled
            refused |= {o.point.name: compiled for o in found if o.point.model == point.model}
            found = [offer for offer in found if offer.point.model != point.model]

    def _offers(
        self, frontier: Frontier, job: Job, program: Program, refused: dict[str, str]
    ) -> Iterator[Offer]:
        from scenelang.measure.choose import offers, refusal
        from scenelang.models.manifest import available, load_manifest
        from scenelang.program.work import load_of

        scene = job.source.scene if job.source is not None else None
        known = available()
        able = []
        for point in frontier.points:
            if not point.offered:
                continue  # charts only
            why = None
            if self.model is not None and point.model != self.model:
                why = f"--model {self.model}"
            elif point.model is not None and point.model not in known:
                why = "not installed"
            else:
                manifest = load_manifest(point.model) if point.model is not None else None
                why = refusal(point, manifest, scene, program.model if scene is None else None)
            if why is None:
                able.append(point)
            else:
                refused[point.name] = why
        yield from offers(able, load_of(program), program.canvas, self._machine(frontier))

    def _machine(self, frontier: Frontier) -> float:
        if self._scale is None:
            from scenelang.measure.choose import machine_scale
            from scenelang.measure.cost import yardstick

            self._scale = machine_scale(frontier, yardstick())
        return self._scale


def _compiled(job: Job, program: Program, point: Point) -> Program | str:
    """The Program for a point's model; the reason where it cannot draw the scene as promised."""
    if point.model in (None, program.model):
        return program
    from scenelang.diagnostics.diagnostic import Diagnostics
    from scenelang.diagnostics.error import SceneError
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
