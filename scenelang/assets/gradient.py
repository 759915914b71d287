"""Gradients: materials whose colour changes between stops, along x or outward from the origin."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from itertools import pairwise
from typing import Any, ClassVar, Final

from scenelang.assets.records import Record

NAMES: Final = "linear", "radial"
STOPS: Final = range(2, 9)  # how many a gradient may have
HARD: Final = 1e-6  # of an offset: stops that are no farther apart are a hard edge

Stops = tuple[tuple[float, float, float, float], ...]


class Gradient(Record):
    """A gradient over the (u, v) of textures.

    Args:
        name: ``linear``, over u from -1 to 1, or ``radial``, over the distance from the origin, 0 to 1.
        stops: offset, red, green and blue of each, in [0, 1], in the space that colours are averaged in;
            offsets rise, and equal neighbours are a hard edge.
    """

    kind: ClassVar = "texture"  # a model that draws textures draws gradients
    material: ClassVar = True
    dimension: ClassVar = 2

    name: str
    stops: Stops = ()

    @property
    def digest(self) -> str:
        """SHA-256, hex, of everything that determines its colours."""
        return hashlib.sha256(repr((self.name, self.stops)).encode()).hexdigest()

    @property
    def edges(self) -> tuple[float, ...]:
        """Offsets of its hard edges."""
        return tuple([b[0] for a, b in pairwise(self.stops) if b[0] - a[0] <= HARD and a[1:] != b[1:]])

    @property
    def slope(self) -> float:
        """The most that a channel changes over a unit of (u, v), apart from hard edges."""
        rates = [
            max(abs(p - q) for p, q in zip(a[1:], b[1:], strict=True)) / (b[0] - a[0])
            for a, b in pairwise(self.stops)
            if b[0] - a[0] > HARD
        ]
        return max(rates, default=0.0) / (2 if self.name == "linear" else 1)


def material_fault(name: str, ops: Iterable[Any]) -> tuple[Any, str] | None:
    """The stop that is wrong among the operations of a material, None where some lack, and why, if one is."""
    stops = [op for op in ops if op.kind == "stop"]
    if name not in NAMES:
        return (stops[0], f"a stop in `{name}`, which is not a gradient") if stops else None
    fault = stops_fault([stop.offset for stop in stops])
    return fault and (stops[fault[0]] if fault[0] >= 0 else None, fault[1])


def stops_fault(offsets: list[float]) -> tuple[int, str] | None:
    """The first stop that is wrong by its offset or number, -1 where some are missing, and why, if one is."""
    for at, offset in enumerate(offsets):
        if not 0.0 <= offset <= 1.0:
            return at, f"a stop at {offset:g}, which is outside 0..1"
        if at and offset < offsets[at - 1]:
            return at, f"a stop at {offset:g} after one at {offsets[at - 1]:g}"
        if at >= STOPS[-1]:
            return at, f"more than {STOPS[-1]} stops in one gradient"
    if len(offsets) < STOPS[0]:
        found = "one stop" if offsets else "no stop"
        return -1 if not offsets else 0, f"a gradient with {found}, at least {STOPS[0]} are needed"
    return None
