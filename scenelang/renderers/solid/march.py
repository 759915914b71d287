"""Rays through the solids' field: the first surface, and the ways through media before it.

The field bounds how far a surface or another kind of material is, and steps go as far (Hart 1996), plus up to
`GAP` where the last two bounds let expect the next surface beyond: just behind that. What is thinner may be
passed. Rays that are done leave the batch.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, field
from operator import add

import numpy as np

from scenelang.renderers.arrays import Array
from scenelang.renderers.solid.field import INF, Meeting, SolidField
from scenelang.renderers.solid.network import Wanted

GAP = 0.009  # world units
TOUCH = 1e-5  # world units: so near counts as met
STEPS = 400  # of a ray at most
HALVINGS = 12  # of the interval in which a medium gives way to a solid
NUDGE = np.float32(1 - 1e-6)  # of a point, to one just before it
T, PAST, FREE, WITHIN, SINCE, LENGTH, WAY = 0, 1, 2, 3, 4, 5, 6  # rows of what a ray carries along
BEGIN = WAY + 3  # and where its objects begin, end, and how fast their distances change
Piece = tuple[Array, ...]  # of ways in media: index of the ray, begin, end, length before it, each (P,)


@dataclass(frozen=True, slots=True)
class Work:
    """What drawing took.

    Args:
        rays: from the eye.
        lights: rays from the light.
        near: rays of both kinds that came near an object; the others took no step.
        steps: points of space on them at which the field was asked.
        met: (object, point) pairs that went through the network.
        refined: pixels that were sampled four times.
    """

    rays: int = 0
    lights: int = 0
    near: int = 0
    steps: int = 0
    met: int = 0
    refined: int = 0

    def __add__(self, other: Work) -> Work:
        return Work(*map(add, astuple(self), astuple(other)))


@dataclass(slots=True)
class Trail:
    """What M rays met.

    Args:
        hit: (M,) how far the first opaque surface is, inf where there is none.
        length: (M,) world units in media before that or before the ray's end.
        soft: (M,) 1 where it was a medium that the surface ends, 0 elsewhere: the distance is not 0 there.
        pieces: of the ways in media.
        near, steps, met: as of `Work`.
    """

    hit: Array
    length: Array
    soft: Array
    pieces: list[Piece] = field(default_factory=list)
    near: int = 0
    steps: int = 0
    met: int = 0


def march(solids: SolidField, origin: Array, way: Array, limit: Array, halvings: int = HALVINGS) -> Trail:
    """Follow rays.

    Args:
        solids: the field.
        origin: of all rays (3,).
        way: unit directions (3, M).
        limit: how far to go (M,).
        halvings: of the interval in which a medium gives way to a solid; none where only that it does counts.
    """
    xp = solids.xp
    hit, length, soft = (xp.full((way.shape[1],), value, way) for value in (INF, 0.0, 0.0))
    trail = Trail(hit, length, soft)
    ids = solids.near(origin, way)
    if not len(ids):
        return trail
    rays = _Rays(solids, origin, trail, ids, xp.take(way, ids), xp.take(limit, ids), halvings)
    for _ in range(STEPS):
        if not len(rays.ids):
            break
        rays.step()
    return trail


class _Rays:
    """Rays under way."""

    def __init__(
        self,
        solids: SolidField,
        origin: Array,
        trail: Trail,
        ids: Array,
        way: Array,
        limit: Array,
        halvings: int,
    ) -> None:
        self.solids, self.xp, self.trail, self.halvings, xp = solids, solids.xp, trail, halvings, solids.xp
        self.origin, self.never = origin[:, None], xp.full((), INF, way)
        self.wanted = Wanted.KIND if solids.mixed else Wanted.DISTANCE
        begin, end, rate = solids.spans(origin, way, limit)
        start = xp.least(begin if solids.draws is None else begin[solids.draws])
        some = xp.where(start < INF)
        blank = xp.full((WAY - FREE, len(start)), 0.0, way)
        rows = xp.concat([start[None], start[None] * NUDGE, blank, way, begin, end, rate], 0)
        self.ids, self.rows = xp.take(ids, some), xp.take(rows, some)
        trail.near = len(some)

    def ask(self, rows: Array, t: Array) -> tuple[Meeting, Array]:
        """What the field answers at t (k,) of rays, and in which balls (N, k) they are there."""
        begin, end, _ = self.objects(rows)
        inside = (begin <= t) & (t <= end)
        p = self.origin + rows[WAY:BEGIN] * t
        return self.solids.meet(p, inside, self.wanted, change=self.solids.mixed), inside

    def objects(self, rows: Array) -> tuple[Array, Array, Array]:
        """Where rays may meet each object, and how fast its distance changes: (N, k) each."""
        n = len(self.solids.solids)
        return rows[BEGIN : BEGIN + n], rows[BEGIN + n : BEGIN + 2 * n], rows[BEGIN + 2 * n :]

    def step(self) -> None:
        """Ask the field where the rays are, note what they met, and move them on."""
        xp, rows, solids = self.xp, self.rows, self.solids
        t = rows[T]
        met, inside = self.ask(rows, t)
        self.trail.steps += len(self.ids)
        self.trail.met += met.met
        free = abs(met.distance)
        if not solids.media:
            within = None
            done = met.distance < TOUCH
            struck = xp.where(done)
        else:
            within = met.distance < 0
            done = within & False
            if solids.mixed:
                dense = met.register[0] > 0.5
                within, done = within & dense, within & ~dense
                free = xp.select(within, met.change, free)
            struck = self._pass_media(within, done, free)
        if len(struck):
            xp.put(self.trail.hit, xp.take(self.ids, struck), self._root(free, struck))
        begin, end, rate = self.objects(rows)
        safe = free / xp.largest(inside * rate)[0].clip(1e-3)
        hope = (1.05 * free) * (t - rows[PAST]) / (rows[FREE] - free).clip(1e-12) + TOUCH
        following = t + xp.minimum(xp.maximum(hope, safe), safe + GAP)
        places = xp.select(begin > t, begin, following)
        if within is not None:  # the way through a medium ends with its ball
            places = xp.select(within & (end > t), xp.minimum(places, end), places)
        places = xp.select(places <= end, places, self.never)
        place = xp.select(
            done, self.never, xp.least(places if solids.draws is None else places[solids.draws])
        )
        going = place < INF
        if within is not None:
            ended = xp.where(within & ~going)
            if len(ended):
                self._close(ended, xp.take(t, ended))
            rows[WITHIN] = within & going
        jumps = place > following
        rows[PAST] = xp.select(jumps, place * NUDGE, t)
        rows[FREE] = free * ~jumps
        rows[T] = place
        left = xp.where(going)
        if len(left) < 0.85 * len(self.ids) or not len(left):
            self.ids, self.rows = xp.take(self.ids, left), xp.take(rows, left)

    def _pass_media(self, within: Array, done: Array, free: Array) -> Array:
        """Note where rays entered and left media; which (k,) struck something opaque from outside."""
        xp, before = self.xp, self.rows[WITHIN] > 0
        enter, leave = xp.where(within & ~before), xp.where(before & ~within)
        if len(enter):
            xp.put(self.rows[SINCE], enter, self._root(free, enter))
        if len(leave):
            back = self._root(free, leave)
            into = xp.where(xp.take(done, leave))
            if len(into):
                part = xp.take(self.rows, xp.take(leave, into))
                low, high = part[PAST], part[T]
                for _ in range(self.halvings):
                    half = (low + high) / 2
                    found, _ = self.ask(part, half)
                    still = (found.distance < 0) & (found.register[0] > 0.5)
                    low, high = xp.select(still, half, low), xp.select(still, high, half)
                xp.put(back, into, high)
                ended = xp.take(self.ids, xp.take(leave, into))
                xp.put(self.trail.hit, ended, high)
                xp.put(self.trail.soft, ended, high * 0 + 1)
            self._close(leave, back)
        return xp.where(done & ~before)

    def _root(self, free: Array, index: Array) -> Array:
        """Where between their last two points some rays met a surface, as far as both bounds tell."""
        xp = self.xp
        rows, free = xp.take(self.rows[:WITHIN], index), xp.take(free, index)
        t, past, before = rows[T], rows[PAST], rows[FREE]
        return xp.maximum(past + (t - past) * (before / (before + free).clip(1e-9)), t - GAP)

    def _close(self, index: Array, end: Array) -> None:
        """End the ways through media of some rays."""
        xp, rows = self.xp, self.rows
        begin, before, ray = (
            xp.take(rows[SINCE], index),
            xp.take(rows[LENGTH], index),
            xp.take(self.ids, index),
        )
        end = xp.maximum(end, begin)
        self.trail.pieces.append((ray, begin, end, before))
        total = before + end - begin
        xp.put(rows[LENGTH], index, total)
        xp.put(self.trail.length, ray, total)
