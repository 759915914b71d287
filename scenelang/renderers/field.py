"""The framed renderer's field: what it answers at points, whoever asks and by whichever library.

Letters are those of `network.py`. Each object's frame (`frames.py`) carries points into its own space, where
the network meets them. All pairs of an object and a point are carried and decoded together, however many
objects they are of; then the cell takes a point's objects in one by one. Nothing here knows a pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenelang.elements.element import Element
from scenelang.program.paints import Paint
from scenelang.program.program import ProgramError
from scenelang.renderers.arrays import Array
from scenelang.renderers.bounds import Interval, Shown, shown
from scenelang.renderers.frames import FAR, Frames
from scenelang.renderers.grid import GridShape, grid_shape
from scenelang.renderers.meetings import Meetings
from scenelang.renderers.network import EMPTY, RADIUS, Cell, Decoder, FramedNetwork
from scenelang.renderers.slopes import Floats, Slopes
from scenelang.renderers.texture import Texture

UNION, SMOOTH, SUBTRACT, INTERSECT = range(4)
SLACK = 0.02  # leaf units by which a learned outline may leave the unit disc
BLEND = 0.15  # world units: the width of the blends that the cell is trained on
FARTHER = 1.3  # widths of a blend at which objects cannot change where its outline lies
FARTHEST = 3.0  # widths at which they cannot by any number of blends, but for 10⁻⁶ world units
CHUNK = 4096  # points that go through a decoder at once: fewer cost calls, more cost caches
ROUNDING = 1e-4, 2e-6  # leaf units, and share of a distance and world units, by which float32 may be off
NO_TEXTURE = -1
_UNKNOWN = 1e9  # world units: how far off a distance may be of which nothing is proved


@dataclass(frozen=True, slots=True)
class Trace:
    """What P pairs did to points.

    Args:
        paint: (groups, P) how far the object's colour came in.
        margin: (groups, P) by how much what was there before is nearer than the object, world units.
    """

    paint: Array
    margin: Array

    def shares(self, meetings: Meetings, seen: Array) -> Array:
        """How much of each object's colour (groups, P) is left when all are met, 0 at points not seen."""
        left, found = 1.0 * seen, 0.0 * self.paint
        for part in reversed(meetings.slots()):
            rest, paint = left[:, : part.stop - part.start], self.paint[:, part]
            found[:, part] = rest * paint
            rest *= 1.0 - paint
        return found


class Field:
    """A program's objects with their weights, ready to be met by points.

    Args:
        network: trained parameters, on any device.
        vectors: (N, 64) float32, geometry and material vectors.
        brought: what users brought, None where a row shows a geometry of the model; all of them if left out.
        paints: likewise, None where a row has the colour of its vector.

    Attributes:
        frames: of the objects.
        reach: (N,) leaf units from an object's origin beyond which it changes nothing; inf where it concerns
            every point.
        draws: (N,) whether something may be seen, where it is met, of what was empty before.

    Raises:
        ProgramError: an object's vector holds no way from the world to a leaf, or an element cannot be drawn.
    """

    def __init__(
        self,
        network: FramedNetwork,
        vectors: np.ndarray,
        tokens: np.ndarray,
        brought: Sequence[Element | None] | None = None,
        paints: Sequence[Paint | None] | None = None,
    ) -> None:
        self.network, self.xp, self.like = network, network.xp, network.codes
        self.vectors, self.tokens = vectors, np.asarray(tokens, np.intp)
        self.brought, self.paints = brought or [None] * len(vectors), paints or [None] * len(vectors)
        self.layout = layout = network.layout
        self.frames = Frames(vectors[:, : layout.geometry], layout)
        self.draws = self.tokens <= SMOOTH
        with self.xp.inference():
            self.slope = float(self.xp.exp(network.read_slope)) / 4
            self.unit = float(np.linalg.norm(self.xp.to_numpy(network.cell_weights()[2][UNION, 0])))
            """Growth of the state per world unit."""
            self._shapes()
            self._cells()
            self._colours()

    def _shapes(self) -> None:
        """Decoders of the leaves in use, grids of elements, and which object has which."""
        xp, network = self.xp, self.network
        every = np.ascontiguousarray(self.vectors[:, : self.layout.code])
        found, self.shape = _numbered(every.view(f"V{every[:1].nbytes}").ravel().tolist())
        codes = np.array([np.frombuffer(code, np.float32) for code in found], np.float32)
        self.codes = codes = codes.reshape(len(found), self.layout.code)
        """Of the leaves in use (K, C): decoders are computed together."""
        self.shapes: list[Decoder | GridShape] = [*network.decoders(xp.array(codes, self.like))]
        self.slopes: list[Slopes | None] = [network.slopes.get(code.tobytes()) for code in codes]
        for element in dict.fromkeys(element for element in self.brought if element is not None):
            if network.config.features != 1:
                raise ProgramError("elements for a network that knows more than distances")
            self.shape[[held == element for held in self.brought]] = len(self.shapes)
            self.shapes.append(grid_shape(element, xp, self.like))
            self.slopes.append(self.shapes[-1].slopes())  # type: ignore[union-attr]

    def _cells(self) -> None:
        """Cells by token and width of the blend; behind them the same with gates that are open."""
        xp, layout = self.xp, self.layout
        widths = self.vectors[:, layout.blend].astype(np.float64)
        self.widths = widths = np.where((widths > 0) & (self.tokens == SMOOTH), widths, BLEND)
        """Of the blends by which objects join (N,), world units."""
        # of the smooth unions from each row on the widest, and the sum; 0 for none
        blends = np.where(self.tokens == SMOOTH, widths, 0.0)[::-1]
        after, total = np.maximum.accumulate(blends)[::-1], np.cumsum(blends)[::-1]
        self.widest = max([BLEND, *after[:1].tolist()])
        every = (self.tokens == INTERSECT) | ((self.tokens == SUBTRACT) & (after > 0))
        beyond = np.minimum(FARTHER * total, FARTHEST * after) / self.frames.scale
        self.reach = np.where(every, np.inf, 1.0 + SLACK + beyond)
        kinds, self._cell = _numbered(list(zip(self.tokens.tolist(), widths.tolist(), strict=True)))
        tokens = [token for token, _ in kinds]
        lines, bias, candidate, bump = (
            np.asarray(xp.to_numpy(part))[tokens].T for part in self.network.cell_weights()
        )
        lines, candidate = lines.swapaxes(0, 1), candidate.swapaxes(0, 1)
        # The fold of s d and s D is s D', so that the cell's own width is that of any other.
        scale = np.array([BLEND / width for _, width in kinds], np.float32)
        table = Cell(lines * scale, bias, candidate, bump[0] / scale)
        opened = Cell(0 * lines, 0 * bias + 1, candidate, 0 * bump[0])
        host = [np.concatenate(pair, -1).astype(np.float32) for pair in zip(table, opened, strict=True)]
        self._opened = len(kinds)
        self._table = Cell(*(xp.array(part, self.like) for part in host))
        self._host = Cell(*host)

    def _colours(self) -> None:
        xp, m = self.xp, self.vectors[:, self.layout.geometry :]
        albedo = self.network.object_albedo(xp.array(m[:, self.layout.material_code].copy(), self.like))
        albedo = xp.concat([albedo, xp.full((len(m), 1), 1.0, self.like)], 1)
        matrix = xp.array(m[:, self.layout.colour].reshape(-1, 3, 4).copy(), self.like)
        self.colours = xp.packed((matrix @ albedo[:, :, None])[:, :, 0].clip(0.0, 1.0).T)
        """Of the objects (3, N); 0 where a texture is worn."""
        self.textures: list[Texture] = []
        self.texture = np.full(len(m), NO_TEXTURE)
        """Which of the textures an object wears (N,)."""
        known: dict[tuple[Paint, bytes], int] = {}
        for i, paint in enumerate(self.paints):
            if paint is None or not self.draws[i]:  # the others leave colours as they are
                continue
            self.texture[i] = known.setdefault((paint, m[i, :6].tobytes()), len(known))
            if len(known) > len(self.textures):
                self.textures.append(Texture(xp, paint, m[i, :6], self.like, light=False))
            self.colours[:, i] = 0.0

    @property
    def provable(self) -> bool:
        """Whether the network is of the kind that `shown` folds intervals of."""
        return self.network.config.state == self.network.config.features == 1

    @property
    def blended(self) -> bool:
        """Whether some object joins by a blend."""
        return bool((self.tokens == SMOOTH).any())

    @property
    def textured(self) -> bool:
        """Whether some object wears a texture."""
        return bool(self.textures)

    @property
    def nothing(self) -> float:
        """The state of points that have met nothing."""
        return float(EMPTY * self.widest / BLEND)

    def cells(self, objects: np.ndarray) -> Cell:
        """Cells of objects, which come last, on the host."""
        return Cell(*(part.take(self._cell[objects], -1) for part in self._host))

    def empty(self, groups: int, count: int, register: int = 3) -> Array:
        """State and register (groups, S + R, count) of points that have met nothing."""
        memory = self.xp.full((groups, self.network.config.state + register, count), 0.0, self.like)
        memory[:, 0] = self.nothing
        return memory

    def features(self, objects: np.ndarray, q: Array, far: np.ndarray) -> Array:
        """Features (groups, F, P) in world units of objects (P,) at leaf coordinates (2, groups, P).

        Args:
            far: (P,) whether points of a column may lie beyond `RADIUS`.
        """
        xp, shape = self.xp, self.shape[objects]
        used = np.flatnonzero(np.bincount(shape)).tolist()
        groups = q.shape[1]
        found = None
        for at in used:
            index = None if len(used) == 1 else np.flatnonzero(shape == at)
            part = q if index is None else xp.take(q, xp.array(index, q))
            rim = far.any() if index is None else far[index].any()
            one = self._decoded(self.shapes[at], part.reshape(2, -1), bool(rim)).reshape(
                -1, groups, part.shape[2]
            )
            if index is None:
                found = one
                break
            if found is None:
                found = xp.full((one.shape[0], groups, len(objects)), 0.0, q)
            for feature, values in zip(found, one, strict=True):
                xp.put(feature, xp.array(index, q), values)
        assert found is not None
        scale = xp.array(self.frames.scale[objects].astype(np.float32), q)
        found = found.swapaxes(0, 1) * scale
        return found.clip(-FAR, FAR) if self.frames.wild[objects].any() else found

    def _decoded(self, shape: Decoder | GridShape, q: Array, far: bool) -> Array:
        """Features (F, M) in leaf units."""
        if not isinstance(shape, Decoder):
            return shape.distance(q)[None]
        parts = []
        for start in range(0, q.shape[1], CHUNK):
            part = q[:, start : start + CHUNK]
            radius = self.xp.length(list(part)) if far else None
            parts.append(self.network.decode(part, radius, 1.0, shape))
        return parts[0] if len(parts) == 1 else self.xp.concat(parts, 1)

    def fold(self, meetings: Meetings, features: Array, trace: Trace | None = None) -> Array:
        """State and register (groups, S + 3, B) of columns that have met their objects.

        Args:
            features: of the pairs (groups, F, P).
            trace: where to write down what each object did.
        """
        xp, s = self.xp, self.network.config.state
        pairs = meetings.pairs
        memory = self.empty(features.shape[0], len(meetings.columns), 3 if trace is None else 4)
        kind = xp.array(self._cell[pairs.object] + self._opened * pairs.open, self.like)
        lines, bias, candidate, bump = (xp.take(part, kind) for part in self._table)
        colours = xp.take(self.colours, xp.array(pairs.object, self.like))
        if trace is not None:  # a colour of 1 over a register of 0 shows the gate
            colours = xp.concat([colours, 0.0 * colours[:1] + 1.0], 0)
        for part in meetings.slots():
            d, old = features[..., part], memory[..., : part.stop - part.start]
            levels, wanted = bias[:, part], 0.0
            for i in range(d.shape[1]):
                levels = levels + d[:, i : i + 1] * lines[:, i, part]
                wanted = wanted + d[:, i : i + 1] * candidate[:, i, part]
            for i in range(s):
                levels = levels + old[:, i : i + 1] * lines[:, d.shape[1] + i, part]
            if trace is not None:
                trace.margin[:, part] = old[:, 0] / self.unit - d[:, 0]
                old[:, s + 3] = 0.0
            new = self.network.update(levels, wanted, bump[:, part], old[:, :s], old[:, s:], colours[:, part])
            old[:, :s], old[:, s:] = new
            if trace is not None:
                trace.paint[:, part] = old[:, s + 3]
        return memory[:, : s + 3]

    def trace(self, groups: int, pairs: int) -> Trace:
        """Room for a trace."""
        return Trace(*(self.xp.full((groups, pairs), 0.0, self.like) for _ in range(2)))

    def picture(self, memory: Array) -> Array:
        """Premultiplied colour and coverage (groups, 4, B), in [0, 1], of points that met all objects."""
        coverage = (0.5 - memory[:, :1] * self.slope).clip(0.0, 1.0)
        return self.xp.concat([memory[:, self.network.config.state :] * coverage, coverage], 1)

    def middles(self, objects: np.ndarray, q: Floats) -> np.ndarray:
        """World distances (P,) at leaf coordinates (2, P)."""
        seen = np.nan_to_num(q).clip(-FAR, FAR)
        far = np.full(len(objects), bool((np.hypot(*seen) > RADIUS).any()))
        points = self.xp.array(seen.astype(np.float32)[:, None], self.like)
        found: np.ndarray = self.xp.to_numpy(self.features(objects, points, far))[0, 0]
        return found

    def rise(self, objects: np.ndarray, q: Floats, radius: Floats) -> np.ndarray:
        """By how much world distances (P,) at leaf coordinates differ at most from those in radii (P,)."""
        found, shape = np.full(len(objects), np.inf), self.shape[objects]
        for at, slopes in enumerate(self.slopes):
            here = np.flatnonzero(shape == at)
            if slopes is not None and len(here):
                found[here] = slopes.rise(q.take(here, -1), radius[here])
        most = np.fmin((found + ROUNDING[0]) * self.frames.scale[objects], _UNKNOWN)
        return np.asarray(most, np.float32)

    def proved(self, meetings: Meetings, middle: np.ndarray, rise: np.ndarray) -> Shown:
        """What blocks are proved to show, whose pairs' distances lie within ``rise`` of ``middle``."""
        objects = meetings.pairs.object
        rise = rise + np.float32(ROUNDING[1]) * (1 + abs(middle))
        distance = Interval(middle - rise, middle + rise)
        cell = self.cells(objects)
        dark = np.asarray(self.xp.to_numpy(self.colours)).take(objects, -1)
        colours = Interval(dark, np.where(self.texture[objects] == NO_TEXTURE, dark, 1.0))
        with np.errstate(all="ignore"):
            return shown(meetings, distance, cell, colours, self.nothing, self.slope)


def _numbered(things: list[Any]) -> tuple[list[Any], np.ndarray]:
    """The different ones, in the order in which they come, and which of these each is."""
    numbers: dict[Any, int] = {}
    index = [numbers.setdefault(thing, len(numbers)) for thing in things]
    return list(numbers), np.array(index, np.intp)
