"""From geometry vectors to frames: where a world point lies in each object's own space.

The inverse reading of a `scenelang.lifting.layout`. All of it is linear algebra and turns by an
angle; nothing here is learned. Points are one array (d, M), and d is whatever the frames are made for.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scenelang.lifting.layout import PLANE_LAYOUT, Layout
from scenelang.program.program import ProgramError
from scenelang.renderers.arrays import Array, Arrays

FAR = 1e15  # leaf units: where points lie that float32 cannot follow; out of reach of everything
TAME = 1e8  # frames of smaller numbers cannot lead a point out of float32
MOST = 1e31  # the compiler keeps maps and deformations below this

Number = Array | float
"""A number, or one for each of many objects: an array (…, 1), which goes beside coordinates (…, M)."""
Point = Sequence[Array]
"""The d coordinates, each (…, M), of points."""


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
    """The frame of one geometry vector.

    Raises:
        ProgramError: it leads from the world to no leaf, which no compiled scene has.
    """
    g = g.astype(np.float64)
    largest = float(np.abs(g[layout.frame.start :]).max())
    last, middle = g[layout.frame], g[layout.middle]
    outer, inner = (
        g[group].reshape(-1, layout.strengths) for group in (layout.outer_warps, layout.inner_warps)
    )
    # from the leaf through the middle map, and on into the world; warps keep the distance to the origin
    middle_linear, middle_shift = _invert(middle)
    last_linear, last_shift = _invert(last)
    reach, moved = float(np.linalg.norm(middle_linear, 2)), float(np.hypot(*middle_shift))
    steps: list[Affine | Warp] = []
    stretch = 1.0
    for frame, warps, radius in ((last, outer, reach + moved), (middle, inner, 1.0)):
        if not np.array_equal(frame, layout.identity):
            steps.append(Affine(tuple(map(tuple, frame.reshape(2, 3).tolist()))))
        for twirl, x, y in warps.tolist():
            if twirl or x or y:
                steps.append(Warp(twirl, (x, y)))
                stretch *= 1.0 + radius * (abs(twirl) + float(np.hypot(x, y)))
    total = last_linear @ middle_linear
    rows = np.linalg.norm(last_linear if outer.any() else total, axis=1).tolist()
    if outer.any():
        centre, half = last_shift, tuple((r * reach, r * moved) for r in rows)
    else:
        centre, half = last_linear @ middle_shift + last_shift, tuple((r, 0.0) for r in rows)
    scale = float(np.linalg.svd(total, compute_uv=False)[1])
    if not (largest < MOST and 1 / MOST < scale < MOST):
        raise ProgramError("a frame beyond float32")
    at = float(centre[0]), float(centre[1])
    wild = largest > TAME or not 1 / TAME < scale < TAME
    return ObjectFrame(tuple(steps), scale, min(stretch, MOST), at, (half[0], half[1]), wild)


def _invert(frame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear part (2, 2) and shift (2,) of the map that a frame (6,) is the inverse of."""
    try:
        linear = np.linalg.inv(frame.reshape(2, 3)[:, :2])
    except np.linalg.LinAlgError:
        raise ProgramError("a frame without an inverse") from None
    if not np.abs(linear).max() < MOST:  # before squares of it overflow
        raise ProgramError("a frame beyond float32")
    return linear, -linear @ frame[[2, 5]]


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
