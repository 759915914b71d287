"""Rays through the solids' field: the first surface, and the ways through media before it.

The field bounds how far a surface or another kind of material is, and steps go as far (Hart 1996), plus up to
`GAP` where the last two bounds let expect the next surface beyond: just behind that. What is thinner may be
passed. Rays that are done leave the batch.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from scenelang.renderers.arrays import Array
from scenelang.renderers.solid.field import INF, Meeting, SolidField
from scenelang.renderers.solid.network import Wanted

GAP = 0.009  # world units
TOUCH = 1e-5  # world units: so near counts as met
STEPS = 400  # of a ray at most
HALVINGS = 6  # of the interval in which a medium gives way to a solid
NUDGE = np.float32(1 - 1e-6)  # of a point, to one just before it
T, PAST, FREE, WAY, WITHIN, SINCE, LENGTH = 0, 1, 2, 3, 6, 7, 8  # rows of what a ray carries along


@dataclass(slots=True)
class Trail:
    """What M rays met.

    Args:
        hit: (M,) how far the first opaque surface is, inf where there is none.
        length: (M,) world units in media before that or before the ray's end.
        soft: (M,) 1 where it was a medium that the surface ends, 0 elsewhere: the distance is not 0 there.
        pieces: of the ways in media, as (index of the ray, begin, end, length before it), each (P,).
        met: (object, point) pairs that went through the network.
    """

    hit: Array
    length: Array
    soft: Array
    pieces: list[tuple[Array, Array, Array, Array]] = field(default_factory=list)
    met: int = 0


def march(solids: SolidField, origin: Array, way: Array, limit: Array) -> Trail:
    """Follow rays.

    Args:
        solids: the field.
        origin: of all rays (3,).
        way: unit directions (3, M).
        limit: how far to go (M,).
    """
    xp, n, media = solids.xp, len(solids.solids), solids.media
    wanted = Wanted.KIND if solids.mixed else Wanted.DISTANCE
    hit, length, soft = (xp.full((way.shape[1],), value, way) for value in (INF, 0.0, 0.0))
    trail = Trail(hit, length, soft)
    draws = [i for i, solid in enumerate(solids.solids) if solid.draws]
    ids = solids.near(origin, way)
    if not len(ids):
        return trail
    never, way = xp.full((), INF, way), xp.take(way, ids)
    begin, end, rate = solids.spans(origin, way, xp.take(limit, ids))
    start = begin[draws[0]]
    for i in draws[1:]:
        start = xp.minimum(start, begin[i])
    blank = xp.full((4 if media else 1, len(ids)), 0.0, way)
    some = xp.where(start < INF)
    rays = xp.concat([start[None], start[None] * NUDGE, blank[:1], way, blank[1:], begin, end, rate], 0)
    ids, rays = xp.take(ids, some), xp.take(rays, some)
    b = WAY + 2 + len(blank)
    e, r = b + n, b + 2 * n

    def ask(rays: Array, t: Array) -> tuple[Meeting, list[Array]]:
        inside = [(rays[b + i] <= t) & (t <= rays[e + i]) for i in range(n)]
        p = origin[:, None] + rays[WAY : WAY + 3] * t
        return solids.meet(p, inside, wanted, change=solids.mixed), inside

    for _ in range(STEPS):
        if not len(ids):
            break
        t, past, before = rays[T], rays[PAST], rays[FREE]
        met, inside = ask(rays, t)
        trail.met += met.met
        d = met.distance
        free = abs(d)
        within = None
        if media:
            dense, within = d < 0, rays[WITHIN] > 0
            if solids.mixed:
                dense = dense & (met.register[0] > 0.5)
                free = xp.select(dense, met.change, free)
        step = t - past
        done = d < TOUCH if within is None else (d < 0) & ~dense
        if within is None:
            struck = xp.where(done)
        else:
            struck = xp.where(done & ~within)
            enter, leave = xp.where(dense & ~within), xp.where(within & ~dense)
            if len(enter):
                xp.put(rays[SINCE], enter, _root(solids, rays, free, enter))
            if len(leave):
                back = _root(solids, rays, free, leave)
                into = xp.where(xp.take(done, leave))
                if len(into):
                    part = xp.take(rays, xp.take(leave, into))
                    low, high = part[PAST], part[T]
                    for _ in range(HALVINGS):
                        half = (low + high) / 2
                        found, _ = ask(part, half)
                        still = (found.distance < 0) & (found.register[0] > 0.5)
                        low, high = xp.select(still, half, low), xp.select(still, high, half)
                    xp.put(back, into, high)
                    ended = xp.take(ids, xp.take(leave, into))
                    xp.put(trail.hit, ended, high)
                    xp.put(trail.soft, ended, high * 0 + 1)
                _close(solids, trail, rays, ids, leave, back)
            within = dense
        if len(struck):
            xp.put(trail.hit, xp.take(ids, struck), _root(solids, rays, free, struck))
        rate = inside[0] * rays[r]
        for i in range(1, n):
            rate = xp.maximum(rate, inside[i] * rays[r + i])
        safe = free / rate.clip(1e-3)
        hope = (1.05 * free) * step / (before - free).clip(1e-12) + TOUCH
        following = t + xp.minimum(xp.maximum(hope, safe), safe + GAP)
        following_t = d * 0 + never
        for i in draws:
            goes = following <= rays[e + i]
            stays = xp.select(goes, following, never)
            if within is not None:  # the way through a medium ends with its ball
                stays = xp.select(~goes & within & (rays[e + i] > t), rays[e + i], stays)
            following_t = xp.minimum(following_t, xp.select(rays[b + i] > t, rays[b + i], stays))
        following_t = xp.select(done, never, following_t)
        lost = following_t == INF
        if within is not None:
            ended = xp.where(lost & within)
            if len(ended):
                _close(solids, trail, rays, ids, ended, xp.take(t, ended))
            rays[WITHIN] = within & ~lost
        jumps = following_t > following
        rays[PAST] = xp.select(jumps, following_t * NUDGE, t)
        rays[FREE] = free * ~jumps
        rays[T] = following_t
        left = xp.where(~lost)
        if len(left) < 0.85 * len(ids) or not len(left):
            ids, rays = xp.take(ids, left), xp.take(rays, left)
    return trail


def _root(solids: SolidField, rays: Array, free: Array, index: Array) -> Array:
    """Where between their last two points some rays met a surface, as far as the bounds at both tell."""
    xp = solids.xp
    rays, free = xp.take(rays[:WAY], index), xp.take(free, index)
    t, past, before = rays[T], rays[PAST], rays[FREE]
    return xp.maximum(past + (t - past) * (before / (before + free).clip(1e-9)), t - GAP)


def _close(solids: SolidField, trail: Trail, rays: Array, ids: Array, index: Array, end: Array) -> None:
    """End the ways through media of some rays."""
    xp = solids.xp
    begin, before, ray = xp.take(rays[SINCE], index), xp.take(rays[LENGTH], index), xp.take(ids, index)
    end = xp.maximum(end, begin)
    trail.pieces.append((ray, begin, end, before))
    total = before + end - begin
    xp.put(rays[LENGTH], index, total)
    xp.put(trail.length, ray, total)
