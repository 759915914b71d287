"""The plane's field: a Program's objects with their weights, and the network as it is written over arrays of
either library, every object at every point: torch draws by it, and what the kernel does not know.

Letters are those of `network.py`. Each object's frame (`frames.py`) carries points into its own space, where
its decoder answers; then the cell takes a point's objects in one by one. Nothing here knows a pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from scenelang.assets.element import Element
from scenelang.compiler.groups import OPERATOR, SMOOTH, UNION, anchored, felt, read_groups, widths_of
from scenelang.compiler.program import Paint, ProgramError
from scenelang.drawing.arrays import Array
from scenelang.drawing.neural.assets import GridShape, Texture, grid_shape, texture_of
from scenelang.drawing.neural.frames import FAR, Frames, read_skins
from scenelang.drawing.neural.network import EMPTY, Cell, Decoder, FramedNetwork
from scenelang.drawing.neural.outlines import OutlineShapes

SLACK = 0.02  # leaf units by which a learned outline may leave the unit disc
BLEND = 0.15  # world units: the width of the blends that the cell is trained on
FARTHER = 1.3  # widths of a blend at which objects cannot change where its outline lies
FARTHEST = 3.0  # widths at which they cannot by any number of blends, but for 10⁻⁶ world units
CHUNK = 4096  # points that go through a decoder at once: fewer cost calls, more cost caches
NO_TEXTURE = -1
ROUNDED = 3  # from the index of a cut to that of the same cut with a rounded edge, see `rounded`


class Field:
    """A program's objects with their weights, ready to be met by points.

    Of rows of vectors (N, 64), ``brought`` has what users brought, None where it is a geometry of the model,
    and ``paints`` textures, None where it is the colour of its vector. ``reach`` (N,) is in leaf units from
    an object's origin, beyond which it changes nothing, inf where it concerns every point; ``draws`` (N,)
    says whether it may be seen where nothing was before, and ``opacity`` (N,) how much it hides. Registers
    hold colours, and if some objects are ``clear`` premultiplied ones, with their coverage. Raises
    `ProgramError` where a vector holds no way to a leaf, or an element cannot be drawn.
    """

    tables: Any = None  # those of the kernel, once it was asked

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
        self.skins = read_skins(self.parts, self.brought)
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
        more = () if self.skins is None else np.flatnonzero(self.skins.reach > 0).tolist()
        grown = {self.brought[i] for i in more}
        elements = dict.fromkeys(element for element in self.brought if element is not None)
        if elements and network.config.features != 1:
            raise ProgramError("elements for a network that knows more than distances")
        outlines = {element: at for at, element in enumerate(e for e in elements if e.curved)}
        self.outline = np.array([outlines.get(held, -1) for held in self.brought], np.intp)  # type: ignore[arg-type]
        """Numbers of outlines among all that are drawn together (N,), -1 for other shapes."""
        for element in elements:
            if element not in outlines:
                self.shape[[held == element for held in self.brought]] = len(self.shapes)
                self.shapes.append(grid_shape(element, xp, self.like, element in grown))
        if outlines:
            self.shape[self.outline >= 0] = len(self.shapes)
            self.shapes.append(OutlineShapes(xp, [*outlines], self.like))

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
        kinds, which = _numbered(list(zip(self.operators.tolist(), blends, strict=True)))
        cells = Cell(*(np.asarray(xp.to_numpy(part)) for part in self.network.cell_weights()))
        # The fold of s d and s D is s D', so that the cell's own width is that of any other.
        scale = np.array([BLEND / (width or BLEND) for _, width in kinds], np.float32)
        shown = [kind if kind == SMOOTH or not width else kind + ROUNDED for kind, width in kinds]
        lines, bias, candidate, bump = (part[shown] for part in rounded(cells, self.network.config.state))
        scale = scale[:, None, None]
        table = Cell(lines * scale, bias, candidate, bump / scale)
        self.cells = Cell(*(part[which].astype(np.float32) for part in table))
        """Cells of all objects and, behind these, groups, which come first, on the host."""

    def _colours(self) -> None:
        xp, parts = self.xp, self.parts
        albedo = self.network.object_albedo(xp.array(parts.material.copy(), self.like))
        self.colours = xp.packed((xp.array(parts.rgb.copy(), self.like) * albedo).clip(0.0, 1.0).T)
        """Colours of the objects (3 or 4, N), as registers hold them; 0 for those with a texture."""
        self.textures: list[Texture] = []
        self.texture = np.full(len(self.paints), NO_TEXTURE)  # Index of each object's texture (N,)
        known: dict[tuple[Paint, bytes], int] = {}
        for i, paint in enumerate(self.paints):
            if paint is None or not self.draws[i]:  # the others leave colours as they are
                continue
            self.texture[i] = known.setdefault((paint, parts.texture[i].tobytes()), len(known))
            if len(known) > len(self.textures):
                self.textures.append(texture_of(xp, paint, parts.texture[i], self.like, light=False))
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

    def within(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Numbers of the objects that may change something in a box of the world (2,), (2,)."""
        every = np.isinf(self.reach)
        least, most = self.frames.boxes(np.where(every, 0.0, self.reach))
        # a box of what are no numbers is everywhere
        aside = ((least > high[:, None]) | (most < low[:, None])).any(0)
        return np.flatnonzero(every | ~aside)

    def folded(
        self, p: Array, objects: np.ndarray | None = None, owners: bool = False
    ) -> tuple[Array, Array]:
        """State and register (S + R, M) of points (2, M) that have met some objects, by default all, and the
        numbers (M,), from 1, of those that show most there, if asked for; else 0.
        """
        every = np.arange(len(self.tokens)) if objects is None else objects
        if not len(every):
            return self.fold(p[:, None], every, owners=owners)
        q = self.frames.local(self.xp, every, p[:, :, None] + self.xp.full((1, 1, len(every)), 0.0, p))
        return self.fold(self.features(every, q, np.ones(len(every), bool)).swapaxes(0, 2), every, q, owners)

    def fold(
        self, d: Array, every: np.ndarray, q: Array | None = None, owners: bool = False
    ) -> tuple[Array, Array]:
        """As `folded`, by features (N, F, M) of the objects and, for textures, leaf coordinates (2, M, N)."""
        xp, groups, s = self.xp, self.groups, self.network.config.state
        count = d.shape[-1]
        blank = xp.full((s + self.register + 2, count), 0.0, d)
        blank[0] = self.nothing
        stack, met = [blank], [False]
        path: list[int] = []

        def join(row: int, operand: tuple[Array, Array, Array], at: int) -> None:
            # the first operand of a group begins its state
            fresh = at > 0 and not met[at] and self.operators[row] <= SMOOTH
            stack[at], met[at] = self._joined(stack[at], row, operand, fresh, owners), True

        def end(kept: int) -> None:
            while len(path) > kept:
                top = stack.pop()
                met.pop()
                operand = top[:s] / self.unit, top[s : s + self.register], top[s + self.register :]
                join(len(self.tokens) + path.pop(), operand, len(path))

        for at, row in enumerate(every.tolist()):
            own = [group for group in groups.path[row].tolist() if group >= 0]
            common = 0
            while common < min(len(own), len(path)) and own[common] == path[common]:
                common += 1
            end(common)
            for group in own[common:]:
                path.append(group)
                stack.append(blank)
                met.append(False)
            colour = self.colours[:, row, None] + xp.full((1, count), 0.0, d)
            if q is not None and (texture := self.texture[row]) != NO_TEXTURE:
                shown = self.textures[texture].at(q[:, :, at]) * float(self.opacity[row])
                colour = xp.concat([shown, colour[3:]], 0)
            shows = xp.full((2, count), float(self.opacity[row]), d)
            shows[0] = float(row + 1)
            join(row, (d[at], colour, shows), len(path))
        end(0)
        result = stack[0][: s + self.register]
        covered = result[0] * self.slope < 0.0
        return result, stack[0][-2] * covered if owners else 0

    def _joined(
        self, memory: Array, row: int, operand: tuple[Array, Array, Array], fresh: bool, owners: bool
    ) -> Array:
        """The memory (S + R + 2, M) that takes in an operand: features (F, M), a register (R, M), and whose
        it is (2, M) and how much that shows; as it is where it is ``fresh``.
        """
        xp, s, end = self.xp, self.network.config.state, self.network.config.state + self.register
        d, colour, shows = operand
        lines, bias, candidate, bump = (xp.array(part[row], self.like) for part in self.cells)
        wanted = candidate @ d
        if fresh:
            return xp.concat([wanted, colour, shows], 0)
        state, register, own = memory[:s], memory[s:end], memory[end:]
        levels = lines @ xp.concat([d, state], 0) + bias[:, None]
        through = 0.0
        if self.clear and self.operators[row] == UNION:
            # a union shows what it covers, through what is clear of it
            through = (0.5 - state[:1] * self.slope).clip(0.0, 1.0) * (1.0 - colour[3:])
            colour = colour + through * register
        new = self.network.update(levels, wanted, bump, state, register, colour)
        if owners:
            share = xp.largest(levels[s:]).clip(0.0, 1.0)
            comes = (share > 0.5) & (shows[1:] >= through * own[1:])
            kept = xp.concat([own[:1], own[1:] * (1.0 - share * (1.0 - through))], 0)
            shows = xp.concat([shows[:1], shows[1:] * share], 0)
            own = xp.select(comes, shows, kept)
        return xp.concat([*new, own], 0)

    def picture(self, memory: Array) -> Array:
        """Premultiplied colour and coverage (4, M), in [0, 1], of points that met all objects."""
        coverage = (0.5 - memory[:1] * self.slope).clip(0.0, 1.0)
        shown = memory[self.network.config.state :] * coverage
        return shown if self.clear else self.xp.concat([shown, coverage], 0)

    def sampled(self, p: Array, offsets: np.ndarray, objects: np.ndarray | None = None) -> Array:
        """Mean pictures (4, M) of samples at offsets (2, K) around points (2, M)."""
        total: Array = 0.0
        for offset in offsets.T:
            total = total + self.picture(self.folded(p + self.xp.array(offset[:, None], p), objects)[0])
        return total / offsets.shape[1]


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
