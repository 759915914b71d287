"""Lamps of a radius: how much of one a point sees, without random numbers.

A lamp is a disc as a point sees it, and what is between them a cone. A ray along its axis tells whether
something opaque comes nearer to the axis than the cone is wide, or holds the cone whole: most points are lit
or dark. For the others the disc is cut into parts, each a thinner cone; beside its axis the field is asked
where things were nearest to the ray. The distance, negative within solids, over the thin cone's radius there
tells what share of the part a straight edge at that distance leaves. Planes through what is nearest on both
sides of the place give the edge's distance even where a solid is thin. Edges of several things hide the same,
or other places, as they face alike, or apart.
"""

from __future__ import annotations

import numpy as np

from scenelang.drawing.arrays import Array, Arrays
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import LAST, PACE, STATE, UNTIL, Rays, T, Trail, Work, _Batch
from scenelang.drawing.solid.network import Wanted
from scenelang.drawing.solid.passes import Passes

PARTS = 4  # of the disc,
ASIDE, WIDE = 0.6, 0.55  # in units of its radius, their middles and radii: shares of straight edges are right
SIDE = (0.6, 0.0, -0.8)  # parts are turned alike but for points straight behind the lamp, seen from there
STRIDE = 0.5  # least steps, in units of the cone's radius,
HASTE, HURRY = 0.03, 0.5  # and of the way that is left, but no more of the cone's radius
# points of a unit ball from which rays go through media: a tetrahedron, whose first and second moments are,
# from everywhere, those of a disc
BEAMS = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], np.float32) / 2
# the like of an icosahedron, where the four differ
MORE_BEAMS = np.array(
    [np.roll((0, a, b), k) for k in range(3) for a in (-0.455, 0.455) for b in (-0.737, 0.737)], np.float32
)
FLOOR = 0.012  # what is added to all steps, in world units; rays end so far before a point
# what rays carry along: the cone's radius over the way that is left, the whole way, the least distance over
# the radius and where it is, the like of the two nearest things before, whether it falls, and its last
SPREAD, WHOLE, LEAST, WHERE, OTHER, THERE, THIRD, FARTHER, FALLS, BEFORE = range(STATE, STATE + 10)


class Cones(Rays):
    """Rays along the axes of cones, whose `told` (6, M) are rows `LEAST` to `FARTHER`."""

    def __init__(self, solids: SolidField, trail: Trail, spread: Array, whole: Array) -> None:
        xp, none = solids.xp, 0 * whole
        more = xp.stack([spread, whole, *[none + 1, none] * 3, none, none], 0)
        self.told = 1 * more[2:8]
        super().__init__(solids, trail, xp.where(none == 0), trail.passes, 0.0, more)

    def _step(self, batch: _Batch) -> None:
        xp, rows = self.xp, batch.rows
        t, d = 1 * rows[T], self._meet(batch, rows[T]).distance
        left = (rows[WHOLE] - t).clip(FLOOR)
        radius = rows[SPREAD] * left
        c = d / radius
        falls = c < rows[BEFORE]
        other = falls & (rows[FALLS] < 1)  # something else comes near
        for first in (OTHER, THIRD):  # what is nearer moves the others on
            kept = other & (rows[LEAST] < rows[first])
            for before, after in ((LEAST, first), (WHERE, first + 1)):
                rows[after], rows[before] = (
                    xp.select(kept, rows[a], rows[b]) for a, b in ((before, after), (after, before))
                )
        least = xp.select(other, 0 * c + 1, rows[LEAST])
        rows[WHERE] = xp.select(c < least, t, rows[WHERE])
        rows[LEAST] = xp.minimum(c, least)
        rows[FALLS], rows[BEFORE] = falls, c
        least = xp.minimum(rows[LEAST], rows[OTHER])  # less than the third
        step = xp.maximum((d - least.clip(-1.0, 1.0) * radius) * rows[PACE], STRIDE * radius)
        following = t + step + (HURRY * rows[SPREAD]).clip(None, HASTE) * left + FLOOR
        ended = xp.where(batch.alive & ((following > rows[UNTIL]) | (least <= -1)))
        xp.put(self.told, xp.take(batch.place, ended), xp.take(rows[LEAST:FALLS], ended))
        self._go(batch, following, batch.alive & (least > -1), rows[UNTIL] < rows[LAST])


def share(xp: Arrays, c: Array) -> Array:
    """The part (M,) of a unit disc on the near side of a straight edge at c from its middle."""
    c = c.clip(-1.0, 1.0)
    return (xp.acos(-c) + c * xp.sqrt(1 - c * c)) / np.pi


def form(xp: Arrays, cos: Array, far: Array, radius: float) -> Array:
    """The light that surfaces receive of a lamp of power 1 that nothing hides, by the cosines at which they
    see its middle and the distances of that, each (K,); 0 within it.

    Source: Snyder, Area Light Sources for Real-Time Graphics, 1996.
    """
    h = (far / radius).clip(1.0)
    x, sin = xp.sqrt(h * h - 1), xp.sqrt((1 - cos * cos).clip(1e-12))
    y = (-x * cos / sin).clip(-1.0, 1.0)
    edge = sin * xp.sqrt(1 - y * y)
    slope = edge / x.clip(1e-6)
    low = (cos * xp.acos(y) - x * edge) / (h * h) + xp.acos(1 / xp.sqrt(1 + slope * slope))
    result = xp.select(cos * h >= 1, cos / (h * h), low / np.pi) / radius**2
    return xp.select((cos * h > -1) & (far > radius), result.clip(0.0), 0 * cos)


def shown(solids: SolidField, at: Array, radius: float, p: Array, n: Array) -> tuple[Array, Work]:
    """Shares (K,) of a lamp's light that what is opaque lets through to points (3, K) outside of the lamp,
    and what it took. Surfaces have normals n (3, K); in media, where one edge is enough, 0.
    """
    xp = solids.xp
    way = p - at[:, None]
    square = (way * way).sum(0)
    far = xp.sqrt(square)
    spread = radius / xp.sqrt((square - radius * radius).clip(1e-9))  # of half the angle
    wide = (ASIDE + WIDE) * spread
    spare = xp.stack([wide, solids.reach - wide * far], 0)  # of the reach, along cones
    ids, passes = solids.passes(at, way / far, far - FLOOR, True, radius, spare)
    part, none = 0 * far + 1, 0 * far
    trail = Trail(none, none, none, ids, passes, none, work=Work(near=len(ids)))
    if not len(ids):
        return part, trail.work
    axes = Cones(solids, trail, xp.take(spread, ids), xp.take(far, ids))
    axes.run(0)
    least = xp.minimum(axes.told[0], axes.told[2])
    xp.put(part, ids, share(xp, least))
    half = xp.where((abs(least) < 1) & (abs(xp.take(n, ids)).sum(0) > 0))
    if len(half):
        some = xp.take(ids, half)
        seen = [xp.take(each, some) for each in (way / far, far, spread, n)]
        near = passes.at(xp, half), xp.take(axes.told, half)
        xp.put(part, some, _parted(solids, at, radius, seen, *near, trail.work))
    return part, trail.work


def _parted(
    solids: SolidField, at: Array, radius: float, seen: list[Array], passes: Passes, told: Array, work: Work
) -> Array:
    """As `shown`, of points on surfaces whose rays, with such passes, told (6, K) where things are near."""
    xp = solids.xp
    ray, far, spread, n = (xp.concat([part] * PARTS, -1) for part in seen)
    x, y, z = seen[0]
    a, b, c = SIDE
    u = xp.stack([y * c - z * b, z * a - x * c, x * b - y * a], 0)
    u = u / xp.sqrt((u * u).sum(0)).clip(1e-6)
    v = xp.stack([y * u[2] - z * u[1], z * u[0] - x * u[2], x * u[1] - y * u[0]], 0)
    turns = [(float(np.cos(i)), float(np.sin(i))) for i in np.arange(PARTS) * 2 * np.pi / PARTS + 0.3]
    # how axes of parts go apart from the ray, back from the point
    aside = xp.concat([ASIDE * seen[2] * (cos * u + sin * v) for cos, sin in turns], 1)
    spread = WIDE * spread
    way = ray - aside
    way = way / xp.sqrt((way * way).sum(0))
    facing = -(n * way).sum(0) / spread
    lit, side = 0 * far + 1, 0 * way  # shares of parts, and the side to which they are lit
    several = [xp.where(xp.concat([least] * PARTS, 0) < 1) for least in told[::2]]
    near, count = xp.concat(several, 0), told.shape[1]
    t = xp.concat([xp.take(t, some % count) for t, some in zip(told[1::2], several, strict=True)], 0)
    rays = passes.at(xp, near % count)
    ways, asides, rays_way, fars, spreads = (xp.take(x, near) for x in (way, aside, ray, far, spread))
    two = []
    for _ in range(2):
        left = (fars - t).clip(FLOOR)
        p = at[:, None] + rays_way * t + asides * left
        met = solids.meet(rays, t, Wanted.DISTANCE, gradient=True, p=p)
        work.met += met.met
        length = xp.sqrt((met.gradient * met.gradient).sum(0)).clip(0.05)
        along = (met.gradient * ways).sum(0) / length
        two.append((t, met.distance / length, along, met.gradient / length - along * ways))
        step = (STRIDE / WIDE * spreads + HASTE) * left + FLOOR
        t = xp.minimum(xp.select(along > 0, t - step, t + step).clip(radius), fars - FLOOR)
    (t, d, along, g), (u, e, beyond, h) = two
    # planes through what is nearest at both meet beside the axis, where an edge is; of thin plates, never
    both = along * beyond < 0
    apart = xp.select(both, along - beyond, 0 * d + 1)
    middle = (e - d + along * t - beyond * u) / apart
    g = xp.select(both, (along * h - beyond * g) / apart, xp.select(e < d, h, g))
    d, t = xp.select(both, d + along * (middle - t), xp.minimum(d, e)), xp.select(both, middle, t)
    steep = xp.sqrt((g * g).sum(0)).clip(1e-3)
    edge = d / (steep * spreads * (fars - t).clip(FLOOR))
    # what is nearest within the lamp hides nothing
    edge = xp.select((d > 0) & (t - along * d < radius), 0 * d + 1, edge)
    hides, g, begin = 1 - share(xp, edge), g / steep, 0
    for some in several:
        band = slice(begin, begin := begin + len(some))
        # of two edges one hides what the other does, other places, or crosses it, by their angle
        before, hidden, rest = xp.take(side, some), hides[band], xp.take(lit, some)
        cos = (g[:, band] * before).sum(0)
        common = xp.select(cos > 0, xp.minimum(hidden, 1 - rest), (hidden - rest).clip(0.0))
        crossed = hidden * (1 - rest)
        xp.put(side, some, xp.select(hidden > 1 - rest, g[:, band], before))
        xp.put(lit, some, rest - hidden + crossed + abs(cos) * (common - crossed))
    open_ = share(xp, facing)
    lit = xp.minimum(xp.minimum(lit, open_) / open_.clip(1e-6), 0 * open_ + 1)
    rest = xp.sqrt((1 - facing * facing).clip(0.0))
    # the mean of max(0, facing + y) over a unit disc
    weight = facing * open_ + rest * rest * rest * (2 / 3 / np.pi)
    return (lit * weight).reshape(PARTS, -1).sum(0) / weight.reshape(PARTS, -1).sum(0).clip(1e-9)
