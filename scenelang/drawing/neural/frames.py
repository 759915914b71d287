"""Frames from geometry vectors: they carry world points into each object's own space.

They invert `scenelang.compiler.lifting`. All of it is linear algebra and turns by an angle; nothing here is
learned. Points are one array (d, M).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import BY_POINTS, Element
from scenelang.compiler.lifting import PLANE_LAYOUT, STRENGTHS, Layout, Parts
from scenelang.compiler.program import ProgramError
from scenelang.drawing.arrays import NUMPY, Array, Arrays

FAR = 1e15  # leaf units: where points lie that float32 cannot follow; out of reach of everything
TAME = 1e8  # frames of smaller numbers cannot lead a point out of float32
MOST = 1e31  # the compiler keeps maps and deformations below this

Floats = npt.NDArray[np.float64]
Number = Array | float
"""A number, or one for each of many objects: an array (…, 1), which goes beside coordinates (…, M)."""
Point = Sequence[Array]  # the d coordinates, each (…, M), of points


class FrameMap(NamedTuple):
    """An affine map: d rows of d factors and a shift."""

    rows: tuple[tuple[Number, ...], ...]

    def __call__(self, xp: Arrays, p: Point) -> Point:
        """Points mapped."""
        return [_combine(xp, row, p) + row[-1] for row in self.rows]


class FrameTurn(NamedTuple):
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


class Frames:
    """The ways of N objects back to their leaves, by vectors (N, .): a map, warps, a map, warps, outermost
    first.

    ``scale`` (N,) is world distance per leaf distance, the smallest singular value of the composed map,
    ``stretch`` (N,) by how much more than 1 a distance can change per world unit, ``wild`` (N,) whether
    points may leave float32 on the way, which costs a detour through float64. Raises `ProgramError` where a
    vector does not lead to a leaf, as those of compiled scenes do.
    """

    def __init__(self, g: np.ndarray, layout: Layout = PLANE_LAYOUT) -> None:
        with np.errstate(all="ignore"):
            self._read(np.ascontiguousarray(g.T, np.float64), layout)

    def _read(self, numbers: Floats, layout: Layout) -> None:
        self.numbers = numbers
        (last_at, outer_at), (middle_at, inner_at) = layout.ways
        last, middle = numbers[last_at], numbers[middle_at]
        # from the leaf through the middle map, and on into the world; warps keep the distance to the origin
        a, b, c, d, x, y = _inverse(middle)
        e, f, g, h, u, v = _inverse(last)
        reach, moved = _stretches(a, b, c, d)[1], np.hypot(x, y)
        self._stages: list[_Stage] = []
        self.stretch = np.ones(numbers.shape[1])
        for frame, warps, radius in ((last_at, outer_at, reach + moved), (middle_at, inner_at, 1.0)):
            rows = numbers[frame]
            moves = (rows != np.reshape(layout.identity, (-1, 1))).any(0)
            steep = _stretches(*rows[[0, 1, 3, 4]])[1]
            self._stages.append(_Stage(frame, moves, steep, np.zeros_like(steep)))
            for at in range(warps.start, warps.stop, STRENGTHS):
                strengths = slice(at, at + STRENGTHS)
                twirl, *bend = numbers[strengths]
                turns = (numbers[strengths] != 0.0).any(0)
                rate = abs(twirl) + np.hypot(*bend)
                self._stages.append(_Stage(strengths, turns, np.ones_like(rate), rate))
                self.stretch *= 1.0 + radius * rate
        p, q, r, s = e * a + f * c, e * b + f * d, g * a + h * c, g * b + h * d
        self.scale = _stretches(p, q, r, s)[0]
        largest = abs(numbers[last_at.start : inner_at.stop]).max(0)
        if not ((largest < MOST) & (self.scale > 1 / MOST) & (self.scale < MOST)).all():
            raise ProgramError("a damaged program: a frame beyond float32")
        self.stretch = np.minimum(self.stretch, MOST)
        outer = (numbers[outer_at] != 0.0).any(0)
        across, along = np.hypot(e, f), np.hypot(g, h)
        zero = np.zeros_like(moved)
        self._centre = np.where(outer, [u, v], [e * x + f * y + u, g * x + h * y + v])
        self._slope = np.where(outer, [across * reach, along * reach], [np.hypot(p, q), np.hypot(r, s)])
        self._more = np.where(outer, [across * moved, along * moved], [zero, zero])
        self.wild = (largest > TAME) | ~((self.scale > 1 / TAME) & (self.scale < TAME))

    def boxes(self, radius: Floats) -> tuple[Floats, Floats]:
        """Corners (2, N) of world boxes outside which leaf coordinates are longer than radii (N,)."""
        half = self._slope * radius + self._more
        return self._centre - half, self._centre + half

    def steps(self, dtype: Any) -> tuple[np.ndarray, np.ndarray]:
        """Rows of all maps (kind 0) and turns (1) that move something, objects in turn, and how many each has
        (N,).
        """
        rows = np.zeros((self.numbers.shape[1], len(self._stages)), dtype)
        there = np.stack([stage.moves for stage in self._stages], 1)
        for at, stage in enumerate(self._stages):
            numbers = self.numbers[stage.numbers]
            rows["kind"][:, at], rows["number"][:, at, : len(numbers)] = len(numbers) == STRENGTHS, numbers.T
            rows["steep"][:, at], rows["rate"][:, at] = stage.steep, stage.rate
        return rows[there], there.sum(1).astype(np.int32)

    def local(self, xp: Arrays, objects: np.ndarray, p: Array) -> Array:
        """Leaf coordinates (2, ..., P) of world points (2, ..., P), a column for each of the objects (P,)."""
        wide = bool(self.wild[objects].any())
        points = list(xp.wide(p) if wide else p)
        for stage in self._stages:
            which = np.flatnonzero(stage.moves[objects])
            if not len(which):
                continue
            every = 2 * len(which) > len(objects)
            factors = self.numbers[stage.numbers][:, objects if every else objects[which]]
            step = _step(xp.array(factors if wide else factors.astype(np.float32), p))
            if every:
                points = list(step(xp, points))
                continue
            index = xp.array(which, p)
            moved = step(xp, [xp.take(coordinate, index) for coordinate in points])
            points = [xp.copy(coordinate) for coordinate in points]
            for coordinate, values in zip(points, moved, strict=True):
                xp.put(coordinate, index, values)
        q = xp.stack(points, 0)
        return xp.narrow(q.clip(-FAR, FAR)) if wide else q

    def blocks(self, objects: np.ndarray, p: Floats, radius: Floats) -> tuple[Floats, Floats]:
        """Leaf coordinates (2, P) of discs' centres (2, P), and radii (P,) of discs in which they lie."""
        points = list(p)
        with np.errstate(all="ignore"):
            for stage in self._stages:
                if not stage.moves[objects].any():
                    continue
                # along the way from the centre, a warp's derivative is no longer than this
                turning = (np.hypot(*points) + radius) * stage.rate[objects]
                radius = radius * stage.steep[objects] * (1.0 + turning)
                points = list(_step(self.numbers[stage.numbers][:, objects])(NUMPY, points))
            return np.stack(points), radius


class _Stage(NamedTuple):
    """One map, or one warp, of every object."""

    numbers: slice  # where its numbers lie in a geometry vector
    moves: np.ndarray  # (N,) whether it moves anything
    steep: Floats  # (N,) how far it takes points apart at most, per distance; of a warp, at the origin
    rate: Floats  # (N,) of a warp, how fast its angle changes at most, per distance


def _step(factors: Array) -> FrameMap | FrameTurn:
    """The map of six numbers (6, P), or the warp of three."""
    if len(factors) == 6:
        return FrameMap((tuple(factors[:3]), tuple(factors[3:])))
    return FrameTurn(factors[0], tuple(factors[1:]))


def _stretches(a: Floats, b: Floats, c: Floats, d: Floats) -> tuple[Floats, Floats]:
    """The smallest and largest singular value of matrices [[a, b], [c, d]]."""
    largest = 0.5 * (np.hypot(a + d, c - b) + np.hypot(a - d, c + b))
    return np.where(largest > 0, abs(a * d - b * c) / largest, 0.0), largest


def _inverse(frame: Floats) -> tuple[Floats, ...]:
    """Linear part (row by row) and shift of the maps that frames (6, N) are the inverses of."""
    a, b, x, c, d, y = frame
    det = a * d - b * c
    if (det == 0.0).any():
        raise ProgramError("a damaged program: a frame without an inverse")
    a, b, c, d = d / det, -b / det, -c / det, a / det
    if not (np.max([abs(a), abs(b), abs(c), abs(d)], 0) < MOST).all():  # before squares of it overflow
        raise ProgramError("a damaged program: a frame beyond float32")
    return a, b, c, d, -(a * x + b * y), -(c * x + d * y)


class Skins(NamedTuple):
    """What objects make of their leaves' distances d: ``|d - first| - wall - last``, or ``d - first`` where
    ``wall``, half of a shell, is 0. A displacement is added behind the first, or at the end where ``late`` is
    1. All are in leaf units, float32 (N,) or numbers of one object.
    """

    first: Array
    wall: Array
    last: Array
    late: Array

    @property
    def reach(self) -> Array:
        """How much farther out objects reach (N,), below 0 where they shrink."""
        return self.first + self.wall + self.last

    def at(self, objects: Any) -> Skins:
        """Those of some objects (P,), or of one."""
        return Skins(*(part[objects] for part in self))

    def placed(self, xp: Arrays, like: Array) -> Skins:
        """The same where an array lies."""
        return Skins(*(xp.array(part, like) for part in self))

    def put_on(self, xp: Arrays, d: Array) -> Array:
        """Distances (…, N) of objects by those of their leaves (…, N), without displacements."""
        d = d - self.first
        return xp.select((d < 0.0) & (self.wall > 0.0), -d, d) - (self.wall + self.last)


def read_skins(parts: Parts, brought: Sequence[Element | None] = ()) -> Skins | None:
    """The skins of vectors' parts, None where no object has one; raises `ProgramError` for a damaged one.
    Those of ``brought`` shapes by points may be of any size.
    """
    grow, shell, order = (np.asarray(part, np.float32) for part in (parts.grow, parts.shell, parts.order))
    if not (grow.any() or shell.any() or order.any()):
        return None
    free = np.array([held is not None and held.form in BY_POINTS for held in brought] or [False])
    known = (free | ((abs(grow - 0.25) <= 0.75) & (shell <= 1.0))) & (shell >= 0.0) & np.isin(order, range(4))
    if not known.all():
        raise ProgramError("a damaged program: a leaf that grows, or a shell, beyond what there is")
    behind = order.astype(int)
    last = np.where(behind & 1, grow, 0.0).astype(np.float32)
    return Skins(grow - last, shell / 2, last, (behind // 2).astype(np.float32))
