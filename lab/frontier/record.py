"""The measured frontier with all of its figures.

The *front* is the set of points that no other one beats: nothing faster has less error.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from pydantic import ConfigDict, NonNegativeFloat, NonNegativeInt, PositiveInt

from scenelang.output import frontier as shipped
from scenelang.output.frontier import FORMAT

Amount = NonNegativeFloat
Count = NonNegativeInt
_STRICT: Final = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


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
class FrameErrors(shipped.FrameErrors):
    """FLIP of frames, in [0, 1], over scenes."""

    __pydantic_config__ = _STRICT
    mean: Amount
    p95: Amount
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
class Point(shipped.Point):
    """A way to draw and its figures."""

    __pydantic_config__ = _STRICT
    flip: FrameErrors | None
    renderer: str  # of the network, or `"reference"`
    spp: Count  # samples a pixel of the reference
    # pixels along a side that it draws, enlarged for the comparison; 0 where it draws any canvas
    side: Count
    scenes: Count  # number on which it was measured
    ms: Times
    # how many times as fast as the paper's streaming renderer at its full size, on the same scenes; 0 where
    # that was not measured
    ratio_to_streaming: Amount
    psnr: Quality | None  # None where only the time was measured
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
class Frontier(shipped.Frontier):
    """All points of one run."""

    __pydantic_config__ = _STRICT
    points: tuple[Point, ...]
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
    streaming_ms: Amount  # a frame of the paper's streaming renderer at its full size, in the same run
    # mean FLIP of some points against 64 samples a pixel, by name: how near the definition is
    converged: dict[str, Amount]
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


def _rounded(value: Any) -> Any:
    """Round floats to four significant digits."""
    if isinstance(value, dict):
        return {k: _rounded(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(v) for v in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value


def front(figures: Sequence[tuple[float, float]]) -> list[bool]:
    """Mask of the Pareto front of (time, error); of equal points the first one counts."""
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
