"""The solids' field: what it answers at points of rays.

Each object's frame (`frames.py`) carries points into its own space. There pairs of points and objects meet
the network together, where the point is in the object's ball (`passes.py`); then the cell takes a point's
objects in, one by one. Where groups of the stream are open it has a state for each (`stacks.py`), and what
a group comes to is taken in as an object is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
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
from scenelang.renderers.solid.stacks import Closing, Stacks

NOTHING = 10.0  # world units: how far a group with nothing in it is at most for what it is taken in by


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
            Of points in groups they are those of their states, as `Closing` has them.
        rays: (P,), place by place.
        objects: their numbers (P,).
        at: where the rays begin behind the objects' maps (3, P).
        way: how that changes along the rays (3, P).
        closings: of the groups that end before each place, and behind the last.
        depth: how many states a point has.
    """

    places: list[Array | None]
    rays: Array
    objects: Array
    at: Array
    way: Array
    closings: list[list[Closing]]
    depth: int = 1


class Operand(NamedTuple):
    """What states take in (k,): an object or a group, as of `Meeting`; `look` is a register (R, k or 1)."""

    distance: Array
    look: Array
    gradient: Array
    change: Array
    owner: Array


@dataclass(slots=True)
class States:
    """What states carry: distances and registers, and what else is asked for, as of `Meeting`.

    Entries are those of M points, then, where groups are open, those of each one's second state, and so on.
    """

    memory: Array
    slope: Array
    bound: Array
    owner: Array

    def parts(self) -> tuple[Array, ...]:
        """All of it, None where it is not asked for."""
        return self.memory, self.slope, self.bound, self.owner

    def at(self, xp: Arrays, index: Array) -> States:
        """Some of the entries."""
        return States(*(part if part is None else xp.take(part, index) for part in self.parts()))


class SolidField(Objects):
    """A program's objects, ready to be met by points of rays."""

    @cached_property
    def _stacks(self) -> Stacks:
        return Stacks(self.xp, self.tree, self.network.codes)

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
        found = Pairs(places, rays, objects, xp.take(passes.origins, objects), pairs[WAY], [[]] * (most + 1))
        if most < 2 or not self.tree.deepest:
            return found
        places, closings, depth = self._stacks.followed(places, rays, objects, every)
        return found._replace(places=places, closings=closings, depth=depth)

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
        places, rays, objects, at, way, closings, depth = pairs
        size = depth * count
        if p is None:
            at = way * xp.take(t, rays) + at
        else:
            at = self._behind(objects, xp.take(p, rays))
        q, own_points = self._local(at, objects)
        d, own = self._distances(q, own_points, objects, gradient)
        looks = self._looks(q, objects) if wanted == Wanted.ALL and self.textures else None
        states = States(
            memory=xp.full(((1, 2, 1 + len(self.looks))[wanted], size), 0.0, t),
            slope=xp.full((3, size), 0.0, t) if gradient else None,
            bound=xp.full((size,), EMPTY, t) if change else None,
            owner=xp.full((size,), 0.0, t) if owners else None,
        )
        states.memory[0] = EMPTY
        stop = 0
        for index, ending in zip(places, closings, strict=False):
            for closing in ending:
                self._close(states, closing, wanted)
            start, stop = stop, stop + (count if index is None else len(index))
            pair = slice(start, stop)
            which, near, look = objects[pair], d[pair], self.looks
            if wanted:
                look = xp.take(look, which) if looks is None else looks[:, pair]
            slope = own if own is None else own[:, pair]
            if not start and self.open and not owners:  # nothing has been met
                after = xp.take(self.first, which) * near[None]
                if wanted:
                    after = xp.concat([after, look[1 - len(states.memory) :]], 0)
                states.memory = _update(xp, states.memory, index, after)
                if states.bound is not None:
                    gap = xp.select(look[-1] > 0.5, abs(near), 0 * near + EMPTY)
                    states.bound = _update(xp, states.bound, index, gap)
                if states.slope is not None:
                    states.slope = _update(xp, states.slope, index, xp.take(self.first, which) * slope)
                continue
            number = which + 1 + 0 * near if owners else None
            self._join(states, index, Operand(near, look, slope, None, number), which, wanted)
        for closing in closings[-1]:
            self._close(states, closing, wanted)
        memory, slope, bound, owner = (_first(part, count) for part in states.parts())
        if bound is not None:
            bound = xp.minimum(bound, abs(memory[0]))
        return Meeting(memory[0], memory[1:], slope, bound, owner, len(rays))

    def _close(self, states: States, closing: Closing, wanted: Wanted) -> None:
        """Let groups end: what they come to goes into the states that they stand in, and theirs are empty."""
        xp, (inner, index, which) = self.xp, closing
        found = states.at(xp, inner)
        d, look = found.memory[0].clip(-EMPTY, NOTHING), found.memory[1:]
        xp.put(states.memory[:1], inner, 0 * found.memory[:1] + EMPTY)
        if states.bound is not None:
            xp.put(states.bound, inner, 0 * d + EMPTY)
        operand = Operand(d, look, found.slope, found.bound, found.owner)
        self._join(states, index, operand, which, wanted)

    def _join(
        self, states: States, index: Array | None, operand: Operand, which: Array, wanted: Wanted
    ) -> None:
        """Let states at an index take in operands by the cells of rows, or groups, `which`."""
        xp, cell = self.xp, self.cells[wanted]
        near, look = operand.distance, operand.look
        if not self.alike:
            cell = Cell(*(xp.take(weights, which) for weights in cell))
        before = _part(xp, states.memory, index)
        if states.owner is not None:  # behind a register of 0, a look of 1 shows where its gate is open
            before, look = xp.concat([before[:1], 0 * before[1:]], 0), 0 * look + 1
        after, take = self.network.join(near, before, look, cell, wanted)
        if states.owner is not None:
            held = xp.select(after[-1] > 0.5, operand.owner, _part(xp, states.owner, index))
            states.owner = _update(xp, states.owner, index, held)
        if states.bound is not None:
            gap = xp.minimum(_part(xp, states.bound, index), self._gap(near, before, look, which))
            if operand.change is not None:
                gap = xp.minimum(gap, operand.change)
            states.bound = _update(xp, states.bound, index, gap)
        if states.slope is not None:
            by_own, by_past = self.network.partials(near, before[0], take, cell)
            past = _part(xp, states.slope, index)
            states.slope = _update(xp, states.slope, index, by_own * operand.gradient + by_past * past)
        states.memory = _update(xp, states.memory, index, after)

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


def _first(whole: Array, count: int) -> Array:
    """The first entries (…, M) of an array, or None."""
    return whole if whole is None else whole[..., :count]


def _update(xp: Arrays, whole: Array, index: Array | None, values: Array) -> Array:
    """An array (…, M) with new values (…, k) at some places, or at every one."""
    if index is None:
        return values
    xp.put(whole, index, values)
    return whole
