"""The exact field of the plane in float64: samples, textures, leaves and folds, part by part.

Leaves and folds take numpy arrays and torch tensors alike, as training makes its data by them on any device.
Points are one array (d, …), or a sequence of its d coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache, reduce
from itertools import product
from math import hypot, inf, isnan
from operator import add, mul
from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import Element, Gradient
from scenelang.assets.picture import texels
from scenelang.compiler.geometries import GEOMETRIES, namespace
from scenelang.compiler.graph import LUMA, ColourStep, Fold, Leaf, Link, Look, Node, leaves
from scenelang.compiler.groups import SMOOTH, SUBTRACT, UNION
from scenelang.compiler.steps import Affine, Grow, Own, Shell, Step, Warp
from scenelang.drawing.image import decoded
from scenelang.language.words import BLEND, TOKENS

Floats = npt.NDArray[np.float64]
Array = Any  # numpy array or torch tensor


def sample_points(
    canvas: tuple[int, int], rows: range, per_side: int, columns: range | None = None
) -> npt.NDArray[np.float64]:
    """World coordinates (2, M) of the samples of some pixel rows and columns, row by row of samples."""
    width, height = canvas
    unit = min(width, height) / 2
    columns = columns or range(width)
    x = ((np.arange(columns.start * per_side, columns.stop * per_side) + 0.5) / per_side - width / 2) / unit
    fine = np.arange(rows.start * per_side, rows.stop * per_side)
    y = (height / 2 - (fine + 0.5) / per_side) / unit
    return np.stack([np.tile(x, len(y)), np.repeat(y, len(x))])


def colour_at(look: Look, q: Sequence[Floats], light: bool = False) -> Floats:
    """Colours (M, 3) of a look with an element at its own coordinates (d, M), linear if ``light``."""
    assert look.element is not None
    if isinstance(look.element, Gradient):  # whose stops are in the space that colours are averaged in
        return _stepped(_graded(look.element, *q), look.colours)
    values = _values(look.element, light)
    if values.ndim == 4:
        places = [(np.clip(x, -1, 1) + 1) / 2 * (len(values) - 1) for x in q]
    else:
        (u, v), (high, wide) = q, values.shape[:2]
        places = [(1 - v) / 2 * high - 0.5, (u + 1) / 2 * wide - 0.5]
    return _stepped(_mixed(values, places), look.colours)


def along(gradient: Gradient, u: Floats, v: Floats) -> Floats:
    """Offsets (M,) of points (u, v) on a gradient."""
    return np.asarray((u + 1) / 2 if gradient.name == "linear" else np.hypot(u, v))


def _graded(gradient: Gradient, u: Floats, v: Floats) -> Floats:
    """Colours (M, 3) of a gradient at points (u, v), before operations."""
    offsets, colours = np.split(np.array(gradient.stops, np.float64), [1], 1)
    s = along(gradient, u, v)
    after = np.searchsorted(offsets[:, 0], s, "right")  # of equal offsets the last has been passed
    a, b = np.maximum(after - 1, 0), np.minimum(after, len(offsets) - 1)
    gap = (offsets[b] - offsets[a])[:, 0]
    share = np.where(gap > 0, (s - offsets[a, 0]) / np.where(gap > 0, gap, 1), 0.0)[:, None]
    return np.asarray(colours[a] * (1 - share) + colours[b] * share)


@lru_cache(maxsize=16)
def _values(element: Element, light: bool) -> Floats:
    """Colours (h, w, 3) or (n, n, n, 3)."""
    result = texels(element).astype(np.float64)
    if element.form == "picture":  # of 8 bits
        result = np.rint(result * 255) / 255
    return np.asarray(decoded(result), np.float64) if light else result


def _mixed(values: Floats, places: list[Floats]) -> Floats:
    """Colours between the nearest nodes along each axis, where the first follows the last."""
    total: Floats = np.zeros((len(places[0]), 3))
    first = [np.floor(place).astype(int) for place in places]
    for corner in np.ndindex(*(2,) * len(places)):
        share, index = np.ones(len(places[0])), []
        for place, low, side, up in zip(places, first, values.shape, corner, strict=False):
            share = share * (place - low if up else 1 - (place - low))
            index.append((low + up) % side)
        total += share[:, None] * values[tuple(index)]
    return total


def _stepped(rgb: Floats, steps: Iterable[ColourStep]) -> Floats:
    """Colours behind operations, clamped after each."""
    for kind, *numbers in steps:
        if kind == "color":
            rgb = rgb * numbers
        elif kind == "grayscale":
            rgb = rgb + numbers[0] * ((rgb @ LUMA)[:, None] - rgb)
        else:
            rgb = _turned(rgb, numbers[0])
        rgb = np.clip(rgb, 0.0, 1.0)
    return rgb


def _turned(rgb: Floats, turns: float) -> Floats:
    """The same S and V of HSV, and H further by so many turns."""
    most, least = rgb.max(1), rgb.min(1)
    first = rgb.argmax(1)
    other = [np.take_along_axis(rgb, ((first + k) % 3)[:, None], 1)[:, 0] for k in (1, 2)]
    span = np.where(most > least, most - least, 1.0)
    hue = (2 * first + (other[0] - other[1]) / span) / 6 + turns
    # a channel is full within a sixth of a turn of its own hue, and empty beyond a third
    away = [abs((hue - own / 3 + 0.5) % 1 - 0.5) for own in range(3)]
    return np.stack([least + (most - least) * np.clip(2 - 6 * a, 0, 1) for a in away], 1)


Brought = Mapping[str, Any]
"""True shapes of elements by geometry: each answers points (M, d) of the leaf's own space with signed
``distances`` (M,), and in space with their gradients ``slopes`` (M, 3)."""


def leaf_distance(geometry: str, p: Array, brought: Brought | None = None) -> Array:
    """Exact signed distance of a leaf at points (d, …), leaf units, those of elements (d, M)."""
    if brought and geometry in brought:
        return brought[geometry].distances(np.transpose(p))
    return GEOMETRIES[geometry].distance(p)


def worn(steps: Sequence[Step], d: Array, p: Array) -> Array:
    """A leaf's own distances (M,) at its own points (d, M), behind those of its steps that change them."""
    for step in steps:
        if not isinstance(step, Own):
            break
        if isinstance(step, Grow):
            d = d - step.r
        elif isinstance(step, Shell):
            d = abs(d) - step.w / 2
        else:
            d = d + step.amount * reduce(mul, [np.sin(step.frequency * x) for x in p])
    return d


def combine(
    big_d: Array, big_c: Array, d: Array, c: Array, token: int, k: float = 0.0
) -> tuple[Array, Array]:
    """One step of the fold: (D, C) behind an object, of distances of shape S and colours that broadcast
    against (*S, 3). k is the width of a blend, 0 for the usual one. Colours of four channels are
    premultiplied, with the coverage behind.
    """
    xp = namespace(d)
    out_d, share, _ = folded(xp, token, k or BLEND * (token == SMOOTH), big_d, d)
    if share is None:
        return out_d, big_c
    share = share[..., None]
    if token == UNION and c.shape[-1] == 4:
        c = c + (1.0 - c[..., 3:]) * xp.where((big_d < 0.0)[..., None], big_c, 0.0)
    return out_d, big_c + (c - big_c) * share if token == SMOOTH else xp.where(share, c, big_c)


def folded(xp: Any, token: int, k: float, big_d: Array, d: Array) -> tuple[Array, Array, Array]:
    """The distance behind an operand, its shares in the colour, None for none, and in the gradient."""
    if token == UNION:
        return xp.minimum(big_d, d), d < xp.clip(big_d, 0.0, None), d <= big_d
    if token == SMOOTH:
        h = xp.clip(0.5 + 0.5 * (big_d - d) / k, 0.0, 1.0)
        # each side by its own share: a difference of the two would swallow the nearer one's digits
        return big_d * (1 - h) + d * h - k * h * (1 - h), h, h
    d = -d if token == SUBTRACT else d
    if not k:
        return xp.maximum(big_d, d), None, d >= big_d
    h = xp.clip(0.5 + 0.5 * (d - big_d) / k, 0.0, 1.0)
    return big_d * (1 - h) + d * h + k * h * (1 - h), None, h


def map_back(frame: Array, p: Array) -> list[Array]:
    """Points (d, …) through the inverse of an affine map, as d rows of d factors and a shift."""
    return [reduce(add, map(mul, row, p)) + row[-1] for row in frame]


def warp_back(twirl: Array, bend: Sequence[Array], p: Array) -> list[Array]:
    """``p -> R(twirl |p| + bend . p) p`` with ``R(a) p = (cos a x + sin a y, -sin a x + cos a y, …)``."""
    x, y, *others = p
    xp = namespace(x)
    angle = reduce(add, map(mul, bend, p), twirl * xp.sqrt(reduce(add, (c * c for c in p))))
    cos, sin = xp.cos(angle), xp.sin(angle)
    return [cos * x + sin * y, cos * y - sin * x, *others]


def carry_back(steps: Sequence[Step], p: Array) -> Array:
    """World points (d, M) to leaf coordinates: from the last step to the first."""
    for step in reversed(steps):
        if isinstance(step, Affine):
            p = map_back(frame_back(step, len(p)), p)
        elif isinstance(step, Warp):
            p = warp_back(step.twirl, step.bend, p)
    return p


@lru_cache(maxsize=1 << 12)
def frame_back(step: Affine, dimension: int) -> Floats:
    """The inverse of an affine map, as d rows of d factors and a shift."""
    rows = np.reshape(step.rows, (3, 4))[:dimension]
    inverse = np.linalg.inv(rows[:, :dimension])
    return np.column_stack([inverse, -inverse @ rows[:, 3]])


@lru_cache(maxsize=1 << 12)
def distance_scale(steps: tuple[Step, ...], dimension: int = 2) -> float:
    """The smallest singular value of the linear part of the affine steps composed in order."""
    linear = np.eye(dimension)
    for step in steps:
        if isinstance(step, Affine):
            linear = np.reshape(step.rows, (3, 4))[:dimension, :dimension] @ linear
    return float(np.linalg.svd(linear, compute_uv=False)[-1])


def evaluate(
    node: Node,
    p: Array,
    outer: tuple[Step, ...] = (),
    *,
    clear: bool = False,
    owners: bool = False,
    brought: Brought | None = None,
) -> tuple[Any, Any]:
    """Distance D (M,) and colour C (M, 3) of a node at world points (d, M), float64, with steps of the folds
    around it, nearest first. In place of C, if ``clear``, premultiplied colour and coverage (M, 4), and if
    ``owners``, the number of the object that shows most, how much it does, and coverage (M, 3).
    """
    steps = (*(move.step for move in node.moves), *outer)
    if isinstance(node, Leaf):
        q = carry_back(steps, p)
        d = worn(steps, leaf_distance(node.geometry, q, brought), q) * distance_scale(steps, len(p))
        look = node.look
        if owners:
            c = np.asarray((node.number, look.opacity, look.opacity), np.float64)
        elif look.element is not None:
            c = colour_at(look, carry_back(look.texture, q)[: look.element.dimension])
        else:
            c = np.asarray(look.colour(), np.float64)
        if clear:
            c = look.opacity * np.concatenate([c, np.ones((*c.shape[:-1], 1))], -1)
        return d, np.broadcast_to(c, (*d.shape, c.shape[-1]))
    big_d, big_c = np.full(p[0].shape, np.inf), np.zeros((*p[0].shape, 4 if clear else 3))
    for index, link in enumerate(node.links):
        d, c = evaluate(link.node, p, steps, clear=clear, owners=owners, brought=brought)
        if index == 0:
            big_d, big_c = d, c
        else:
            # nothing blends with the empty set, which is infinitely far from everywhere
            empty = np.isinf(big_d).all() or np.isinf(d).all()
            token = TOKENS["union" if empty and link.op == "smooth" else link.op]
            width = 0.0 if empty else link.width
            with np.errstate(invalid="ignore"):
                if owners:
                    behind = np.where(big_d[:, None] < 0.0, 1.0 - c[:, 2:], 0.0) * (token == UNION)
                    blank = np.zeros((len(c), 1))
                    big_d, share = combine(big_d, blank, d, blank + 1.0, token, width)
                    big_c = _owned(big_c, c, share, behind)
                else:
                    big_d, big_c = combine(big_d, big_c, d, c, token, width)
    return big_d, big_c


def _owned(big_c: Floats, c: Floats, share: Floats, behind: Floats) -> Floats:
    """Owners (M, 3) as of `evaluate` behind an operand's, which comes in by a share (M, 1); ``behind`` (M, 1)
    is how much is seen through it.
    """
    left = (1.0 - share * (1.0 - behind)) * big_c[:, 1:]
    comes = (share > 0.5) & (c[:, 1:2] >= behind * big_c[:, 1:2])
    number, most = np.where(comes, c[:, :1], big_c[:, :1]), np.where(comes, share * c[:, 1:2], left[:, :1])
    return np.concatenate([number, most, left[:, 1:] + share * c[:, 2:]], 1)


def placed_leaves(
    node: Node, outer: tuple[Step, ...] = (), taken: bool = False
) -> Iterator[tuple[Leaf, tuple[Step, ...], bool]]:
    """Leaves in order with all their steps, and whether a `subtract` takes them away."""
    steps = (*(move.step for move in node.moves), *outer)
    if isinstance(node, Leaf):
        yield node, steps, taken
    else:
        for at, link in enumerate(node.links):
            yield from placed_leaves(link.node, steps, taken or (at > 0 and link.op == "subtract"))


_MOST, _LEAST = 1 << 16, 1 << 10  # pixels of a part that is halved whatever it holds, and of one that is not
_FEW = 4  # objects that are no reason to go on halving
_DIGITS = 1e-12  # of a coordinate: more than float64 loses in a step


def parts(
    root: Fold, canvas: tuple[int, int], brought: Brought | None
) -> Iterator[tuple[Node, range, range]]:
    """Parts of a picture: the node that may be seen there, rows and columns."""
    (width, height), unit = canvas, min(canvas) / 2
    todo: list[tuple[Node, range, range]] = [(root, range(height), range(width))]
    while todo:
        node, rows, columns = todo.pop()
        across, down = columns.start + columns.stop - width, height - rows.start - rows.stop
        radius = hypot(len(rows), len(columns)) / 2 / unit * (1.0 + 1e-9)
        low, node = within(node, np.array([[across], [down]]) / 2 / unit, radius, brought=brought)
        few = low > 0 or sum(1 for _ in leaves(node)) <= _FEW
        if len(rows) * len(columns) <= (_MOST if few else _LEAST):
            yield Fold("scene", ()) if low > 0 else node, rows, columns
        else:
            halves = [(side[: len(side) // 2], side[len(side) // 2 :]) for side in (rows, columns)]
            todo += [(node, tall, wide) for tall, wide in product(*halves) if tall and wide]


def within(
    node: Node,
    centre: Array,
    radius: float,
    outer: tuple[Step, ...] = (),
    *,
    signed: bool = True,
    brought: Brought | None = None,
) -> tuple[float, Node]:
    """A bound below the distance of a node in a disc of world points, and the node without what is outside,
    if ``signed``: then only the sign of the distance counts, and the colour where it is negative. A blend
    wants the distance itself.
    """
    steps = (*(move.step for move in node.moves), *outer)
    if isinstance(node, Leaf):
        q, spread = _carried(steps, centre, radius)
        d = worn(steps, leaf_distance(node.geometry, q, brought), q)
        low = float(d[0] - spread) * distance_scale(steps)
        return (-inf if isnan(low) else low), node
    last = max((index for index, link in enumerate(node.links) if link.width), default=-1)
    low = inf
    kept: list[Link] = []
    for index, link in enumerate(node.links):
        free = signed and index > last
        own, child = within(link.node, centre, radius, steps, signed=free, brought=brought)
        if free and ((own > 0 and link.op != "intersect") or (index and not kept and link.op != "union")):
            low = min(low, own) if link.op == "union" else low
            continue
        kept.append(Link(link.op, child, link.k))
        if link.op == "intersect":
            low = max(low, own)
        elif link.op != "subtract":
            low = min(low, own) - link.width / 4  # what a blend adds at most
    return low, Fold(node.kind, tuple(kept), node.moves, node.span)


def _carried(steps: tuple[Step, ...], centre: Array, radius: float) -> tuple[Array, float]:
    """A disc carried back: the centre, and the radius of a disc around it that holds all of its points."""
    for step in reversed(steps):
        size = hypot(*np.ravel(centre))
        if isinstance(step, Affine):
            radius = _stretch(step) * (radius + _DIGITS * (size + hypot(step.rows[3], step.rows[7])))
        elif isinstance(step, Warp):
            rate = abs(step.twirl) + hypot(*step.bend)  # how fast the angle changes
            radius = (radius + _DIGITS * size) * (1.0 + rate * (size + radius))
        centre = np.asarray(carry_back((step,), centre))
    return centre, radius


@lru_cache(maxsize=1 << 12)
def _stretch(step: Affine) -> float:
    """Greatest factor by which the way back lengthens."""
    return float(np.linalg.norm(frame_back(step, 2)[:, :2], 2))
