"""Objects that rays may meet: their frames, and the balls in which each lies; none of it is learned.

A ray has a slot for each ball that it passes, so that its cost depends on those balls alone, however many
objects the scene has. An object that cuts away everything outside of it is met wherever something may be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scenelang.drawing.arrays import Array, Arrays
from scenelang.drawing.tables import BEGINS, CLIPS, DRAWS, MAP, TURN_Z, Objects


class Turn(NamedTuple):
    """A turn of coordinates (i, j) by an angle ``twirl |p| + rate p[along]``, in the sense of R."""

    i: int
    j: int
    twirl: float
    rate: float
    along: int

    def _carried(self, xp: Arrays, p: Array) -> tuple[Array, Array, Array, Array | None]:
        angle, length = self.rate * p[self.along], None
        if self.twirl:
            length = xp.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
            angle = angle + self.twirl * length
        cos, sin = xp.cos(angle), xp.sin(angle)
        a, b = p[self.i], p[self.j]
        rows = [p[0], p[1], p[2]]
        rows[self.i], rows[self.j] = cos * a + sin * b, cos * b - sin * a
        return xp.stack(rows, 0), cos, sin, length

    def __call__(self, xp: Arrays, p: Array) -> Array:
        return self._carried(xp, p)[0]

    def pulled(self, xp: Arrays, p: Array, g: Array) -> Array:
        """The gradient (3, M) before the turn of what has the gradient g behind it; p lies before it."""
        q, cos, sin, length = self._carried(xp, p)
        a, b = g[self.i], g[self.j]
        swing = a * q[self.j] - b * q[self.i]  # how it changes with the angle
        rows = [g[0], g[1], g[2]]
        rows[self.i], rows[self.j] = cos * a - sin * b, sin * a + cos * b
        rows[self.along] = rows[self.along] + self.rate * swing
        result = xp.stack(rows, 0)
        return result if length is None else result + (self.twirl * swing / length.clip(1e-12)) * p


class Map(NamedTuple):
    """An affine map: p to linear p + shift."""

    linear: Array  # (3, 3)
    shift: Array  # (3,)

    def __call__(self, xp: Arrays, p: Array) -> Array:
        return xp.dense(p, self.linear, self.shift)

    def pulled(self, xp: Arrays, p: Array, g: Array) -> Array:
        """As `Turn.pulled`."""
        return self.linear.T @ g


@dataclass(frozen=True, slots=True)
class SolidFrame:
    """An object's way back to its leaf, outermost first."""

    outer: Map  # into the space in which the object lies in a ball about the origin
    steps: tuple[Turn | Map, ...]  # what follows it
    scale: float  # world distance per leaf distance, the smallest singular value of the composed map
    reach: float  # the ball that holds a leaf ball of radius r has the radius reach r + moved
    moved: float
    amount: float  # of the displacement
    frequency: float

    def ball(self, radius: float) -> float:
        """Radius of the ball behind `outer` outside which leaf coordinates are longer than ``radius``."""
        return self.reach * radius + self.moved

    def local(self, xp: Arrays, p: Array) -> Array:
        """Leaf coordinates of points behind `outer`, both (3, M)."""
        for step in self.steps:
            p = step(xp, p)
        return p

    def pulled(self, xp: Arrays, p: Array, g: Array) -> Array:
        """Gradient (3, M) at points behind `outer` of what has the gradient g in leaf coordinates."""
        passed = []
        for step in self.steps:
            passed.append((step, p))
            p = step(xp, p)
        for step, at in reversed(passed):
            g = step.pulled(xp, at, g)
        return g


INF = float("inf")
OBJECT, WAY, BEGIN, END, RATE, SLOT = 0, slice(1, 4), 4, 5, 6, 7  # what a slot of a ray has, and how many


@dataclass(frozen=True, slots=True)
class Solid:
    """One object: where rays may meet it."""

    frame: SolidFrame
    draws: bool  # something may be seen, where it is met, of what was empty before
    clips: bool  # outside its ball nothing is left of its group so far, or of what the group it begins joins
    begins: bool  # a group
    ends: int  # groups that end behind it
    radius: float  # leaf units from its origin beyond which it changes nothing
    ball: float  # radius of the ball around that behind the frame's outer map
    rate: float  # at which its world distance changes in it at most, per step of 1 behind the map
    centre: Array  # (3,) of a ball of the world around that
    extent: float  # radius of this
    wide: bool = False  # its ball holds more than what its leaf changes
    box: tuple[Array, Array] | None = (
        None  # behind the map, least and greatest coordinates (3, 1) that it changes
    )


def read_solids(xp: Arrays, objects: Objects, like: Array) -> list[Solid]:
    """The rows of a table, with arrays where another lies."""
    steps = [_step(xp, row, like) for row in objects.steps]
    rows, flags = objects.rows, {flag: objects.flagged(flag).tolist() for flag in (DRAWS, CLIPS, BEGINS)}
    names = ("scale", "reach", "moved", "amount", "frequency", "ends", "radius", "ball", "rate", "extent")
    numbers = {name: rows[name].tolist() for name in (*names, "step", "steps")}
    solids = []
    for i in range(len(rows)):
        own = {name: numbers[name][i] for name in names}
        first, count = numbers["step"][i], numbers["steps"][i]
        frame = {name: own.pop(name) for name in names[:5]}
        solids.append(
            Solid(
                SolidFrame(_affine(xp, rows["map"][i], like), tuple(steps[first : first + count]), **frame),
                **{
                    name: flags[flag][i]
                    for name, flag in (("draws", DRAWS), ("clips", CLIPS), ("begins", BEGINS))
                },
                centre=xp.array(rows["centre"][i], like),
                wide=bool(objects.wide[i]),
                **own,
            )
        )
    return solids


def _step(xp: Arrays, row: np.void, like: Array) -> Turn | Map:
    if row["kind"] == MAP:
        return _affine(xp, row["map"], like)
    if row["kind"] == TURN_Z:
        return Turn(0, 1, float(row["twirl"]), float(row["rate"]), 0)
    return Turn(0, 2, 0.0, float(row["rate"]), 1)


def _affine(xp: Arrays, numbers: np.ndarray, like: Array) -> Map:
    return Map(xp.array(numbers[:9].reshape(3, 3), like), xp.array(numbers[9:], like))


class Passes(NamedTuple):
    """The balls that M rays pass, K at most."""

    # (SLOT, K, M), a ray's last object first: its number, or -1 minus it where it does not draw; the ray's
    # direction behind its map; begin and end, inf and -inf where there is none; the distance's greatest rate
    slots: Array
    origins: Array  # (3, N), the point behind the map of each object, or (3, M) in the world
    many: bool = False  # whether each ray has a point of its own

    def at(self, xp: Arrays, index: Array) -> Passes:
        """Passes of some of the rays."""
        origins = xp.take(self.origins, index) if self.many else self.origins
        return Passes(xp.take(self.slots, index), origins, self.many)


def find_passes(
    xp: Arrays,
    solids: Sequence[Solid],
    origin: Array,
    origins: Array,
    way: Array,
    limit: Array,
    tight: bool = True,
    begin: Array | float = 0.0,
    spare: Array = None,
) -> tuple[Array, Passes]:
    """Indices (k,) of rays that may meet something that draws, and the balls that these pass, boxes too if
    ``tight``. Rays go from (3,), behind the objects' maps (3, N), or from a point each (3, M), along unit
    directions (3, M) from ``begin`` (M,) up to a limit. Balls of rays from (3,) may be smaller by ``spare``
    (2, M), its first row for each unit of the way and the second at its beginning.
    """
    low, high, result = 0 * way[0] + begin, limit, []
    filled, drawn = xp.whole(0 * low), low < 0
    around: list[tuple[Array, Array]] = []  # of the groups that a group stands in
    for i, solid in reversed(list(enumerate(solids))):
        around += [(low, high)] * solid.ends
        start = origins if origin.ndim == 2 else origins[:, i, None]
        rays, values = _crossed(xp, solid, origin, start, (way, low, high), tight, spare)
        if solid.begins:
            low, high = around.pop()
        if solid.clips:
            low, high = 0 * way[0] + INF, 0 * way[0] - INF
            xp.put(low, rays, values[BEGIN])
            xp.put(high, rays, values[END])
        values[OBJECT] = i if solid.draws else -1 - i
        slot = xp.take(filled, rays)
        xp.put(filled, rays, slot + 1)
        if solid.draws:
            xp.put(drawn, rays, slot >= 0)
        result.append((rays, slot, values))
    some = xp.where(drawn)
    count, most = len(some), int(filled.max()) if len(some) else 0
    slots = xp.full((SLOT, most, count), 0.0, way)
    slots[BEGIN], slots[END] = INF, -INF
    if count:
        rays, slot, values = (xp.concat(parts, -1) for parts in zip(*result, strict=True))
        place = xp.take(placed(xp, some, filled), rays)
        kept = xp.where(place >= 0)
        if len(kept) < len(place):
            place, slot, values = (xp.take(each, kept) for each in (place, slot, values))
        xp.put(slots.reshape(SLOT, -1), slot * count + place, values)
    many = origin.ndim == 2
    return some, Passes(slots, xp.take(origins, some) if many else origins, many)


def _crossed(
    xp: Arrays, solid: Solid, origin: Array, start: Array, ways: tuple[Array, ...], tight: bool, spare: Array
) -> tuple[Array, Array]:
    """Indices (k,) of rays that pass an object's ball between low and high, and their slots (SLOT, k)."""
    (way, low, high), near, less = ways, None, 0.0  # leaf units by which the ball is smaller
    if origin.ndim == 2:  # the ball is ahead, or around
        to = solid.centre[:, None] - origin
        ahead, room = (to * way).sum(0), solid.extent**2 * (1 + 1e-5) - (to * to).sum(0)
        near = xp.where((room >= 0) | ((ahead > 0) & (room + ahead * ahead >= 0)))
        start = solid.frame.outer(xp, xp.take(origin, near))
    else:
        to = solid.centre - origin
        far = float(xp.sqrt(to @ to))
        if far > solid.extent:  # rays within a cone around the ball, by its cosine less 1e-5 for rounding
            near = xp.where(to @ way >= far * (1 - (solid.extent / far) ** 2) ** 0.5 - 1e-5 * far)
            if spare is not None and not solid.wide:
                rate, least = xp.take(spare, near)
                less = (least + rate * (far - solid.extent)).clip(0.0) / solid.frame.scale
    if near is not None:
        way, low, high = xp.take(way, near), xp.take(low, near), xp.take(high, near)
    a = solid.frame.outer.linear @ way
    square = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    middle = -((start * a).sum(0) if origin.ndim == 2 else start[:, 0] @ a) / square
    closest = start + middle * a  # to the ball's centre
    ball = solid.ball - solid.frame.reach * less
    left = ball**2 - closest[0] * closest[0] - closest[1] * closest[1] - closest[2] * closest[2]
    half = xp.sqrt((left / square).clip(0.0))
    begin, end = xp.maximum(middle - half, low), xp.minimum(middle + half, high)
    if tight and solid.box is not None:
        first, last = ((side - start) / a for side in (solid.box[0] + less, solid.box[1] - less))
        begin = xp.maximum(begin, xp.largest(xp.minimum(first, last))[0])
        end = xp.minimum(end, xp.least(xp.maximum(first, last)))
    hit = xp.where((left > 0) & (begin <= end))
    values = xp.concat([square[None], a, begin[None], end[None], solid.rate * xp.sqrt(square)[None]], 0)
    return hit if near is None else xp.take(near, hit), xp.take(values, hit)


def placed(xp: Arrays, index: Array, like: Array) -> Array:
    """Positions (M,) of entries in an index, -1 for those that are not in it; `like` are integers (M,)."""
    result = 0 * like - 1
    xp.put(result, index, xp.whole(0 * index + 1).cumsum(0) - 1)
    return result
