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
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.compiler.groups import BEGINS, ENDS, OPERATOR, SMOOTH, SUBTRACT, UNION
from scenelang.compiler.program import Program
from scenelang.drawing.how import How, RenderError
from scenelang.drawing.neural.assets import stepped
from scenelang.drawing.neural.field import NO_TEXTURE, Field
from scenelang.drawing.neural.meetings import Pairs, meetings_of
from scenelang.output.roots import zeros

Floats = npt.NDArray[np.float64]

UNITS: Final = 256, 1024  # least and most of the longer side of a canvas: pixels, where they are as many
FINEST: Final = 1 / 16  # units between nodes of the grid that finds outlines, for small layers; else a half
BLOCK: Final = 8  # nodes along a side of blocks that are looked at first
STEEP: Final = 1.1  # how much faster than exact ones learned distances change at most
STEPS: Final = 5  # that find an outline between two nodes
SHARP_DEG: Final = 25.0  # between normals of neighbours on an outline: a corner
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


class Layer(NamedTuple):
    """A region of one look: where all of its terms are negative."""

    row: int  # whose look it is
    shape: list[Operand]  # the fold that bounds it
    # where the first fold is below the second, or, if that is to be, below 0 too
    wins: tuple[tuple[list[Operand], list[Operand], bool], ...] = ()


def layers_of(fold: Sequence[Operand], looks: Sequence[object], cuts: Sequence[Operand] = ()) -> list[Layer]:
    """Layers of a fold that is cut later, in the order of painting; equal looks (N,) need no borders."""
    last = max((at for at, operand in enumerate(fold) if at and operand.operator == SMOOTH), default=-1)
    result: list[Layer] = []
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
            result += [Layer(operand.rows[0], [operand, *more])] if inner is None else inner
    return result


def _cuts(fold: Sequence[Operand]) -> list[Operand]:
    return [operand for operand in fold if operand.operator >= SUBTRACT]


def _seen(fold: Sequence[Operand]) -> Iterator[Layer]:
    """Leaves of a fold, each where its colour is the last one taken by more than half."""
    for at, operand in enumerate(fold):
        if at and operand.operator >= SUBTRACT:
            continue
        won = (([operand], list(fold[:at]), operand.operator == UNION),) if at else ()
        for layer in _seen(operand.inner) if operand.inner else (Layer(operand.rows[0], []),):
            yield layer._replace(wins=layer.wins + won)


class Shapes:
    """Distances of folds of a Program, by its network or by formulas, in units of the drawing."""

    def __init__(self, program: Program, exact: bool = False) -> None:
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
        tokens = [self.program.tokens[operand.rows.start : operand.rows.stop].copy() for operand in fold]
        tokens[0][0] &= ~(OPERATOR | BEGINS)
        if fold[0].inner:
            tokens[0][-1] -= 1 << ENDS
        rows = [row for operand in fold for row in operand.rows]
        return self.field(rows, np.concatenate(tokens))

    def ask(self, field: Field, p: Floats, half_px: float = 0.0) -> Floats:
        """Distances (G, B) of a field at points (2, G, B); right within half a side around them."""
        world = (p - self.half) / self.unit * [[[1.0]], [[-1.0]]]
        every = np.isinf(field.reach)
        low, high = field.frames.boxes(np.where(every, 0.0, field.reach))
        least, most = world.min(1) - half_px / self.unit, world.max(1) + half_px / self.unit
        meets = ((low[:, None] <= most[..., None]) & (high[:, None] >= least[..., None])).all(0)
        pairs = Pairs.of(*np.nonzero(meets | every))
        result = np.full(p.shape[1:], field.nothing)
        if len(pairs):
            meetings, _ = meetings_of(pairs)
            objects, xp = meetings.pairs.object, field.xp
            with xp.inference():
                points = world[..., meetings.columns[meetings.places()]].astype(np.float32)
                q = field.frames.local(xp, objects, points)
                memory = field.fold(meetings, field.features(objects, q, np.ones(len(objects), bool)))
            result[:, meetings.columns] = memory[:, 0]
        return np.asarray(result * (self.unit / field.unit))


class Region:
    """A layer to be outlined; its function is negative inside, and about as steep as a distance."""

    def __init__(self, shapes: Shapes, layer: Layer) -> None:
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
        shell = np.asarray(getattr(self.bound.parts, "shell", 0.0))  # how thick leaves are, 0 for whole ones
        fine = np.where(shell > 0, np.minimum(shell / 2, 1 / 8), 1 / 8) * self.bound.frames.scale
        self.step = float(np.clip(fine.min() * shapes.unit, FINEST, 0.5))

    def at(self, p: Floats, half_px: float = 0.0) -> Floats:
        """Values (G, B) at points (2, G, B)."""
        shapes = self.shapes
        off = abs(p - shapes.half) - shapes.half - BORDER
        result = np.maximum(shapes.ask(self.bound, p, half_px), off.max(0))
        for one, other, floor in self.wins:
            rest = shapes.ask(other, p, half_px)
            result = np.maximum(result, shapes.ask(one, p, half_px) - (rest.clip(0.0) if floor else rest))
        return np.asarray(result)

    def grid(self) -> tuple[Floats, Floats, float]:
        """Values (rows, columns) at nodes, the first of these (2,), and the way between two."""
        size, step = self.high - self.low, self.step
        columns, rows = (int(n) for n in np.ceil(size.clip(0.0) / (BLOCK * step)) + 1)
        first = self.low - step / 2
        place = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), 0).reshape(2, 1, -1) * BLOCK
        middle = first[:, None, None] + (place + (BLOCK - 1) / 2) * step
        reach = BLOCK * step / 2**0.5
        value = self._parts(middle, BLOCK * step / 2)
        near = np.flatnonzero(abs(value[0]) < self.steep * reach * (1 + bool(self.wins)))
        values = np.repeat(value, BLOCK * BLOCK, 0)
        inner = np.stack(np.divmod(np.arange(BLOCK * BLOCK), BLOCK)[::-1])[:, :, None]
        values[:, near] = self._parts(first[:, None, None] + (place[:, :, near] + inner) * step)
        grid = values.T.reshape(rows, columns, BLOCK, BLOCK).swapaxes(1, 2)
        return np.pad(grid.reshape(rows * BLOCK, -1), 1, constant_values=1.0), first - step, step

    def _parts(self, p: Floats, half_px: float = 0.0) -> Floats:
        """As `at`, some blocks at a time."""
        each = max(1, (1 << 16) // (p.shape[1] * len(self.bound.tokens)))
        parts = [self.at(p[..., i : i + each], half_px) for i in range(0, p.shape[2], each)]
        return np.concatenate([np.empty((p.shape[1], 0)), *parts], 1)

    def outlines(self) -> list[tuple[Floats, Floats]]:
        """Closed outlines with the inside on one hand: points (2, n), and unit normals there (2, n)."""
        grid, first, step = self.grid()
        loops = _loops(grid < 0)
        if not loops:
            return []
        ends = np.concatenate(loops)  # (n, 2): nodes inside and outside
        inside, outside = (np.stack(np.divmod(node, grid.shape[1])[::-1]) for node in ends.T)
        a, b = (first[:, None] + node * step for node in (inside, outside))
        f, g = (grid[node[1], node[0]] for node in (inside, outside))
        points, *_ = zeros(lambda p: self._parts(p[:, None])[0], a, b, f, g, STEPS)
        off = 0.02 * np.array([[1, -1, 0, 0], [0, 0, 1, -1]])[:, :, None]
        around = self._parts(points[:, None] + off)
        normals = np.stack([around[0] - around[1], around[2] - around[3]])
        normals /= np.hypot(*normals).clip(1e-9)
        cuts = np.cumsum([len(loop) for loop in loops])[:-1]
        return list(zip(np.split(points, cuts, 1), np.split(normals, cuts, 1), strict=True))


# Of the sides of a cell, top, right, bottom and left, those where an outline enters and leaves it, by the
# corners that are inside as bits: top left 1, top right 2, bottom right 4, bottom left 8.
_WAYS: Final = {
    1: "30", 2: "01", 3: "31", 4: "12", 5: "3012", 6: "02", 7: "32",
    8: "23", 9: "20", 10: "0123", 11: "21", 12: "13", 13: "10", 14: "03",
}  # fmt: skip


def _loops(inside: npt.NDArray[np.bool_]) -> list[npt.NDArray[np.intp]]:
    """Closed outlines on a grid whose border is outside, as pairs of neighbours inside and outside (n, 2)."""
    rows, columns = inside.shape
    flat, number = inside.ravel().astype(np.intp), np.arange(rows * columns).reshape(rows, columns)
    corner = [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]]
    kind = np.sum([flat[nodes] << bit for bit, nodes in enumerate(corner)], 0)
    # sides by their first node, those that go right before those that go down
    side = [corner[0], corner[1] + rows * columns, corner[3], corner[0] + rows * columns]
    after: dict[int, int] = {}
    for case, ways in _WAYS.items():
        some = np.nonzero(kind == case)
        for a, b in zip(ways[::2], ways[1::2], strict=True):
            after.update(zip(side[int(a)][some].tolist(), side[int(b)][some].tolist(), strict=True))
    result = []
    while after:
        start, at = after.popitem()
        loop = [start]
        while at != start:
            loop.append(at)
            at = after.pop(at)
        node = np.array(loop)
        down, node = np.divmod(node, rows * columns)
        ends = np.stack([node, node + np.where(down > 0, columns, 1)], 1)
        result.append(np.where(flat[ends[:, :1]] > 0, ends, ends[:, ::-1]))
    return result


def _meet(p: Floats, along: Floats, then: Floats, past: Floats, most: float) -> Floats:
    """Points (n, 2) where lines meet, by a point and a direction each; the middle where that is far off."""
    turn = along[:, 0] * past[:, 1] - along[:, 1] * past[:, 0]
    share = ((then - p)[:, 0] * past[:, 1] - (then - p)[:, 1] * past[:, 0]) / np.where(turn, turn, 1e-9)
    middle, result = (p + then) / 2, p + share[:, None] * along
    return np.where(np.hypot(*(result - middle).T)[:, None] < most, result, middle)


def _pieces(points: Floats, normals: Floats) -> list[tuple[Floats, Floats]]:
    """A closed outline between its corners: points (n, 2), ends among them, and directions there (n, 2).

    A corner lies where the tangents of two neighbours meet. Without any the outline is cut into quarters.
    """
    p, along = points.T, np.stack([-normals[1], normals[0]], 1)
    if ((np.roll(p, -1, 0) - p) * along).sum() < 0:
        along = -along
    ahead, then = np.roll(p, -1, 0), np.roll(along, -1, 0)
    most = 3 * float(np.median(np.hypot(*(ahead - p).T)))
    sharp = np.flatnonzero((along * then).sum(1) < np.cos(np.radians(SHARP_DEG)))
    if not len(sharp):
        cuts = [len(p) * i // 4 for i in range(5)]
        smooth = np.sum([np.roll(along, i, 0) for i in (-2, -1, 0, 1, 2)], 0)
        parts = [np.arange(a, b + 1) % len(p) for a, b in pairwise(cuts)]
        return [(p[part], smooth[part] / np.hypot(*smooth[part].T)[:, None]) for part in parts]
    places = _meet(p[sharp], along[sharp], ahead[sharp], then[sharp], most)
    # of corners the points before and behind them
    corners = [(int(i), int(i + 1) % len(p), place) for i, place in zip(sharp, places, strict=True)]
    at = 0
    while at < len(corners):  # a short side is what a learned corner has lost
        (i, _, one), (_, j, other) = corners[at - 1], corners[at]
        if len(corners) < 3 or np.hypot(*(other - one)) > BEVEL:
            at += 1
            continue
        corners[at] = i, j, _meet(p[[i]], along[[i]], p[[j]], along[[j]], most)[0]
        del corners[at - 1]
        at = max(at - 1, 0)
    result = []
    for (_, i, one), (j, _, other) in zip([corners[-1], *corners], corners, strict=False):
        part = (i + np.arange((j - i) % len(p) + 1)) % len(p)
        own = along[part]
        result.append((np.concatenate([[one], p[part], [other]]), np.concatenate([own[:1], own, own[-1:]])))
    return result


def fitted(p: Floats, along: Floats) -> list[Floats]:
    """Lines (1, 2) and cubics (3, 2), each by the points behind its first, that pass points (n, 2).

    The directions (n, 2) at the ends of curves are kept.
    """
    chord = p[-1] - p[0]
    length = float(np.hypot(*chord))
    off = abs(chord[0] * (p - p[0])[:, 1] - chord[1] * (p - p[0])[:, 0])
    if len(p) == 2 or (length > 0 and off.max() < NEAR * length):
        return [p[-1:]]
    start, end = along[0], -along[-1]
    step = np.hypot(*np.diff(p, axis=0).T)
    u = np.concatenate([[0.0], step.cumsum()]) / step.sum()
    for turn in range(5):
        v = 1 - u
        b = np.stack([v**3, 3 * u * v**2, 3 * u**2 * v, u**3])
        ways = b[1, :, None] * start, b[2, :, None] * end
        rest = p - (b[0] + b[1])[:, None] * p[0] - (b[2] + b[3])[:, None] * p[-1]
        c = np.array([[(one * other).sum() for other in ways] for one in ways])
        x = np.array([(one * rest).sum() for one in ways])
        det = c[0, 0] * c[1, 1] - c[0, 1] ** 2
        sizes = np.array([x[0] * c[1, 1] - x[1] * c[0, 1], c[0, 0] * x[1] - c[0, 1] * x[0]]) / (det or 1.0)
        if not (det > 1e-12 and sizes.min() > 1e-3 * length and sizes.max() < 3 * step.sum()):
            sizes[:] = step.sum() / 3
        q = np.stack([p[0], p[0] + sizes[0] * start, p[-1] + sizes[1] * end, p[-1]])
        there = b.T @ q
        error = np.hypot(*(there - p).T)
        if error.max() < NEAR:
            return [q[1:]]
        if turn == 4 or error.max() > 40 * NEAR:
            break
        d1, d2 = 3 * np.diff(q, axis=0), 6 * np.diff(q, 2, axis=0)
        slope = np.stack([v**2, 2 * u * v, u**2]).T @ d1
        bend = np.stack([v, u]).T @ d2
        below = (slope * slope).sum(1) + ((there - p) * bend).sum(1)
        u = np.clip(u - ((there - p) * slope).sum(1) / np.where(abs(below) > 1e-9, below, np.inf), 0.0, 1.0)
    cut = int(error[1:-1].argmax()) + 1
    middle = along[max(1, cut - 2) : min(len(p) - 1, cut + 3)].sum(0)
    along = along.copy()
    along[cut] = middle / max(float(np.hypot(*middle)), 1e-9)
    return fitted(p[: cut + 1], along[: cut + 1]) + fitted(p[cut:], along[cut:])


def _number(value: float) -> str:
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    text = "0" if text == "-0" else text
    return text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text


def _joined(numbers: Sequence[float]) -> str:
    """Numbers with no more between them than is needed."""
    result = ""
    for text in map(_number, numbers):
        result += text if not result or text.startswith("-") else f" {text}"
    return result


def path_of(points: Floats, normals: Floats) -> str:
    """A closed outline as path data: a circle, or lines and cubics, relative and in hundredths of units."""
    p = points.T
    middle = p.mean(0)
    a = np.concatenate([2 * (p - middle), np.ones((len(p), 1))], 1)
    x, y, rest = np.linalg.lstsq(a, ((p - middle) ** 2).sum(1), rcond=None)[0]
    radius = float(np.sqrt(max(rest + x * x + y * y, 0.0)))
    if abs(np.hypot(*(p - middle - [x, y]).T) - radius).max() < ROUND * NEAR:
        r, d = _number(radius), _number(2 * radius)
        first = _joined([middle[0] + x - radius, middle[1] + y])
        way = int(((p - np.roll(p, 1, 0))[:, 0] * (p + np.roll(p, 1, 0))[:, 1]).sum() < 0)
        return f"M{first}a{r} {r} 0 1 {way} {d} 0a{r} {r} 0 1 {way}-{d} 0z"
    parts = [curve for piece in _pieces(points, normals) for curve in fitted(*piece)]
    at = np.round(parts[-1][-1], 2)
    result, last = f"M{_joined(at)}", ""
    for number, curve in enumerate(parts):
        move = np.round(curve, 2) - at
        at = np.round(curve[-1], 2)
        if len(curve) == 3:
            word, values = "c", move.ravel().tolist()
        elif number == len(parts) - 1:
            continue
        else:
            flat = abs(move[0]) < 0.005
            word, values = (
                ("h", [move[0, 0]]) if flat[1] else ("v", [move[0, 1]]) if flat[0] else ("l", move[0])
            )
        text = _joined(values)
        result += (word if word != last else "" if text.startswith("-") else " ") + text
        last = word
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
            stops = getattr(paint.element, "stops", ())
            made = self._gradient(row, paint.element.name, stops) if stops else None
            fill = self._refer(made or self._picture(row, region))
        opacity = "" if self.opacity[row] >= 1 else f' fill-opacity="{_number(self.opacity[row])}"'
        return f'fill="{fill}"{opacity}'

    def _refer(self, made: str) -> str:
        name = self.defined.setdefault(made, f"p{len(self.defined) + 1}")
        return f"url(#{name})"

    def _local(self, row: int, p: Floats) -> Floats:
        """Leaf coordinates (2, M) of a row at points (2, M)."""
        shapes, field = self.shapes, self.shapes.whole
        world = (p[:, None] - shapes.half) / shapes.unit * [[[1.0]], [[-1.0]]]
        q = field.frames.local(field.xp, np.full(p.shape[1], row), world.astype(np.float32))
        return np.asarray(q, np.float64)[:, 0]

    def _gradient(self, row: int, name: str, stops: Sequence[tuple[float, ...]]) -> str | None:
        """A gradient; None where its lines are bent."""
        size = self.shapes.size
        q = self._local(row, np.array([[0, 1, 0, 1, 0.5], [0, 0, 1, 1, 0.5]]) * size[:, None])
        if (
            abs(q[:, 1] + q[:, 2] - q[:, 0] - q[:, 3]).max() + abs(q[:, 0] + q[:, 3] - 2 * q[:, 4]).max()
            > 1e-4
        ):
            return None
        (a, b, u), (c, d, v) = self.shapes.whole.parts.texture[row].astype(np.float64).reshape(2, 3)
        there = np.array([[a, b], [c, d]]) @ q + [[u], [v]]
        way = np.stack([(there[:, 1] - there[:, 0]) / size[0], (there[:, 2] - there[:, 0]) / size[1]], 1)
        if not abs(np.linalg.det(way)) > 1e-12:
            return None
        back = np.linalg.inv(way)
        shift = -back @ there[:, 0]
        moved = " ".join(f"{value:.6g}" for value in [*back.T.ravel(), *shift])
        texture = self.shapes.whole.textures[self.looks[row][2]]
        offsets = np.array([stop[0] for stop in stops])
        shown = np.array([stop[1:] for stop in stops], np.float32).T
        if any(step[0] == "hue" for step in texture.steps):  # which bends the way from colour to colour
            more = np.linspace(0, 1, 17)
            shown = np.concatenate([shown, [np.interp(more, offsets, channel) for channel in shown]], 1)
            offsets = np.concatenate([offsets, more])
            order = np.argsort(offsets, kind="stable")
            offsets, shown = offsets[order], shown[:, order].astype(np.float32)
        shown = stepped(self.shapes.whole.xp, shown, texture.steps)
        listed = "".join(
            f'<stop offset="{at:.4g}" stop-color="{_hex(rgb)}"/>'
            for at, rgb in zip(offsets, shown.T, strict=True)
        )
        ends = 'x1="-1" x2="1"' if name == "linear" else 'cx="0" cy="0" r="1"'
        form = f'id="%s" gradientUnits="userSpaceOnUse" {ends} gradientTransform="matrix({moved})"'
        return f"<{name}Gradient {form}>{listed}</{name}Gradient>"

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


def svg_of(program: Program, how: How) -> tuple[str, bool]:
    """A Program of the plane as SVG, and whether blended colours became the nearer object's; raises
    `RenderError` where there are no outlines.
    """
    shapes = Shapes(program, how.backend == "exact")
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
        data = ""
        for points, normals in region.outlines():
            x, y = points
            if abs((x * np.roll(y, 1) - y * np.roll(x, 1)).sum()) / 2 > SMALL:
                data += path_of(points, normals)
        if data:
            body.append(f'<path d="{data}" {inks.of(region)}/>')
    if inks.defined:
        defined = "\n".join(made.replace("%s", name, 1) for made, name in inks.defined.items())
        body.insert(0, f"<defs>\n{defined}\n</defs>")
    size = f'width="{width}" height="{height}" viewBox="0 0 {across} {down}"'
    linked = (
        ' xmlns:xlink="http://www.w3.org/1999/xlink"'
        if any("<image" in made for made in inks.defined)
        else ""
    )
    text = "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg"{linked} {size}>', *body, "</svg>", ""])
    return text, blended > 0
