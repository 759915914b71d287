"""The solids' field: what it answers at points of rays.

Each object's frame (`frames.py`) carries points into its own space. There pairs of points and objects meet
the network together, where the point is in the object's ball (`passes.py`); then the cell takes a point's
objects in, one by one.
"""

from __future__ import annotations

from typing import NamedTuple

from scenelang.renderers.arrays import Array, Arrays
from scenelang.renderers.solid.network import EMPTY, Cell, Wanted
from scenelang.renderers.solid.objects import Objects
from scenelang.renderers.solid.passes import (
    BEGIN,
    END,
    INF,
    OBJECT,
    WAY,
    Passes,
    find_passes,
)


class Meeting(NamedTuple):
    """What the field answers at points (M,).

    Args:
        distance: D.
        register: colours and medium (R, M), as in `SolidField.looks`, the medium alone (1, M), or nothing.
        gradient: of D (3, M), if asked for.
        change: a bound on D and on how far another object's material may begin, if asked for.
        owner: number of the object whose material holds, from 1, if asked for.
        met: pairs of points and objects that met.
    """

    distance: Array
    register: Array
    gradient: Array = None
    change: Array = None
    owner: Array = None
    met: int = 0


class Pairs(NamedTuple):
    """Points of M rays and the objects that they meet: P pairs.

    Args:
        places: the points (k,) that meet an object, those that meet a second, and so on; None where all do.
        rays: (P,), place by place.
        objects: their numbers (P,).
        at: where the rays begin behind the objects' maps (3, P).
        way: how that changes along the rays (3, P).
    """

    places: list[Array | None]
    rays: Array
    objects: Array
    at: Array
    way: Array


class SolidField(Objects):
    """A program's objects, ready to be met by points of rays."""

    def passes(self, origin: Array, way: Array, limit: Array, tight: bool = True) -> tuple[Array, Passes]:
        """As `find_passes`, of unit directions way (3, M)."""
        origins = (self.linear * origin[:, None]).sum(1) + self.shift
        return find_passes(self.xp, self.solids, origin, origins, way, limit, tight)

    def meet(
        self,
        passes: Passes,
        t: Array,
        wanted: Wanted,
        gradient: bool = False,
        change: bool = False,
        owners: bool = False,
        p: Array | None = None,
    ) -> Meeting:
        """Let points of rays meet the objects.

        Args:
            passes: of the rays.
            t: how far along each the point is (M,).
            wanted: what of the register to answer beside the distance.
            gradient, change, owners: what else; with owners the register says nothing.
            p: the points themselves (3, M), where they are a little off the rays.
        """
        return self.answer(self.pairs(passes, t), t, wanted, gradient, change, owners, p)

    def pairs(self, passes: Passes, t: Array) -> Pairs:
        """Pairs of points at t (M,) and the objects in whose balls these are."""
        xp, count = self.xp, len(t)
        inside = self.inside(passes, t)
        total = inside.sum(0)
        before = total - inside.cumsum(0)  # a point's first object is in the last slot
        every, most = xp.where(t == t), int(total.max()) if count else 0
        flats, places = [], list[Array | None]()
        if count and int(total.min()):
            slots = xp.whole(inside * (before == 0) * xp.where(inside[:, 0] == inside[:, 0])[:, None])
            flats, places = [slots.sum(0) * count + every], [None]
        for turn in range(len(places), most):
            flats.append(xp.where((inside & (before == turn)).reshape(-1)))
            places.append(flats[-1] % count)
        flat = xp.concat([every[:0], *flats], 0)
        rays = xp.concat([every[:0], *(every if place is None else place for place in places)], 0)
        pairs = xp.take(passes.slots[: WAY.stop].reshape(WAY.stop, -1), flat)
        objects = xp.whole(pairs[OBJECT])
        if not self.draws:
            objects = xp.select(objects < 0, -1 - objects, objects)
        return Pairs(places, rays, objects, xp.take(passes.origins, objects), pairs[WAY])

    def answer(
        self,
        pairs: Pairs,
        t: Array,
        wanted: Wanted,
        gradient: bool = False,
        change: bool = False,
        owners: bool = False,
        p: Array | None = None,
    ) -> Meeting:
        """As `meet`, of pairs whose rays have come to t (M,)."""
        xp, count = self.xp, len(t)
        places, rays, objects, at, way = pairs
        if p is None:
            at = way * xp.take(t, rays) + at
        else:
            at = self._behind(objects, xp.take(p, rays))
        q, own_points = self._local(at, objects)
        d, own = self._distances(q, own_points, objects, gradient)
        looks = self._looks(q, objects) if wanted == Wanted.ALL and self.textures else None
        memory = xp.full(((1, 2, 1 + len(self.looks))[wanted], count), 0.0, t)
        memory[0] = EMPTY
        slope = xp.full((3, count), 0.0, t) if gradient else None
        bound = xp.full((count,), EMPTY, t) if change else None
        owner = xp.full((count,), 0.0, t) if owners else None
        stop = 0
        for index in places:
            start, stop = stop, stop + (count if index is None else len(index))
            pair = slice(start, stop)
            which, near = objects[pair], d[pair]
            before, look = _part(xp, memory, index), self.looks
            if wanted:
                look = xp.take(look, which) if looks is None else looks[:, pair]
            if not start and self.open and owner is None:  # nothing has been met
                after = xp.take(self.first, which) * near[None]
                if wanted:
                    after = xp.concat([after, look[1 - len(memory) :]], 0)
                memory = _update(xp, memory, index, after)
                if bound is not None:
                    gap = xp.select(look[-1] > 0.5, abs(near), 0 * near + EMPTY)
                    bound = _update(xp, bound, index, gap)
                if slope is not None and own is not None:
                    slope = _update(xp, slope, index, xp.take(self.first, which) * own[:, pair])
                continue
            cell = self.cells[wanted]
            if not self.alike:
                cell = Cell(*(xp.take(weights, which) for weights in cell))
            if owner is not None:  # behind a register of 0, a look of 1 shows where its gate is open
                before, look = xp.concat([before[:1], 0 * before[1:]], 0), 0 * look + 1
            after, take = self.network.join(near, before, look, cell, wanted)
            if owner is not None:
                held = xp.select(after[-1] > 0.5, which + 1 + 0 * near, _part(xp, owner, index))
                owner = _update(xp, owner, index, held)
            if bound is not None:
                gap = self._gap(near, before, look, which)
                bound = _update(xp, bound, index, xp.minimum(_part(xp, bound, index), gap))
            if slope is not None and own is not None:
                by_own, by_past = self.network.partials(near, before[0], take, cell)
                past = _part(xp, slope, index)
                slope = _update(xp, slope, index, by_own * own[:, pair] + by_past * past)
            memory = _update(xp, memory, index, after)
        if bound is not None:
            bound = xp.minimum(bound, abs(memory[0]))
        return Meeting(memory[0], memory[1:], slope, bound, owner, len(rays))

    def _gap(self, d: Array, before: Array, look: Array, which: Array) -> Array:
        """How far (k,) objects with distances d (k,) leave the kind of material as it is."""
        xp, gap = self.xp, abs(d)
        if self.smooth is not None:
            blend = xp.minimum(gap, abs(before[0] - d) / 2)
            gap = xp.select(xp.take(self.smooth, which), blend, gap)
        # objects of the kind that is there change nothing of it
        return xp.select(abs(before[1] - look[-1]) > 0.5, gap, 0 * gap + EMPTY)

    def inside(self, passes: Passes, t: Array) -> Array:
        """Which balls (K, M) points at t (M,) are in, of objects that change something there."""
        inside = (passes.slots[BEGIN] <= t) & (t <= passes.slots[END])
        if not self.draws:  # the others change only what is there
            touched = inside[0] & ~inside[0]
            for slot in reversed(range(len(inside))):
                inside[slot] &= touched | (passes.slots[OBJECT, slot] >= 0)
                touched = touched | inside[slot]
        return inside

    def colours(self, passes: Passes, t: Array, p: Array) -> Array:
        """Colours (3, M) at points p in objects, as `meet` answers, sooner where it is one object alone."""
        xp, inside = self.xp, self.inside(passes, t)
        alone = inside.sum(0) == 1
        one, several = xp.where(alone), xp.where(~alone)
        found = xp.full((3, len(t)), 0.0, t)
        if len(several):
            there = passes.at(xp, several), xp.take(t, several), Wanted.ALL
            xp.put(found, several, self.meet(*there, p=xp.take(p, several)).register[:3])
        if len(one):
            objects = xp.whole(xp.take((passes.slots[OBJECT] * inside).sum(0), one))
            xp.put(found, one, self.worn(objects, xp.take(p, one)))
        return found

    def textured(self, passes: Passes) -> Array:
        """Texels (M,) that rays may cross in a world unit, 0 where they pass no object with a texture."""
        slots, xp = passes.slots, self.xp
        objects = xp.whole(slots[OBJECT].clip(0))
        detail = xp.take(self.detail, objects.reshape(-1)).reshape(objects.shape)
        return (detail * (slots[OBJECT] >= 0) * (slots[BEGIN] < INF)).sum(0)


def _part(xp: Arrays, whole: Array, index: Array | None) -> Array:
    """Entries (…, k) of an array (…, M), or all."""
    return whole if index is None else xp.take(whole, index)


def _update(xp: Arrays, whole: Array, index: Array | None, values: Array) -> Array:
    """An array (…, M) with new values (…, k) at some places, or at every one."""
    if index is None:
        return values
    xp.put(whole, index, values)
    return whole
