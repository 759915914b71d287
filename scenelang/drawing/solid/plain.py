"""The solids' field as the network is written, over arrays of either library: torch draws and learns by it.

Points go through the objects in turn. An object's frame carries those in its ball to its leaf, the decoder
answers there, and the cell takes the answer in, as ``kernel/fold.h`` does; open groups have states of their
own. Rays go on by steps as long as the field allows, and to where other balls begin, as ``kernel/march.h``
has it; lamps of a radius are those of `soft.py`.

Letters: N objects, M points or rays, R rows of the register, P pieces.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import takewhile
from typing import Any, NamedTuple

import numpy as np

from scenelang.assets.element import Element
from scenelang.compiler.groups import OPERATOR, SMOOTH, read_groups, widths_of
from scenelang.drawing.arrays import NUMPY, Array, Arrays
from scenelang.drawing.how import check_time
from scenelang.drawing.kernel import Asked
from scenelang.drawing.neural.assets import Texture, grid_shape, texture_of
from scenelang.drawing.neural.frames import Skins
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import HALVINGS, INF, STEPS, Pieces, Trail, Work
from scenelang.drawing.solid.network import EMPTY, RADIUS, SolidCell, SolidNetwork, Wanted
from scenelang.drawing.solid.soft import ASIDE, FLOOR, HASTE, HURRY, PARTS, SIDE, STRIDE, WIDE, share
from scenelang.drawing.tables import (
    BEGINS,
    BOXED,
    CLIPS,
    DRAWS,
    MAP,
    SKINNED,
    STOPS,
    TURN_Z,
    cell_keys,
    cell_of,
)

NOTHING = 10.0  # world units: how far a group with nothing in it is at most for what it is taken in by
EQUAL = 2e-6  # world units: surfaces so near each other lie in one plane
NEARLY = 1e-4  # and a point so near them is on them
BEHIND = 3e-5  # world units behind where a surface is foreseen that it is asked for
ROUNDING = 2e-7  # of distances, as a part of how far and large things are: what is less deep is not met
POINTS, PAIRS = 1 << 16, 1 << 20  # points at a time, and balls of rays at a time
FULL = 0.7  # of rays that are asked at least so many are under way
# of media that differ, linear colours and extinction: abruptly, or along a piece; halvings of the way between
JUMP, DRIFT, BETWEEN = 0.03, 0.2, 8


class _Map(NamedTuple):
    """An affine map: p to linear p + shift."""

    linear: Array  # (3, 3)
    shift: Array  # (3,)

    def __call__(self, xp: Arrays, p: Array) -> Array:
        return xp.dense(p, self.linear, self.shift)

    def pulled(self, xp: Arrays, p: Array, g: Array) -> Array:
        """The gradient (3, M) before the step, at p, of what has the gradient g behind it."""
        return self.linear.T @ g


class _Turn(NamedTuple):
    """A turn of coordinates (i, j) by an angle ``twirl |p| + rate p[along]``, in the sense of R."""

    i: int
    j: int
    twirl: float
    rate: float
    along: int

    def _carried(self, xp: Arrays, p: Array) -> tuple[Array, Array, Array, Array]:
        length = xp.sqrt((p * p).sum(0)) if self.twirl else 0 * p[0] + 1
        angle = self.rate * p[self.along] + self.twirl * length
        cos, sin = xp.cos(angle), xp.sin(angle)
        a, b = p[self.i], p[self.j]
        rows = [p[0], p[1], p[2]]
        rows[self.i], rows[self.j] = cos * a + sin * b, cos * b - sin * a
        return xp.stack(rows, 0), cos, sin, length

    def __call__(self, xp: Arrays, p: Array) -> Array:
        return self._carried(xp, p)[0]

    def pulled(self, xp: Arrays, p: Array, g: Array) -> Array:
        """As `_Map.pulled`."""
        q, cos, sin, length = self._carried(xp, p)
        a, b = g[self.i], g[self.j]
        swing = a * q[self.j] - b * q[self.i]  # how it changes with the angle
        rows = [g[0], g[1], g[2]]
        rows[self.i], rows[self.j] = cos * a - sin * b, sin * a + cos * b
        rows[self.along] = rows[self.along] + self.rate * swing
        return xp.stack(rows, 0) + (self.twirl * swing / length.clip(1e-12)) * p


class _Solid(NamedTuple):
    """An object; numbers as in a row of `OBJECT`."""

    number: int
    row: dict[str, float]
    flags: int
    ends: int  # groups that end behind it
    path: tuple[int, ...]  # groups that are open at it
    steps: tuple[Any, ...]  # maps and turns to its leaf, outermost first
    decode: Callable[..., Array]  # leaf coordinates (3, M) to distances (1, M), or with gradients (4, M)
    texture: Texture | None
    box: tuple[Array, Array] | None  # behind the map, least and greatest coordinates (3, 1) that it changes

    def distance(self, xp: Arrays, p: Array, gradient: bool, far: bool) -> tuple[Array, Array, Array]:
        """World distances (M,) of the object alone at points (3, M), which may be ``far`` from its leaf;
        gradients (3, M) or nothing; leaf coordinates (3, M).
        """
        row, q, passed = self.row, p, []
        for step in self.steps:
            passed.append(q)
            q = step(xp, q)
        length = xp.sqrt((q * q).sum(0)) if far else None
        rim = 1.0 if length is None else RADIUS / length.clip(RADIUS)
        found = self.decode(q * rim, gradient=gradient)
        d, g = found[0], found[1:]
        if length is not None:
            d = d + (length - RADIUS).clip(0.0)
            if gradient:
                n = q / length.clip(1e-9)
                g = xp.select(length > RADIUS, rim * (g - (g * n).sum(0) * n) + n, g)
        skin = Skins(*(row[name] for name in Skins._fields))
        if row["amount"] and not skin.late:
            d, g = self._displaced(xp, q, d, g)
        if self.flags & SKINNED:
            if gradient and skin.wall:
                g = xp.select(d < skin.first, -g, g)
            d = skin.put_on(xp, d)
            if row["amount"] and skin.late:
                d, g = self._displaced(xp, q, d, g)
        for step, at in zip(reversed(self.steps), reversed(passed), strict=True):
            g = step.pulled(xp, at, g) if gradient else g
        return d * row["scale"], g * row["scale"], q

    def _displaced(self, xp: Arrays, q: Array, d: Array, g: Array) -> tuple[Array, Array]:
        f, amount = self.row["frequency"], self.row["amount"]
        (a, b, c), (u, v, w) = xp.sin(f * q), xp.cos(f * q)
        more = xp.stack([u * b * c, a * v * c, a * b * w], 0) if len(g) else g
        return d + amount * (a * b * c), g + (amount * f) * more


class _Ways(NamedTuple):
    """Ways of n rays through the balls of objects with ``numbers`` (N,)."""

    numbers: list[int]
    stops: Array  # (N, 1) whether rays stop where a ball begins
    draws: Array  # (N, 1)
    origin: Array  # (3, n)
    way: Array  # (3, n)
    begin: Array  # (N, n), inf where a ray passes none
    end: Array
    rate: Array

    def at(self, xp: Arrays, index: Array) -> _Ways:
        """The ways of some rays."""
        return _Ways(*self[:3], *(xp.take(part, index) for part in self[3:]))

    def first(self, xp: Arrays) -> Array:
        """Distances (n,) to the first ball."""
        return xp.least(xp.select(self.stops, self.begin, INF))


class _Met(NamedTuple):
    """The field where n rays are."""

    d: Array
    look: Array  # the register (R, n), where it is asked for
    free: Array  # world units within which nothing changes
    medium: Array  # a mask
    rate: Array  # at which distances change at most, per unit of the way
    next: Array  # where other objects begin in which something may be
    cuts: Array  # where any other objects begin
    until: Array  # where the first of those that are met ends
    last: Array  # where the last of those that draw does
    pairs: int


class PlainField(SolidField):
    """A `SolidField` that asks the network itself."""

    shades = False

    def __init__(self, *rows: Any, **named: Any) -> None:
        super().__init__(*rows, **named)
        xp, like, count = self.xp, self.network.codes, len(self.rows[0])
        self._most = max(1 << 10, PAIRS // max(1, count))  # rays at a time
        with xp.inference():
            self._joins, self._solids = self._all_joins(), self._all_solids()
        register, flags = self.tables.looks.register, self.tables.objects.rows["flags"]
        hues = register[self.hues - 3 : self.hues, register[-1] > 0.5]
        # rows of registers by which media differ
        self._marks = [*range(self.hues - 3, self.hues)] * bool((hues != hues[:, :1]).any())
        self._marks += [len(register) - self.switched] * (self.sigma is None)
        self._stops, self._draws = (
            xp.array((flags & flag > 0)[:, None], like) > 0 for flag in (STOPS, DRAWS)
        )

    def _all_joins(self) -> list[tuple[tuple[SolidCell, ...], bool]]:
        """Cells of objects and, behind these, of groups, and whether they blend."""
        (vectors, tokens, _), network = self.rows, self.network
        groups = read_groups(tokens)
        widths = widths_of(np.asarray(tokens, np.intp) & OPERATOR, network.layout.unpack(vectors).width)
        keys = [(int(token), width) for token, width in cell_keys(groups, widths).tolist()]
        known = {key: (cell_of(network, *key), key[0] == SMOOTH) for key in dict.fromkeys(keys)}
        return [known[key] for key in keys]

    def _all_solids(self) -> list[_Solid]:
        (vectors, _, brought), (rows, steps, _) = self.rows, self.tables.objects
        xp, network, like, none = self.xp, self.network, self.network.codes, [None] * len(vectors)
        parts, brought, paints = network.layout.unpack(vectors), brought or none, self.paints or none

        def placed(*numbers: np.ndarray) -> Any:
            return (xp.array(part, like) for part in numbers)

        def mapped(numbers: np.ndarray) -> _Map:
            return _Map(*placed(numbers[:9].reshape(3, 3), numbers[9:]))

        def step(row: Any) -> _Map | _Turn:
            if row["kind"] == MAP:
                return mapped(row["map"])
            j = 1 if row["kind"] == TURN_Z else 2
            return _Turn(0, j, float(row["twirl"]), float(row["rate"]), j - 1)

        names = [name for name in rows.dtype.names or () if rows.dtype[name] == np.float32]
        grown = {own for own, row in zip(brought, rows, strict=True) if row["flags"] & SKINNED}
        decoders: dict[int, Any] = {}
        result = []
        for i, (row, own) in enumerate(zip(rows, brought, strict=True)):
            number, first, paint = int(row["decoder"]), int(row["step"]), paints[i]
            if number not in decoders and isinstance(own, Element):
                decoders[number] = grid_shape(own, xp, like, own in grown).field
            elif number not in decoders:
                layers = network.decoder(*placed(parts.code[i].copy()))
                decoders[number] = partial(network.field, layers=layers)
            paint = paint if row["texture"] >= 0 else None
            low, high = placed(row["low"][:, None], row["high"][:, None])
            solid = _Solid(
                number=i,
                row={name: float(row[name]) for name in names},
                flags=int(row["flags"]),
                ends=int(row["ends"]),
                path=tuple(row["path"][: row["depth"]].tolist()),
                steps=(mapped(row["map"]), *map(step, steps[first : first + int(row["steps"])])),
                decode=decoders[number],
                texture=texture_of(xp, paint, parts.texture[i], like, light=True) if paint else None,
                box=(low, high) if row["flags"] & BOXED else None,
            )
            result.append(solid)
        return result

    def near(self, p: Array, reach: Array | float, gradient: bool = False, every: bool = False) -> Asked:
        """As `Kernel.field`, at points (3, M) anywhere: exact where D is less than a reach, (M,) or one."""
        xp, reach, size, met = self.xp, 0 * self.xp.frozen(p[0]) + reach, 1 + len(self.looks), 0
        asked, states = (Wanted.ALL if every else Wanted.DISTANCE, 3 * gradient), []
        far = float(reach.max()) if len(reach) else 0.0
        for at in _slices(max(len(reach), 1), POINTS):
            check_time(self.network.until_s)
            state, pairs = self._folded(p[:, at], self._held(p[:, at], reach[at]), *asked, far)
            states.append(state)
            met += pairs
        state = xp.concat(states, 1)
        slope, owner = state[-3:] if asked[1] else state[:0], state[size] if every else state[0, :0]
        return Asked(state[0], slope, state[1:size] if every else state[:0], owner, met)

    def own(self, objects: Array, p: Array, gradient: bool = True) -> tuple[Array, Array]:
        """As `SolidField.own`; gradients are there anyway."""
        found = 0 * self.xp.concat([p, p[:1]], 0)
        for solid, index, at in self._each(objects, p):
            d, g, _ = solid.distance(self.xp, at, True, True)
            self.xp.put(found, index, self.xp.concat([d[None], g], 0))
        return found[0], found[1:]

    def worn(self, objects: Array, p: Array) -> Array:
        """Colours (3, K) of objects, whatever else is at points (3, K)."""
        colours = self.xp.take(self.looks[:3], objects)
        for solid, index, at in self._each(objects, p):
            if solid.texture is not None:
                self.xp.put(colours, index, solid.texture.at(solid.distance(self.xp, at, False, True)[2]))
        return colours

    def _each(self, objects: Array, p: Array) -> Iterator[tuple[_Solid, Array, Array]]:
        """Objects, the places of their points, and these."""
        for i in sorted(set(objects.tolist())):
            index = self.xp.where(objects == i)
            yield self._solids[i], index, self.xp.take(p, index)

    def _held(self, p: Array, reach: Array) -> Iterable[tuple[int, Array]]:
        """Numbers of objects and masks (M,) of the points that are in their balls, larger by a reach (M,)."""
        there, around, result = reach == reach, [], list[tuple[int, Array]]()
        for solid in reversed(self._solids):
            around += [there] * solid.ends
            row, a = solid.row, solid.steps[0](self.xp, p)
            ball = row["ball"] + reach * (row["reach"] / row["scale"])
            within = (a * a).sum(0) <= ball * ball
            result.append((solid.number, within & there))
            if solid.flags & BEGINS:
                there = around.pop()
            if solid.flags & CLIPS:
                there = there & within
        return reversed(result)

    def _folded(
        self, p: Array, held: Iterable[tuple[int, Array]], wanted: Wanted, more: int, reach: float = 0.0
    ) -> tuple[Array, int]:
        """The states of points (3, M) that meet objects where masks (M,) hold, and how many pairs met.

        A state (…, M) has the distance; then the kind of material, or the register and the number of the
        object, if wanted; then, if there is 1 row ``more``, a bound on how far another kind of material may
        begin, or another medium, and of 3 the gradient.
        """
        xp, never, pairs = self.xp, p[0] != p[0], 0
        empty = [EMPTY, *[0.0] * (0, 1, 1 + len(self.looks))[wanted], *[EMPTY if more == 1 else 0.0] * more]
        states, masks, path, touched = list[Array](), list[Array](), tuple[int, ...](), xp.copy(never)

        def begin() -> None:
            states.append(xp.stack([xp.full((len(never),), value, p) for value in empty], 0))
            masks.append(xp.copy(never))

        def end(level: int) -> None:
            """End groups until so many are open: each goes into the state that it stands in."""
            while len(states) > level + 1:
                index = xp.where(masks.pop())
                x, which = xp.take(states.pop(), index), len(self._solids) + path[len(states) - 1]
                x = xp.concat([x[:1].clip(None, NOTHING), x[1:]], 0)
                self._take_in(states[-1], index, x, which, wanted, more)
                xp.put(masks[-1], index, index == index)

        begin()
        for i, mask in held:
            solid = self._solids[i]
            index = xp.where(mask if solid.flags & DRAWS else mask & touched)
            if not len(index):
                continue
            end(len([*takewhile(lambda pair: pair[0] == pair[1], zip(path, solid.path, strict=False))]))
            path = solid.path
            while len(states) <= len(path):
                begin()
            far = solid.row["radius"] + reach / solid.row["scale"] > RADIUS
            d, g, q = solid.distance(xp, xp.take(p, index), more == 3, far)
            rows, one = [d[None]], 0 * d[None] + 1
            if wanted:
                look = self.looks[-1 if wanted == Wanted.KIND else 0 :, i, None] * one
                worn = (
                    solid.texture if wanted == Wanted.ALL and more != 1 else None
                )  # rays know plain colours
                rows += [look] if worn is None else [worn.at(q), look[3:]]
                rows += [(i + 1) * one] * (wanted == Wanted.ALL)
            x = xp.concat([*rows, EMPTY * one if more == 1 else g], 0)
            self._take_in(states[-1], index, x, i, wanted, more)
            xp.put(masks[-1], index, index == index)
            xp.put(touched, index, index == index)
            pairs += len(index)
        end(0)
        return states[0], pairs

    def _take_in(self, state: Array, index: Array, x: Array, which: int, wanted: Wanted, more: int) -> None:
        """Let states at an index (k,) take in operands, states (…, k), by the cell of an object or group."""
        xp, (cells, smooth), size = self.xp, self._joins[which], (1, 2, 1 + len(self.looks))[wanted]
        cell, before, d, switched = cells[wanted], xp.take(state, index), x[0], self.switched
        memory, look = before[:size], x[1:size]
        if wanted == Wanted.ALL:  # behind a register of 0, a look of 1 shows where its gate is open
            memory, look = xp.concat([memory, 0 * d[None]], 0), xp.concat([look, 0 * d[None] + 1], 0)
            switched += 1
        after, take = self.network.join(d, memory, look, cell, wanted, switched)
        if wanted == Wanted.ALL and more != 1 and not smooth:  # in one plane the earlier one's material shows
            plane = (abs(d - before[0]) < EQUAL) & (abs(d) < NEARLY) & (before[size - 1] + x[size - 1] < 0.5)
            after = xp.concat([after[:1], xp.select(plane, memory[1:], after[1:])], 0)
        rows = [after[:size]]
        if wanted == Wanted.ALL:
            rows.append(xp.select(after[size:] > 0.5, x[size : size + 1], before[size : size + 1]))
        if more == 1:
            a, b = before[1:size], x[1:size]
            differ = abs(a[-1] - b[-1]) > 0.5
            if wanted == Wanted.ALL:
                differ = differ | ((a[-1] + b[-1] > 1) & (self._unlike(a, b) > JUMP))
            # within which the operand leaves the kind of material, or the medium, as it is
            room = xp.minimum(abs(d), abs(before[0] - d) / 2) if smooth else abs(d)
            room = xp.minimum(xp.select(differ, room, EMPTY), x[-1])
            rows.append(xp.minimum(before[-1], room)[None])
        if more == 3:
            by_own, by_past = self.network.partials(d, before[0], take, cell)
            rows.append(by_own * x[-3:] + by_past * before[-3:])
        xp.put(state, index, xp.concat(rows, 0))

    def _unlike(self, a: Array, b: Array) -> Array:
        """Differences of media with registers (R, k)."""
        return abs(a - b)[self._marks].sum(0)

    def _crossed(
        self, origin: Array, way: Array, low: Array, high: Array, wide: Array | None = None
    ) -> tuple[_Ways, Array]:
        """Ways of those rays from points (3, M) along unit directions (3, M), from low up to high (M,), that
        come to a ball in which something may be; and their indices (n,). Of cones balls are as much smaller
        as the ``reach`` is more than their radius there, ``wide`` (M,) of the way that is left.
        """
        xp, around, rows, most = self.xp, [], [], high
        for solid in reversed(self._solids):
            around += [(low, high)] * solid.ends
            outer, ball, less = solid.steps[0], solid.row["ball"], 0.0  # leaf units by which it is smaller
            start, a = outer(xp, origin), outer.linear @ way
            if wide is not None and not self.objects.wide[solid.number]:
                to = origin - xp.array(self.objects.rows["centre"][solid.number], way)[:, None]
                left = most + FLOOR - xp.sqrt((to * to).sum(0)) + solid.row["extent"]
                less = (self.reach - wide * left).clip(0.0) / solid.row["scale"]
                ball = ball - solid.row["reach"] * less
            square = (a * a).sum(0)
            middle = -(start * a).sum(0) / square
            closest = start + middle * a
            left = ball * ball - (closest * closest).sum(0)
            half = xp.sqrt((left / square).clip(0.0))
            begin, end = xp.maximum(middle - half, low), xp.minimum(middle + half, high)
            if solid.box is not None:
                first, last = ((side - start) / a for side in (solid.box[0] + less, solid.box[1] - less))
                begin = xp.maximum(begin, xp.largest(xp.minimum(first, last))[0])
                end = xp.minimum(end, xp.least(xp.maximum(first, last)))
            hit = (left > 0) & (begin <= end)
            begin, end = xp.select(hit, begin, INF), xp.select(hit, end, -INF)
            rows.append((begin, end, solid.row["rate"] * xp.sqrt(square)))
            if solid.flags & BEGINS:
                low, high = around.pop()
            if solid.flags & CLIPS:
                low, high = begin, end
        tables = [xp.stack(list(part)[::-1], 0) for part in zip(*rows, strict=True)]
        passed = xp.where((tables[0] < INF).any(1))
        stops, draws, begin, end, rate = (part[passed] for part in (self._stops, self._draws, *tables))
        some = xp.where((stops & (begin < INF)).any(0))
        return _Ways(passed.tolist(), stops, draws, origin, way, begin, end, rate).at(xp, some), some

    def _asked(self, ways: _Ways, t: Array, wanted: Wanted) -> _Met:
        """What rays meet at t (n,)."""
        xp, ahead, inside, more = (
            self.xp,
            ways.begin > t,
            (ways.begin <= t) & (t <= ways.end),
            int(wanted > 0),
        )
        p, held = ways.origin + ways.way * t, zip(ways.numbers, inside, strict=True)
        state, pairs = self._folded(p, held, wanted, more)
        d, look = state[0], state[1 : 1 + len(self.looks)]
        medium = (d < 0) & (state[-1 - wanted] > 0.5 if self.mixed and wanted else self.media)
        free = xp.select(medium, xp.minimum(abs(d), state[-1]), abs(d)) if wanted else abs(d)
        rate = xp.largest(xp.select(inside, ways.rate, 1e-3))[0]
        following, cuts = (xp.least(xp.select(mask, ways.begin, INF)) for mask in (ahead & ways.stops, ahead))
        until = xp.least(xp.select(inside & (ways.end > t), ways.end, INF))
        last = xp.largest(xp.select(inside & ways.draws, ways.end, -INF))[0]
        return _Met(d, look, free, medium, rate, following, cuts, until, last, pairs)

    def march(self, origin: Array, way: Array, limit: Array, *, start: Any = 0.0, **how: Any) -> Trail:
        """As `SolidField.march`."""
        xp, low = self.xp, 0 * way[0] + start
        origin = origin if origin.ndim == 2 else 0 * way + origin[:, None]
        hit, length, soft, depth, none = 0 * low + INF, 0 * low, 0 * low, 0 * low, 0 * low[:0]
        work, pieces = Work(), [(xp.whole(none), none, none, none)]
        for at in _slices(len(low) if self._solids else 0, self._most):
            ways, some = self._crossed(origin[:, at], way[:, at], low[at], limit[at])
            if len(some):
                *found, parts, more = self._followed(ways, **how)
                for part, own in zip((hit, length, soft), found, strict=True):
                    xp.put(part, some + at.start, own)
                pieces += [(xp.take(some + at.start, ray), *rest) for ray, *rest in parts]
                work += more
        ray, begin, end, sigma = (xp.concat(list(part), 0) for part in zip(*pieces, strict=True))
        order = xp.order(begin)
        order = xp.take(order, xp.order(xp.take(ray, order)))
        ray, begin, end, sigma = (xp.take(part, order) for part in (ray, begin, end, sigma))
        own = sigma * (end - begin)
        total = xp.wide(own).cumsum(0) - own
        first = xp.where(xp.concat([ray[:1] >= 0, ray[1:] != ray[:-1]], 0))
        base = xp.wide(depth)
        xp.put(base, xp.take(ray, first), xp.take(total, first))
        before = xp.narrow(total - xp.take(base, ray)) / sigma
        xp.add(depth[None], ray, own[None])
        return Trail(hit, length, soft, depth, Pieces(ray, begin, end, before, sigma), work)

    def _followed(
        self, ways: _Ways, gap: float, halvings: int = HALVINGS, steps: int = STEPS, whole: bool = False
    ) -> tuple[Array, Array, Array, list[tuple[Array, ...]], Work]:
        """Follow rays to their first surfaces, and through media before these: as `Trail` has them how far
        they are, lengths, and where media give way; rays, begins, ends and extinctions of pieces; the work.
        """
        xp, pieces = self.xp, list[tuple[Array, ...]]()
        wanted = Wanted.ALL if self._marks else Wanted(bool(self.mixed))
        past, large = ways.first(xp), max(float(solid.row["extent"]) for solid in self._solids)
        t = past + BEHIND
        hit, length, soft, free, since, seen = 0 * t + INF, 0 * t, 0 * t, 0 * t, 0 * t, 0 * t
        work, ids, within = Work(near=len(t)), xp.where(t == t), t != t
        look = first = 0 * t + 0 * self.looks[:, :1]  # of the medium where it was asked for last, or begins

        def close(mask: Array, end: Array) -> None:
            """End the ways of some rays through media."""
            some = xp.where(mask)
            if len(some):
                rays, begin = xp.take(ids, some), xp.take(since, some)
                end = xp.maximum(xp.take(end, some), begin)
                sigma = 0 * end + self.sigma if self.sigma else xp.take(look[-self.switched], some).clip(1e-9)
                pieces.append((rays, begin, end, sigma))
                xp.put(length, rays, xp.take(length, rays) + (end - begin))

        def halved(mask: Array, low: Array, times: int, other: Array | None = None) -> Array:
            """Where, between there and t (n,), some rays leave media, or what they look like is nearer to
            another look (R, n) than to that before; t for other rays.
            """
            some, end = xp.where(mask), 1 * t
            there, low, high = ways.at(xp, some), xp.take(low, some), xp.take(t, some)
            looks = [] if other is None else [xp.take(part, some) for part in (look, other)]
            for _ in range(times):
                half = (low + high) / 2
                now = self._asked(there, half, wanted)
                off = [self._unlike(now.look, part) for part in looks]
                before = off[0] < off[1] if off else now.medium
                low, high = xp.select(before, half, low), xp.select(before, high, half)
                work.met += now.pairs
            xp.put(end, some, high)
            return end

        for _ in range(steps):
            check_time(self.network.until_s)
            some = xp.where(t < INF)
            if not len(some):
                break
            if len(some) < FULL * len(ids):
                ways, rows = ways.at(xp, some), (ids, t, past, free, since, seen, within, look, first)
                ids, t, past, free, since, seen, within, look, first = (xp.take(part, some) for part in rows)
            met, alive = self._asked(ways, t, wanted), t < INF
            work += Work(steps=len(some), met=met.pairs)
            medium = met.medium & alive
            done = alive & ~medium & (met.d < -ROUNDING * (t + large))
            at = xp.maximum(past + (t - past) * (free / (free + met.free).clip(1e-9)), t - gap)
            struck, into = xp.where(done & ~within), done & within
            xp.put(hit, xp.take(ids, struck), xp.take(at, struck))
            if self.media:
                close(within & ~medium & ~done & alive, at)
                if into.any():  # the distance need not be 0 there
                    end, some = halved(into, past, halvings), xp.where(into)
                    xp.put(hit, xp.take(ids, some), xp.take(end, some))
                    xp.put(soft, xp.take(ids, some), 0 * xp.take(t, some) + 1)
                    close(into, end)
                since = xp.select(medium & ~within, at, since)
                if self._marks:
                    other = (self._unlike(met.look, look) > JUMP) | (self._unlike(met.look, first) > DRIFT)
                    other = other & medium & within
                    end = halved(other, seen, BETWEEN, met.look) if other.any() else t
                    close(other, end)
                    since = xp.select(other, end, since)
                    first = xp.select(other | (medium & ~within), met.look, first)
                    look, seen = xp.select(medium, met.look, look), xp.select(medium, t, seen)
                within = medium
            alive = alive & ~done
            # bounds fell from `free` to met.free; on that line they are 0 soon, and 5 % more is behind that
            safe = met.free / met.rate
            hope = 1.05 * met.free * (t - past) / (free - met.free).clip(1e-12)
            hope = xp.select(free > 0, hope, 0.0) + BEHIND
            hope = xp.select((met.d < 0) & ~medium, 8 * BEHIND, hope)  # not yet deep: it may be thin
            ahead = t + xp.minimum(xp.maximum(hope, safe), safe + gap)
            ahead = xp.select(within, xp.minimum(ahead, met.until), ahead)
            over = (within & (met.until == INF)) | (~within & (ahead > met.last))
            following = xp.minimum(xp.select(over, INF, ahead), xp.select(within, met.cuts, met.next))
            close(alive & within & (following == INF), t)
            jumps = over | (following > ahead)
            past, free = xp.select(jumps, following, t), xp.select(jumps, 0.0, met.free)
            t = xp.select(alive, following + xp.select(jumps, BEHIND, 0.0), INF)
        work.lost = int((t < INF).sum())
        close(within & (t < INF), t)
        return hit, length, soft, pieces, work

    def shown(self, at: Array, radius: float, p: Array, n: Array) -> tuple[Array, Work]:
        """As `SolidField.shown`, asked of the field of `opaque`."""
        xp, way, work = self.xp, p - at[:, None], Work()
        square = (way * way).sum(0)
        far = xp.sqrt(square)
        spread = radius / xp.sqrt((square - radius * radius).clip(1e-9))  # of half the angle
        result = 0 * far + 1
        for some in _slices(len(far) if self._solids else 0, self._most):
            seen = [part[..., some] for part in (way / far, far, spread, n)]
            low, wide = 0 * seen[1] + radius, (ASIDE + WIDE) * seen[2]
            ways, ids = self._crossed(0 * seen[0] + at[:, None], seen[0], low, seen[1] - FLOOR, wide)
            if not len(ids):
                continue
            seen, work.near = [xp.take(part, ids) for part in seen], work.near + len(ids)
            told = self._told(ways, seen[1], seen[2], work)
            least = xp.minimum(told[0], told[2])
            xp.put(result, ids + some.start, share(xp, least))
            half = xp.where((abs(least) < 1) & (abs(seen[3]).sum(0) > 0))
            if len(half):
                ways, seen = ways.at(xp, half), [xp.take(each, half) for each in seen]
                parts = self._parts(at, radius, ways, seen, xp.take(told, half), work)
                xp.put(result, xp.take(ids, half) + some.start, parts)
        return result, work

    def _told(self, ways: _Ways, far: Array, spread: Array, work: Work) -> Array:
        """What rays along the axes of cones tell (6, M): the least distance over the cone's radius, and where
        it is; the like of the two nearest things before.
        """
        xp, none = self.xp, 0 * far
        result = xp.stack([none + 1, none] * 3, 0)
        t, told, ids, falls, before = ways.first(xp), 1 * result, xp.where(far == far), far != far, none
        for _ in range(STEPS):
            check_time(self.network.until_s)
            some = xp.where(t < INF)
            if not len(some):
                break
            if len(some) < FULL * len(ids):
                xp.put(result, ids, told)
                ways, rows = ways.at(xp, some), (t, told, falls, before, ids, far, spread)
                t, told, falls, before, ids, far, spread = (xp.take(part, some) for part in rows)
            met = self._asked(ways, t, Wanted.DISTANCE)
            work.steps, work.met = work.steps + len(some), work.met + met.pairs
            alive, left = t < INF, (far - t).clip(FLOOR)
            wide = spread * left
            c = met.d / wide
            falling = c < before
            other = falling & ~falls & alive  # something else comes near
            six = [*told]
            for first in (2, 4):  # what is nearer moves the others on
                kept = other & (six[0] < six[first])
                for a, b in ((0, first), (1, first + 1)):
                    six[a], six[b] = xp.select(kept, six[b], six[a]), xp.select(kept, six[a], six[b])
            least = xp.select(other, 0 * c + 1, six[0])
            six[1] = xp.select((c < least) & alive, t, six[1])
            six[0] = xp.select(alive, xp.minimum(c, least), six[0])
            told, falls, before = xp.stack(six, 0), falling, c
            least = xp.minimum(six[0], six[2])  # less than the third
            step = xp.maximum((met.d - least.clip(-1.0, 1.0) * wide) / met.rate, STRIDE * wide)
            ahead = t + step + (HURRY * spread).clip(None, HASTE) * left + FLOOR
            following = xp.minimum(xp.select(ahead > met.last, INF, ahead), met.next)
            t = xp.select(alive & (least > -1), following, INF)
        xp.put(result, ids, told)
        return result

    def _parts(
        self, at: Array, radius: float, ways: _Ways, seen: list[Array], told: Array, work: Work
    ) -> Array:
        """As `shown`, of points on surfaces whose rays, with such ways, told (6, K) where things are near."""
        xp = self.xp
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
        axes, asides, rays_way, fars, spreads = (xp.take(x, near) for x in (way, aside, ray, far, spread))
        ways = ways.at(xp, near % count)
        two = []
        for _ in range(2):
            left = (fars - t).clip(FLOOR)
            p = at[:, None] + rays_way * t + asides * left
            inside = (ways.begin <= t) & (t <= ways.end)
            state, met = self._folded(p, zip(ways.numbers, inside, strict=True), Wanted.DISTANCE, 3)
            work.met += met
            g, length = state[-3:], xp.sqrt((state[-3:] * state[-3:]).sum(0)).clip(0.05)
            along = (g * axes).sum(0) / length
            two.append((t, state[0] / length, along, g / length - along * axes))
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
        lit = (lit * weight).reshape(PARTS, -1).sum(0)
        return lit / weight.reshape(PARTS, -1).sum(0).clip(1e-9)


def _slices(count: int, most: int) -> Iterator[slice]:
    """So many in parts of at most so many."""
    return (slice(start, start + most) for start in range(0, count, most))


def solid_field(network: SolidNetwork, *rows: Any, **named: Any) -> SolidField:
    """The field that a network's library asks: the kernel for numpy, the network as written for torch."""
    return (SolidField if network.xp is NUMPY else PlainField)(network, *rows, **named)
