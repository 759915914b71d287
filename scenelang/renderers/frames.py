"""From geometry vectors to frames: where a world point lies in each object's own space.

The inverse reading of a `scenelang.lifting.layout`. All of it is linear algebra and turns by an
angle; nothing here is learned. Points are one array (d, M), and d is whatever the frames are made for.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import hypot
from typing import NamedTuple

import numpy as np

from scenelang.graph.spaces import stretches
from scenelang.lifting.layout import PLANE_LAYOUT, Layout
from scenelang.program.program import ProgramError
from scenelang.renderers.arrays import Array, Arrays

FAR = 1e15  # leaf units: where points lie that float32 cannot follow; out of reach of everything
TAME = 1e8  # frames of smaller numbers cannot lead a point out of float32
MOST = 1e31  # the compiler keeps maps and deformations below this

Number = Array | float
"""A number, or one for each of many objects: an array (…, 1), which goes beside coordinates (…, M)."""
Point = Sequence[Array]  # the d coordinates, each (…, M), of points


class Affine(NamedTuple):
    """An affine map: d rows of d factors and a shift."""

    rows: tuple[tuple[Number, ...], ...]

    def __call__(self, xp: Arrays, p: Point) -> Point:
        """Points mapped."""
        return [_combine(xp, row, p) + row[-1] for row in self.rows]


class Warp(NamedTuple):
    """A clockwise turn of the first two coordinates by an angle t |p| + b · p."""

    twirl: Number
    bend: tuple[Number, ...]

    def __call__(self, xp: Arrays, p: Point) -> Point:
        """Points turned."""
        angle = _combine(xp, self.bend, p)
        if not (isinstance(self.twirl, float) and self.twirl == 0.0):
            angle = xp.add_product(angle, xp.length(p), self.twirl)
        cos, sin = xp.cos(angle), xp.sin(angle)
        x, y, *others = p
        return [xp.add_product(x * cos, y, sin), xp.add_product(y * cos, x, -sin), *others]


def _combine(xp: Arrays, factors: tuple[Number, ...], p: Point) -> Array:
    """The sum (…, M) of coordinates times a factor each."""
    total = p[0] * factors[0]
    for coordinate, factor in zip(p[1:], factors[1:], strict=False):
        total = xp.add_product(total, coordinate, factor)
    return total


@dataclass(frozen=True, slots=True)
class ObjectFrame:
    """An object's way back to its leaf, outermost first.

    Args:
        steps: frames and warps in the order a world point meets them; identities are left out.
        scale: world distance per leaf distance, the smallest singular value of the composed map.
        stretch: how much faster than one world unit per world unit a distance can change at most.
        centre: world point about which the object lies.
        half: half extents (x, y) of the world box that holds a leaf disc of radius r: half[0] r + half[1].
        wild: whether points may leave float32 on the way, which costs a detour through float64.
    """

    steps: tuple[Affine | Warp, ...]
    scale: float
    stretch: float
    centre: tuple[float, float]
    half: tuple[tuple[float, float], tuple[float, float]]
    wild: bool

    @property
    def growth(self) -> float:
        """How many leaf units a point moves at most as it moves by a world unit."""
        return self.stretch / self.scale

    def box(self, radius: float) -> tuple[float, float, float, float]:
        """World box (xmin, ymin, xmax, ymax) outside which leaf coordinates are longer than ``radius``."""
        dx, dy = (slope * radius + more for slope, more in self.half)
        x, y = self.centre
        return x - dx, y - dy, x + dx, y + dy


def read_frame(g: np.ndarray, layout: Layout = PLANE_LAYOUT) -> ObjectFrame:
    """The frame of one geometry vector of the plane, in plain floats, as a stream has one for each object.

    Raises:
        ProgramError: it does not lead from the world to a leaf, as those of compiled scenes do.
    """
    numbers = g.tolist()
    last, outer, middle, inner = [numbers[part] for part in _parts(layout)]
    steps: list[Affine | Warp] = []
    # from the leaf through the middle map, and on into the world; warps keep the distance to the origin
    a, b, c, d, x, y = _inverse(middle)
    e, f, g_, h, u, v = _inverse(last)
    reach, moved = stretches(a, b, c, d)[1], hypot(x, y)
    stretch = 1.0
    for frame, warps, radius in ((last, outer, reach + moved), (middle, inner, 1.0)):
        if frame != [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]:
            steps.append(Affine((tuple(frame[:3]), tuple(frame[3:]))))
        for at in range(0, len(warps), layout.strengths):
            twirl, *bend = warps[at : at + layout.strengths]
            if twirl or any(bend):
                steps.append(Warp(twirl, tuple(bend)))
                stretch *= 1.0 + radius * (abs(twirl) + hypot(*bend))
    p, q, r, s = e * a + f * c, e * b + f * d, g_ * a + h * c, g_ * b + h * d
    scale = stretches(p, q, r, s)[0]
    largest = max(map(abs, (*last, *outer, *middle, *inner)))
    if not (largest < MOST and 1 / MOST < scale < MOST):
        raise ProgramError("a damaged program: a frame beyond float32")
    if any(outer):
        centre, across, along = (u, v), hypot(e, f), hypot(g_, h)
        half = (across * reach, across * moved), (along * reach, along * moved)
    else:
        centre = e * x + f * y + u, g_ * x + h * y + v
        half = (hypot(p, q), 0.0), (hypot(r, s), 0.0)
    wild = largest > TAME or not 1 / TAME < scale < TAME
    return ObjectFrame(tuple(steps), scale, min(stretch, MOST), centre, half, wild)


@lru_cache
def _parts(layout: Layout) -> tuple[slice, ...]:
    return layout.frame, layout.outer_warps, layout.middle, layout.inner_warps


def _inverse(frame: list[float]) -> tuple[float, ...]:
    """Linear part (row by row) and shift of the map that a frame (6,) is the inverse of."""
    a, b, x, c, d, y = frame
    det = a * d - b * c
    if det == 0.0:
        raise ProgramError("a damaged program: a frame without an inverse")
    a, b, c, d = d / det, -b / det, -c / det, a / det
    if not max(abs(a), abs(b), abs(c), abs(d)) < MOST:  # before squares of it overflow
        raise ProgramError("a damaged program: a frame beyond float32")
    return a, b, c, d, -(a * x + b * y), -(c * x + d * y)


def local_points(xp: Arrays, frame: ObjectFrame, p: Array) -> Array:
    """Leaf coordinates of world points, both (d, M)."""
    if frame.wild:
        return xp.narrow(xp.stack(way_back(xp, frame.steps, list(xp.wide(p))), 0).clip(-FAR, FAR))
    return xp.stack(way_back(xp, frame.steps, list(p)), 0) if frame.steps else p


def way_back(xp: Arrays, steps: Iterable[Affine | Warp], p: Point) -> Point:
    """Points carried through maps and warps in turn."""
    for step in steps:
        p = step(xp, p)
    return p
