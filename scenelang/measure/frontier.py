"""Speed against error: what was measured of each way to draw, which of them are worth having, and the file.

A *point* is a way to draw: a model with its sampling, or the exact reference. The *front* are
the points that no other one beats: nothing faster has less error.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final, Literal, get_args

from scenelang.backend.render import Samples
from scenelang.files import read_json, read_regular
from scenelang.models.manifest import ROOT, available, load_manifest

FORMAT: Final = 1
NAME: Final = "frontier.json"
MOST_BYTES: Final = 4 << 20


@dataclass(frozen=True, slots=True)
class Times:
    """Milliseconds of a warm frame, over scenes."""

    median: float
    p95: float


@dataclass(frozen=True, slots=True)
class Errors:
    """FLIP of frames, in [0, 1], over scenes.

    Args:
        mean, p95, worst: as they say.
        bound: what is promised: the 97.5th percentile.
    """

    mean: float
    p95: float
    bound: float
    worst: float


@dataclass(frozen=True, slots=True)
class Quality:
    """PSNR of frames in dB, at most 50 each, over scenes; ``p5`` is the 5th percentile."""

    mean: float
    p5: float
    worst: float


@dataclass(frozen=True, slots=True)
class Cost:
    """Milliseconds of a frame as a sum; each coefficient is at least 0.

    Args:
        frame: of any frame.
        thousand_objects: for each 1,000 objects.
        megapixel: for each million pixels of the canvas.
        megameeting: for each million pixels within objects' bounds, summed over objects; where nothing is
            skipped every object meets every pixel.
        outline: for each 1,000 pixels around those bounds, where pixels are sampled four times.
        spread: 95 of 100 measured frames took at most so many times what the sum says.
    """

    frame: float
    thousand_objects: float
    megapixel: float
    megameeting: float
    outline: float
    spread: float


@dataclass(frozen=True, slots=True)
class Point:
    """A way to draw and its figures.

    Args:
        name: what charts call it.
        backend: ``"neural"`` or ``"reference"``.
        model: name of the model; None for the reference and for what has no trained weights.
        renderer: of the network, or ``"reference"``.
        samples, skip: how it draws.
        spp: samples a pixel of the reference.
        side: pixels along a side that it draws, enlarged for the comparison; 0 where it draws any canvas.
        offered: whether `scenelang render` chooses it.
        why_not: why it does not.
        scenes: on how many it was measured.
        ms, flip, psnr: figures; no errors where only the time was measured.
        ratio_to_streaming: how many times as fast as the paper's streaming renderer at its full size, on the
            same scenes; 0 where that was not measured.
        cost: what a frame takes elsewhere; None where it is not offered.
        parameters, bytes: numbers of the network and size of its file.
        on_front: whether nothing offered is both faster and nearer, in FLIP.
        command: what draws a scene this way; None where nothing does.
    """

    name: str
    backend: Literal["neural", "reference"]
    model: str | None
    renderer: str
    samples: Samples
    skip: bool
    spp: int
    side: int
    offered: bool
    why_not: str | None
    scenes: int
    ms: Times
    ratio_to_streaming: float
    flip: Errors | None
    psnr: Quality | None
    cost: Cost | None
    parameters: int
    bytes: int
    on_front: bool
    command: str | None

    @property
    def title(self) -> str:
        """The name, and at which size it draws if that is not the canvas."""
        return f"{self.name} ({self.side}², enlarged)" if self.side else self.name


@dataclass(frozen=True, slots=True)
class Frontier:
    """All points of one run.

    Args:
        set: the scenes' set.
        seed, scenes: of the scenes.
        canvas: pixels.
        threads: cores that drew.
        clock: ``"processor"`` time, which other work on the machine changes little, or ``"wall"``.
        machine, revision, torch: where and what.
        yardstick_ms: what `scenelang.measure.cost.yardstick` took there.
        streaming_ms: a frame of the paper's streaming renderer at its full size, in the same run.
        converged: mean FLIP of some points against 64 samples a pixel, by name: how near the definition is.
        points: in the order of their time.
    """

    set: str
    seed: int
    scenes: int
    canvas: tuple[int, int]
    threads: int
    clock: str
    machine: str
    revision: str
    torch: str
    yardstick_ms: float
    streaming_ms: float
    converged: dict[str, float]
    points: tuple[Point, ...]

    def to_json(self) -> str:
        """The file's text."""
        return json.dumps(_rounded({"format": FORMAT, **asdict(self)}), indent=1) + "\n"

    @staticmethod
    def from_json(data: bytes) -> Frontier:
        """Read a file as if a stranger had written it.

        Points in 8 bits, which files of before have, are left out: nothing draws so any more.

        Raises:
            ValueError: it is none, or holds what it cannot.
        """
        found = read_json(data)
        if not isinstance(found, dict) or found.pop("format", None) != FORMAT:
            raise ValueError(f"no frontier of format {FORMAT}")
        points = found.get("points")
        if not isinstance(points, list) or not all(isinstance(p, dict) for p in points):
            raise ValueError("a frontier without points")
        made = tuple(_point(p) for p in points if p.pop("precision", "float32") == "float32")
        canvas = found.get("canvas")
        if not isinstance(canvas, list) or len(canvas) != 2:
            raise ValueError("a frontier without a canvas")
        frontier: Frontier = _made(Frontier, {**found, "points": made, "canvas": tuple(canvas)})
        return frontier


def _point(told: dict[str, Any]) -> Point:
    parts = {
        key: None if told.get(key) is None else _made(kind, told[key])
        for key, kind in (("ms", Times), ("flip", Errors), ("psnr", Quality), ("cost", Cost))
    }
    if parts["ms"] is None:
        raise ValueError("a point without a time")
    point: Point = _made(Point, {**told, **parts})
    return point


def _made(kind: Any, told: Any) -> Any:
    """A dataclass from a dictionary with exactly its fields, each of the type it has to be."""
    if not isinstance(told, dict) or told.keys() != {f.name for f in fields(kind)}:
        raise ValueError(f"fields of a {kind.__name__.lower()} are missing or unknown")
    for field in fields(kind):
        value = told[field.name]
        if not _fits(str(field.type), value):
            raise ValueError(f"`{field.name}` of a {kind.__name__.lower()} does not hold what it should")
    return kind(**told)


def _fits(kind: str, value: Any) -> bool:
    if value is None:
        return kind.endswith("| None")
    kind = kind.removesuffix(" | None")
    if kind == "float":
        return type(value) in (int, float) and math.isfinite(value) and value >= 0
    if kind in ("int", "bool", "str"):
        return type(value).__name__ == kind and (kind != "int" or value >= 0)
    known = {
        "Samples": get_args(Samples),
        "Literal['neural', 'reference']": ("neural", "reference"),
    }
    choices = known.get(kind.replace('"', "'"))
    if choices is not None:
        return value in choices
    if kind == "tuple[int, int]":
        return all(type(v) is int and v > 0 for v in value)
    if kind == "dict[str, float]":
        return isinstance(value, dict) and all(_fits("float", v) for v in value.values())
    return True  # made before


def _short(value: float) -> float:
    """Four digits that count."""
    return float(f"{value:.4g}")


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _rounded(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(v) for v in value]
    return _short(value) if isinstance(value, float) else value


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
    drawn = [p for p in points if p.flip is not None]
    if not drawn:
        return 0
    fastest = min(drawn, key=lambda p: p.ms.median)
    nearest = min((p for p in drawn if p.flip is not None), key=lambda p: (p.flip.mean, p.ms.median))  # type: ignore[union-attr]
    low, high = sorted((fastest.ms.median, nearest.ms.median))
    return sum(low < p.ms.median < high for p in drawn if p is not fastest and p is not nearest)


def frontier_path(model: str) -> Path:
    """Where the frontier of a model's set is shipped: beside the weights of the model named like the set."""
    return ROOT / load_manifest(model).set / NAME


def load_frontier(model: str) -> Frontier | None:
    """The shipped frontier of the set that a model belongs to, None where there is none.

    Raises:
        ValueError: it is damaged.
        KeyError: there is no such model.
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
