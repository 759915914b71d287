"""The solids' field: distances, gradients and colours of objects at points, folded along the stream.

Each object's frame (`passes.py`) carries points into its own space. Pairs of points and objects meet the
network together, where the point is in the object's ball; then the cell takes a point's objects in, one by
one. Open groups have states of their own (`States`), and a group's result is taken in as an object is. A
group that draws goes on in the state around it where nothing has been met in that state yet.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from scenelang.assets.element import Element
from scenelang.compiler.groups import (
    OPERATOR,
    SMOOTH,
    SUBTRACT,
    UNION,
    Floats,
    Groups,
    read_groups,
    widths_of,
)
from scenelang.compiler.lifting import Parts
from scenelang.compiler.program import Paint
from scenelang.drawing.arrays import Array, Arrays, Smooth
from scenelang.drawing.kernel import Asked, load_kernel
from scenelang.drawing.neural.assets import GridShape, grid_shape, texture_of
from scenelang.drawing.neural.frames import Skins, read_skins
from scenelang.drawing.solid.network import BLEND, EMPTY, RADIUS, SolidCell, SolidNetwork, Wanted, element_box
from scenelang.drawing.solid.norms import Norms
from scenelang.drawing.solid.passes import (
    BEGIN,
    END,
    INF,
    OBJECT,
    WAY,
    Passes,
    SolidFrame,
    find_passes,
    read_solids,
)
from scenelang.drawing.tables import DRAWS, SKINNED, SLACK, SMALL, Tables, read_looks, read_objects


class SolidClosing(NamedTuple):
    """Groups that end, k of them."""

    inner: Array  # entries (k,): the point's number and, for each state below it, the number of points
    outer: Array  # those of the states that take them in
    which: Array  # numbers of the groups, behind those of the objects


# what happens at points in turn: a group ends, or the points (k,) meet an object, all where they are None
Steps = list[SolidClosing | Array | None]


class Stacks:
    """The groups that are open at each object, as bits: the outermost is 1, one in that 2, and so on."""

    def __init__(self, xp: Arrays, groups: Groups, like: Array) -> None:
        def placed(values: np.ndarray) -> Array:
            return xp.array(np.ascontiguousarray(values), like)

        self._xp, self._groups, self._count = xp, groups.deepest, len(groups.tokens)
        bits = 1 << np.arange(groups.deepest)
        there = groups.path >= 0
        self._path = placed(groups.path.T)  # (D, N)
        self._open = placed(there @ bits)
        self._cuts = placed((there & (groups.joins[groups.path] >= SUBTRACT)) @ bits)
        self._ways = placed(np.unique(groups.path, axis=0, return_inverse=True)[1].reshape(-1))
        self._states = placed(np.array([bin(i).count("1") for i in range(2 << groups.deepest)]))

    def followed(
        self, places: Sequence[Array | None], rays: Array, objects: Array, every: Array
    ) -> tuple[Steps, int]:
        """Steps and depth of `SolidPairs`, by places without states and all points' numbers."""
        xp, count = self._xp, len(every)
        ways, begun = xp.take(self._ways, objects), 0 * every
        met = count if places[0] is None else len(places[0])
        xp.put(begun, rays[:met], ways[:met])
        if (ways == xp.take(begun, rays)).all() and not xp.take(self._cuts, objects).any():
            return [*places], 1  # each point meets one group alone
        result: Steps = []
        stacks, paths = 0 * every, xp.take(self._path, 0 * every)
        start, deepest = 0, 1
        for place in places:
            points = every if place is None else place
            which = objects[start : start + len(points)]
            stack, path, last = xp.take(stacks, points), xp.take(self._path, which), xp.take(paths, points)
            opened = xp.take(self._open, which)
            common, same = 0 * stack, points == points
            for depth in range(self._groups):
                same = same & (path[depth] == last[depth]) & (path[depth] >= 0)
                common = common + same * (1 << depth)
            # what begins in what is not empty, or cuts it, has a state of its own
            begun = opened & ~common & (xp.take(self._cuts, which) | (common + 1) * (start > 0))
            stack = self._closed(result, points, stack, common, last, count) | begun
            states = xp.take(self._states, stack)
            deepest = max(deepest, 1 + int(states.max())) if len(points) else deepest
            result.append(place if place is None and not start else points + count * states)
            xp.put(stacks, points, stack)
            xp.put(paths, points, path)
            start += len(points)
        self._closed(result, every, stacks, 0 * every, paths, count)
        if deepest > 1 and result[0] is None:
            result[0] = every
        return result, deepest

    def _closed(
        self, steps: Steps, points: Array, stack: Array, common: Array, path: Array, count: int
    ) -> Array:
        """End the groups of stacks (k,) but for what they have in common with what follows; those left."""
        xp = self._xp
        ending = stack & ~common
        for depth in reversed(range(self._groups)):
            bit = 1 << depth
            some = xp.where((ending & bit) > 0)
            if len(some):
                inner = xp.take(points, some) + count * xp.take(self._states, xp.take(stack, some))
                steps.append(SolidClosing(inner, inner - count, self._count + xp.take(path[depth], some)))
                stack = stack - (ending & bit)
        return stack


AWAY = 50.0  # leaf units by which objects are moved that are not to be met
NOTHING = 10.0  # world units: how far a group with nothing in it is at most for what it is taken in by


class Meeting(NamedTuple):
    """Answers of the field, of an object or of a group at points (M,); None where not asked for."""

    distance: Array  # D
    register: (
        Array  # colours and medium (R, M), as in `SolidField.looks`, the medium alone (1, M), or nothing
    )
    gradient: Array = None  # of D (3, M)
    change: Array = None  # a bound on D and on how far another object's material may begin
    owner: Array = None  # number of the object whose material holds, from 1
    met: int = 0  # pairs of points and objects that met


class Material(NamedTuple):
    """A material at points (M,); colours are linear."""

    colour: Array  # (3, M)
    medium: Array  # a mask
    glow: Array  # (3, M)
    density: Array  # extinction per world unit, where it is a medium
    roughness: Array  # of what is glossy, minus it of metal, 0 of others


class SolidPairs(NamedTuple):
    """Points of M rays and the objects that they meet: P pairs."""

    # points that meet an object, those that meet a second, and so on; of points in groups they are those of
    # their states, as `SolidClosing` has them
    steps: Steps
    rays: Array  # (P,), place by place
    objects: Array  # their numbers (P,)
    at: Array  # where the rays begin behind the objects' maps (3, P)
    way: Array  # how that changes along the rays (3, P); None where they are points
    depth: int = 1  # how many states a point has
    far: bool = False  # whether points may be farther from leaves than the decoder sees


@dataclass(slots=True)
class States:
    """Distances, registers and optional values of M points, then of those in second states, and so on."""

    memory: Array
    slope: Array
    bound: Array
    owner: Array


class SolidField:
    """A program's objects with their weights, ready to be met by points of rays.

    Of rows of vectors (N, 64) and tokens (N,), ``brought`` and ``paints`` are elements and textures, None
    where a row has the geometry or the colour of its vector. Raises `ProgramError` where a vector holds no
    way to a leaf, or an element is damaged. Distances hold up to ``reach`` around objects, at least.
    """

    def __init__(
        self,
        network: SolidNetwork,
        vectors: np.ndarray,
        tokens: np.ndarray,
        brought: Sequence[Element | None] | None = None,
        paints: Sequence[Paint | None] | None = None,
        reach: float = 0.0,
    ) -> None:
        self.network, self.xp, self.tree, self.reach = network, network.xp, read_groups(tokens), reach
        self.rows, self.paints = (vectors, tokens, brought), paints
        none = [None] * len(vectors)
        parts = network.layout.unpack(vectors)
        widths = widths_of(np.asarray(tokens, np.intp) & OPERATOR, parts.width)
        self.stacks = Stacks(self.xp, self.tree, network.codes) if self.tree.deepest else None
        with self.xp.inference():
            self.objects = read_objects(vectors, network.layout, self.tree, widths, reach)
            self.solids = read_solids(self.xp, self.objects, network.codes)
            self._tables(parts)
            self._cells(widths)
            self._textures(parts.texture, paints or none)
            self._looks(parts)
            self._decoders(parts.code, brought or none)
            self._alone()
        kinds = self.xp.to_numpy(self.looks)[-1] > 0.5
        drawn = np.array([solid.draws for solid in self.solids], bool)
        self.edged = any(not isinstance(own, GridShape) and network.edged(own) for own in self.decoders)
        self.draws = bool(drawn.all())  # whether all objects draw
        self.media = bool(kinds.any())  # whether some object is a medium
        self.mixed = self.media and not kinds.all()  # whether some are and some are not
        # whether media have different colours
        hues = self.xp.to_numpy(self.looks)[self.hues - 3 : self.hues, kinds]
        self.coloured = self.media and np.ptp(hues, 1).max() > 0
        self.adding: Array | None = None  # (N,), 1 for objects of groups that neither draw nor take away
        if (groups := self.tree).deepest:
            there = groups.path >= 0
            cuts = (there & (groups.joins[groups.path] == SUBTRACT)).sum(1) + (groups.tokens == SUBTRACT)
            adding = there.any(1) & ~drawn & (cuts % 2 == 0)
            self.adding = self.xp.array(adding.astype(np.float32), network.codes)

    def _tables(self, parts: Parts) -> None:
        """Build the tables (…, N) that pairs of points and objects look up."""
        xp, network = self.xp, self.network
        frames, count = [solid.frame for solid in self.solids], len(self.solids)

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
        skins = read_skins(parts)
        self.skins = None if skins is None else skins.placed(xp, network.codes)
        # which objects (N,) have a skin
        self.skinned = self.objects.flagged(SKINNED)

    def _cells(self, widths: Floats) -> None:
        """Cells of the objects and, behind these, of the groups; `widths` are those of rows' blends."""
        xp, network, groups = self.xp, self.network, self.tree
        operators = np.concatenate([groups.tokens, groups.joins])
        widths = np.concatenate([np.where(groups.first, 0.0, widths), widths[groups.rows]])
        smooth = xp.array((operators == SMOOTH).astype(np.float32), network.codes) > 0
        self.smooth = smooth if SMOOTH in operators else None
        keys = list(zip(operators.tolist(), widths.tolist(), strict=True))
        self.alike = len(set(keys)) <= 1
        known = {
            (token, width): network.cut(token, width)
            if token >= SUBTRACT and width
            else network.cell(token, width or BLEND)
            for token, width in dict.fromkeys(keys)
        }
        cells = [known[key] for key in (keys[:1] if self.alike else keys)] or [network.cell(UNION, BLEND)]
        self.cells = [
            SolidCell(*(xp.concat(list(part), 1) for part in zip(*each, strict=True)))
            for each in zip(*cells, strict=True)
        ]

    def _textures(self, frames: np.ndarray, paints: Sequence[Paint | None]) -> None:
        """Build the textures of objects."""
        xp, like = self.xp, self.network.codes
        worn = {
            i: texture_of(xp, paint, frames[i], like, light=True)
            for i, paint in enumerate(paints)
            if paint is not None and self.solids[i].draws  # the others leave colours as they are
        }
        self.textures = list(worn.items())  # those that draw, with their objects' numbers
        # texels that a way of a world unit may cross; 0 without a texture
        detail = [worn[i].detail / s.frame.scale if i in worn else 0.0 for i, s in enumerate(self.solids)]
        self.detail = xp.array(np.array(detail, np.float32), like)

    def _looks(self, parts: Parts) -> None:
        """Build the register (R, N) of objects: colours, medium, and what a scene writes beside these."""
        worn = np.zeros(len(self.solids), bool)
        worn[[i for i, _ in self.textures]] = True
        looks, like = read_looks(self.network, parts, worn, self.objects.flagged(DRAWS)), self.network.codes
        self.looks, self.density = self.xp.array(looks.register, like), self.xp.array(looks.density, like)
        self.hues, self.switched, self.sigma = looks.hues, looks.switched, looks.sigma
        self.glowing, self.rough = looks.glowing, looks.rough

    def glow(self, register: Array) -> Array:
        """The light (3, M) that materials of registers (R, M) give off, linear."""
        return register[self.hues : self.hues + 3] if self.glowing else 0 * register[:3]

    def extinction(self, register: Array) -> Array:
        """The extinction (M,) of media with registers (R, M), per world unit."""
        return 0 * register[0] + self.sigma if self.sigma else register[-self.switched]

    def material(self, met: Meeting | Asked) -> Material:
        """The material at points that were asked for all (`Wanted.ALL`), as it holds wherever D < 0."""
        register = met.register
        parts = self.glow(register), self.extinction(register), register[-2] * self.rough
        return Material(register[:3], register[-1] > 0.5, *parts)

    def _decoders(self, codes: np.ndarray, brought: Sequence[Element | None]) -> None:
        """Build the decoders of distances, and each object's index among them."""
        xp, network = self.xp, self.network
        grown = {brought[i] for i in np.flatnonzero(self.skinned).tolist()}
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
        self.decoders: list[Smooth | Norms | GridShape] = [
            *map(network.decoder, learned),
            *(
                grid_shape(key, xp, network.codes, key in grown)
                for key in ordered
                if isinstance(key, Element)
            ),
        ]
        self.decoder = xp.array(np.array([number[key] for key in keys], np.float32), network.codes)
        boxes = [
            element_box(key) if isinstance(key, Element) else network.box(decoder)  # type: ignore[arg-type]
            for key, decoder in zip(ordered, self.decoders, strict=True)
        ]
        for i, (key, solid) in enumerate(zip(keys, self.solids, strict=True)):
            box = boxes[number[key]]
            # a small box, where an affine map leads to the leaf
            if not ((box[1] - box[0]).min() > SMALL or solid.frame.steps or solid.wide):
                sides = box[:, :, None] + np.reshape([-1, 1], (2, 1, 1)) * max(solid.radius - 1, 0.0)
                low, high = (xp.array(side, network.codes) for side in sides.astype(np.float32))
                self.solids[i] = replace(solid, box=(low, high))
        lone = [
            element is None and s.draws and s.radius <= 1 + SLACK and not s.frame.steps
            for element, s in zip(brought, self.solids, strict=True)
        ]
        plain = ~self.skinned & np.array(lone, bool)
        media = np.asarray(xp.to_numpy(self.looks))[-1] > 0.5
        self.segments = [network.segment(code) for code in learned] if (plain & media).any() else []
        known = np.array([bool(own) for own in self.segments] + [False] * len(ordered), bool)
        asked = plain & media & known[np.array([number[key] for key in keys], np.intp)]
        # 1 where the network for whole segments may answer
        self.asked = xp.array(asked.astype(np.float32), network.codes)
        self.answered = bool(asked.any())

    def _alone(self) -> None:
        """Prepare the answers for points that meet one object alone, or meet it first."""
        xp, like, solids = self.xp, self.network.codes, self.solids
        # the diameter of what an object changes: no distance in it is greater
        reach = np.array([2 * s.radius * s.frame.scale for s in solids], np.float32)
        cell = SolidCell(*(weights[:, : len(solids)] for weights in self.cells[Wanted.ALL]))
        # factors of distances (N,) of objects that are met first; 0: the cell has to be asked
        self.first = self.network.alone(xp.array(reach, like), cell)
        drawn = xp.array(np.array([s.draws for s in solids], np.float32), like)
        # whether the cell need not be asked for any object that draws
        self.open = bool(((self.first > 0) | (drawn == 0)).all())
        self.factor = self.first * self.scale  # world units for a leaf unit of objects that are met alone
        self.special = [  # to which more than a map leads, or that are not as their leaves
            i
            for i, s in enumerate(solids)
            if s.draws and (s.radius > RADIUS or s.frame.steps or s.frame.amount or self.skinned[i])
        ]
        # groups of objects that are met alone: those of each decoder, and each special one; -1 for others
        self.groups = len(self.decoders) + len(self.special)
        group = 1 * self.decoder
        for at, i in enumerate(self.special):
            group[i] = len(self.decoders) + at
        self.group = xp.select((self.first > 0) & (drawn > 0), group, 0 * group - 1)

    def worn(self, objects: Array, p: Array) -> Array:
        """Colours (3, P) of objects, whatever else is at points p (3, P)."""
        xp = self.xp
        colours = xp.take(self.looks[:3], objects)
        for i, texture in self.textures:
            index = xp.where(objects == i)
            if len(index):
                frame = self.solids[i].frame
                own = frame.outer(xp, xp.take(p, index))
                xp.put(colours, index, texture.at(frame.local(xp, own)))
        return colours

    def normals(self, objects: Array, p: Array) -> Array:
        """Gradients (3, P) of objects' own distances at points p (3, P)."""
        return self._distances(*self._local(self.behind(objects, p), objects), objects, True)[1]

    def own(self, objects: Array, at: Array) -> Array:
        """World distances (P,) from objects alone at points (3, P) behind their maps."""
        return self._distances(*self._local(at, objects), objects, False)[0]

    def before(self, objects: Array, at: Array) -> Array:
        """World points (3, P) that objects' maps carry to points (3, P)."""
        xp = self.xp
        linear = np.moveaxis(np.asarray(xp.to_numpy(self.linear), np.float64), -1, 0)
        back = xp.array(np.moveaxis(np.linalg.inv(linear), 0, -1).astype(np.float32), self.network.codes)
        return (xp.take(back, objects) * (at - xp.take(self.shift, objects))).sum(1)

    def behind(self, objects: Array, p: Array) -> Array:
        """World points (3, P) behind the objects' maps."""
        xp = self.xp
        return (xp.take(self.linear, objects) * p).sum(1) + xp.take(self.shift, objects)

    def _worn_looks(self, q: Array, objects: Array) -> Array:
        """Registers (R, P) of objects with their textures' colours at leaf coordinates (3, P)."""
        xp = self.xp
        looks = xp.take(self.looks, objects)
        for i, texture in self.textures:
            index = xp.where(objects == i)
            if len(index):
                xp.put(looks[:3], index, texture.at(xp.take(q, index)))
        return looks

    def _local(self, at: Array, objects: Array) -> tuple[Array, list[tuple[SolidFrame, Array, Array]]]:
        """Leaf coordinates (3, P) behind the maps; for objects with more, frames, indices and points."""
        xp, q = self.xp, at
        own = [
            (frame, index, xp.take(at, index))
            for i, frame in self.turned
            if len(index := xp.where(objects == i))
        ]
        for frame, index, p in own:
            q = 1 * at if q is at else q
            xp.put(q, index, frame.local(xp, p))
        return q, own

    def _distances(
        self,
        q: Array,
        own: list[tuple[SolidFrame, Array, Array]],
        objects: Array,
        gradient: bool,
        far: bool = False,
    ) -> tuple[Array, Array]:
        """World distances (P,) at leaf coordinates, as `_local` has them; gradients (3, P) if asked."""
        xp, bulge = self.xp, None
        if self.bumpy:
            bulge = xp.take(self.frequency, objects), xp.take(self.amount, objects)
        skin = None
        if self.skins is not None:
            skin = Skins(*(xp.take(part, objects) for part in self.skins))
        d, g = self._leaf(q, partial(self._decoded, objects=objects), far or self.far, bulge, skin, gradient)
        scale = xp.take(self.scale, objects)
        if not gradient:
            return d * scale, g
        for frame, index, p in own:
            xp.put(g, index, frame.pulled(xp, p, xp.take(g, index)))
        return d * scale, (xp.take(self.linear, objects) * g[:, None]).sum(0) * scale

    def decoded(self, at: Array, bounds: Sequence[int]) -> Array:
        """Leaf distances (P,) at points (3, P) behind objects' maps, group by group, with bounds between."""
        parts = []
        for group, (a, b) in enumerate(pairwise(bounds)):
            if a < b and group < len(self.decoders):
                parts.append(self._field(at[:, a:b], False, self.decoders[group])[0])
            elif a < b:
                i = self.special[group - len(self.decoders)]
                frame, decoder = self.solids[i].frame, self.decoders[int(self.decoder[i])]
                bulge = (frame.frequency, frame.amount) if frame.amount else None
                q, far = frame.local(self.xp, at[:, a:b]), self.solids[i].radius > RADIUS
                skin = None if self.skins is None else self.skins.at(i)
                parts.append(self._leaf(q, partial(self._field, decoder=decoder), far, bulge, skin, False)[0])
        return parts[0] if len(parts) == 1 else self.xp.concat(parts, 0)

    def _leaf(
        self,
        q: Array,
        field: Callable[..., Array],
        far: bool,
        bulge: tuple[Any, Any] | None,
        skin: Skins | None,
        gradient: bool,
    ) -> tuple[Array, Array]:
        """Leaf distances (P,) by a field, which does not know what is ``far``; gradients (3, P) if asked."""
        xp, place = self.xp, q
        if far:
            length = xp.sqrt((q * q).sum(0))
            rim = RADIUS / length.clip(RADIUS)
            place = q * rim
        result = field(place, gradient=gradient)
        d, g = result[0], result[1:]
        if far:
            d = d + (length - RADIUS).clip(0.0)
            if gradient:
                n = q / length.clip(1e-9)
                g = xp.select(length > RADIUS, rim * (g - (g * n).sum(0) * n) + n, g)
        early: Any = 1.0
        if skin is not None:
            early = 1.0 - skin.late
            if bulge is not None:
                d, g = _displaced(xp, q, d, g, bulge, early)
            if gradient:
                g = xp.select((d - skin.first < 0.0) & (skin.wall > 0.0), -g, g)
            d, early = skin.put_on(xp, d), skin.late
        if bulge is not None:
            d, g = _displaced(xp, q, d, g, bulge, early)
        return d, g

    def _decoded(self, q: Array, gradient: bool, objects: Array) -> Array:
        """Decode leaf coordinates (3, P) to distances (1, P), or to these and gradients (4, P)."""
        xp = self.xp
        if len(self.decoders) == 1:
            return self._field(q, gradient, self.decoders[0])
        result, which = xp.full((4 if gradient else 1, q.shape[1]), 0.0, q), xp.take(self.decoder, objects)
        for i, layers in enumerate(self.decoders):
            index = xp.where(which == i)
            if len(index):
                xp.put(result, index, self._field(xp.take(q, index), gradient, layers))
        return result

    def _field(self, q: Array, gradient: bool, decoder: Smooth | Norms | GridShape) -> Array:
        if isinstance(decoder, GridShape):
            return decoder.field(q, gradient)
        return self.network.field(q, decoder, gradient)

    def passes(
        self, origin: Array, way: Array, limit: Array, tight: bool = True, *more: Any
    ) -> tuple[Array, Passes]:
        """As `find_passes`, of unit directions way (3, M)."""
        origins = origin if origin.ndim == 2 else (self.linear * origin[:, None]).sum(1) + self.shift
        return find_passes(self.xp, self.solids, origin, origins, way, limit, tight, *more)

    def begun(self, passes: Passes, objects: Array, rays: Array) -> Array:
        """Where rays, by their numbers (P,), begin behind the maps of objects (P,)."""
        if passes.many:
            return self.behind(objects, self.xp.take(passes.origins, rays))
        return self.xp.take(passes.origins, objects)

    def opaque(self, reach: float) -> SolidField:
        """The field of what is opaque alone, with distances up to a reach around it.

        A later medium takes away what is opaque before it. In a group that is not of media alone, one that
        comes first is moved away.
        """
        vectors, tokens, brought = self.rows
        if self.media:
            medium = np.asarray(self.xp.to_numpy(self.looks))[-1] > 0.5
            vectors, tokens, tree = vectors.copy(), tokens.copy(), self.tree
            whole = [bool(medium[(tree.path == group).any(1)].all()) for group in range(len(tree.joins))]
            for row in np.flatnonzero(medium).tolist():
                groups = [whole[group] for group in tree.path[row].tolist() if group >= 0]
                begins = bool(tree.first[row])
                if sum(groups) > begins * groups[-1:].count(True):
                    continue  # in a group of media, which goes as one
                if (begins and not groups[-1]) or not row:
                    vectors[row, self.network.layout.places.frame][3::4] += AWAY
                elif tokens[row] & OPERATOR <= SMOOTH:
                    tokens[row] = tokens[row] & ~OPERATOR | SUBTRACT
                    vectors[row, self.network.layout.places.width] = 0.0
        result = SolidField(self.network, vectors, tokens, brought, None, reach)
        result.media = result.mixed = False  # nobody asks for kinds
        return result

    def hazy(self) -> SolidField:
        """The field of what is not opaque alone, where all is joined by plain unions; elsewhere itself."""
        vectors, tokens, brought = self.rows
        if not self.mixed or self.tree.deepest or (self.tree.tokens != UNION).any():
            return self
        medium = np.asarray(self.xp.to_numpy(self.looks))[-1] > 0.5
        kept = [brought[i] for i in np.flatnonzero(medium).tolist()] if brought else None
        return SolidField(self.network, vectors[medium], tokens[medium], kept)

    def meet(
        self,
        passes: Passes | SolidPairs,
        t: Array,
        wanted: Wanted,
        gradient: bool = False,
        change: bool = False,
        owners: bool = False,
        p: Array | None = None,
    ) -> Meeting:
        """Let points of rays, by their passes or pairs, meet the objects, t (M,) along each.

        Beside the distance ``wanted`` of the register is answered; with ``owners`` the register says nothing.
        ``p`` are the points themselves (3, M), where they are a little off the rays.
        """
        xp, count = self.xp, len(t)
        pairs = self.pairs(passes, t) if isinstance(passes, Passes) else passes
        steps, rays, objects, at, way, depth, far = pairs
        size = depth * count
        if p is None:
            at = at if way is None else way * xp.take(t, rays) + at
        else:
            at = self.behind(objects, xp.take(p, rays))
        q, own_points = self._local(at, objects)
        d, own = self._distances(q, own_points, objects, gradient, far)
        looks = self._worn_looks(q, objects) if wanted == Wanted.ALL and self.textures else None
        states = States(
            memory=xp.full(((1, 2, 1 + len(self.looks))[wanted], size), 0.0, t),
            slope=xp.full((3, size), 0.0, t) if gradient else None,
            bound=xp.full((size,), EMPTY, t) if change else None,
            owner=xp.full((size,), 0.0, t) if owners else None,
        )
        states.memory[0] = EMPTY
        stop = 0
        for index in steps:
            if isinstance(index, SolidClosing):
                self._close(states, index, wanted)
                continue
            start, stop = stop, stop + (count if index is None else len(index))
            pair = slice(start, stop)
            which, near, look = objects[pair], d[pair], self.looks
            if wanted:
                look = xp.take(look, which) if looks is None else looks[:, pair]
            slope = own[:, pair]
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
            self._join(states, index, Meeting(near, look, slope, None, number), which, wanted)
        parts = states.memory, states.slope, states.bound, states.owner
        first: list[Any] = [part if part is None else part[..., :count] for part in parts]
        memory, slope, bound, owner = first
        if bound is not None:
            bound = xp.minimum(bound, abs(memory[0]))
        return Meeting(memory[0], memory[1:], slope, bound, owner, len(rays))

    @cached_property
    def tables(self) -> Tables:
        """Flat tables for the kernel."""
        return Tables(self.network, *self.rows, self.paints, self.reach)

    def near(self, p: Array, reach: Array, gradient: bool = False, every: bool = False) -> Asked:
        """As `Kernel.field`, at points (3, M) anywhere: exact where D is less than a reach (M,)."""
        at, far = (np.asarray(self.xp.to_numpy(part)) for part in (p, reach))
        *answers, met = load_kernel().field(self.tables, at, far, gradient, every)
        d, slope, register, owner = (self.xp.array(part, p) for part in answers)
        return Asked(d, slope, register, owner, met)

    def pairs(self, passes: Passes, t: Array) -> SolidPairs:
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
        steps: Steps = [*places]
        depth = 1
        if most > 1 and self.stacks is not None:
            steps, depth = self.stacks.followed(places, rays, objects, every)
        return SolidPairs(steps, rays, objects, self.begun(passes, objects, rays), pairs[WAY], depth)

    def _close(self, states: States, closing: SolidClosing, wanted: Wanted) -> None:
        """Let groups end: what they come to goes into the states that they stand in, and theirs are empty."""
        xp, (inner, index, which) = self.xp, closing
        parts = states.memory, states.slope, states.bound, states.owner
        ended: list[Any] = [part if part is None else xp.take(part, inner) for part in parts]
        memory, *others = ended
        d = memory[0].clip(-EMPTY, NOTHING)
        xp.put(states.memory[:1], inner, 0 * memory[:1] + EMPTY)
        if states.bound is not None:
            xp.put(states.bound, inner, 0 * d + EMPTY)
        self._join(states, index, Meeting(d, memory[1:], *others), which, wanted)

    def _join(
        self, states: States, index: Array | None, operand: Meeting, which: Array, wanted: Wanted
    ) -> None:
        """Let states at an index take in operands by the cells of rows, or groups, `which`."""
        xp, cell = self.xp, self.cells[wanted]
        near, look = operand.distance, operand.register
        if not self.alike:
            cell = SolidCell(*(xp.take(weights, which) for weights in cell))
        before = _part(xp, states.memory, index)
        if states.owner is not None:  # behind a register of 0, a look of 1 shows where its gate is open
            before, look = xp.concat([before[:1], 0 * before[1:]], 0), 0 * look + 1
        after, take = self.network.join(near, before, look, cell, wanted, self.switched)
        if states.owner is not None:
            held = xp.select(after[-1] > 0.5, operand.owner, _part(xp, states.owner, index))
            states.owner = _update(xp, states.owner, index, held)
        if states.bound is not None:
            # distances (k,) within which operands leave the kind of material as it is
            gap = abs(near)
            if self.smooth is not None:
                blend = xp.minimum(gap, abs(before[0] - near) / 2)
                gap = xp.select(xp.take(self.smooth, which), blend, gap)
            # those of the kind that is there change nothing of it
            gap = xp.select(abs(before[1] - look[-1]) > 0.5, gap, 0 * gap + EMPTY)
            gap = xp.minimum(_part(xp, states.bound, index), gap)
            if operand.change is not None:
                gap = xp.minimum(gap, operand.change)
            states.bound = _update(xp, states.bound, index, gap)
        if states.slope is not None:
            by_own, by_past = self.network.partials(near, before[0], take, cell)
            past = _part(xp, states.slope, index)
            states.slope = _update(xp, states.slope, index, by_own * operand.gradient + by_past * past)
        states.memory = _update(xp, states.memory, index, after)

    def inside(self, passes: Passes, t: Array) -> Array:
        """A mask of balls (K, M) around the points at t (M,), of objects that change something there."""
        inside = (passes.slots[BEGIN] <= t) & (t <= passes.slots[END])
        if not self.draws:  # the others change only what is there
            touched = t < t
            for slot in reversed(range(len(inside))):
                inside[slot] &= touched | (passes.slots[OBJECT, slot] >= 0)
                touched = touched | inside[slot]
        return inside

    def colours(self, passes: Passes, t: Array, p: Array) -> Array:
        """Colours (3, M) at points p in objects, as `meet` answers, sooner where it is one object alone."""
        xp, inside = self.xp, self.inside(passes, t)
        alone = inside.sum(0) == 1
        one, several = xp.where(alone), xp.where(~alone)
        result = xp.full((3, len(t)), 0.0, t)
        if len(several):
            there = passes.at(xp, several), xp.take(t, several), Wanted.ALL
            xp.put(result, several, self.meet(*there, p=xp.take(p, several)).register[:3])
        if len(one):
            objects = xp.whole(xp.take((passes.slots[OBJECT] * inside).sum(0), one))
            xp.put(result, one, self.worn(objects, xp.take(p, one)))
        return result

    def textured(self, passes: Passes) -> Array:
        """Texels (M,) that rays may cross in a world unit, 0 where they pass no object with a texture."""
        slots, xp = passes.slots, self.xp
        objects = xp.whole(slots[OBJECT].clip(0))
        detail = xp.take(self.detail, objects.reshape(-1)).reshape(objects.shape)
        return (detail * (slots[OBJECT] >= 0) * (slots[BEGIN] < INF)).sum(0)


def _displaced(
    xp: Arrays, q: Array, d: Array, g: Array, bulge: tuple[Any, Any], share: Any
) -> tuple[Array, Array]:
    """Distances (P,), and gradients (3, P) or none, with so much of a displacement."""
    f, amount = bulge[0], bulge[1] * share
    s = xp.sin(f * q)
    d = d + amount * (s[0] * s[1] * s[2])
    if len(g):
        c = xp.cos(f * q)
        more = xp.stack([c[0] * s[1] * s[2], s[0] * c[1] * s[2], s[0] * s[1] * c[2]], 0)
        g = g + (amount * f) * more
    return d, g


def _part(xp: Arrays, whole: Array, index: Array | None) -> Array:
    """Entries (…, k) of an array (…, M), or all."""
    return whole if index is None else xp.take(whole, index)


def _update(xp: Arrays, whole: Array, index: Array | None, values: Array) -> Array:
    """An array (…, M) with new values (…, k) at some places, or at every one."""
    if index is None:
        return values
    xp.put(whole, index, values)
    return whole
