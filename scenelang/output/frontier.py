"""Speed against error: the measured frontier, and the choice of a point of it for a scene.

A *point* is a way to draw: a model with its sampling, or the exact reference. The *front* is
the set of points that no other one beats: nothing faster has less error.
"""

from __future__ import annotations

import json
import math
import statistics
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from pydantic import ConfigDict, NonNegativeFloat, NonNegativeInt, PositiveInt, TypeAdapter, ValidationError

from scenelang.assets.files import read_json, read_regular
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import ROOT, available, load_manifest
from scenelang.compiler.program import Program
from scenelang.drawing.how import RenderError, Samples
from scenelang.drawing.render import exact_graph
from scenelang.drawing.small import Load
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import Scene

Amount = NonNegativeFloat
Count = NonNegativeInt

FORMAT: Final = 1
NAME: Final = "frontier.json"
MOST_BYTES: Final = 4 << 20
_STRICT: Final = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a picture's time and error; None for no limit."""

    ms: float | None  # most milliseconds of a frame on this machine
    flip: float | None  # most mean FLIP

    def __bool__(self) -> bool:
        return self.ms is not None or self.flip is not None


@dataclass(frozen=True, slots=True)
class Times:
    """Milliseconds of a warm frame, over scenes."""

    __pydantic_config__ = _STRICT
    median: Amount
    p95: Amount
    # the 95 % interval of the median, by its order statistics
    low: Amount = 0.0
    high: Amount = 0.0


@dataclass(frozen=True, slots=True)
class Errors:
    """FLIP of frames, in [0, 1], over scenes."""

    __pydantic_config__ = _STRICT
    mean: Amount
    p95: Amount
    bound: Amount  # promised
    worst: Amount
    interval: Amount = 0.0  # half the width of the 95 % interval of the mean


@dataclass(frozen=True, slots=True)
class Quality:
    """PSNR of frames in dB, at most 50 each, over scenes; ``p5`` is the 5th percentile."""

    __pydantic_config__ = _STRICT
    mean: Amount
    p5: Amount
    worst: Amount
    interval: Amount = 0.0  # half the width of the 95 % interval of the mean


@dataclass(frozen=True, slots=True)
class Ratio:
    """Ratio of the times of two ways, on the same scenes drawn in turn."""

    __pydantic_config__ = _STRICT
    # names of points
    slow: str
    fast: str
    scenes: Count
    mean: Amount  # of the scenes' ratios
    interval: Amount  # half the width of its 95 % interval


@dataclass(frozen=True, slots=True)
class Cost:
    """Milliseconds of a frame as a sum; each coefficient is at least 0."""

    __pydantic_config__ = _STRICT
    frame: Amount  # of any frame
    thousand_objects: Amount  # for each 1,000 objects
    megapixel: Amount  # for each million pixels of the canvas
    # for each million pixels within objects' bounds, summed over objects; where nothing is skipped every
    # object meets every pixel
    megameeting: Amount
    outline: Amount  # for each 1,000 pixels around those bounds, where pixels are sampled four times
    spread: Amount  # 95 of 100 measured frames took at most this many times the sum


@dataclass(frozen=True, slots=True)
class Point:
    """A way to draw and its figures."""

    __pydantic_config__ = _STRICT
    name: str  # label in charts
    backend: Literal["neural", "reference"]
    model: str | None  # name of the model; None for the reference and for a way without trained weights
    renderer: str  # of the network, or `"reference"`
    # how it draws
    samples: Samples
    skip: bool
    spp: Count  # samples a pixel of the reference
    # pixels along a side that it draws, enlarged for the comparison; 0 where it draws any canvas
    side: Count
    offered: bool  # true where `scenelang render` may choose it
    why_not: str | None  # reason if not
    scenes: Count  # number on which it was measured
    # figures; no errors where only the time was measured
    ms: Times
    # how many times as fast as the paper's streaming renderer at its full size, on the same scenes; 0 where
    # that was not measured
    ratio_to_streaming: Amount
    flip: Errors | None
    psnr: Quality | None
    cost: Cost | None  # what a frame takes elsewhere; None where it is not offered
    # numbers of the network and size of its file
    parameters: Count
    bytes: Count
    on_front: bool  # true where nothing offered is both faster and nearer, in FLIP
    command: str | None  # the command that draws a scene this way, if there is one

    @property
    def title(self) -> str:
        """The name, and at which size it draws if that is not the canvas."""
        return f"{self.name} ({self.side}², enlarged)" if self.side else self.name


@dataclass(frozen=True, slots=True)
class Frontier:
    """All points of one run."""

    __pydantic_config__ = _STRICT
    set: str  # the scenes' set
    # of the scenes
    seed: Count
    scenes: Count
    canvas: tuple[PositiveInt, PositiveInt]  # pixels
    threads: Count  # cores that drew
    clock: str  # `"processor"` time, which other work on the machine changes little, or `"wall"`
    # where and what
    machine: str
    revision: str
    torch: str
    yardstick_ms: Amount  # time of `yardstick` there
    streaming_ms: Amount  # a frame of the paper's streaming renderer at its full size, in the same run
    # mean FLIP of some points against 64 samples a pixel, by name: how near the definition is
    converged: dict[str, Amount]
    points: tuple[Point, ...]  # in the order of their time
    ratios: tuple[Ratio, ...] = ()
    command: str = ""  # the command that measured it

    def point(self, name: str) -> Point | None:
        """The point of a name, if it was measured."""
        return next((p for p in self.points if p.name == name), None)

    def ratio(self, slow: str, fast: str) -> Ratio | None:
        """Ratio of two ways' times, if it was measured."""
        return next((r for r in self.ratios if (r.slow, r.fast) == (slow, fast)), None)

    def to_json(self) -> str:
        """The file's text."""
        return json.dumps(_rounded({"format": FORMAT, **asdict(self)}), indent=1) + "\n"

    @staticmethod
    def from_json(data: bytes) -> Frontier:
        """Read a file as if a stranger had written it; raises `ValueError` where it is none."""
        result = read_json(data)
        if not isinstance(result, dict) or result.pop("format", None) != FORMAT:
            raise ValueError(f"not a frontier of format {FORMAT}")
        try:
            return TypeAdapter(Frontier).validate_json(json.dumps(result))
        except ValidationError as error:
            place = ".".join(map(str, error.errors()[0]["loc"]))
            raise ValueError(f"`{place}` of the frontier does not hold what it should") from None


def _rounded(value: Any) -> Any:
    """Round floats to four significant digits."""
    if isinstance(value, dict):
        return {k: _rounded(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(v) for v in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value


def front(figures: Sequence[tuple[float, float]]) -> list[bool]:
    """Mask of the Pareto front of (time, error): no other point is as good in both and better in one.

    Of equal points the first one counts.
    """
    order = sorted(range(len(figures)), key=lambda i: (*figures[i], i))
    mask = [False] * len(figures)
    best = math.inf
    for i in order:
        if figures[i][1] < best:
            best, mask[i] = figures[i][1], True
    return mask


def between(points: Iterable[Point]) -> int:
    """Number of points between the fastest and the nearest one, without these, among those with an error."""
    drawn = [(p.ms.median, p.flip.mean) for p in points if p.flip is not None]
    nearest = min(drawn, key=lambda p: p[::-1], default=(0.0, 0.0))
    return sum(min(drawn)[0] < ms < nearest[0] for ms, _ in drawn)


def frontier_path(model: str) -> Path:
    """Shipped file of the frontier of a model's set: next to the weights of the model of the set's name."""
    return ROOT / load_manifest(model).set / NAME


def load_frontier(model: str) -> Frontier | None:
    """The shipped frontier of the set that a model belongs to, None where there is none.

    Raises `ValueError` where it is damaged, `KeyError` where there is no such model.
    """
    if model not in available():
        raise KeyError(model)
    try:
        data = read_regular(frontier_path(model), MOST_BYTES)
    except FileNotFoundError:
        return None
    if len(data) > MOST_BYTES:
        raise ValueError(f"a frontier of more than {MOST_BYTES >> 20} MB")
    return Frontier.from_json(data)


UNITS: Final = (1.0, 1e3, 1e6, 1e6, 1e3)  # of the terms of a `Cost`
_ROUNDS: Final = 15  # of the yardstick
OBJECTS: Final = 4
"""Objects of the largest scenes whose errors were measured; more have more outlines to be wrong at."""


class NothingFits(Exception):
    """No point keeps the limits; the message names the nearest one."""


@dataclass(frozen=True, slots=True)
class Offer:
    """A point and what it promises for a scene on this machine."""

    point: Point  # from the frontier
    ms: float  # at least the time of 95 of 100 frames
    flip: float  # at least the error of 97.5 of 100 scenes

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
    """Factor of a promised error for a scene unlike those that were measured, at 256 x 256.

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
    lower(scene, load_manifest(point.model), None, diagnostics := Diagnostics())
    return diagnostics.errors[0].message if diagnostics.errors else None


def offers(points: Sequence[Point], load: Load, canvas: tuple[int, int], scale: float) -> list[Offer]:
    """Promises of points for a scene, the fastest first; ``scale`` is that of `machine_scale`."""
    result = []
    for point in points:
        if point.cost is None or point.flip is None:
            continue
        ms = predicted_ms(point.cost, load, point.skip) * point.cost.spread * scale
        result.append(Offer(point, ms, min(1.0, point.flip.bound * error_scale(canvas, load.objects))))
    return sorted(result, key=lambda o: (o.ms, o.flip))


def choose(offers: Sequence[Offer], limits: Limits, refused: dict[str, str]) -> Choice:
    """The fastest offer that keeps the error, or the one of least error that keeps the time.

    Of offers that promise nearly the same error, within 2 %, the faster one is better. With both limits the
    fastest that keeps both is taken. Raises `NothingFits` where no offer keeps them.
    """
    if not offers:
        reasons = "; ".join(f"{name}: {why}" for name, why in list(refused.items())[:3])
        raise NothingFits("nothing on the frontier draws this scene" + (f" ({reasons})" if reasons else ""))
    good = [offer for offer in offers if not _lacks(offer, limits)]
    if not good:
        raise NothingFits(_nearest(offers, limits))
    if limits.flip is not None:
        first = min(good, key=lambda o: (o.ms, o.flip))
        limit = f"FLIP {limits.flip:g}" + (f" and {limits.ms:g} ms" if limits.ms is not None else "")
        why = f"the fastest of {len(good)} that keep {limit}"
    else:
        least = min(o.flip for o in good)
        first = min((o for o in good if o.flip <= 1.02 * least), key=lambda o: o.ms)
        why = f"the most exact of {len(good)} that keep {limits.ms:g} ms"
    notes = [f"chosen by the frontier: {first.told()}, {why}"]
    others = [offer for offer in offers if offer is not first]
    by, worse = ("ms", "slower") if limits.flip is not None else ("flip", "no more exact")
    runner_up = min(others, key=lambda o: (o not in good, getattr(o, by)), default=None)
    if runner_up is not None:
        notes.append(f"runner-up: {runner_up.told()}, {_lacks(runner_up, limits) or worse}")
    return Choice(first, runner_up, refused, tuple(notes))


def _lacks(offer: Offer, limits: Limits) -> str:
    """Limits that an offer exceeds, in words."""
    slow = limits.ms is not None and offer.ms > limits.ms
    wrong = limits.flip is not None and offer.flip > limits.flip
    return " and ".join(["too slow"] * slow + ["not exact enough"] * wrong)


def _nearest(offers: Sequence[Offer], limits: Limits) -> str:
    """Message about the offer that is nearest to limits that none keeps."""
    asked = [f"{limits.ms:g} ms"] if limits.ms is not None else []
    asked += [f"FLIP {limits.flip:g}"] if limits.flip is not None else []
    exact = [o for o in offers if limits.flip is not None and o.flip <= limits.flip]
    if exact:
        nearest = f"exact enough is {min(exact, key=lambda o: o.ms).told()}"
    elif limits.flip is not None:
        nearest = f"the most exact is {min(offers, key=lambda o: (o.flip, o.ms)).told()}"
    else:
        nearest = f"the fastest is {min(offers, key=lambda o: o.ms).told()}"
    return f"nothing draws this scene within {' and '.join(asked)}; {nearest}"


# ---------------------------------------------------------------- predicted times


def predicted_ms(cost: Cost, load: Load, skip: bool) -> float:
    """Likely milliseconds of a frame on the measured machine; at most `Cost.spread` times as many."""
    terms = (cost.frame, cost.thousand_objects, cost.megapixel, cost.megameeting, cost.outline)
    return sum(t * v / unit for t, v, unit in zip(terms, load.row(skip), UNITS, strict=True))


def yardstick() -> float:
    """Milliseconds of a fixed piece of work like that of a frame, on one core: small products, cosines, sums.

    The ratio of two machines' yardsticks is what times are scaled by. Takes about 50 ms.
    """
    import torch

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
    """Time on this machine relative to the measured one, by the yardstick."""
    return here_ms / frontier.yardstick_ms if frontier.yardstick_ms > 0 else 1.0
