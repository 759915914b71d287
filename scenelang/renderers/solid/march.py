"""Rays through the solids' field: the first surface, and the ways through media before it.

The field bounds how far a surface or another kind of material is, and steps go as far (Hart 1996), plus up to
a gap where the last two bounds let expect the next surface beyond: just behind that. What is thinner may be
passed. Rays that are done leave the batch.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, field
from operator import add
from typing import NamedTuple

import numpy as np

from scenelang.renderers.arrays import Array, Arrays
from scenelang.renderers.solid.field import Meeting, SolidField
from scenelang.renderers.solid.network import Wanted
from scenelang.renderers.solid.passes import BEGIN, END, INF, OBJECT, RATE, Passes, placed
from scenelang.renderers.solid.segments import known, lengths

TOUCH = 1e-5  # world units: so near counts as met
STEPS = 400  # of a ray at most
HALVINGS = 16  # of the interval in which a medium gives way to a solid
NUDGE = np.float32(1 - 1e-6)  # of a point, to one just before it
T, PAST, FREE, WITHIN, SINCE, LENGTH, STATE = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
)  # rows of what a ray carries along, how many


Piece = tuple[Array, ...]  # of ways in media: index of the ray, begin, end, length before it, each (P,)


class Pace(NamedTuple):
    """What is saved where solids are drawn, and what it costs.

    Args:
        gap: world units by which steps may go beyond what is certain; what is thinner may be passed.
        nodes: points on a ray's way through a medium at which the light is asked for.
        contrast: pixels that differ more from their neighbours, in sRGB, are sampled four times.
    """

    gap: float = 0.009
    nodes: int = 3
    contrast: float = 0.04


CAREFUL = Pace()


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
        place: (M,) of rays in `passes`, -1 where they pass none.
        passes: the balls that those pass.
        pieces: of the ways in media.
        near, steps, met: as of `Work`.
    """

    hit: Array
    length: Array
    soft: Array
    place: Array
    passes: Passes
    pieces: list[Piece] = field(default_factory=list)
    near: int = 0
    steps: int = 0
    met: int = 0

    def at(self, xp: Arrays, index: Array) -> Passes:
        """The balls that some of the rays pass."""
        return self.passes.at(xp, xp.take(self.place, index))


def march(
    solids: SolidField,
    origin: Array,
    way: Array,
    limit: Array,
    halvings: int = HALVINGS,
    gap: float = CAREFUL.gap,
    whole: bool = False,
) -> Trail:
    """Follow rays.

    Args:
        solids: the field.
        origin: of all rays (3,).
        way: unit directions (3, M).
        limit: how far to go (M,).
        halvings: of the interval in which a medium gives way to a solid; none where only that it does counts.
        gap: as of `Pace`.
        whole: whether nobody asks where media begin and end, so that `segments.py` may answer.
    """
    xp = solids.xp
    hit, length, soft = (xp.full((way.shape[1],), value, way) for value in (INF, 0.0, 0.0))
    ids, passes = solids.passes(origin, way, limit)
    trail = Trail(hit, length, soft, placed(xp, ids, xp.whole(length)), passes, near=len(ids))
    if whole and solids.segments and len(ids):
        sure = known(solids, passes)
        some, rest = xp.where(sure), xp.where(~sure)
        if len(some):
            answers, trail.met = lengths(solids, passes.at(xp, some))
            xp.put(length, xp.take(ids, some), answers)
        ids, passes = xp.take(ids, rest), passes.at(xp, rest)
    if len(ids):
        rays = _Rays(solids, trail, ids, passes, gap)
        for _ in range(STEPS):
            if not len(rays.ids):
                break
            rays.step()
        rays.finish(halvings)
    return trail


class _Rays:
    """Rays under way."""

    def __init__(self, solids: SolidField, trail: Trail, ids: Array, passes: Passes, gap: float) -> None:
        self.solids, self.xp, self.trail, self.gap = solids, solids.xp, trail, gap
        self.ids, self.passes = ids, passes
        slots = self.passes.slots
        self.never = self.xp.full((), INF, slots)
        self.wanted = Wanted.KIND if solids.mixed else Wanted.DISTANCE
        self.rows = self.xp.full((STATE, len(ids)), 0.0, slots)
        self.rows[T] = self.xp.least(self._drawn(slots[BEGIN]))
        self.rows[PAST] = self.rows[T] * NUDGE
        self.ended: list[tuple[Array, Array, Passes]] = []  # in media, where something opaque is

    def _drawn(self, places: Array) -> Array:
        """Places (K, k) of the objects that draw, inf for the others."""
        if self.solids.draws:
            return places
        return self.xp.select(self.passes.slots[OBJECT] < 0, self.never, places)

    def step(self) -> None:
        """Ask the field where the rays are, note what they met, and move them on."""
        xp, rows, solids, slots = self.xp, self.rows, self.solids, self.passes.slots
        t = rows[T]
        met = self._ask(self.passes, t)
        self.trail.steps += len(t)
        free = abs(met.distance)
        within = None
        if not solids.media:
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
        begin, end = slots[BEGIN], slots[END]
        safe = free / xp.largest(met.inside * slots[RATE])[0].clip(1e-3)
        hope = (1.05 * free) * (t - rows[PAST]) / (rows[FREE] - free).clip(1e-12) + TOUCH
        following = t + xp.minimum(xp.maximum(hope, safe), safe + self.gap)
        places = xp.select(begin > t, begin, following)
        if within is not None:  # the way through a medium ends with its ball
            places = xp.select(within & (end > t), xp.minimum(places, end), places)
        places = xp.select(places <= end, places, self.never)
        place = xp.select(done, self.never, xp.least(self._drawn(places)))
        going = place < INF
        if within is not None:
            ended = xp.where(within & ~going)
            if len(ended):
                self._close(xp.take(self.ids, ended), xp.take(rows, ended), xp.take(t, ended))
            rows[WITHIN] = within & going
        jumps = place > following
        rows[PAST] = xp.select(jumps, place * NUDGE, t)
        rows[FREE] = free * ~jumps
        rows[T] = place
        left = xp.where(going)
        if len(left) < 0.85 * len(self.ids) or not len(left):
            self.ids, self.rows, self.passes = self._only(left)

    def _only(self, index: Array) -> tuple[Array, Array, Passes]:
        """Some of the rays: which they are, their rows and their balls."""
        xp = self.xp
        return xp.take(self.ids, index), xp.take(self.rows, index), self.passes.at(xp, index)

    def _ask(self, passes: Passes, t: Array) -> Meeting:
        found = self.solids.meet(passes, t, self.wanted, change=self.solids.mixed)
        self.trail.met += found.met
        return found

    def _pass_media(self, within: Array, done: Array, free: Array) -> Array:
        """Note where rays entered and left media; which (k,) struck something opaque from outside."""
        xp, before = self.xp, self.rows[WITHIN] > 0
        enter, leave = xp.where(within & ~before), xp.where(before & ~within & ~done)
        if len(enter):
            xp.put(self.rows[SINCE], enter, self._root(free, enter))
        if len(leave):
            ray, row, back = xp.take(self.ids, leave), xp.take(self.rows, leave), self._root(free, leave)
            xp.put(self.rows[LENGTH], leave, self._close(ray, row, back))
        into = xp.where(before & done)
        if len(into):
            self.ended.append(self._only(into))
        return xp.where(done & ~before)

    def finish(self, halvings: int) -> None:
        """Find where media give way to something opaque: there the distance need not be 0."""
        if not self.ended:
            return
        xp = self.xp
        ids, rows, passes = zip(*self.ended, strict=True)
        ray, row = xp.concat(ids, 0), xp.concat(rows, 1)
        slots = passes[0]._replace(slots=xp.concat([each.slots for each in passes], 2))
        low, high = row[PAST], row[T]
        for _ in range(halvings):
            half = (low + high) / 2
            found = self._ask(slots, half)
            still = (found.distance < 0) & (found.register[0] > 0.5)
            low, high = xp.select(still, half, low), xp.select(still, high, half)
        xp.put(self.trail.hit, ray, high)
        xp.put(self.trail.soft, ray, high * 0 + 1)
        self._close(ray, row, high)

    def _root(self, free: Array, index: Array) -> Array:
        """Where between their last two points some rays met a surface, as far as both bounds tell."""
        xp = self.xp
        rows, free = xp.take(self.rows[:WITHIN], index), xp.take(free, index)
        t, past, before = rows[T], rows[PAST], rows[FREE]
        return xp.maximum(past + (t - past) * (before / (before + free).clip(1e-9)), t - self.gap)

    def _close(self, ray: Array, rows: Array, end: Array) -> Array:
        """End the ways through media of rays (k,) with such rows (STATE, k); lengths (k,) in media so far."""
        xp, begin, before = self.xp, rows[SINCE], rows[LENGTH]
        end = xp.maximum(end, begin)
        self.trail.pieces.append((ray, begin, end, before))
        total = before + end - begin
        xp.put(self.trail.length, ray, total)
        return total
