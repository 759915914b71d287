"""Speed against error: what was measured of each way to draw, which of them are worth having, and the file.

A *point* is a way to draw: a model with its sampling, or the exact reference. The *front* are
the points that no other one beats: nothing faster has less error.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import ConfigDict, NonNegativeFloat, NonNegativeInt, PositiveInt, TypeAdapter, ValidationError

from scenelang.backend.options import Samples
from scenelang.files import read_json, read_regular
from scenelang.models.manifest import ROOT, available, load_manifest

Amount = NonNegativeFloat
Count = NonNegativeInt

FORMAT: Final = 1
NAME: Final = "frontier.json"
MOST_BYTES: Final = 4 << 20
_STRICT: Final = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, slots=True)
class Limits:
    """What a picture may take; None for no limit."""

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
    bound: Amount  # what is promised
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
    """How many times as long one way took as another, on the same scenes drawn in turn."""

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
    spread: Amount  # 95 of 100 measured frames took at most so many times what the sum says


@dataclass(frozen=True, slots=True)
class Point:
    """A way to draw and its figures."""

    __pydantic_config__ = _STRICT
    name: str  # what charts call it
    backend: Literal["neural", "reference"]
    model: str | None  # name of the model; None for the reference and for what has no trained weights
    renderer: str  # of the network, or `"reference"`
    # how it draws
    samples: Samples
    skip: bool
    spp: Count  # samples a pixel of the reference
    # pixels along a side that it draws, enlarged for the comparison; 0 where it draws any canvas
    side: Count
    offered: bool  # whether `scenelang render` chooses it
    why_not: str | None  # why it does not
    scenes: Count  # on how many it was measured
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
    on_front: bool  # whether nothing offered is both faster and nearer, in FLIP
    command: str | None  # what draws a scene this way; None where nothing does

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
    yardstick_ms: Amount  # what `scenelang.measure.choose.yardstick` took there
    streaming_ms: Amount  # a frame of the paper's streaming renderer at its full size, in the same run
    # mean FLIP of some points against 64 samples a pixel, by name: how near the definition is
    converged: dict[str, Amount]
    points: tuple[Point, ...]  # in the order of their time
    ratios: tuple[Ratio, ...] = ()
    command: str = ""  # that measured it

    def point(self, name: str) -> Point | None:
        """The point of a name, if it was measured."""
        return next((p for p in self.points if p.name == name), None)

    def ratio(self, slow: str, fast: str) -> Ratio | None:
        """What one way's time is of another's, if that was measured."""
        return next((r for r in self.ratios if (r.slow, r.fast) == (slow, fast)), None)

    def to_json(self) -> str:
        """The file's text."""
        return json.dumps(_rounded({"format": FORMAT, **asdict(self)}), indent=1) + "\n"

    @staticmethod
    def from_json(data: bytes) -> Frontier:
        """Read a file as if a stranger had written it; raises `ValueError` where it is none."""
        found = read_json(data)
        if not isinstance(found, dict) or found.pop("format", None) != FORMAT:
            raise ValueError(f"not a frontier of format {FORMAT}")
        try:
            return TypeAdapter(Frontier).validate_json(json.dumps(found))
        except ValidationError as error:
            place = ".".join(map(str, error.errors()[0]["loc"]))
            raise ValueError(f"`{place}` of the frontier does not hold what it should") from None


def _rounded(value: Any) -> Any:
    """Floats of four digits that count."""
    if isinstance(value, dict):
        return {k: _rounded(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(v) for v in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value


def front(figures: Sequence[tuple[float, float]]) -> list[bool]:
    """Which of (time, error) no other one beats: none is as good in both and better in one.

    Of equal points the first is kept.
    """
    order = sorted(range(len(figures)), key=lambda i: (*figures[i], i))
    kept = [False] * len(figures)
    best = math.inf
    for i in order:
        if figures[i][1] < best:
            best, kept[i] = figures[i][1], True
    return kept


def between(points: Iterable[Point]) -> int:
    """How many points lie between the fastest and the nearest: measured in error, and neither of the two."""
    drawn = [(p.ms.median, p.flip.mean) for p in points if p.flip is not None]
    nearest = min(drawn, key=lambda p: p[::-1], default=(0.0, 0.0))
    return sum(min(drawn)[0] < ms < nearest[0] for ms, _ in drawn)


def frontier_path(model: str) -> Path:
    """Where the frontier of a model's set is shipped: beside the weights of the model named like the set."""
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
