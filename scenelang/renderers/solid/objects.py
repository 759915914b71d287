"""What objects of solids are at points, each alone: distances, gradients and colours in their own spaces."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from scenelang.elements.element import Element
from scenelang.lifting.vector import Parts
from scenelang.program.groups import OPERATOR, SMOOTH, SUBTRACT, UNION, Floats, read_groups, widths_of
from scenelang.program.paints import Paint
from scenelang.renderers.arrays import Array, Smooth
from scenelang.renderers.grid import GridShape, grid_shape
from scenelang.renderers.solid.boxes import element_box
from scenelang.renderers.solid.frames import SolidFrame
from scenelang.renderers.solid.network import BLEND, RADIUS, Cell, SolidNetwork, Wanted
from scenelang.renderers.solid.passes import SLACK, read_solids
from scenelang.renderers.texture import Texture

TAGS = np.array([[0.618034], [0.754878], [0.569840]])  # parts of whole numbers times these lie apart


class Objects:
    """A program's objects with their weights: their distances and colours, each alone.

    Args:
        network: trained parameters, on any device.
        vectors: (N, 64) float32, geometry and material vectors.
        tokens: (N,) as of a Program.
        brought: what users brought, None where a row shows a geometry of the model; all of them if left out.
        paints: likewise, None where a row has the colour of its vector.

    Raises:
        ProgramError: an object's vector holds no way from the world to a leaf, or an element is damaged.
    """

    def __init__(
        self,
        network: SolidNetwork,
        vectors: np.ndarray,
        tokens: np.ndarray,
        brought: Sequence[Element | None] | None = None,
        paints: Sequence[Paint | None] | None = None,
    ) -> None:
        self.network, self.xp, self.tree = network, network.xp, read_groups(tokens)
        none = [None] * len(vectors)
        parts = network.layout.unpack(vectors)
        widths = widths_of(np.asarray(tokens, np.intp) & OPERATOR, parts.width)
        with self.xp.inference():
            self.solids = read_solids(network, vectors, self.tree, widths)
            self._tables(parts)
            self._cells(widths)
            self._textures(parts.texture, paints or none)
            self._decoders(parts.code, brought or none)
            self._alone()
        kinds = self.xp.to_numpy(self.looks)[-1] > 0.5
        self.draws = all(solid.draws for solid in self.solids)
        """Whether all objects draw."""
        self.adding = self._adding()
        self.media = bool(kinds.any())
        """Whether some object is a medium."""
        self.mixed = self.media and not kinds.all()
        """Whether not all are."""
        self.coloured = self.media and np.ptp(self.xp.to_numpy(self.looks)[-4:-1, kinds], 1).max() > 0
        """Whether media have different colours."""

    def _adding(self) -> Array | None:
        """Which objects (N,) of groups do not draw but take nothing away, 1 or 0; None without groups."""
        groups = self.tree
        if not groups.deepest:
            return None
        there, drawn = groups.path >= 0, np.array([solid.draws for solid in self.solids])
        cuts = (there & (groups.joins[groups.path] == SUBTRACT)).sum(1) + (groups.tokens == SUBTRACT)
        adding = there.any(1) & ~drawn & (cuts % 2 == 0)
        return self.xp.array(adding.astype(np.float32), self.network.codes)

    def _tables(self, parts: Parts) -> None:
        """What pairs of points and objects look up: arrays (…, N)."""
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
        look = network.look(xp.array(parts.material.copy(), network.codes)).T
        colour = table(parts.rgb.T, 3) * look[:3]
        self.looks = xp.concat([colour.clip(0.0, 1.0), look[3:]], 0)
        """Of each object colour and medium (R, N); where some have textures, a plain colour between these."""

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
            Cell(*(xp.concat(list(part), 1) for part in zip(*each, strict=True)))
            for each in zip(*cells, strict=True)
        ]

    def _textures(self, frames: np.ndarray, paints: Sequence[Paint | None]) -> None:
        """What objects wear in place of a colour.

        In place of a texture's colours theirs is a plain one, unlike any other's, that tells where one
        object ends and how the light falls.
        """
        xp, like = self.xp, self.network.codes
        worn = {
            i: Texture(xp, paint, frames[i], like, light=True)
            for i, paint in enumerate(paints)
            if paint is not None and self.solids[i].draws  # the others leave colours as they are
        }
        self.textures = list(worn.items())
        """Those that draw, with their numbers."""
        detail = [worn[i].detail / s.frame.scale if i in worn else 0.0 for i, s in enumerate(self.solids)]
        self.detail = xp.array(np.array(detail, np.float32), like)
        """Texels that a way of a world unit may cross; 0 without a texture."""
        if worn:
            tags = (0.4 + 0.6 * (TAGS * (np.arange(len(paints)) + 1) % 1.0)).astype(np.float32)
            plain = xp.select(self.detail > 0, xp.array(tags, like), self.looks[:3])
            self.looks = xp.concat([self.looks[:3], plain, self.looks[3:]], 0)

    def _decoders(self, codes: np.ndarray, brought: Sequence[Element | None]) -> None:
        """What tells distances, and which of them is each object's."""
        xp, network = self.xp, self.network
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
        self.decoders: list[Smooth | GridShape] = [
            *map(network.decoder, learned),
            *(grid_shape(key, xp, network.codes) for key in ordered if isinstance(key, Element)),
        ]
        self.decoder = xp.array(np.array([number[key] for key in keys], np.float32), network.codes)
        boxes = [
            element_box(key) if isinstance(key, Element) else network.box(decoder)  # type: ignore[arg-type]
            for key, decoder in zip(ordered, self.decoders, strict=True)
        ]
        self.solids = [
            solid.within(xp, boxes[number[key]], network.codes)
            for key, solid in zip(keys, self.solids, strict=True)
        ]
        plain = [
            element is None and s.draws and s.radius <= 1 + SLACK and not s.frame.steps
            for element, s in zip(brought, self.solids, strict=True)
        ]
        self.asked = xp.array(np.array(plain, np.float32), network.codes) * (self.looks[-1] > 0.5)
        """1 where `segments.py` may answer."""
        self.answered = bool(self.asked.sum() > 0)
        """Whether that is so of any."""
        known = len(network.segment_w) and self.answered
        self.segments = [network.segment(code) for code in learned] if known else []

    def _alone(self) -> None:
        """What holds where an object is the first that is met, or the only one."""
        xp, like, solids = self.xp, self.network.codes, self.solids
        reach = np.array([2 * s.radius * s.frame.scale for s in solids], np.float32)
        cell = Cell(*(weights[:, : len(solids)] for weights in self.cells[Wanted.ALL]))
        self.first = self.network.alone(xp.array(reach, like), cell)
        """What distances (N,) of objects that are met first are multiplied with; 0: the cell has to say."""
        drawn = xp.array(np.array([s.draws for s in solids], np.float32), like)
        self.open = bool(((self.first > 0) | (drawn == 0)).all())
        """Whether that is so of no object that draws."""
        self.factor = self.first * self.scale
        """World units for a leaf unit of objects that are met alone."""
        self.special = [
            i
            for i, s in enumerate(solids)
            if s.draws and (s.radius > RADIUS or s.frame.steps or s.frame.amount)
        ]
        """Objects to which more than a map leads, or that are displaced."""
        self.groups = len(self.decoders) + len(self.special)
        """Of objects that are met alone: those of each decoder, and each special one."""
        group = 1 * self.decoder
        for at, i in enumerate(self.special):
            group[i] = len(self.decoders) + at
        self.group = xp.select((self.first > 0) & (drawn > 0), group, 0 * group - 1)
        """Of each object that draws its group, else -1."""

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
        gradient = self._distances(*self._local(self._behind(objects, p), objects), objects, True)[1]
        assert gradient is not None
        return gradient

    def _behind(self, objects: Array, p: Array) -> Array:
        """World points (3, P) behind the objects' maps."""
        xp = self.xp
        return (xp.take(self.linear, objects) * p).sum(1) + xp.take(self.shift, objects)

    def _looks(self, q: Array, objects: Array) -> Array:
        """Registers (R, P) of objects with their textures' colours at leaf coordinates (3, P)."""
        xp = self.xp
        looks = xp.take(self.looks, objects)
        for i, texture in self.textures:
            index = xp.where(objects == i)
            if len(index):
                xp.put(looks[:3], index, texture.at(xp.take(q, index)))
        return looks

    def _local(self, at: Array, objects: Array) -> tuple[Array, list[tuple[SolidFrame, Array, Array]]]:
        """Leaf coordinates (3, P) of points (3, P) behind the objects' maps.

        Of objects with more than a map, their frames, indices and points too.
        """
        xp, q = self.xp, at
        own = []
        for i, frame in self.turned:
            index = xp.where(objects == i)
            if len(index):
                own.append((frame, index, xp.take(at, index)))
        if own:
            q = 1 * at
            for frame, index, p in own:
                xp.put(q, index, frame.local(xp, p))
        return q, own

    def _distances(
        self, q: Array, own: list[tuple[SolidFrame, Array, Array]], objects: Array, gradient: bool
    ) -> tuple[Array, Array | None]:
        """World distances (P,) at leaf coordinates, as `_local` has them; gradients (3, P) if asked."""
        xp = self.xp
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

    def decoded(self, at: Array, bounds: Sequence[int]) -> Array:
        """Leaf distances (P,) at points (3, P) behind objects' maps, group by group, with bounds between."""
        ask = [*(partial(self._field, decoder=decoder, gradient=False) for decoder in self.decoders)]
        ask += [partial(self._special, i) for i in self.special]
        pieces = zip(ask, pairwise(bounds), strict=True)
        parts = [told(at[:, a:b])[0] for told, (a, b) in pieces if a < b]
        return parts[0] if len(parts) == 1 else self.xp.concat(parts, 0)

    def _special(self, i: int, at: Array) -> Array:
        """Leaf distances (1, P) of an object at points (3, P) behind its map."""
        xp, frame = self.xp, self.solids[i].frame
        q = frame.local(xp, at)
        place, beyond = q, 0.0
        if self.solids[i].radius > RADIUS:
            length = xp.sqrt((q * q).sum(0))
            place, beyond = q * (RADIUS / length.clip(RADIUS)), (length - RADIUS).clip(0.0)
        d = self._field(place, self.decoders[int(self.decoder[i])], False) + beyond
        if not frame.amount:
            return d
        s = xp.sin(frame.frequency * q)
        return d + frame.amount * (s[0] * s[1] * s[2])

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

    def _field(self, q: Array, decoder: Smooth | GridShape, gradient: bool) -> Array:
        if isinstance(decoder, GridShape):
            return decoder.field(q, gradient)
        return self.network.field(q, decoder, gradient)
