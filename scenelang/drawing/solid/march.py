"""Rays through the solids' field: the first surface, and the ways through media before it.

The field bounds how far a surface or another kind of material is, and a step goes as far (Hart 1996). Where
the last two bounds predict a surface farther on, a step goes just behind that, by at most `MarchSettings.gap`
more. A ray prepares its questions once, up to where it meets other objects; most rays meet one object alone
and ask its decoder, with no cell between.

A network has learned the length of half a ray inside a leaf. It answers for rays that pass only media under
affine maps, joined by unions and beyond the reach of blends, whose balls are apart.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, field
from itertools import pairwise
from operator import add
from typing import NamedTuple

import numpy as np

from scenelang.drawing.arrays import Array, Arrays
from scenelang.drawing.how import check_time
from scenelang.drawing.solid.field import Meeting, SolidField, SolidPairs
from scenelang.drawing.solid.network import Wanted, folded
from scenelang.drawing.solid.passes import BEGIN, END, INF, OBJECT, RATE, WAY, Passes, placed

TOUCH = 1e-5  # world units: so near counts as met
STEPS = 800  # of all rays at most
NUDGE = np.float32(1 - 1e-6)  # of a point, to one just before it
# rows of what a ray carries along: where it is and was, how far the surface was there; the objects that it
# meets are the same up to a place, until which that falls at a pace; where it leaves the last; which group
T, PAST, FREE, UNTIL, PACE, LAST, GROUP = range(7)
# of rays that meet one object alone: the ray's origin behind its map, how that changes, the scale
FROM, ALONG, SCALE, STATE = slice(7, 10), slice(10, 13), 13, 14
# where there are media: whether the object is one; whether the ray is in one, since where, how long before
DENSE, WITHIN, SINCE, LENGTH, MISTY = range(14, 19)
FULL = 0.7  # of rays that are asked at least so many are under way,
FEW = 8  # but for these
SMALL = 2000  # rays are too few for two batches
# of a way through media, where its material is asked for, and the like of each object's part of it
LOOKS, PARTS = (0.003, *(i / 8 for i in range(1, 8)), 0.997), (0.3, 0.5, 0.7)
JUMP = 0.03  # of materials that differ: linear colours, or extinction
BETWEEN = 8  # halvings of the way between
HALVINGS = 16  # of the interval in which a medium gives way to a solid
WAIT = 4  # times as many are under way as wait to join them at most


# of ways in media: index of the ray, begin, end, length before it, and behind `parted` extinction, each (P,);
# the length before is then that of media of this extinction
Piece = tuple[Array, ...]


@dataclass(slots=True)
class Work:
    """Counts of the work of drawing."""

    rays: int = 0  # from the eye
    lights: int = 0  # rays from the light
    near: int = 0  # rays of both kinds that came near an object; the others took no step
    steps: int = 0  # points of space on them at which the field was asked
    met: int = 0  # (object, point) pairs that went through the network
    refined: int = 0  # pixels that were sampled four times
    lost: int = 0  # rays that took all the steps there are without coming to an end

    def __add__(self, other: Work) -> Work:
        return Work(*map(add, astuple(self), astuple(other)))


@dataclass(slots=True)
class Trail:
    """Surfaces and media that M rays met."""

    hit: Array  # (M,) how far the first opaque surface is, inf where there is none
    length: Array  # (M,) world units in media before that or before the ray's end
    soft: Array  # (M,) 1 where a surface ends a medium, 0 elsewhere: the distance is not 0 there
    place: Array  # (M,) of rays in `passes`, -1 where they pass none
    passes: Passes
    depth: Array  # (M,) optical depth of those media
    pieces: list[Piece] = field(default_factory=list)
    work: Work = field(default_factory=Work)

    def at(self, xp: Arrays, index: Array) -> Passes:
        """The balls that some of the rays pass."""
        return self.passes.at(xp, xp.take(self.place, index))


@dataclass(slots=True)
class _Batch:
    """Rays that are asked together."""

    place: Array  # numbers of their balls (n,)
    rows: Array  # what they carry along (…, n)
    alive: Array  # which are still under way (n,)
    left: int = 0  # as many
    more: int = 0  # as many wait
    waiting: list[tuple[Array, Array]] = field(default_factory=list)  # places and rows that come in
    bounds: list[int] = field(
        default_factory=list
    )  # where each group of rays of one object begins, and the end
    pairs: SolidPairs | None = None  # of the others


class Rays:
    """Rays under way: those that meet one object alone, side by side by its group, and the others."""

    def __init__(
        self, solids: SolidField, trail: Trail, ids: Array, passes: Passes, gap: float, more: Array = None
    ) -> None:
        self.solids, self.xp, self.trail, self.gap = solids, solids.xp, trail, gap
        self.ids, self.passes = ids, passes
        self.never = self.xp.full((), INF, passes.slots)
        self.wanted = Wanted.KIND if solids.mixed else Wanted.DISTANCE
        self.struck: list[tuple[Array, Array, Array]] = []
        self.ended: list[tuple[Array, Array]] = []  # in media, where something opaque is
        rows = self.xp.full((MISTY if solids.media else STATE, len(ids)), 0.0, passes.slots)
        if more is not None:  # that rays carry along
            rows = self.xp.concat([rows, more], 0)
        rows[T] = rows[UNTIL] = -1.0  # before everything
        rows[LAST] = self.xp.largest(passes.slots[END])[0]
        self.between: list[tuple[Array, Array]] = []  # rays on their way from some objects to others
        every = self.xp.where(rows[T] < 0)
        self.batches = [_Batch(every[:0], rows[:, :0], every[:0] < 0) for _ in range(2)]
        self._go_on(every, rows, passes)

    def run(self, halvings: int, most: int = STEPS, few: float = 0.0) -> None:
        """Follow the rays to their ends, or for as many steps, by which they miss what they have not met yet,
        or until as small a part of them is under way.
        """
        xp = self.xp
        for _ in range(most):
            check_time(self.solids.network.until_s)
            under_way = sum(batch.left + batch.more for batch in self.batches)
            between = sum(len(place) for place, _ in self.between)
            if under_way + between < few * len(self.ids):
                self._give_up()
                break
            if _enough(between, under_way):
                places, rows = zip(*self.between, strict=True)
                place, self.between = xp.concat(places, 0), []
                self._go_on(place, xp.concat(rows, 1), self.passes.at(xp, place))
            if under_way < SMALL:
                self._join()
            batch = max(self.batches, key=lambda batch: batch.left + batch.more)
            if _enough(batch.more, batch.left) or batch.left < FULL * len(batch.alive) - FEW:
                self._regroup(batch)
            if batch.left:
                self._step(batch)
            elif not self.between:
                break
        else:
            self.trail.work.lost = sum(batch.left + batch.more for batch in self.batches)
        if self.struck:
            places, rows, frees = zip(*self.struck, strict=True)
            hit = self._root(xp.concat(rows, 1), xp.concat(frees, 0))
            xp.put(self.trail.hit, xp.take(self.ids, xp.concat(places, 0)), hit)
        if self.ended:
            self._finish(halvings)

    def _give_up(self) -> None:
        """Let rays that are under way end where they are, near surfaces, as if they met one."""
        xp, left = self.xp, [*self.between]
        for batch in self.batches:
            index = xp.where(batch.alive)
            left += [(xp.take(batch.place, index), xp.take(batch.rows, index)), *batch.waiting]
        places, parts = zip(*left, strict=True)
        ray, rows = xp.take(self.ids, xp.concat(places, 0)), xp.concat(parts, 1)
        xp.put(self.trail.hit, ray, rows[T])
        within = xp.where(rows[WITHIN] > 0) if self.solids.media else ray[:0]
        if len(within):
            row = xp.take(rows, within)
            self._close(xp.take(ray, within), row, row[T])

    def _join(self) -> None:
        """Let few rays that meet one object alone go along with as many or more that meet several."""
        xp, (alone, others) = self.xp, self.batches
        if 0 < alone.left + alone.more <= others.left + others.more:
            index = xp.where(alone.alive)
            others.waiting += [(xp.take(alone.place, index), xp.take(alone.rows, index)), *alone.waiting]
            others.more += alone.left + alone.more
            none = index[:0]
            self.batches[0] = _Batch(none, alone.rows[:, :0], none < 0)

    def _go_on(self, place: Array, rows: Array, passes: Passes) -> None:
        """Rays come to where they meet other objects, or none; up to `UNTIL` they are sure to come."""
        xp, solids = self.xp, self.solids
        t, following = 1 * rows[T], rows[UNTIL]
        begin, end = passes.slots[BEGIN], passes.slots[END]
        at = xp.select(begin > t, begin, following)
        if solids.media:  # the way through a medium ends with its ball
            within = rows[WITHIN] > 0
            at = xp.select(within & (end > t), xp.minimum(at, end), at)
        at = xp.select(at <= end, at, self.never)
        if not solids.draws:  # those that do not are no reason to stop
            at = xp.select(passes.slots[OBJECT] < 0, self.never, at)
        rows[T] = xp.least(at)
        if solids.adding is not None:  # what a group leaves may begin where it meets more
            objects = xp.whole(passes.slots[OBJECT])
            objects = xp.select(objects < 0, -1 - objects, objects)
            adds = xp.take(solids.adding, objects.reshape(-1)).reshape(begin.shape)
            more = xp.select((adds > 0) & (begin > t), begin, self.never)
            rows[T] = xp.minimum(rows[T], xp.least(more))
        going = rows[T] < INF
        if solids.media:
            if not solids.draws:  # in a medium steps end where something may cut it
                cuts = within & going & (passes.slots[OBJECT] < 0) & (begin > t)
                rows[T] = xp.minimum(rows[T], xp.least(xp.select(cuts, begin, self.never)))
            ended = xp.where(within & ~going)
            if len(ended):
                row = xp.take(rows, ended)
                self._close(xp.take(self.ids, xp.take(place, ended)), row, xp.take(t, ended))
        jumps = rows[T] > following
        rows[PAST] = xp.select(jumps, rows[T] * NUDGE, t)
        rows[FREE] = rows[FREE] * ~jumps
        self._enter(passes, rows)
        alone = rows[GROUP] < solids.groups
        for batch, mask in zip(self.batches, (alone, ~alone), strict=True):
            index = xp.where(mask & going)
            if len(index):
                index = xp.take(index, xp.order(xp.take(rows[GROUP], index)))
                batch.waiting.append((xp.take(place, index), xp.take(rows, index)))
                batch.more += len(index)

    def _enter(self, passes: Passes, rows: Array) -> None:
        """Note what rays meet from where they are on, up to where that changes."""
        xp, solids, slots, t = self.xp, self.solids, passes.slots, rows[T]
        begin, end = slots[BEGIN], slots[END]
        rows[UNTIL] = xp.least(xp.select(begin > t, begin, xp.select(end < t, self.never, end)))
        inside = xp.narrow(solids.inside(passes, t))
        # a bound lasts for its length over the fastest change of a distance; 1e-3: outside of every ball
        rows[PACE] = 1 / xp.largest(inside * slots[RATE])[0].clip(1e-3)
        objects = xp.whole((inside * slots[OBJECT]).sum(0)).clip(0, len(solids.solids) - 1)
        group = xp.take(solids.group, objects)
        alone = (inside.sum(0) == 1) & (group >= 0)
        rows[GROUP] = xp.select(alone, group, 0 * t + solids.groups)
        rows[FROM] = solids.begun(passes, objects, xp.where(t == t) if passes.many else t)
        rows[ALONG] = (inside * slots[WAY]).sum(1)
        rows[SCALE] = xp.take(solids.factor, objects)
        if solids.media:
            rows[DENSE] = xp.take(solids.looks[-1], objects)

    def _regroup(self, batch: _Batch) -> None:
        """Take out of a batch the rays that are done, and take in those that wait."""
        xp, index = self.xp, self.xp.where(batch.alive)
        places, parts = zip((batch.place, batch.rows), *batch.waiting, strict=True)
        if len(index) == 0 and len(batch.waiting) == 1:
            batch.place, batch.rows = batch.waiting[0]
        else:
            place, rows = xp.concat(places, 0), xp.concat(parts, 1)
            if batch.waiting:
                index = xp.concat([index, xp.where(place >= 0)[len(batch.place) :]], 0)
                index = xp.take(index, xp.order(xp.take(rows[GROUP], index)))
            batch.place, batch.rows = xp.take(place, index), xp.take(rows, index)
        batch.waiting, batch.more = [], 0
        batch.alive, batch.left = batch.place >= 0, len(batch.place)
        if batch is not self.batches[0]:
            batch.pairs = self.solids.pairs(self.passes.at(xp, batch.place), batch.rows[T])
        else:
            groups = np.asarray(xp.to_numpy(batch.rows[GROUP]))
            batch.bounds = np.searchsorted(groups, np.arange(self.solids.groups + 1)).tolist()

    def _meet(self, batch: _Batch, t: Array) -> Meeting:
        """Let points at t (n,) meet the objects."""
        solids, rows = self.solids, batch.rows
        self.trail.work.steps += len(t)
        if batch.pairs is None:
            d = solids.decoded(rows[FROM] + rows[ALONG] * t, batch.bounds) * rows[SCALE]
            result = Meeting(d, d[None][:0], met=len(t))
        else:
            result = solids.meet(batch.pairs, t, self.wanted, change=solids.mixed)
        self.trail.work.met += result.met
        return result

    def _ask(self, batch: _Batch, t: Array) -> tuple[Array, Array, Array]:
        """Masks of points at t (n,) inside media and inside opaque solids, and how far both hold."""
        solids, rows = self.solids, batch.rows
        result = self._meet(batch, t)
        d, free, dense = result.distance, abs(result.distance), None
        if batch.pairs is None:
            dense = rows[DENSE] > 0.5 if solids.mixed else None
        else:
            if solids.mixed:
                dense = result.register[0] > 0.5
                free = self.xp.select((d < 0) & dense, result.change, free)
        within = (d < 0) & batch.alive
        if not solids.media:
            return within & False, (d < TOUCH) & batch.alive, free
        if dense is None:
            return within, within & False, free
        return within & dense, within & ~dense, free

    def _step(self, batch: _Batch) -> None:
        """Ask the field where rays are, note what they met, and move them on."""
        xp, rows, alive = self.xp, batch.rows, batch.alive
        t = 1 * rows[T]
        within, done, free = self._ask(batch, t)
        struck = self._pass_media(batch, within, done, free) if self.solids.media else xp.where(done)
        if len(struck):
            self.struck.append(
                (xp.take(batch.place, struck), xp.take(rows[:UNTIL], struck), xp.take(free, struck))
            )
        safe = free * rows[PACE]
        # The bounds fell from FREE at PAST to `free` at t; on that line they are 0 after another
        # free (t - PAST) / (FREE - free). 5 % more puts the point behind the surface, so that the ray ends.
        hope = (1.05 * free) * (t - rows[PAST]) / (rows[FREE] - free).clip(1e-12) + TOUCH
        following = t + xp.minimum(xp.maximum(hope, safe), safe + self.gap)
        lasting = rows[UNTIL] < rows[LAST]
        if self.solids.media:
            lasting = lasting | within
            rows[WITHIN] = within
        rows[FREE] = free
        self._go(batch, following, alive & ~done, lasting)

    def _go(self, batch: _Batch, following: Array, alive: Array, lasting: Array) -> None:
        """Move those rays (n,) of a batch on that are still alive; where they meet other objects, if they are
        lasting, they are between batches.
        """
        xp, rows = self.xp, batch.rows
        over = (following > rows[UNTIL]) & alive
        rows[PAST], rows[T] = rows[T], following
        crossing = xp.where(over & lasting)
        if len(crossing):
            row = xp.take(rows, crossing)
            row[UNTIL], row[T] = row[T], row[PAST]
            self.between.append((xp.take(batch.place, crossing), row))
        batch.alive = alive & ~over
        batch.left = int(batch.alive.sum())

    def _pass_media(self, batch: _Batch, within: Array, done: Array, free: Array) -> Array:
        """Note where rays entered and left media; which (k,) struck something opaque from outside."""
        xp, rows, before = self.xp, batch.rows, batch.rows[WITHIN] > 0
        changed = xp.where(batch.alive & ((within != before) | done))
        if not len(changed):
            return changed
        within, done, before = (xp.take(mask, changed) for mask in (within, done, before))
        enter, leave, into = (
            xp.take(changed, xp.where(mask))
            for mask in (within & ~before, before & ~within & ~done, before & done)
        )
        if len(enter):
            xp.put(rows[SINCE], enter, self._root(xp.take(rows[:UNTIL], enter), xp.take(free, enter)))
        if len(leave):
            row = xp.take(rows, leave)
            length = self._close(
                xp.take(self.ids, xp.take(batch.place, leave)), row, self._root(row, xp.take(free, leave))
            )
            xp.put(rows[LENGTH], leave, length)
        if len(into):
            self.ended.append((xp.take(batch.place, into), xp.take(rows, into)))
        return xp.take(changed, xp.where(done & ~before))

    def _finish(self, halvings: int) -> None:
        """Find where media give way to something opaque: there the distance need not be 0."""
        xp = self.xp
        places, rows = zip(*self.ended, strict=True)
        place, row = xp.concat(places, 0), xp.concat(rows, 1)
        passes, ray = self.passes.at(xp, place), xp.take(self.ids, place)
        low, high = row[PAST], row[T]
        for _ in range(halvings):
            half = (low + high) / 2
            result = self.solids.meet(passes, half, self.wanted)
            self.trail.work.met += result.met
            still = (result.distance < 0) & (result.register[0] > 0.5)
            low, high = xp.select(still, half, low), xp.select(still, high, half)
        xp.put(self.trail.hit, ray, high)
        xp.put(self.trail.soft, ray, high * 0 + 1)
        self._close(ray, row, high)

    def _root(self, rows: Array, free: Array) -> Array:
        """Estimate where rays met a surface between their last two points, from both bounds."""
        t, past, before = rows[T], rows[PAST], rows[FREE]
        result = past + (t - past) * (before / (before + free).clip(1e-9))
        return self.xp.maximum(result, t - self.gap)

    def _close(self, ray: Array, rows: Array, end: Array) -> Array:
        """End the ways through media of rays (k,) with such rows (STATE, k); lengths (k,) in media so far."""
        xp, begin, before = self.xp, rows[SINCE], rows[LENGTH]
        end = xp.maximum(end, begin)
        self.trail.pieces.append((ray, begin, end, before))
        total = before + end - begin
        xp.put(self.trail.length, ray, total)
        return total


def _enough(waiting: int, under_way: int) -> bool:
    """True where so many waiting rays should join the batch."""
    return waiting > under_way / WAIT + FEW if under_way else waiting > 0


def known(solids: SolidField, passes: Passes, start: Array) -> Array:
    """A mask (M,) of rays from a ``start`` (M,) that the network answers for."""
    xp, begin, end = solids.xp, passes.slots[BEGIN], passes.slots[END]
    objects = xp.whole(passes.slots[OBJECT]).clip(0)
    asked = xp.take(solids.asked, objects.reshape(-1)).reshape(objects.shape)
    # where the light is in a ball, both halves of the ray would have to be asked for
    held = (asked > 0) & (begin > start) & (passes.slots[OBJECT] >= 0)
    fits = (held | (begin == INF)).sum(0) == len(begin)
    for slot in range(1, len(begin)):
        fits = fits & (((begin[slot] < end[:slot]) & (begin[:slot] < end[slot])).sum(0) == 0)
    return fits


def lengths(solids: SolidField, passes: Passes) -> tuple[Array, int]:
    """Optical depths of media on `known` rays (M,), and how many objects they were asked of."""
    xp, slots = solids.xp, passes.slots
    flat = xp.where((slots[BEGIN] < INF).reshape(-1))
    pairs = xp.take(slots.reshape(len(slots), -1), flat)
    objects, way, end = xp.whole(pairs[OBJECT]), pairs[WAY], pairs[END]
    speed = xp.sqrt((way * way).sum(0))
    q = solids.begun(passes, objects, flat % slots.shape[2]) + way * end
    result, which = 0 * end, xp.take(solids.decoder, objects)
    for i, layers in enumerate(solids.segments):
        some = xp.where(which == i)
        if len(some):
            x = folded(xp, xp.take(q, some), xp.take(way, some) / -xp.take(speed, some))
            xp.put(result, some, solids.network.field(x, layers, False)[0])
    result = xp.minimum(result.clip(0.0) / speed, end - pairs[BEGIN])
    if solids.sigma is None:
        result = result * xp.take(solids.density, objects)
    each = 0 * slots[OBJECT].reshape(-1)
    xp.put(each, flat, result)
    return each.reshape(slots.shape[1:]).sum(0) * (solids.sigma or 1.0), len(flat)


def parted(solids: SolidField, trail: Trail, coloured: bool) -> Piece:
    """The ways of rays through media, cut where one medium's density, or colour if ``coloured``, gives way to
    another's.
    """
    xp, hues = solids.xp, solids.hues
    ray, begin, end, before = (xp.concat(parts, 0) for parts in zip(*trail.pieces, strict=True))
    slots, dense = trail.at(xp, ray).slots, solids.sigma is None
    inside = (slots[BEGIN] < end) & (slots[END] > begin)
    objects = xp.whole((inside * slots[OBJECT]).sum(0)).clip(0, len(solids.solids) - 1)
    piece = ray, begin, end, before, xp.take(solids.density, objects) if dense else 0 * end + solids.sigma
    several = inside.sum(0) > 1
    some, coloured = xp.where(several), coloured and solids.coloured
    if (coloured or dense) and len(some):

        def material(passes: Passes, t: Array) -> Array:
            register = solids.meet(passes, t, Wanted.ALL).register
            colours = [register[hues - 3 : hues]] if coloured else []
            return xp.concat([*colours, solids.extinction(register)[None], register[-1:]], 0)

        result = [tuple(xp.take(part, xp.where(~several)) for part in piece)]
        ray, begin, end, before, _ = (xp.take(part, some) for part in piece)
        passes = trail.at(xp, ray)
        first, last = (begin + (end - begin) * LOOKS[at] for at in (0, -1))
        into, out = (xp.minimum(xp.maximum(passes.slots[side], first), last) for side in (BEGIN, END))
        looks = [row for share in PARTS * dense for row in into + (out - into) * share]
        places = list(xp.rising(xp.stack(looks + [begin + (end - begin) * share for share in LOOKS], 0)))
        seen = [material(passes, t) for t in places]
        steps = [xp.where(abs(a - b).sum(0) > JUMP) for a, b in pairwise(seen)]
        which = xp.concat(steps, 0)
        low, high, first, last = (
            xp.concat([xp.take(part, step) for part, step in zip(parts, steps, strict=True)], -1)
            for parts in (places[:-1], places[1:], seen[:-1], seen[1:])
        )
        passes = passes.at(xp, which)
        for _ in range(BETWEEN):
            half = (low + high) / 2
            there = material(passes, half)
            nearer = abs(there - first).sum(0) < abs(there - last).sum(0)
            low, high = xp.select(nearer, half, low), xp.select(nearer, high, half)
        start, done = begin, 0
        for step, at in zip(steps, seen, strict=False):  # a ray changes once in each
            stop, done = low[done : done + len(step)], done + len(step)
            rays, starts, befores, sigma = (xp.take(part, step) for part in (ray, start, before, at[-2]))
            result.append((rays, starts, stop, befores, sigma))
            start, before = 1 * start, 1 * before
            xp.put(start, step, stop)
            xp.put(before, step, befores + stop - starts)
        result.append((ray, start, end, before, seen[-1][-2]))
        piece = tuple(xp.concat(list(parts), 0) for parts in zip(*result, strict=True))
    return _stacked(xp, piece, trail.depth) if dense else piece


def _stacked(xp: Arrays, piece: Piece, depth: Array) -> Piece:
    """Pieces of media of several densities, in order, with the right lengths before them; their optical
    depths are added to those of the rays (M,).
    """
    order = xp.order(piece[1])
    order = xp.take(order, xp.order(xp.take(piece[0], order)))
    ray, begin, end, _, sigma = (xp.take(part, order) for part in piece)
    own = sigma * (end - begin)
    total = xp.wide(own).cumsum(0) - own
    first = xp.where(xp.concat([ray[:1] >= 0, ray[1:] != ray[:-1]], 0))
    base = xp.wide(0 * depth)
    xp.put(base, xp.take(ray, first), xp.take(total, first))
    before = xp.narrow(total - xp.take(base, ray))
    xp.add(depth[None], ray, own[None])
    return ray, begin, end, before / sigma, sigma


class MarchSettings(NamedTuple):
    """Trade-offs between speed and accuracy where solids are drawn."""

    gap: float = 0.009  # world units by which steps may pass what is certain, and what is thinner
    nodes: int = 3  # points on a ray's way through a medium at which the light is asked for
    contrast: float = 0.04  # sRGB: pixels that differ more from their neighbours are sampled four times


CAREFUL = MarchSettings()
MARCH_SETTINGS = {
    **{"four": CAREFUL, "adaptive": CAREFUL},
    **{"quick": MarchSettings(0.04, 2, 0.15), "one": MarchSettings(0.04, 2)},
}
"""Settings of each way to sample solids."""


def march(
    solids: SolidField,
    origin: Array,
    way: Array,
    limit: Array,
    halvings: int = HALVINGS,
    gap: float = CAREFUL.gap,
    whole: bool = False,
    steps: int = STEPS,
    start: Array | float = 0.0,
    few: float = 0.0,
) -> Trail:
    """Follow rays from an origin (3,), or one each (3, M), along unit directions (3, M), from ``start`` (M,)
    up to a limit (M,), in ``steps`` at most; as few of them may be given up.

    ``halvings`` of the interval find where a medium gives way to a solid; ``gap`` is that of
    `MarchSettings`. If ``whole``, nobody asks where media begin and end, so that the network for segments may
    answer.
    """
    xp = solids.xp
    hit, length, soft = (xp.full((way.shape[1],), value, way) for value in (INF, 0.0, 0.0))
    ids, passes = solids.passes(origin, way, limit, not (whole and solids.answered), start)
    trail = Trail(hit, length, soft, placed(xp, ids, xp.whole(length)), passes, 0 * length)
    trail.work.near = len(ids)
    if whole and solids.answered and len(ids):
        sure = known(solids, passes, xp.take(0 * limit + start, ids))
        some, rest = xp.where(sure), xp.where(~sure)
        if len(some):
            answers, trail.work.met = lengths(solids, passes.at(xp, some))
            xp.put(trail.depth, xp.take(ids, some), answers)
        ids, passes = xp.take(ids, rest), passes.at(xp, rest)
    if len(ids):
        Rays(solids, trail, ids, passes, gap).run(halvings, steps, few)
    if trail.pieces and solids.sigma is None:
        trail.pieces = [parted(solids, trail, not whole)]
    elif trail.pieces:
        trail.depth += solids.sigma * length
    return trail
