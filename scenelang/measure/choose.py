"""Which point of the frontier draws a scene: the fastest that is good enough, or the best that is in time."""

from __future__ import annotations

import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import torch

from scenelang.backend.load import Load
from scenelang.backend.options import RenderError
from scenelang.backend.render import exact_graph
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.graph.lower import lower
from scenelang.measure.frontier import Cost, Frontier, Limits, Point
from scenelang.models.manifest import available, load_manifest
from scenelang.program.program import Program
from scenelang.scene.schema import Scene

UNITS: Final = (1.0, 1e3, 1e6, 1e6, 1e3)  # of the terms of a `Cost`
_ROUNDS: Final = 15  # of the yardstick
OBJECTS: Final = 4
"""Objects of the largest scenes whose errors were measured; more have more outlines to be wrong at."""


class NothingFits(Exception):
    """No point draws the scene as fast or as exactly as asked; says which comes nearest."""


@dataclass(frozen=True, slots=True)
class Offer:
    """A point and what it promises for a scene on this machine."""

    point: Point  # from the frontier
    ms: float  # what 95 of 100 frames stay under
    flip: float  # what 97.5 of 100 scenes stay under

    def told(self) -> str:
        digits = 0 if self.ms >= 10 else 1
        return f"{self.point.name}: {self.ms:.{digits}f} ms and FLIP {self.flip:.2g} at most"


@dataclass(frozen=True, slots=True)
class Choice:
    """The point that draws, and why."""

    offer: Offer  # the chosen one
    runner_up: Offer | None  # the one that would be next
    refused: dict[str, str]  # names of points that cannot draw the scene, and the reason
    notes: tuple[str, ...]  # lines for people


def error_scale(canvas: tuple[int, int], objects: int) -> float:
    """By how much a promised error grows for a scene unlike those that were measured, at 256 x 256.

    Errors lie along outlines. On a smaller canvas more of the pixels do, in proportion to its shorter side,
    and with more than `OBJECTS` objects there is more outline, in proportion to their number. A larger canvas
    or fewer objects promise no less error than was measured.
    """
    return max(1.0, 256 / min(canvas)) * max(1.0, objects / OBJECTS)


def refusal(point: Point, scene: Scene | None, program: Program, only: str | None = None) -> str | None:
    """Reason why a point cannot draw a scene; None if it can.

    Args:
        scene: None of a compiled program, which is drawn by its own model.
        program: of the scene, for the model that it names.
        only: the one model to choose.
    """
    if only is not None and point.model != only:
        return f"--model {only}"
    if point.model is not None and point.model not in available():
        return "not installed"
    if not point.offered:
        return point.why_not or "not offered"
    if scene is None:
        if point.backend == "reference":
            return "a compiled program keeps only what the network needs"
        return None if point.model == program.model else f"the program was compiled for `{program.model}`"
    if point.model is None:
        try:
            if scene.elements:
                exact_graph(scene)
        except RenderError as error:  # an element has no original
            return str(error)
        return None
    lower(scene, load_manifest(point.model), None, found := Diagnostics())
    return found.errors[0].message if found.errors else None


def offers(points: Sequence[Point], load: Load, canvas: tuple[int, int], scale: float) -> list[Offer]:
    """What points that can draw a scene promise for it, the fastest first; ``scale`` from `machine_scale`."""
    found = []
    for point in points:
        if point.cost is None or point.flip is None:
            continue
        ms = predicted_ms(point.cost, load, point.skip) * point.cost.spread * scale
        found.append(Offer(point, ms, min(1.0, point.flip.bound * error_scale(canvas, load.objects))))
    return sorted(found, key=lambda o: (o.ms, o.flip))


def choose(found: Sequence[Offer], limits: Limits, refused: dict[str, str]) -> Choice:
    """The fastest offer that keeps the error, or the one of least error that keeps the time.

    Of offers that promise nearly the same error, within 2 %, the faster one is better. With both limits the
    fastest that keeps both is taken. Raises `NothingFits` where no offer keeps them.
    """
    if not found:
        told = "; ".join(f"{name}: {why}" for name, why in list(refused.items())[:3])
        raise NothingFits("nothing on the frontier draws this scene" + (f" ({told})" if told else ""))
    good = [offer for offer in found if not _lacks(offer, limits)]
    if not good:
        raise NothingFits(_nearest(found, limits))
    if limits.flip is not None:
        first = min(good, key=lambda o: (o.ms, o.flip))
        limit = f"FLIP {limits.flip:g}" + (f" and {limits.ms:g} ms" if limits.ms is not None else "")
        why = f"the fastest of {len(good)} that keep {limit}"
    else:
        least = min(o.flip for o in good)
        first = min((o for o in good if o.flip <= 1.02 * least), key=lambda o: o.ms)
        why = f"the most exact of {len(good)} that keep {limits.ms:g} ms"
    notes = [f"chosen by the frontier: {first.told()}, {why}"]
    others = [offer for offer in found if offer is not first]
    by, worse = ("ms", "slower") if limits.flip is not None else ("flip", "no more exact")
    runner_up = min(others, key=lambda o: (o not in good, getattr(o, by)), default=None)
    if runner_up is not None:
        notes.append(f"runner-up: {runner_up.told()}, {_lacks(runner_up, limits) or worse}")
    return Choice(first, runner_up, refused, tuple(notes))


def _lacks(offer: Offer, limits: Limits) -> str:
    """Which limits an offer exceeds, in words."""
    slow = limits.ms is not None and offer.ms > limits.ms
    wrong = limits.flip is not None and offer.flip > limits.flip
    return " and ".join(["too slow"] * slow + ["not exact enough"] * wrong)


def _nearest(found: Sequence[Offer], limits: Limits) -> str:
    """What comes nearest to limits that nothing keeps."""
    asked = [f"{limits.ms:g} ms"] if limits.ms is not None else []
    asked += [f"FLIP {limits.flip:g}"] if limits.flip is not None else []
    exact = [o for o in found if limits.flip is not None and o.flip <= limits.flip]
    if exact:
        told = f"exact enough is {min(exact, key=lambda o: o.ms).told()}"
    elif limits.flip is not None:
        told = f"the most exact is {min(found, key=lambda o: (o.flip, o.ms)).told()}"
    else:
        told = f"the fastest is {min(found, key=lambda o: o.ms).told()}"
    return f"nothing draws this scene within {' and '.join(asked)}; {told}"


# ---------------------------------------------------------------- what a frame will take


def predicted_ms(cost: Cost, load: Load, skip: bool) -> float:
    """Milliseconds of a frame on the machine that was measured, most likely; times `Cost.spread` at most."""
    terms = (cost.frame, cost.thousand_objects, cost.megapixel, cost.megameeting, cost.outline)
    return sum(t * v / unit for t, v, unit in zip(terms, load.row(skip), UNITS, strict=True))


@torch.no_grad()
def yardstick() -> float:
    """Milliseconds of a fixed piece of work like that of a frame, on one core: small products, cosines, sums.

    The ratio of two machines' yardsticks is what times are scaled by. Takes about 50 ms.
    """
    g = torch.Generator().manual_seed(1)
    x, w = torch.randn(32, 4096, generator=g), torch.randn(32, 32, generator=g) / 6
    b = torch.zeros(32, 1)
    plain = np.linspace(-1, 1, 1 << 15)
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    times = []
    try:
        for _ in range(_ROUNDS):
            started = time.thread_time()
            y = x
            for _ in range(4):
                y = torch.addmm(b, w, y).relu_()
            _ = y[:8].cos().mul_(y[8:16]).sum()
            _ = np.cos(np.hypot(plain, 0.5)) * plain
            times.append(1000 * (time.thread_time() - started))
    finally:
        torch.set_num_threads(before)
    return statistics.median(times[_ROUNDS // 3 :])


def machine_scale(frontier: Frontier, here_ms: float) -> float:
    """How many times as long as there this machine takes, by the yardstick."""
    return here_ms / frontier.yardstick_ms if frontier.yardstick_ms > 0 else 1.0
