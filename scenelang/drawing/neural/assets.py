"""Grids and pictures that users bring, looked up at points of the plane or of space."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from scenelang.assets.element import HARD, Element, Gradient
from scenelang.assets.picture import texels
from scenelang.assets.pyramid import unpacked
from scenelang.assets.tensors import TensorError
from scenelang.compiler.graph import LUMA, ColourStep
from scenelang.compiler.program import Paint, ProgramError
from scenelang.drawing.arrays import Array, Arrays
from scenelang.drawing.image import decoded
from scenelang.drawing.neural.frames import FrameMap


def blended(xp: Arrays, flat: Array, first: Array, share: Sequence[Array], corners: Sequence[int]) -> Array:
    """Values (…, M) inside cells of a grid, linear along each axis, from ``flat`` (…, K), the last axis
    first. ``first`` is the least node (M,) of each cell, ``share`` how far into it a point lies, d times
    (M,).
    """
    values = []
    for corner in corners:
        row = first + corner
        values.append(_between(xp.take(flat, row), xp.take(flat, row + 1), share[-1]))
    for along in reversed(share[:-1]):
        values = [_between(a, b, along) for a, b in zip(values[::2], values[1::2], strict=True)]
    return values[0]


def _between(a: Array, b: Array, share: Array) -> Array:
    """``a + (b - a) share``, in place of b."""
    b -= a
    b *= share
    b += a
    return b


class Lattice:
    """Values (…, n^d), the last axis first to change, at nodes of [-1, 1]^d, linear between them."""

    def __init__(self, xp: Arrays, flat: Array, side: int, d: int) -> None:
        self.xp, self.d, self.half = xp, d, (side - 1) / 2
        self.nodes, self.side = flat, side
        self._corners = [0, side] if d == 2 else [0, side, side * side, side * side + side]

    def at(self, q: Array) -> Array:
        """Values (…, M) at points (d, M) of the cube."""
        place = (q + 1.0) * self.half
        cell = self.xp.whole(place).clip(0, self.side - 2)
        first = cell[0]
        for axis in range(1, self.d):
            first = first * self.side + cell[axis]
        return blended(self.xp, self.nodes, first, [*(place - self.xp.narrow(cell))], self._corners)


class GridShape(Lattice):
    """A grid of distances. Outside the cube a distance is the least that what lies inside can have."""

    def distance(self, q: Array) -> Array:
        """Distances (M,), in leaf units, at leaf coordinates (d, M)."""
        at = q.clip(-1.0, 1.0)
        result, off = self.at(at), q - at
        beyond = (off * off).sum(0)
        return self.xp.select(beyond > 0, self.xp.sqrt(result * result + beyond), result)

    def steepest(self) -> float:
        """The rate at which the distance in the plane changes at most; infinite for grids that end inside."""
        grid = self.xp.to_numpy(self.nodes).astype(np.float64).reshape(self.side, self.side)
        if min(grid[[0, -1]].min(), grid[:, [0, -1]].min()) < 0:
            return np.inf
        most = [abs(np.diff(grid, axis=axis)).max() * self.half for axis in (0, 1)]
        return max(1.0, float(np.hypot(*most)))

    def field(self, q: Array, gradient: bool) -> Array:
        """Distances (1, M), or these with their change over a cell (1 + d, M), which hides edges."""
        rows = [self.distance(q)[None], *([self._change(self.distance, q)] if gradient else [])]
        return self.xp.concat(rows, 0)

    def _change(self, values: Callable[[Array], Array], q: Array, most: float | None = None) -> Array:
        """Changes (d, M) of values over a cell about points, of coordinates up to ``most``."""
        xp, step, rows = self.xp, 0.5 / self.half, []
        for axis in range(self.d):
            ends = []
            for way in (step, -step):
                moved = [*q]
                moved[axis] = q[axis] + way if most is None else (q[axis] + way).clip(-most, most)
                ends.append((values(xp.stack(moved, 0)), moved[axis]))
            (ahead, last), (behind, first) = ends
            rows.append((ahead - behind) / (2 * step if most is None else last - first))
        return xp.stack(rows, 0)


NEARER = 4  # times that the point of a surface is sought that is nearest to a point outside of the cube
ALONG = 0.6  # of the way along the surface to where a plane would be nearest: it may be round


class GrownShape(GridShape):
    """A grid of an object that reaches out of the cube, where its distances are true ones, too.

    The point of the surface that is nearest to a point outside is sought: from that nearest to the nearest
    point of the cube, along the surface to where it faces the point.
    """

    def steepest(self) -> float:
        return np.inf

    def distance(self, q: Array) -> Array:
        xp, inside = self.xp, q.clip(-1.0, 1.0)
        result = self.at(inside)
        some = xp.where(((q - inside) * (q - inside)).sum(0) > 0)
        if len(some):
            xp.put(result, some, self._nearest(xp.take(q, some))[1])
        return result

    def field(self, q: Array, gradient: bool) -> Array:
        result, xp = super().field(q, gradient), self.xp
        some = xp.where(((q - q.clip(-1.0, 1.0)) * (q - q.clip(-1.0, 1.0))).sum(0) > 0)
        if gradient and len(some):
            away = self._nearest(xp.take(q, some))[0]
            xp.put(result[1:], some, away / xp.length([*away]).clip(1e-9))
        return result

    def _nearest(self, q: Array) -> tuple[Array, Array]:
        """Ways (d, M) to points outside of the cube from the nearest of the surface, about, and lengths."""
        xp = self.xp
        best, normal = self._foot(q.clip(-1.0, 1.0))
        least = xp.length([*(q - best)])
        for _ in range(NEARER):
            away = q - best
            along = away - (away * normal).sum(0) * normal
            found, turned = self._foot((best + ALONG * along).clip(-1.0, 1.0))
            far = xp.length([*(q - found)])
            nearer = far < least
            best, normal = xp.select(nearer, found, best), xp.select(nearer, turned, normal)
            least = xp.select(nearer, far, least)
        return q - best, least

    def _foot(self, q: Array) -> tuple[Array, Array]:
        """Points of the surface (d, M) that are nearest to points of the cube, and unit normals there."""
        slope = self._change(self.at, q, 1.0)
        normal = slope / self.xp.sqrt((slope * slope).sum(0)).clip(1e-9)
        return q - self.at(q) * normal, normal


@lru_cache(maxsize=8)
def _grid(element: Element) -> np.ndarray:
    try:
        return unpacked(element)
    except TensorError as error:
        raise ProgramError(str(error)) from None


def grid_shape(element: Element, xp: Arrays, like: Array, grown: bool = False) -> GridShape:
    """The shape of an element, of objects that reach out of it if ``grown``, where an array lies; raises
    ProgramError where it is damaged.
    """
    grid = _grid(element)
    return (GrownShape if grown else GridShape)(xp, xp.array(grid.reshape(-1), like), len(grid), grid.ndim)


EDGE = 64.0  # texels to a leaf unit that a hard edge counts as
MOST = 1e20  # of a frame's numbers: points times these stay in float32


class Texture:
    """Colours of a paint at leaf coordinates, linear if ``light``; ``frame`` (6,) leads from x and y to the
    picture. Raises `ProgramError` for a damaged element or a frame beyond float32.
    """

    texels: Any = None

    def __init__(self, xp: Arrays, paint: Paint, frame: np.ndarray, like: Array, light: bool) -> None:
        self._xp, self.steps = xp, paint.steps
        assert isinstance(paint.element, Element)
        values = _nodes(paint.element, light)
        flat = xp.array(values.reshape(3, -1), like)
        self.lattice = Lattice(xp, flat, len(values[0]), 3) if values.ndim == 4 else None
        # from leaf coordinates to shares of the picture's sides, from its upper left corner
        (*a, u), (*b, v) = _rows(frame, paint)
        right, down = [n / 2 for n in a], [-n / 2 for n in b]
        self.place = FrameMap(((*right, (u + 1) / 2 % 1.0), (*down, (1 - v) / 2 % 1.0)))
        self.texels, self.sides = flat, values.shape[-2:]
        across = _across(self.place) if values.ndim == 3 else 0.5
        self.detail = across * max(values.shape)  # Texels that a way of a leaf unit may cross, about

    def at(self, q: Array) -> Array:
        """Colours (3, M) at leaf coordinates (d, M)."""
        return stepped(self._xp, self._colours(q), self.steps)

    def _colours(self, q: Array) -> Array:
        return self._picture(q) if self.lattice is None else self.lattice.at(q.clip(-1.0, 1.0))

    def _spot(self, q: Array) -> Any:
        return self.place(self._xp, [*q[: len(self.place.rows[0]) - 1]])

    def _picture(self, q: Array) -> Array:
        xp, (high, wide) = self._xp, self.sides
        cells, shares = [], []
        for share, count in zip(self._spot(q), (wide - 2, high - 2), strict=True):
            place = (share - xp.floor(share)) * count + 0.5  # among the texels and the one before the first
            cells.append(xp.whole(place))
            shares.append(place - xp.narrow(cells[-1]))
        return blended(xp, self.texels, cells[1] * wide + cells[0], shares[::-1], [0, wide])


class _Graded(Texture):
    """The same of a gradient, whose stops are in the space that colours are averaged in."""

    def __init__(self, xp: Arrays, paint: Paint, gradient: Gradient, frame: np.ndarray) -> None:
        self._xp, self.steps, self.gradient = xp, paint.steps, gradient
        self.place = FrameMap(_rows(frame, paint))
        self.detail = EDGE if gradient.edges else min(_across(self.place) * gradient.slope, EDGE)

    def _colours(self, q: Array) -> Array:
        xp, stops = self._xp, self.gradient.stops
        u, v = self._spot(q)
        s = (u + 1.0) * 0.5 if self.gradient.name == "linear" else xp.length([u, v])
        rows = [xp.full((len(s),), value, s) for value in stops[0][1:]]
        for (begin, *a), (end, *b) in pairwise(stops):
            over = end - begin
            share = ((s - begin) * (1.0 / over)).clip(0.0, 1.0) if over > HARD else xp.narrow(s >= end)
            rows = [row + share * (y - x) for row, x, y in zip(rows, a, b, strict=True)]
        return xp.stack(rows, 0)


def texture_of(xp: Arrays, paint: Paint, frame: np.ndarray, like: Array, light: bool) -> Texture:
    """The texture of a paint, which may be a gradient; as `Texture`."""
    if isinstance(paint.element, Gradient):
        return _Graded(xp, paint, paint.element, frame)
    return Texture(xp, paint, frame, like, light)


def _rows(frame: np.ndarray, paint: Paint) -> Any:
    """Rows (2, 3) of a texture's frame, or (2, 4) where it tilts; raises ProgramError for what is beyond
    float32.
    """
    if not max(abs(frame).max(), *map(abs, paint.tilt)) < MOST:
        raise ProgramError("a texture's frame beyond float32")
    rows = frame.astype(np.float64).reshape(2, 3)
    return (np.insert(rows, 2, paint.tilt, 1) if any(paint.tilt) else rows).tolist()


def _across(place: FrameMap) -> float:
    """The most that a coordinate changes over a leaf unit, about."""
    return float(abs(np.array([row[:-1] for row in place.rows])).max())


@lru_cache(maxsize=32)
def _nodes(element: Element, light: bool) -> np.ndarray:
    """Colours (3, n, n, n) of space, or (3, h + 2, w + 2) of a picture, which goes on beyond its sides."""
    try:
        values = texels(element)
    except TensorError as error:
        raise ProgramError(str(error)) from None
    if values.ndim == 3:
        values = np.pad(values, ((1, 1), (1, 1), (0, 0)), "wrap")
    if light:
        values = decoded(values).astype(np.float32)
    return np.ascontiguousarray(np.moveaxis(values, -1, 0))


def stepped(xp: Arrays, rgb: Array, steps: tuple[ColourStep, ...]) -> Array:
    """Colours (3, M) behind a paint's colour steps, clamped after each."""
    for name, *numbers in steps:
        if name == "color":
            rgb = rgb * xp.array(np.array(numbers, np.float32)[:, None], rgb)
        elif name == "grayscale":
            luma = LUMA[0] * rgb[0] + LUMA[1] * rgb[1] + LUMA[2] * rgb[2]
            rgb = rgb + float(numbers[0]) * (luma - rgb)
        else:
            rgb = turned(xp, rgb, float(numbers[0]))
        rgb = rgb.clip(0.0, 1.0)
    return rgb


def turned(xp: Arrays, rgb: Array, turns: float) -> Array:
    """Colours (3, M) with another hue of HSV, in turns, of the same saturation and value."""
    r, g, b = rgb
    value, least = xp.maximum(xp.maximum(r, g), b), xp.minimum(xp.minimum(r, g), b)
    chroma = value - least
    sixth = 1.0 / chroma.clip(1e-12)  # of grey, which has no hue, 0 of it is taken
    of_green, of_blue = (b - r) * sixth + 2.0, (r - g) * sixth + 4.0
    hue = xp.select(value == r, (g - b) * sixth, xp.select(value == g, of_green, of_blue)) / 6.0 + turns % 1.0
    hue = (hue - xp.floor(hue)) * 6.0
    shares = abs(hue - 3.0) - 1.0, 2.0 - abs(hue - 2.0), 2.0 - abs(hue - 4.0)
    return xp.stack([least + chroma * share.clip(0.0, 1.0) for share in shares], 0)
