"""Rays through the solids' field: the first surface, and the ways through media before it.

A ray steps by what the field's distance leaves free of surfaces (Hart 1996), and as far as the last two
distances let expect the surface, but never more than `GAP` beyond what is certain. What is thinner than that
may be passed. Rays that are done leave the batch.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from scenelang.renderers.arrays import Array
from scenelang.renderers.solid.field import Meeting, SolidField

GAP = 0.006  # world units
TOUCH = 1e-5  # world units: so near counts as met
STEPS = 400  # of a ray at most
HALVINGS = 7  # of the interval in which a medium gives way to a solid
INF = float("inf")
T, PAST, D_PAST, SINCE, WITHIN, LENGTH, WAY = 0, 1, 2, 3, 4, 5, 6  # rows of what a ray carries along


@dataclass(slots=True)
class Trail:
    """What M rays met.

    Args:
        hit: (M,) how far the first opaque surface is, inf where there is none.
        length: (M,) world units in media before that or before the ray's end.
        soft: (M,) 1 where it was a medium that the surface ends, 0 elsewhere: the distance is not 0 there.
        begin, end: (N, M) where the rays may meet each object.
        pieces: of the ways in media, as (index of the ray, begin, end, length before it), each (P,).
        met: (object, point) pairs that went through the network.
    """

    hit: Array
    length: Array
    soft: Array
    begin: Array
    end: Array
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
    draws = [i for i, solid in enumerate(solids.solids) if solid.draws]
    begin, end, rate = solids.spans(origin, way)
    hit, length, soft = (xp.full((way.shape[1],), value, way) for value in (INF, 0.0, 0.0))
    trail = Trail(hit, length, soft, begin, end)
    if not n:
        return trail
    never = xp.full((), INF, way)
    begin, end = begin.clip(0.0), xp.minimum(end, limit)
    begin = xp.select(begin <= end, begin, never)
    start = begin[draws[0]]
    for i in draws[1:]:
        start = xp.minimum(start, begin[i])
    ids = xp.where(start < INF)
    rest = start[None] * 0
    rays = xp.concat([start[None], start[None], rest, rest, rest, rest, way, begin, end, rate], 0)
    rays = xp.take(rays, ids)
    b, e, r = WAY + 3, WAY + 3 + n, WAY + 3 + 2 * n

    def ask(rays: Array, t: Array, register: bool, change: bool) -> tuple[Meeting, list[Array]]:
        inside = [(rays[b + i] <= t) & (t <= rays[e + i]) for i in range(n)]
        p = origin[:, None] + rays[WAY : WAY + 3] * t
        return solids.meet(p, inside, register=register, change=change), inside

    for _ in range(STEPS):
        if not len(ids):
            break
        t, past, d_past = rays[T], rays[PAST], rays[D_PAST]
        met, inside = ask(rays, t, media, media)
        d = met.distance
        trail.met += sum(int(mask.sum()) for mask in inside)
        fastest = xp.select(inside[0], rays[r], 0 * d + 1e-3)
        for i in range(1, n):
            fastest = xp.maximum(fastest, xp.select(inside[i], rays[r + i], 1e-3 + 0 * d))
        gap = (t - past).clip(1e-9)
        slope = (d_past - d) / gap
        root = t + d / slope.clip(1e-4)  # for d < 0 between the two
        root = xp.maximum(xp.maximum(root, past), t - GAP)
        if media:
            within = rays[WITHIN] > 0
            dense = (d < 0) & (met.register[3] > 0.5)
            done = (d < 0) & ~dense
            enter, leave = xp.where(dense & ~within), xp.where(within & ~dense)
            struck = xp.where(done & ~within)
            if len(enter):
                xp.put(rays[SINCE], enter, xp.take(root, enter))
            if len(leave):
                out = xp.take(d, leave) >= 0
                back = xp.take(t + d / (xp.select(slope < -1e-4, slope, slope * 0 - 1e-4)), leave)
                back = xp.maximum(xp.maximum(back, xp.take(past, leave)), xp.take(t, leave) - 4 * GAP)
                back = xp.minimum(back, xp.take(t, leave))
                into = xp.where(~out)
                if len(into):
                    part = xp.take(rays, xp.take(leave, into))
                    low, high = part[PAST], part[T]
                    for _ in range(HALVINGS):
                        half = (low + high) / 2
                        found, _ = ask(part, half, True, False)
                        still = (found.distance < 0) & (found.register[3] > 0.5)
                        low, high = xp.select(still, half, low), xp.select(still, high, half)
                    xp.put(back, into, high)
                    ended = xp.take(ids, xp.take(leave, into))
                    xp.put(trail.hit, ended, high)
                    xp.put(trail.soft, ended, high * 0 + 1)
                _close(solids, trail, rays, ids, leave, back)
            rays[WITHIN] = dense * 1.0
            free = met.change
        else:
            done = d < TOUCH
            struck = xp.where(done)
            free = d
        if len(struck):
            at = xp.select(xp.take(d, struck) < 0, xp.take(root, struck), xp.take(t, struck))
            xp.put(trail.hit, xp.take(ids, struck), at)
        safe = abs(free) / fastest
        # a little beyond where the surface is expected, so that it lies between two points
        hope = xp.select(slope * d > 1e-4 * abs(d), 1.05 * d / slope + TOUCH, never)
        step = xp.minimum(xp.maximum(hope, safe), safe + GAP)
        following = t + step
        following_t = d * 0 + never
        for i in draws:
            goes = following <= rays[e + i]
            stays = xp.select(goes, following, never)
            if media:
                stays = xp.select(~goes & (rays[WITHIN] > 0) & (rays[e + i] > t), rays[e + i], stays)
            following_t = xp.minimum(following_t, xp.select(rays[b + i] > t, rays[b + i], stays))
        following_t = xp.select(done, never, following_t)
        lost = following_t == INF
        if media:
            ended = xp.where(lost & (rays[WITHIN] > 0))
            if len(ended):
                _close(solids, trail, rays, ids, ended, xp.take(t, ended))
                xp.put(rays[WITHIN], ended, xp.take(t, ended) * 0)
        rays[PAST], rays[D_PAST] = t * 1, d
        rays[T] = following_t
        left = xp.where(~lost)
        if len(left) < 0.85 * len(ids) or not len(left):
            ids, rays = xp.take(ids, left), xp.take(rays, left)
    return trail


def _close(solids: SolidField, trail: Trail, rays: Array, ids: Array, index: Array, end: Array) -> None:
    """End the ways through media of some rays."""
    xp = solids.xp
    begin, before, ray = xp.take(rays[SINCE], index), xp.take(rays[LENGTH], index), xp.take(ids, index)
    end = xp.maximum(end, begin)
    trail.pieces.append((ray, begin, end, before))
    total = before + end - begin
    xp.put(rays[LENGTH], index, total)
    xp.put(trail.length, ray, total)
