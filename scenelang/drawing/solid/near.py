"""The solids' field at points anywhere, asked only as far as it matters there.

A point meets the objects that are within its reach. Objects of many scenes are sorted out by cells: points
that lie in one cell have the same objects to choose from.

Letters as in `network.py`.
"""

from __future__ import annotations

import numpy as np

from scenelang.drawing.arrays import Array
from scenelang.drawing.solid.field import Meeting, SolidField, SolidPairs, Steps
from scenelang.drawing.solid.network import RADIUS, Wanted

FEW = 12  # objects that every point is held against
HALF = 1 << 16  # cells on either side of the origin
LN2, ROOT = 0.6931472, 0.8661  # of a cube of side 1 the ball around has the radius `ROOT`


def near(
    field: SolidField,
    p: Array,
    reach: Array,
    wanted: Wanted = Wanted.DISTANCE,
    gradient: bool = False,
    owners: bool = False,
) -> Meeting:
    """Answers of the field at points p (3, M), as of `SolidField.meet`, exact where D is less than a reach
    (M,) in world units; elsewhere D is anything from there on, 100 where no object is near.
    """
    return field.meet(near_pairs(field, p, reach), p[0], wanted, gradient, owners=owners)


def near_pairs(field: SolidField, p: Array, reach: Array) -> SolidPairs:
    """Points (3, M) and the objects whose balls, larger by a reach (M,) in world units, hold them."""
    xp, every = field.xp, field.xp.where(p[0] == p[0])
    maybe = _by_cells(field, p, reach) if len(field.solids) > FEW else [every] * len(field.solids)
    held: list[Array] = []
    there = p[0] == p[0]  # within all that cuts away what is outside of it
    around: list[Array] = []
    far = field.far
    for i, solid in reversed(list(enumerate(field.solids))):
        around += [there] * solid.ends
        index, frame = maybe[i], solid.frame
        own, reaches = (p, reach) if index is every else (xp.take(p, index), xp.take(reach, index))
        at = frame.outer(xp, own)
        ball = solid.ball + reaches * (frame.reach / frame.scale)
        within = at[0] * at[0] + at[1] * at[1] + at[2] * at[2] <= ball * ball
        index = xp.where(within) if index is every else xp.take(index, xp.where(within))
        if len(index):
            far = far or solid.radius + float(reaches.max()) / frame.scale > RADIUS
        held.append(xp.take(index, xp.where(xp.take(there, index))))
        if solid.begins:
            there = around.pop()
        if solid.clips:
            clipped = p[0] != p[0]
            clipped[index] = True
            there = there & clipped
    return _paired(field, p, held[::-1], every, far)


def _paired(field: SolidField, p: Array, held: list[Array], every: Array, far: bool) -> SolidPairs:
    """Pairs of points with the objects that hold them, by indices (k,) of points for each object."""
    xp, met = field.xp, 0 * every
    rays, objects, turns = [every[:0]], [every[:0]], [every[:0]]
    for i, index in enumerate(held):
        turn = xp.take(met, index)
        if not field.solids[i].draws:  # it changes only what is there
            some = xp.where(turn > 0)
            index, turn = xp.take(index, some), xp.take(turn, some)
        xp.put(met, index, turn + 1)
        rays.append(index)
        objects.append(0 * index + i)
        turns.append(turn)
    turn = xp.concat(turns, 0)
    most = int(met.max()) if len(met) else 0
    ordered = [xp.where(turn == i) for i in range(most)]
    order = xp.concat([every[:0], *ordered], 0)
    ray, which = xp.take(xp.concat(rays, 0), order), xp.take(xp.concat(objects, 0), order)
    places: list[Array | None] = []
    start = 0
    for part in ordered:
        places.append(ray[start : start + len(part)])
        start += len(part)
    steps: Steps = [*places]
    depth = 1
    if most > 1 and field.stacks is not None:
        steps, depth = field.stacks.followed(places, ray, which, every)
    return SolidPairs(steps, ray, which, field.behind(which, xp.take(p, ray)), None, depth, far)


def _by_cells(field: SolidField, p: Array, reach: Array) -> list[Array]:
    """Indices (k,) of points for each object that it may hold, by cells that are as wide as their reach."""
    xp, solids = field.xp, field.solids
    level = xp.floor(xp.log(reach.clip(1e-3)) * (1 / LN2))
    side = xp.exp((level + 1) * LN2)
    cells = xp.whole(xp.floor(p / side)).clip(-HALF, HALF - 1) + HALF
    key = ((xp.whole(level).clip(-10, 20) + 10) * (2 * HALF) + cells[0]) * (2 * HALF) ** 2
    key = key + cells[1] * (2 * HALF) + cells[2]
    order = xp.order(key)
    key = xp.take(key, order)
    first = xp.where(xp.concat([key[:1] == key[:1], key[1:] != key[:-1]], 0))
    each = xp.take(order, first)  # a point of each cell
    centre = (xp.floor(xp.take(p, each) / xp.take(side, each)) + 0.5) * xp.take(side, each)
    # the ball around a cell, with what its points reach
    ball = xp.take(side, each) * ROOT
    spread = xp.take(side, each)
    ends = xp.concat([first[1:], 0 * first[:1] + len(order)], 0)
    bounds = np.stack([np.asarray(xp.to_numpy(part)) for part in (first, ends)])
    result = []
    for solid in solids:
        off = centre - solid.centre[:, None]
        more = spread * (solid.extent / solid.ball * solid.frame.reach / solid.frame.scale)
        far = xp.sqrt(off[0] * off[0] + off[1] * off[1] + off[2] * off[2])
        some = np.flatnonzero(np.asarray(xp.to_numpy(far <= ball + more + solid.extent)))
        parts = [order[a:b] for a, b in bounds[:, some].T.tolist()]
        result.append(xp.concat([order[:0], *parts], 0))
    return result
