"""The solids' field: what it answers at points of rays.

Each object's frame (`frames.py`) carries points into its own space. There pairs of points and objects meet
the network together, where the point is in the object's ball (`passes.py`); then the cell takes a point's
objects in, one by one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scenelang.elements.element import Element
from scenelang.renderers.arrays import Array, Arrays, Layers
from scenelang.renderers.field import SMOOTH, UNION
from scenelang.renderers.grid import GridShape, grid_shape
from scenelang.renderers.solid.network import BLEND, EMPTY, RADIUS, Cell, SolidNetwork, Wanted
from scenelang.renderers.solid.passes import BEGIN, END, OBJECT, SLACK, WAY, Passes, find_passes, read_solids

_ROWS = (1, 2, 5)  # of a point's memory, by `Wanted`


class Meeting(NamedTuple):
    """What the field answers at points (M,).

    Args:
        distance: D.
        register: colour and medium (4, M), the medium alone (1, M), or nothing (0, M).
        inside: which balls (K, M) the points are in.
        gradient: of D (3, M), if asked for.
        change: a bound on D and on how far another object's material may begin, if asked for.
        owner: number of the object whose material holds, from 1, if asked for.
        met: pairs of points and objects that met.
    """

    distance: Array
    register: Array
    inside: Array
    gradient: Array = None
    change: Array = None
    owner: Array = None
    met: int = 0


class SolidField:
    """A program's objects with their weights, ready to be met by points.

    Args:
        network: trained parameters, on any device.
        vectors: (N, 64) float32, geometry and material vectors.
        tokens: (N,) boolean tokens 0 to 3.
        brought: what users brought, None where a row shows a geometry of the model; all of them if left out.

    Raises:
        ProgramError: an object's vector holds no way from the world to a leaf, or an element is damaged.
    """

    def __init__(
        self,
        network: SolidNetwork,
        vectors: np.ndarray,
        tokens: np.ndarray,
        brought: Sequence[Element | None] | None = None,
    ) -> None:
        self.network, self.xp, self.tokens = network, network.xp, tokens
        with self.xp.inference():
            self.solids = read_solids(network, vectors, tokens)
            self._tables(vectors)
            self._decoders(vectors, brought or [None] * len(vectors))
        kinds = self.xp.to_numpy(self.looks)[3] > 0.5
        self.draws = all(solid.draws for solid in self.solids)
        """Whether all objects draw."""
        self.media = bool(kinds.any())
        """Whether some object is a medium."""
        self.mixed = self.media and not kinds.all()
        """Whether not all are."""
        self.coloured = self.media and np.ptp(self.xp.to_numpy(self.looks)[:3, kinds], 1).max() > 0
        """Whether media have different colours."""

    def _tables(self, vectors: np.ndarray) -> None:
        """What pairs of points and objects look up: arrays (…, N)."""
        xp, network, layout = self.xp, self.network, self.network.layout
        m = vectors[:, layout.geometry :]
        frames, count = [solid.frame for solid in self.solids], len(vectors)

        def table(values: object, *shape: int) -> Array:
            return xp.array(np.array(values, np.float32).reshape(*shape, count), network.codes)

        self.scale, self.amount, self.frequency = (
            table([getattr(frame, name) for frame in frames]) for name in ("scale", "amount", "frequency")
        )
        self.linear = xp.stack([f.outer.linear for f in frames], -1) if frames else table([], 3, 3)
        self.shift = xp.stack([f.outer.shift for f in frames], -1) if frames else table([], 3)
        self.turned = [(i, frame) for i, frame in enumerate(frames) if frame.steps]
        self.far = any(solid.radius > RADIUS for solid in self.solids)
        self.bumpy = any(frame.amount for frame in frames)
        look = network.look(xp.array(m[:, layout.material_code].copy(), network.codes)).T
        matrix = table(m[:, layout.colour].T, 3, 4)
        colour = (matrix[:, :3] * look[:3]).sum(1) + matrix[:, 3]
        self.looks = xp.concat([colour.clip(0.0, 1.0), look[3:]], 0)
        self.empty = xp.full((), EMPTY, network.codes)
        self.smooth = table(self.tokens == SMOOTH) > 0 if SMOOTH in self.tokens else None
        keys = [(solid.token, solid.frame.blend if solid.token == SMOOTH else BLEND) for solid in self.solids]
        self.alike = len(set(keys)) <= 1
        cells = [network.cell(*key) for key in (keys[:1] if self.alike else keys)]
        cells = cells or [network.cell(UNION, BLEND)]
        self.cells = [
            Cell(*(xp.concat(list(part), 1) for part in zip(*each, strict=True)))
            for each in zip(*cells, strict=True)
        ]

    def _decoders(self, vectors: np.ndarray, brought: Sequence[Element | None]) -> None:
        """What tells distances, and which of them is each object's."""
        xp, network = self.xp, self.network
        codes = vectors[:, : network.layout.code]
        keys = [
            code.tobytes() if element is None else element
            for code, element in zip(codes, brought, strict=True)
        ]
        # codes first, whose numbers are those of their segments
        ordered = sorted(dict.fromkeys(keys), key=lambda key: isinstance(key, Element))
        number = {key: at for at, key in enumerate(ordered)}
        learned = [
            xp.array(np.frombuffer(key, np.float32).copy(), network.codes)
            for key in ordered
            if isinstance(key, bytes)
        ]
        self.decoders: list[Layers | GridShape] = [
            *map(network.decoder, learned),
            *(grid_shape(key, xp, network.codes) for key in ordered if isinstance(key, Element)),
        ]
        self.decoder = xp.array(np.array([number[key] for key in keys], np.float32), network.codes)
        plain = [
            element is None and s.draws and s.radius <= 1 + SLACK and not s.frame.steps
            for element, s in zip(brought, self.solids, strict=True)
        ]
        self.asked = xp.array(np.array(plain, np.float32), network.codes) * (self.looks[3] > 0.5)
        """1 where `segments.py` may answer."""
        known = len(network.segment_w) and float(self.asked.sum())
        self.segments = [network.segment(code) for code in learned] if known else []

    def passes(self, origin: Array, way: Array, limit: Array) -> tuple[Array, Passes]:
        """As `find_passes`, of unit directions way (3, M)."""
        origins = (self.linear * origin[:, None]).sum(1) + self.shift
        return find_passes(self.xp, self.solids, origin, origins, way, limit)

    def meet(
        self,
        passes: Passes,
        t: Array,
        wanted: Wanted,
        gradient: bool = False,
        change: bool = False,
        owners: bool = False,
    ) -> Meeting:
        """Let points of rays meet the objects.

        Args:
            passes: of the rays.
            t: how far along each the point is (M,).
            wanted: what of the register to answer beside the distance.
            gradient, change, owners: what else; with owners the register says nothing.
        """
        xp, count = self.xp, len(t)
        inside = self._inside(passes, t)
        places = [xp.where(mask) for mask in inside]
        rays = xp.concat(places, 0)
        flat = xp.concat([place + count * slot for slot, place in enumerate(places)], 0)
        pairs = xp.take(passes.slots[: WAY.stop].reshape(WAY.stop, -1), flat)
        objects = xp.whole(pairs[OBJECT])
        if not self.draws:
            objects = xp.select(objects < 0, -1 - objects, objects)
        at = pairs[WAY] * xp.take(t, rays) + xp.take(passes.origins, objects)
        d, own = self._distances(at, objects, gradient)
        memory = xp.full((_ROWS[wanted], count), 0.0, t)
        memory[0] = EMPTY
        slope = xp.full((3, count), 0.0, t) if gradient else None
        bound = xp.full((count,), EMPTY, t) if change else None
        owner = xp.full((count,), 0.0, t) if owners else None
        stop = len(rays)
        for place in reversed(places):  # a point's first object is in the last slot
            if not len(place):
                continue
            stop, pair = stop - len(place), slice(stop - len(place), stop)
            index, which, near = None if len(place) == count else place, objects[pair], d[pair]
            before, look = _part(xp, memory, index), self.looks
            if wanted:
                look = xp.take(look, which)
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
        return Meeting(memory[0], memory[1:], inside, slope, bound, owner, len(rays))

    def _gap(self, d: Array, before: Array, look: Array, which: Array) -> Array:
        """How far (k,) objects with distances d (k,) leave the kind of material as it is."""
        xp, gap = self.xp, abs(d)
        if self.smooth is not None:
            blend = xp.minimum(gap, abs(before[0] - d) / 2)
            gap = xp.select(xp.take(self.smooth, which), blend, gap)
        # objects of the kind that is there change nothing of it
        return xp.select(abs(before[1] - look[3]) > 0.5, gap, self.empty)

    def _inside(self, passes: Passes, t: Array) -> Array:
        """Which balls (K, M) points at t (M,) are in, of objects that change something there."""
        inside = (passes.slots[BEGIN] <= t) & (t <= passes.slots[END])
        if not self.draws:  # the others change only what is there
            touched = inside[0] & ~inside[0]
            for slot in reversed(range(len(inside))):
                inside[slot] &= touched | (passes.slots[OBJECT, slot] >= 0)
                touched = touched | inside[slot]
        return inside

    def _distances(self, at: Array, objects: Array, gradient: bool) -> tuple[Array, Array | None]:
        """World distances (P,) to objects at points (3, P) behind their maps; gradients (3, P) if asked."""
        xp, q, g = self.xp, at, None
        own = []  # of the objects with more than a map, their points
        for i, frame in self.turned:
            index = xp.where(objects == i)
            if len(index):
                own.append((frame, index, xp.take(at, index)))
        if own:
            q = 1 * at
            for frame, index, p in own:
                xp.put(q, index, frame.local(xp, p))
        length = rim = None
        place = q
        if self.far:
            length = xp.sqrt((q * q).sum(0))
            rim = RADIUS / length.clip(RADIUS)
            place = q * rim
        found = self._decoded(place, objects, gradient)
        d, g = found[0], found[1:]
        if length is not None and rim is not None:
            d = d + (length - RADIUS).clip(0.0)
            if gradient:
                n = q / length.clip(1e-9)
                g = xp.select(length > RADIUS, rim * (g - (g * n).sum(0) * n) + n, g)
        if self.bumpy:
            f, amount = xp.take(self.frequency, objects), xp.take(self.amount, objects)
            s = xp.sin(f * q)
            d = d + amount * (s[0] * s[1] * s[2])
            if gradient:
                c = xp.cos(f * q)
                more = xp.stack([c[0] * s[1] * s[2], s[0] * c[1] * s[2], s[0] * s[1] * c[2]], 0)
                g = g + (amount * f) * more
        scale = xp.take(self.scale, objects)
        if not gradient:
            return d * scale, None
        for frame, index, p in own:
            xp.put(g, index, frame.pulled(xp, p, xp.take(g, index)))
        return d * scale, (xp.take(self.linear, objects) * g[:, None]).sum(0) * scale

    def _decoded(self, q: Array, objects: Array, gradient: bool) -> Array:
        """What decoders say at leaf coordinates (3, P): distances (1, P), or these and gradients (4, P)."""
        xp = self.xp
        if len(self.decoders) == 1:
            return self._field(q, self.decoders[0], gradient)
        found, which = xp.full((4 if gradient else 1, q.shape[1]), 0.0, q), xp.take(self.decoder, objects)
        for i, layers in enumerate(self.decoders):
            index = xp.where(which == i)
            if len(index):
                xp.put(found, index, self._field(xp.take(q, index), layers, gradient))
        return found

    def _field(self, q: Array, decoder: Layers | GridShape, gradient: bool) -> Array:
        if isinstance(decoder, GridShape):
            return decoder.field(q, gradient)
        return self.network.field(q, decoder, gradient)


def _part(xp: Arrays, whole: Array, index: Array | None) -> Array:
    """Entries (…, k) of an array (…, M), or all."""
    return whole if index is None else xp.take(whole, index)


def _update(xp: Arrays, whole: Array, index: Array | None, values: Array) -> Array:
    """An array (…, M) with new values (…, k) at some places, or at every one."""
    if index is None:
        return values
    xp.put(whole, index, values)
    return whole
