"""Flat scenes as drawings: outlines of the learned field as cubic Béziers, in SVG.

What a scene shows is painted in layers. In a union each object is one, with all that is cut off it later:
the result of a cut grows with the distance that it cuts, so it may be made before the union as well as after.
What a blend joins is one layer, or one for each look in it.

Source: P. J. Schneider, An algorithm for automatically fitting digitized curves, in Graphics Gems, 1990.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import BY_POINTS, Gradient, splined
from scenelang.compiler.groups import BEGINS, ENDS, OPERATOR, SMOOTH, SUBTRACT, UNION
from scenelang.compiler.program import Program
from scenelang.drawing.how import RenderError
from scenelang.drawing.kernel import load_kernel
from scenelang.drawing.neural.assets import stepped
from scenelang.drawing.neural.draw import draws
from scenelang.drawing.neural.field import NO_TEXTURE, Field
from scenelang.drawing.neural.tables import tables_of
from scenelang.output.mesh import crossed, zeros

Floats = npt.NDArray[np.float64]

UNITS: Final = 256, 1024  # least and most of the longer side of a canvas: pixels, where they are as many
FINEST: Final = 1 / 16  # units between nodes of the grid that finds outlines, for small layers; else a half
BLOCK: Final = 8  # nodes along a side of blocks that are looked at first
STEEP: Final = 1.1  # how much faster than exact ones learned distances change at most
STEPS: Final = 5  # that find an outline between two nodes
SHARP_DEG: Final = 25.0  # between normals of neighbours on an outline: a corner
FITS: Final = 8  # of a curve, before it is cut
NEAR: Final = 0.05  # units that curves may lie off outlines
ROUND: Final = 2.0  # times as much: circles
BEVEL: Final = 0.3  # units: shorter pieces between two corners are left out
SMALL: Final = 0.3  # square units: smaller specks are left out
BORDER: Final = 2.0  # units around the canvas where layers end
MOST_BLENDED: Final = 100  # each is compared with all that were blended before
FINER: Final = 2.0  # texels of a picture for a unit
MOST_TEXELS: Final = 1 << 22


class Operand(NamedTuple):
    """An operand of a fold: some rows, and its own operands if it is a group."""

    operator: int
    rows: range
    inner: list[Operand]


def operands(tokens: npt.NDArray[np.int8]) -> list[Operand]:
    """The operands of a stream whose tokens (N,) have no fault."""
    stack: list[list[Operand]] = [[]]
    begun: list[tuple[int, int]] = []
    for row, token in enumerate(np.asarray(tokens, np.intp).tolist()):
        operator = token & OPERATOR
        if token & BEGINS:
            begun.append((operator, row))
            stack.append([])
            operator = UNION
        stack[-1].append(Operand(operator, range(row, row + 1), []))
        for _ in range(token >> ENDS):
            inner, (operator, first) = stack.pop(), begun.pop()
            stack[-1].append(Operand(operator, range(first, row + 1), inner))
    return stack[0]


def tokens_of(fold: Sequence[Operand]) -> list[int]:
    """Tokens of the rows of operands that follow each other, whatever groups they were taken from."""
    result: list[int] = []
    for operand in fold:
        own = tokens_of(operand.inner) if operand.inner else [UNION]
        if result:  # in the first operand nothing has been met
            own[0] = operand.operator | (BEGINS if operand.inner else 0) | own[0] & -1 << ENDS
            own[-1] += (1 << ENDS) * bool(operand.inner)
        result += own
    return result


class SvgLayer(NamedTuple):
    """A region of one look: where all of its terms are negative."""

    row: int  # whose look it is
    shape: list[Operand]  # the fold that bounds it
    # where the first fold is below the second, or, if that is to be, below 0 too
    wins: tuple[tuple[list[Operand], list[Operand], bool], ...] = ()


def layers_of(fold: Sequence[Operand], looks: Sequence[Any], cuts: Sequence[Operand] = ()) -> list[SvgLayer]:
    """Layers of a fold that is cut later, in the order of painting; equal looks (N,) need no borders."""
    last = max((at for at, operand in enumerate(fold) if at and operand.operator == SMOOTH), default=-1)
    result: list[SvgLayer] = []
    if last >= 0:
        whole = [*fold[: last + 1], *_cuts(fold[last + 1 :]), *cuts]
        seen = list(_seen(fold[: last + 1]))
        if len({looks[layer.row] for layer in seen}) == 1:
            seen = seen[:1]
        result = [layer._replace(shape=whole) for layer in seen]
    for at in range(last + 1, len(fold)):
        operand = fold[at]
        if not at or operand.operator == UNION:
            more = [*_cuts(fold[at + 1 :]), *cuts]
            inner = layers_of(operand.inner, looks, more) if operand.inner else None
            result += [SvgLayer(operand.rows[0], [operand, *more])] if inner is None else inner
    return result


def _cuts(fold: Sequence[Operand]) -> list[Operand]:
    return [operand for operand in fold if operand.operator >= SUBTRACT]


def _seen(fold: Sequence[Operand]) -> Iterator[SvgLayer]:
    """Leaves of a fold, each where its colour is the last one taken by more than half."""
    for at, operand in enumerate(fold):
        if at and operand.operator >= SUBTRACT:
            continue
        won = (([operand], list(fold[:at]), operand.operator == UNION),) if at else ()
        for layer in _seen(operand.inner) if operand.inner else (SvgLayer(operand.rows[0], []),):
            yield layer._replace(wins=layer.wins + won)


class Shapes:
    """Distances of folds of a Program, by its network or by formulas, in units of the drawing."""

    def __init__(self, program: Program, exact: bool) -> None:
        from scenelang.drawing.closed import field_of

        self.program, self.network = program, field_of(program, exact)
        longer = max(program.canvas)
        self.size = np.array(program.canvas) * (min(max(longer, UNITS[0]), UNITS[1]) / longer)
        self.unit, self.half = float(self.size.min()) / 2, self.size[:, None, None] / 2
        self.brought, self.paints = program.brought(), program.paints()
        self.whole = self.field(range(len(program)), program.tokens)

    def field(self, rows: Sequence[int], tokens: npt.NDArray[np.int8]) -> Field:
        """The field of a stream of some rows."""
        some = list(rows)
        brought, paints = [self.brought[i] for i in some], [self.paints[i] for i in some]
        return Field(self.network, self.program.vectors[some], tokens, brought, paints)  # type: ignore[arg-type]

    def fold(self, fold: Sequence[Operand]) -> Field:
        """The field of operands that follow each other."""
        rows = [row for operand in fold for row in operand.rows]
        return self.field(rows, np.array(tokens_of(fold), np.int8))

    def ask(self, field: Field, p: Floats, half_px: float = 0.0) -> Floats:
        """Distances (G, B) of a field at points (2, G, B); right within half a side around them."""
        world = (p - self.half) / self.unit * [[[1.0]], [[-1.0]]]
        points = world.reshape(2, -1)
        if draws(field):
            result = load_kernel().states(tables_of(field), points, half_px / self.unit)
        else:
            with field.xp.inference():
                result = field.folded(points.astype(np.float32))[0][0]
        return np.asarray(result.reshape(p.shape[1:]) * (self.unit / field.unit), np.float64)


class Region:
    """A layer to be outlined; its function is negative inside, and about as steep as a distance."""

    def __init__(self, shapes: Shapes, layer: SvgLayer) -> None:
        self.shapes, self.layer = shapes, layer
        self.bound = shapes.fold(layer.shape)
        self.wins = [(shapes.fold(one), shapes.fold(other), floor) for one, other, floor in layer.wins]
        fields = [self.bound, *(field for one, other, _ in self.wins for field in (one, other))]
        self.steep = STEEP * max(float(field.frames.stretch.max()) for field in fields)
        shown = [o.rows for o in layer.shape if o.operator < SUBTRACT or o is layer.shape[0]]
        rows = [layer.row] if layer.wins else [row for some in shown for row in some]
        boxes = shapes.program.bounds[rows].astype(np.float64)
        low, high = boxes[:, :2].min(0), boxes[:, 2:].max(0)
        half = shapes.half[:, 0, 0]
        corners = np.array([[low[0], -high[1]], [high[0], -low[1]]]) * shapes.unit + half
        self.low, self.high = corners.clip(-2 * BORDER, shapes.size + 2 * BORDER)
        shell = self.bound.parts.shell  # how thick leaves are, 0 for whole ones
        fine = np.where(shell > 0, np.minimum(shell / 2, 1 / 8), 1 / 8) * self.bound.frames.scale
        self.step = float(np.clip(fine.min() * shapes.unit, FINEST, 0.5))

    def at(self, p: Floats, half_px: float = 0.0) -> Floats:
        """Values (G, B) at points (2, G, B), some columns at a time."""
        shapes, result = self.shapes, np.empty(p.shape[1:])
        each = max(1, (1 << 16) // (p.shape[1] * len(self.bound.tokens)))
        for some in (slice(i, i + each) for i in range(0, p.shape[2], each)):
            q = p[..., some]
            beyond = (abs(q - shapes.half) - shapes.half).max(0) - BORDER
            value = np.maximum(shapes.ask(self.bound, q, half_px), beyond)
            for one, other, floor in self.wins:
                rest = shapes.ask(other, q, half_px)
                value = np.maximum(value, shapes.ask(one, q, half_px) - (rest.clip(0.0) if floor else rest))
            result[:, some] = value
        return result

    def grid(self) -> tuple[Floats, Floats, float]:
        """Values (rows, columns) at nodes, the first of these (2,), and the way between two."""
        size, step = self.high - self.low, self.step
        columns, rows = (int(n) for n in np.ceil(size.clip(0.0) / (BLOCK * step)) + 1)
        first = self.low - step / 2
        place = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), 0).reshape(2, 1, -1) * BLOCK
        middle = first[:, None, None] + (place + (BLOCK - 1) / 2) * step
        reach = BLOCK * step / 2**0.5
        value = self.at(middle, BLOCK * step / 2)
        near = np.flatnonzero(abs(value[0]) < self.steep * reach * (1 + bool(self.wins)))
        values = np.repeat(value, BLOCK * BLOCK, 0)
        inner = np.stack(np.divmod(np.arange(BLOCK * BLOCK), BLOCK)[::-1])[:, :, None]
        values[:, near] = self.at(first[:, None, None] + (place[:, :, near] + inner) * step)
        grid = values.T.reshape(rows, columns, BLOCK, BLOCK).swapaxes(1, 2)
        return np.pad(grid.reshape(rows * BLOCK, -1), 1, constant_values=1.0), first - step, step

    def outlines(self) -> list[tuple[Floats, Floats]]:
        """Closed outlines with the inside on one hand: points (2, n), and unit normals there (2, n)."""
        grid, first, step = self.grid()
        if not (loops := _loops(grid < 0)):
            return []
        ends = np.concatenate(loops)  # (n, 2): nodes inside and outside
        inside, outside = (np.stack(np.divmod(node, grid.shape[1])[::-1]) for node in ends.T)
        a, b = (first[:, None] + node * step for node in (inside, outside))
        f, g = (grid[node[1], node[0]] for node in (inside, outside))
        points, *_ = zeros(lambda p: self.at(p[:, None])[0], a, b, f, g, STEPS, False, 0.0)
        off = 0.02 * np.array([[1, -1, 0, 0], [0, 0, 1, -1]])[:, :, None]
        around = self.at(points[:, None] + off)
        normals = np.stack([around[0] - around[1], around[2] - around[3]])
        normals /= np.hypot(*normals).clip(1e-9)
        cuts = np.cumsum([len(loop) for loop in loops])[:-1]
        return list(zip(np.split(points, cuts, 1), np.split(normals, cuts, 1), strict=True))


def _loops(inside: npt.NDArray[np.bool_]) -> list[npt.NDArray[np.intp]]:
    """Closed outlines on a grid whose border is outside, as pairs of neighbours inside and outside (n, 2)."""
    flat, way = inside.ravel(), np.array([1, inside.shape[1], -1, -inside.shape[1]])
    node, to = np.nonzero(flat[(np.arange(flat.size)[:, None] + way) % flat.size] < flat[:, None])
    # the next pair of a cell; corners inside that face each other are apart
    beside = node + way[(to + 1) % 4]
    across = beside + way[to]
    then = np.where(flat[across], (across, (to + 3) % 4), (beside, to))
    then = np.where(flat[beside], then, (node, (to + 1) % 4))
    after = dict(zip((4 * node + to).tolist(), (4 * then[0] + then[1]).tolist(), strict=True))
    result = []
    while after:
        start, at = after.popitem()
        loop = [start]
        while at != start:
            loop.append(at)
            at = after.pop(at)
        node, to = np.divmod(loop, 4)
        result.append(np.stack([node, node + way[to]], 1))
    return result


def _pieces(points: Floats, normals: Floats) -> list[tuple[Floats, Floats]]:
    """A closed outline between its corners: points (n, 2), ends among them, and directions there (n, 2).

    A corner lies where the tangents of two neighbours meet; a short side is one that a learned corner lost.
    """
    p, along, count = points.T, np.stack([-normals[1], normals[0]], 1), points.shape[1]
    way = np.roll(p, -1, 0) - p
    if (way * along).sum() < 0:
        along = -along
    most = 3 * float(np.median(np.hypot(*way.T)))

    def meet(i: npt.NDArray[np.intp], j: npt.NDArray[np.intp]) -> Floats:
        """Where tangents meet (n, 2); the middle where that is far off."""
        between, turn = p[j] - p[i], crossed(along[i], along[j])
        share = crossed(between, along[j]) / np.where(turn, turn, 1e-9)
        middle, result = (p[i] + p[j]) / 2, p[i] + share[:, None] * along[i]
        return np.where(np.hypot(*(result - middle).T)[:, None] < most, result, middle)

    before = np.flatnonzero((along * np.roll(along, -1, 0)).sum(1) < np.cos(np.radians(SHARP_DEG)))
    if not len(before):
        parts = [np.arange(count * i // 4, count * (i + 1) // 4 + 1) % count for i in range(4)]
        return [(p[part], along[part]) for part in parts]
    behind = (before + 1) % count
    place = meet(before, behind)
    far = np.flatnonzero(np.hypot(*(place - np.roll(place, 1, 0)).T) > BEVEL)
    if len(far) > 1:
        before, behind = before[far], behind[np.roll(far, -1) - 1]
        place = meet(before, behind)
    result = []
    for one, i, j, other in zip(np.roll(place, 1, 0), np.roll(behind, 1), before, place, strict=True):
        own = along[part := (i + np.arange((j - i) % count + 1)) % count]
        result.append((np.concatenate([[one], p[part], [other]]), np.concatenate([own[:1], own, own[-1:]])))
    return result


def fitted(p: Floats, along: Floats) -> list[Floats]:
    """Lines (1, 2) and cubics (3, 2), each by the points behind its first, along points (n, 2).

    The directions (n, 2) at the ends of curves are kept.
    """
    chord, step = p[-1] - p[0], np.hypot(*np.diff(p, axis=0).T)
    length = float(np.hypot(*chord))
    if len(p) == 2 or (length > 0 and abs(crossed(chord, p - p[0])).max() < NEAR * length):
        return [p[-1:]]
    u = np.concatenate([[0.0], step.cumsum()]) / step.sum()
    ends, error = p[[0, 0, -1, -1]], np.full(len(p), np.inf)
    for _ in range(FITS):
        b = np.stack([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3], 1)
        ways = b[:, 1] * crossed(along, along[0]), -b[:, 2] * crossed(along, along[-1])
        sizes = np.linalg.lstsq(np.stack(ways, 1), crossed(along, p - b @ ends), rcond=None)[0]
        if not (sizes.min() > 1e-3 * length and sizes.max() < 3 * step.sum()):
            sizes[:] = step.sum() / 3
        q = ends + np.stack([0 * chord, sizes[0] * along[0], -sizes[1] * along[-1], 0 * chord])
        off = b @ q - p
        error = np.hypot(*off.T)
        if error.max() < NEAR:
            return [q[1:]]
        slope = np.stack([(1 - u) ** 2, 2 * u * (1 - u), u**2], 1) @ np.diff(3 * q, axis=0)
        u = (u - (slope * off).sum(1) / (slope * slope).sum(1).clip(1e-9)).clip(0.0, 1.0)
    cut = int(error[1:-1].argmax()) + 1
    along = along.copy()
    along[cut] = along[max(1, cut - 2) : min(len(p) - 1, cut + 3)].sum(0)
    along[cut] /= max(float(np.hypot(*along[cut])), 1e-9)
    return fitted(p[: cut + 1], along[: cut + 1]) + fitted(p[cut:], along[cut:])


def _said(*numbers: float) -> str:
    """Numbers in hundredths, with no more between them than is needed."""
    return " ".join(f"{round(number, 2) + 0.0:g}" for number in numbers).replace(" -", "-")


def path_of(points: Floats, normals: Floats) -> str:
    """A closed outline as path data: a circle, or lines and cubics, relative and in hundredths of units."""
    p = points.T
    middle = p.mean(0)
    a = np.concatenate([2 * (p - middle), np.ones((len(p), 1))], 1)
    x, y, rest = np.linalg.lstsq(a, ((p - middle) ** 2).sum(1), rcond=None)[0]
    r = float(np.sqrt(max(rest + x * x + y * y, 0.0)))
    if abs(np.hypot(*(p - middle - [x, y]).T) - r).max() < ROUND * NEAR:
        way = int(crossed(p, np.roll(p, 1, 0)).sum() < 0)
        first = _said(middle[0] + x - r, middle[1] + y)
        return f"M{first}a{_said(r, r, 0, 1, way, 2 * r, 0)}a{_said(r, r, 0, 1, way, -2 * r, 0)}z"
    parts = [curve for piece in _pieces(points, normals) for curve in fitted(*piece)]
    at = np.round(parts[-1][-1], 2)
    result = f"M{_said(*at)}"
    for curve in parts[: -1 if len(parts[-1]) == 1 else None]:
        result += ("c" if len(curve) == 3 else "l") + _said(*(np.round(curve, 2) - at).ravel())
        at = np.round(curve[-1], 2)
    return result + "z"


def _hex(rgb: npt.ArrayLike) -> str:
    return "#" + "".join(f"{int(255 * c + 0.5):02x}" for c in np.clip(np.asarray(rgb, np.float64), 0.0, 1.0))


class Inks:
    """Fills of the rows of a Program, and definitions that they refer to."""

    def __init__(self, shapes: Shapes) -> None:
        self.shapes, self.defined = shapes, dict[str, str]()
        field = shapes.whole
        colours = np.asarray(field.colours, np.float64).T
        opacity = colours[:, 3:] if colours.shape[1] > 3 else np.ones((len(colours), 1))
        self.opacity: list[float] = opacity[:, 0].tolist()
        self.plain = [_hex(rgb) for rgb in colours[:, :3] / np.maximum(opacity, 1e-9)]
        self.looks = list(zip(self.plain, self.opacity, field.texture.tolist(), strict=True))

    def of(self, region: Region) -> str:
        """Attributes of a region's path."""
        row, worn = region.layer.row, self.looks[region.layer.row][2]
        fill = self.plain[row]
        if worn != NO_TEXTURE:
            paint = self.shapes.paints[row]
            assert paint is not None
            made = self._gradient(row, paint.element) if isinstance(paint.element, Gradient) else None
            made = made or self._picture(row, region)
            fill = f"url(#{self.defined.setdefault(made, f'p{len(self.defined) + 1}')})"
        opacity = "" if self.opacity[row] >= 1 else f' fill-opacity="{_said(self.opacity[row])}"'
        return f'fill="{fill}"{opacity}'

    def _local(self, row: int, p: Floats) -> Floats:
        """Leaf coordinates (2, M) of a row at points (2, M)."""
        shapes, field = self.shapes, self.shapes.whole
        world = (p[:, None] - shapes.half) / shapes.unit * [[[1.0]], [[-1.0]]]
        q = field.frames.local(field.xp, np.full(p.shape[1], row), world.astype(np.float32))
        return np.asarray(q, np.float64)[:, 0]

    def _back(self, row: int, matrix: Floats) -> Floats | None:
        """The map (3, 2) to points from what a map (2, 3) makes of a leaf's own; None where that is bent."""
        p = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1], [0.5, 0.5, 1]]) * [*self.shapes.size, 1]
        there = self._local(row, p[:, :2].T).T @ matrix[:, :2].T + matrix[:, 2]
        way = np.linalg.lstsq(p, there, rcond=None)[0]
        if abs(p @ way - there).max() > 1e-4 or not abs(np.linalg.det(way[:2])) > 1e-12:
            return None
        return np.asarray(np.linalg.inv(np.concatenate([way, [[0], [0], [1]]], 1))[:, :2])

    def path(self, layer: SvgLayer) -> str | None:
        """The path of a whole polygon or spline as it is written; None of all else."""
        element = self.shapes.brought[layer.row]
        alone = len(layer.shape) == 1 and not layer.wins and not layer.shape[0].inner
        if (
            element is None
            or element.form not in BY_POINTS
            or not alone
            or self.shapes.whole.skinned[layer.row]
        ):
            return None
        if (back := self._back(layer.row, np.eye(3)[:2])) is None:
            return None
        spline = element.form == "spline"
        ends = [curve[1:] for curve in splined(element.points)] if spline else element.points[1:]
        first, *rest = (np.reshape(p, (-1, 2)) @ back[:2] + back[2] for p in (element.points[0], *ends))
        return f"M{_said(*first[0])}" + "".join("LC"[spline] + _said(*p.ravel()) for p in rest) + "z"

    def _gradient(self, row: int, gradient: Gradient) -> str | None:
        """A gradient; None where its lines are bent."""
        whole = self.shapes.whole
        back = self._back(row, whole.parts.texture[row].astype(np.float64).reshape(2, 3))
        if back is None:
            return None
        moved = " ".join(f"{round(value, 6) + 0.0:.6g}" for value in back.ravel())
        texture, stops = whole.textures[self.looks[row][2]], np.array(gradient.stops)
        if any(step[0] == "hue" for step in texture.steps):  # which bends the way from colour to colour
            more = np.linspace(0, 1, 17)
            between = [more, *(np.interp(more, stops[:, 0], channel) for channel in stops.T[1:])]
            stops = np.concatenate([stops, np.stack(between, 1)])
            stops = stops[np.argsort(stops[:, 0], kind="stable")]
        shown = stepped(whole.xp, stops[:, 1:].T.astype(np.float32), texture.steps).T
        pairs = zip(stops[:, 0], shown, strict=True)
        listed = "".join(f'<stop offset="{at:.4g}" stop-color="{_hex(rgb)}"/>' for at, rgb in pairs)
        ends = 'x1="-1" x2="1"' if gradient.name == "linear" else 'cx="0" cy="0" r="1"'
        form = f'id="%s" gradientUnits="userSpaceOnUse" {ends} gradientTransform="matrix({moved})"'
        return f"<{gradient.name}Gradient {form}>{listed}</{gradient.name}Gradient>"

    def _picture(self, row: int, region: Region) -> str:
        """A pattern of one picture, which a texture shows within a region."""
        from PIL import Image

        low = np.floor(region.low.clip(0, self.shapes.size - 1))
        high = np.ceil(region.high.clip(low + 1, self.shapes.size))
        finer = min(FINER, max(1.0, (MOST_TEXELS / np.prod(high - low)) ** 0.5))
        wide, tall = np.maximum(1, np.rint((high - low) * finer)).astype(int).tolist()
        across = low[0] + (np.arange(wide) + 0.5) * (high - low)[0] / wide
        down = low[1] + (np.arange(tall) + 0.5) * (high - low)[1] / tall
        p = np.stack(np.meshgrid(across, down)).reshape(2, -1)
        texture = self.shapes.whole.textures[self.looks[row][2]]
        rgb = texture.at(self._local(row, p).astype(np.float32)).T.reshape(tall, wide, 3)
        file = io.BytesIO()
        Image.fromarray(np.floor(255 * np.clip(rgb, 0, 1) + 0.5).astype(np.uint8)).save(file, "png")
        data = base64.b64encode(file.getvalue()).decode()
        (x, y), (width, height) = low.astype(int).tolist(), (high - low).astype(int).tolist()
        held = f'width="{width}" height="{height}"'
        picture = f'<image {held} preserveAspectRatio="none" xlink:href="data:image/png;base64,{data}"/>'
        return f'<pattern id="%s" patternUnits="userSpaceOnUse" x="{x}" y="{y}" {held}>{picture}</pattern>'


def svg_of(program: Program, exact: bool) -> tuple[str, bool]:
    """A Program of the plane as SVG, and whether blended colours became the nearer object's; raises
    `RenderError` where there are no outlines.
    """
    shapes = Shapes(program, exact)
    inks, (width, height), body = Inks(shapes), program.canvas, []
    across, down = (f"{side:g}" for side in shapes.size)
    if program.background is not None:
        fill = _hex(program.background)
        body.append(f'<rect width="{across}" height="{down}" fill="{fill}"/>')
    layers = layers_of(operands(program.tokens), inks.looks)
    if (blended := sum(bool(layer.wins) for layer in layers)) > MOST_BLENDED:
        raise RenderError(f"{blended:,} objects of other colours in a blend; an SVG has {MOST_BLENDED}")
    for layer in layers:
        region = Region(shapes, layer)
        data = inks.path(layer) or ""
        for points, normals in () if data else region.outlines():
            x, y = points
            if abs((x * np.roll(y, 1) - y * np.roll(x, 1)).sum()) / 2 > SMALL:
                data += path_of(points, normals)
        if data:
            body.append(f'<path d="{data}" {inks.of(region)}/>')
    if inks.defined:
        defined = "\n".join(made.replace("%s", name, 1) for made, name in inks.defined.items())
        body.insert(0, f"<defs>\n{defined}\n</defs>")
    size = f'width="{width}" height="{height}" viewBox="0 0 {across} {down}"'
    linked = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    return "\n".join([f"<svg {linked} {size}>", *body, "</svg>", ""]), blended > 0
