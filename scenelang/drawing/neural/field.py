"""The framed renderer's field: what it answers at points, whoever asks and by whichever library.

Letters are those of `network.py`. Each object's frame (`frames.py`) carries points into its own space, where
the network meets them. All pairs of an object and a point are carried and decoded together, however many
objects they are of; then the cell takes a point's objects in one by one. Nothing here knows a pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from scenelang.assets.element import Element
from scenelang.compiler.groups import OPERATOR, SMOOTH, UNION, anchored, felt, read_groups, widths_of
from scenelang.compiler.program import Paint, ProgramError
from scenelang.drawing.arrays import Array, Arrays
from scenelang.drawing.neural.assets import GridShape, Texture, grid_shape, texture_of
from scenelang.drawing.neural.frames import FAR, Floats, Frames, read_skins
from scenelang.drawing.neural.meetings import Interval, Meetings, NestedSlot, Nesting, Shown, nesting, shown
from scenelang.drawing.neural.network import EMPTY, RADIUS, Cell, Decoder, FramedNetwork
from scenelang.drawing.neural.outlines import OutlineShapes, true_slopes

SLACK = 0.02  # leaf units by which a learned outline may leave the unit disc
BLEND = 0.15  # world units: the width of the blends that the cell is trained on
FARTHER = 1.3  # widths of a blend at which objects cannot change where its outline lies
FARTHEST = 3.0  # widths at which they cannot by any number of blends, but for 10⁻⁶ world units
CHUNK = 4096  # points that go through a decoder at once: fewer cost calls, more cost caches
ROUNDING = 1e-4, 2e-6  # leaf units, and share of a distance and world units, by which float32 may be off
NO_TEXTURE = -1
CORNERS = {4: 0.36, 16: 0.54}  # pixels from the centre to the farthest of samples, a little rounded up
NEAR = 0.85  # pixels: farther from an outline a pixel has one colour
ROUNDED = 3  # from the index of a cut to that of the same cut with a rounded edge, see `rounded`
_UNKNOWN = 1e9  # world units: how far off a distance may be of which nothing is proved


class Met(NamedTuple):
    """A turn and what came of it at points, (groups, n) each."""

    turn: NestedSlot
    rows: np.ndarray  # (n,) numbers of the objects, behind these of the groups
    distance: Array  # world units
    paint: Array  # how far the colour came in
    margin: Array  # by how much what was there before is nearer, world units
    through: Array | None  # how much is seen through it, None where nothing is


class Trace(list[Met]):
    """Effects of the turns of pairs on points."""

    def none(self) -> Array:
        """A mask of columns (groups, B), all False."""
        return 0.0 * self[0].paint > 0  # in the first turn all columns meet an object

    def shares(self, xp: Arrays, nest: Nesting, seen: Array, pairs: int) -> Array:
        """Share of each object's colour (groups, P) that is left when all are met, 0 at points not seen."""
        result, seen = xp.full((len(seen), pairs), 0.0, self[0].paint), 1.0 * seen
        left = xp.concat([seen, xp.full((len(seen), nest.states - seen.shape[1]), 0.0, seen)], 1)
        for turn, *_, paint, _, through in reversed(self):
            rest = left[:, turn.at]
            into, at = (result, turn.which) if turn.ending is None else (left, turn.ending)
            into[:, at], left[:, turn.at] = rest * paint, rest * _left(paint, through)
        return result


def _left(paint: Array, through: Array | None) -> Array:
    """Share of what was before that is left behind an object that came in by ``paint``."""
    return 1.0 - paint if through is None else 1.0 - paint * (1.0 - through)


class Field:
    """A program's objects with their weights, ready to be met by points.

    Of rows of vectors (N, 64), ``brought`` has what users brought, None where it is a geometry of the model,
    and ``paints`` textures, None where it is the colour of its vector. ``reach`` (N,) is in leaf units from
    an object's origin, beyond which it changes nothing, inf where it concerns every point; ``draws`` (N,)
    says whether it may be seen where nothing was before, and ``opacity`` (N,) how much it hides. Registers
    hold colours, and if some objects are ``clear`` premultiplied ones, with their coverage. Raises
    `ProgramError` where a vector holds no way to a leaf, or an element cannot be drawn.
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
        self.vectors, self.groups = vectors, read_groups(tokens)
        self.tokens = self.groups.tokens
        self._raw = np.asarray(tokens, np.intp) & OPERATOR
        self.brought, self.paints = brought or [None] * len(vectors), paints or [None] * len(vectors)
        self.layout = layout = network.layout
        self.parts = layout.unpack(vectors)
        self.frames = Frames(vectors[:, : layout.geometry], layout)
        cuts = np.append(self.groups.joins > SMOOTH, False)  # of no group, too
        self.draws = (self.tokens <= SMOOTH) & ~cuts[self.groups.path].any(1)
        self.skins = read_skins(self.parts)
        self.skinned = np.zeros(len(vectors), bool) if self.skins is None else np.any(self.skins[:3], axis=0)
        self.opacity = np.where(self.draws, 1.0 - self.parts.clear, 1.0).clip(0.0, 1.0).astype(np.float32)
        self.clear = bool((self.opacity < 1.0).any())
        self.register = 4 if self.clear else 3
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
        every = np.ascontiguousarray(self.parts.code)
        result, self.shape = _numbered(every.view(f"V{every[:1].nbytes}").ravel().tolist())
        codes = np.array([np.frombuffer(code, np.float32) for code in result], np.float32)
        self.codes = codes = codes.reshape(len(result), every.shape[1])
        """Codes of the leaves in use (K, C), whose decoders are computed together."""
        learned = network.decoders(xp.array(codes, self.like))
        self.shapes: list[Any] = [*learned]
        """Decoders, grids and outlines."""
        self.slopes: list[Any] = [None if isinstance(shape, Decoder) else shape for shape in learned]
        """Bounds for each on how far distances differ within a radius, None where nothing is known."""
        more = () if self.skins is None else np.flatnonzero(self.skins.reach > 0).tolist()
        grown = {self.brought[i] for i in more}
        elements = dict.fromkeys(element for element in self.brought if element is not None)
        if elements and network.config.features != 1:
            raise ProgramError("elements for a network that knows more than distances")
        outlines = {element: at for at, element in enumerate(e for e in elements if e.form == "outline")}
        self.outline = np.array([outlines.get(held, -1) for held in self.brought], np.intp)  # type: ignore[arg-type]
        """Numbers of outlines among all that are drawn together (N,), -1 for other shapes."""
        for element in elements:
            if element not in outlines:
                self.shape[[held == element for held in self.brought]] = len(self.shapes)
                self.shapes.append(grid_shape(element, xp, self.like, element in grown))
                self.slopes.append(self.shapes[-1].slopes())
        if outlines:
            self.shape[self.outline >= 0] = len(self.shapes)
            self.shapes.append(OutlineShapes(xp, [*outlines], self.like))
            self.slopes.append(true_slopes())

    def _cells(self) -> None:
        """Cells by operator and width of the blend; behind them the same with gates that are open."""
        xp, groups = self.xp, self.groups
        widths = widths_of(self._raw, self.parts.width.astype(np.float64))
        self.group_widths = widths[groups.rows]  # Widths of the blends by which groups join (G,), 0 for none
        # operators of objects and, behind them, of groups (N + G,), widths of their blends, world units, and
        # stretches
        self.operators = np.concatenate([self.tokens, groups.joins])
        self.widths = np.append(np.where(self.tokens == SMOOTH, widths, BLEND), self.group_widths)
        most = self.frames.stretch.max(initial=1.0)
        self.stretch = np.append(self.frames.stretch, np.full(len(groups.joins), most))
        seen = felt(groups, widths)
        self.widest = max([BLEND, *seen.widest.tolist()])
        beyond = np.minimum(FARTHER * seen.total, FARTHEST * seen.widest) / self.frames.scale
        if self.skins is not None:
            beyond = beyond + self.skins.reach
        # in a block a row may hide all before it in its group, and be out of reach in a part of the block
        self.reach = np.where(seen.everywhere | anchored(groups), np.inf, 1.0 + SLACK + beyond)
        blends = [*np.where(groups.first, 0.0, widths).tolist(), *self.group_widths.tolist()]
        kinds, self._kinds = _numbered(list(zip(self.operators.tolist(), blends, strict=True)))
        cells = Cell(*(np.asarray(xp.to_numpy(part)) for part in self.network.cell_weights()))
        # The fold of s d and s D is s D', so that the cell's own width is that of any other.
        scale = np.array([BLEND / (width or BLEND) for _, width in kinds], np.float32)
        shown = [kind if kind == SMOOTH or not width else kind + ROUNDED for kind, width in kinds]
        lines, bias, candidate, bump = (part[shown].T for part in rounded(cells, self.network.config.state))
        lines, candidate = lines.swapaxes(0, 1), candidate.swapaxes(0, 1)
        table = Cell(lines * scale, bias, candidate, bump[0] / scale)
        opened = Cell(np.zeros_like(lines), np.ones_like(bias), candidate, np.zeros_like(bump[0]))
        host = [np.concatenate(pair, -1).astype(np.float32) for pair in zip(table, opened, strict=True)]
        self._opened = len(kinds)
        self._table = Cell(*(xp.array(part, self.like) for part in host))
        self._host = Cell(*host)

    def _colours(self) -> None:
        xp, parts = self.xp, self.parts
        albedo = self.network.object_albedo(xp.array(parts.material.copy(), self.like))
        self.colours = xp.packed((xp.array(parts.rgb.copy(), self.like) * albedo).clip(0.0, 1.0).T)
        """Colours of the objects (3 or 4, N), as registers hold them; 0 for those with a texture."""
        self.textures: list[tuple[Paint, Texture]] = []
        self.texture = np.full(len(self.paints), NO_TEXTURE)  # Index of each object's texture (N,)
        known: dict[tuple[Paint, bytes], int] = {}
        for i, paint in enumerate(self.paints):
            if paint is None or not self.draws[i]:  # the others leave colours as they are
                continue
            self.texture[i] = known.setdefault((paint, parts.texture[i].tobytes()), len(known))
            if len(known) > len(self.textures):
                self.textures.append((paint, texture_of(xp, paint, parts.texture[i], self.like, light=False)))
            self.colours[:, i] = 0.0
        if self.clear:
            opacity = xp.array(self.opacity, self.like)
            self.colours = xp.concat([self.colours * opacity, opacity[None]], 0)

    @property
    def blended(self) -> bool:
        """True where some object joins by a blend."""
        return bool((self._raw == SMOOTH).any())

    @property
    def rounded(self) -> bool:
        """True where outlines lie elsewhere than those of the objects."""
        return bool((self.parts.width > 0.0).any()) or self.blended

    @property
    def textured(self) -> bool:
        """True where some object has a texture."""
        return bool(self.textures)

    @property
    def nothing(self) -> float:
        """The state of points that have met nothing."""
        return float(EMPTY * self.widest / BLEND)

    def cells(self, objects: np.ndarray, opened: bool = False) -> Cell:
        """Cells of objects, which come last, on the host; with gates that are open if asked for."""
        return Cell(*(part.take(self._kinds[objects] + self._opened * opened, -1) for part in self._host))

    def every_cell(self) -> Cell:
        """Cells of all objects and, behind these, groups, which come last, on the host."""
        return Cell(*(part.take(self._kinds, -1) for part in self._host))

    def joins(self) -> Cell:
        """Cells of all groups, which come last, on the host."""
        return Cell(*(part.take(self._kinds[len(self.tokens) :], -1) for part in self._host))

    def empty(self, groups: int, count: int, more: int = 0) -> Array:
        """State and register (groups, S + R, count) of points that have met nothing, with room for more."""
        size = self.network.config.state + self.register + more
        memory = self.xp.full((groups, size, count), 0.0, self.like)
        memory[:, 0] = self.nothing
        return memory

    def features(self, objects: np.ndarray, q: Array, far: np.ndarray) -> Array:
        """Features (groups, F, P) in world units of objects (P,) at leaf coordinates (2, groups, P); ``far``
        (P,) says whether points of a column may lie beyond `RADIUS`.
        """
        xp, shape = self.xp, self.shape[objects]
        used = np.flatnonzero(np.bincount(shape)).tolist()
        groups = q.shape[1]
        result = None
        for at in used:
            index = None if len(used) == 1 else np.flatnonzero(shape == at)
            part = q if index is None else xp.take(q, xp.array(index, q))
            rim = far.any() if index is None else far[index].any()
            kind, flat = self.shapes[at], part.reshape(2, -1)
            if isinstance(kind, OutlineShapes):
                which = self.outline[objects if index is None else objects[index]]
                one = kind.distance(flat, xp.array(np.tile(which, groups), q))[None]
            else:
                one = self._decoded(kind, flat, bool(rim))
            one = one.reshape(-1, groups, part.shape[2])
            if index is None:
                result = one
                break
            if result is None:
                result = xp.full((one.shape[0], groups, len(objects)), 0.0, q)
            for feature, values in zip(result, one, strict=True):
                xp.put(feature, xp.array(index, q), values)
        assert result is not None
        if self.skins is not None:
            result = self.skins.at(objects).placed(xp, q).put_on(xp, result)
        scale = xp.array(self.frames.scale[objects].astype(np.float32), q)
        result = result.swapaxes(0, 1) * scale
        return result.clip(-FAR, FAR) if self.frames.wild[objects].any() else result

    def _decoded(self, shape: Any, q: Array, far: bool) -> Array:
        """Features (F, M) in leaf units."""
        parts = []
        if isinstance(shape, GridShape):
            return shape.distance(q)[None]
        for start in range(0, q.shape[1], CHUNK):
            part = q[:, start : start + CHUNK]
            radius = self.xp.length(list(part)) if far and isinstance(shape, Decoder) else None
            parts.append(self.network.decode(part, radius, 1.0, shape))
        return parts[0] if len(parts) == 1 else self.xp.concat(parts, 1)

    def nests(self) -> tuple[np.ndarray, ...]:
        """The groups around each object (N, D), their operators and widths, -1 for none."""
        path, joins = self.groups.path, np.append(self.groups.joins, -1)
        return path, joins[path], np.append(self.group_widths, -1.0)[path]

    def fold(self, meetings: Meetings, features: Array, trace: Trace | None = None) -> Array:
        """State and register (groups, S + R, B) of columns that have met their objects, by the features
        (groups, F, P) of the pairs; ``trace`` takes down what each object did.
        """
        xp, s, pairs = self.xp, self.network.config.state, meetings.pairs
        nest, count = nesting(meetings, self.groups), len(self.tokens)
        starts = [turn.fresh for turn in nest.turns if turn.ending is None]
        fresh = np.concatenate([pairs.open[:0], *starts]) | pairs.open
        groups, more = features.shape[0], int(trace is not None)
        stack = self.empty(groups, nest.states, more)
        every = self._cells_at(self._kinds[pairs.object] + self._opened * fresh)
        colours = xp.take(self.colours, xp.array(pairs.object, self.like))
        if trace is not None:  # a colour of 1 over a register of 0 shows the gate
            colours = xp.concat([colours, 0.0 * colours[:1] + 1.0], 0)
        over = self._over(self.tokens[pairs.object], fresh)

        def put(index: Array, values: Array) -> None:
            for plane, new in zip(stack, values, strict=True):
                xp.put(plane, index, new)

        for turn in nest.turns:
            which, at = turn.which, turn.at
            index = at if isinstance(at, slice) else xp.array(at, self.like)
            old = stack[..., at] if isinstance(at, slice) else xp.take(stack, index)
            if turn.ending is None:
                rows, d, own = pairs.object[which], features[..., which], colours[:, which]
                cell = Cell(*(part[..., which] for part in every))
                lies = over if over is None else over[which]
            else:  # groups that end join as objects
                top = xp.array(turn.ending, self.like)
                ended, rows = xp.take(stack, top), count + which
                if trace is not None:
                    ended[:, -1] = 1.0
                d, own = ended[:, :s] / self.unit, ended[:, s:]
                cell, lies = self._cells_at(self._kinds[rows]), self._over(self.operators[rows])
                put(top, self.empty(groups, len(ended[0, 0]), more))
            took = self._took(old, cell, d, own, trace is not None, lies)
            if not isinstance(at, slice):
                put(index, old)
            if trace is not None:
                trace.append(Met(turn, rows, d[:, 0], *took))
        return stack[:, : s + self.register, : len(meetings.columns)]

    def _over(self, operators: np.ndarray, fresh: np.ndarray | None = None) -> Array | None:
        """1 for operands (n,) that lie over what was before, 0 for others; None where none is clear."""
        if not self.clear:
            return None
        over = operators == UNION
        return self.xp.array((over if fresh is None else over & ~fresh).astype(np.float32), self.like)

    def _cells_at(self, kinds: np.ndarray) -> Cell:
        index = self.xp.array(kinds, self.like)
        return Cell(*(self.xp.take(part, index) for part in self._table))

    def _took(
        self, memory: Array, cell: Cell, d: Array, colours: Array, traced: bool, over: Array | None
    ) -> tuple[Array, Array, Array]:
        """Let memories (groups, S + R, n) take an object in each; how far its colour came in, the margin, and
        how much is seen through it. ``d`` are features (groups, F, n), colours registers (R, n) or (groups,
        R, n), ``over`` as of `_over`.
        """
        s, (lines, bias, candidate, bump) = self.network.config.state, cell
        levels, wanted = bias, 0.0
        for i in range(d.shape[1]):
            levels = levels + d[:, i : i + 1] * lines[:, i]
            wanted = wanted + d[:, i : i + 1] * candidate[:, i]
        for i in range(s):
            levels = levels + memory[:, i : i + 1] * lines[:, d.shape[1] + i]
        paint = margin = through = None
        if traced:
            margin = memory[:, 0] / self.unit - d[:, 0]
            memory[:, -1] = 0.0
        if over is not None:  # a union shows what it covers, through what is clear of it
            through = (0.5 - memory[:, :1] * self.slope).clip(0.0, 1.0) * over * (1.0 - colours[..., 3:4, :])
            colours = colours + through * memory[:, s:]
            through = through[:, 0]
        new = self.network.update(levels, wanted, bump, memory[:, :s], memory[:, s:], colours)
        memory[:, :s], memory[:, s:] = new
        if traced:
            paint = memory[:, -1] + 0.0
        return paint, margin, through

    def picture(self, memory: Array) -> Array:
        """Premultiplied colour and coverage (groups, 4, B), in [0, 1], of points that met all objects."""
        coverage = (0.5 - memory[:, :1] * self.slope).clip(0.0, 1.0)
        shown = memory[:, self.network.config.state :] * coverage
        return shown if self.clear else self.xp.concat([shown, coverage], 1)

    def middles(self, objects: np.ndarray, q: Floats) -> np.ndarray:
        """World distances (P,) at leaf coordinates (2, P)."""
        seen = np.nan_to_num(q).clip(-FAR, FAR)
        far = np.full(len(objects), bool((np.hypot(*seen) > RADIUS).any()))
        points = self.xp.array(seen.astype(np.float32)[:, None], self.like)
        result: np.ndarray = self.xp.to_numpy(self.features(objects, points, far))[0, 0]
        return result

    def rise(self, objects: np.ndarray, q: Floats, radius: Floats) -> np.ndarray:
        """Greatest difference (P,) of world distances at leaf coordinates from those within radii (P,)."""
        result, shape = np.full(len(objects), np.inf), self.shape[objects]
        for at, slopes in enumerate(self.slopes):
            here = np.flatnonzero(shape == at)
            if slopes is not None and len(here):
                result[here] = slopes.rise(q.take(here, -1), radius[here])
        most = np.fmin((result + ROUNDING[0]) * self.frames.scale[objects], _UNKNOWN)
        return np.asarray(most, np.float32)

    def proved(self, meetings: Meetings, middle: np.ndarray, rise: np.ndarray) -> Shown:
        """Prove the pictures of blocks whose pairs' distances lie within ``rise`` of ``middle``."""
        objects = meetings.pairs.object
        cell = self.cells(objects)
        dark = np.asarray(self.xp.to_numpy(self.colours)).take(objects, -1)
        colours = Interval(dark, np.where(self.texture[objects] == NO_TEXTURE, dark, self.opacity[objects]))
        lies = [tokens == UNION for tokens in (self.tokens[objects], self.groups.joins)]
        with np.errstate(all="ignore"):
            rise = rise + np.float32(ROUNDING[1]) * (1 + abs(middle))
            distance = Interval(middle - rise, middle + rise)
            nest = nesting(meetings, self.groups)
            fold = distance, cell, colours, self.nothing, self.slope, nest, self.joins()
            return shown(meetings, *fold, lies if self.clear else None)


def rounded(cells: Cell, s: int) -> Cell:
    """Cells with tokens in front, and behind them those of operators whose edges have a width.

    A cut that rounds its edge is a smooth union turned inside out: where that takes (D, d) to D', the
    intersection takes (-D, -d) to -D', and the subtraction (-D, d). Gates of the register stay shut.
    """
    lines, bias, candidate, bump = (part[SMOOTH] for part in cells)
    features = lines.shape[-1] - s
    result = [lines], [bias], [candidate], [bump]
    for sign in (1.0, -1.0):  # of the object's features
        turned = lines * np.array([sign] * features + [-1.0] * s, np.float32)
        shut = np.where(np.arange(len(bias)) < s, bias, -1.0).astype(np.float32)
        turned[s:] = 0.0
        for part, more in zip(result, (turned, shut, -sign * candidate, -bump), strict=True):
            part.append(more)
    more = Cell(*(np.stack(part) for part in result))
    return Cell(*(np.concatenate([one, two]) for one, two in zip(cells, more[:], strict=True)))


def _numbered(things: list[Any]) -> tuple[list[Any], np.ndarray]:
    """The different ones, in the order in which they come, and which of these each is."""
    numbers: dict[Any, int] = {}
    index = [numbers.setdefault(thing, len(numbers)) for thing in things]
    return list(numbers), np.array(index, np.intp)
