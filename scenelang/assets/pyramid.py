"""Elements as arrays: distances and colours as pyramids of grids over [-1, 1]^d, with their codecs; curves.

Each grid has twice as many cells as the one before. What it adds to that one is a step at each node: a whole
number from -127 to 127. Of signed distances it counts times a width that grows with the distance, so that
nodes far from the surface mostly have the step 0, and packing makes little of them. Between the nodes of a
grid the next one expects what the cubic through four of them gives (Deslauriers and Dubuc 1989). Nothing here
is learned.

Of two codings, ``deflate`` has one width for all grids; ``bzip2`` has finer steps in the last grid, at the
nodes that normals on the surface are made of. Without, a smooth surface looks hammered in the light.

Colours have steps for luma and for both differences of colour (YCoCg, Malvar and Sullivan 2003), which take
steps twice as wide, and nodes between are expected linearly. Only nodes beside a surface take any but 0, so
that bzip2 makes little of the others.
"""

from __future__ import annotations

import bz2
import zlib
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import GRAIN, MOST_SIDE, Element, Facts, splined

Grid = npt.NDArray[np.float32]  # of colours (3, n, n, n)
FINE: Final = 24.0  # steps in a cell's side near the surface
FINER: Final = 64.0  # the same in the last grid of the coding with finer steps,
NEAR: Final = 2.0  # within so many cells of the surface
# far from the surface a distance has FAR + FIRST / n steps, n nodes along an axis: coarse grids shape blends
FAR: Final = 8.0
FIRST: Final = 400.0
FARTHEST: Final = 4.0  # larger than any distance in the cube
SPLINE: Final = 1e-5  # leaf units: farthest that quadratic curves lie off a spline
Mask = npt.NDArray[np.bool_]
_LUMA: Final = np.array([[0.25, 0.5, 0.25], [1.0, 0.0, -1.0], [-0.5, 1.0, -0.5]], np.float32)


def between(grid: Grid, linear: bool = False) -> Grid:
    """The grid of twice as many cells: the nodes, and what lies between them by cubics.

    Of colours (3, n, …) it is ``linear``: the means of neighbours.
    """
    for axis in range(int(linear), grid.ndim):
        a = np.moveaxis(grid, axis, 0)
        n = len(a)
        out = np.empty((2 * n - 1, *a.shape[1:]), np.float32)
        out[0::2] = a
        if n < 4 or linear:
            out[1::2] = (a[:-1] + a[1:]) / 2
        else:
            middle = a[1:-2] + a[2:-1]
            middle *= 9
            middle -= a[:-3]
            middle -= a[3:]
            np.divide(middle, 16, out=out[3:-3:2])
            out[1] = (5 * a[0] + 15 * a[1] - 5 * a[2] + a[3]) / 16
            out[-2] = (5 * a[-1] + 15 * a[-2] - 5 * a[-3] + a[-4]) / 16
        grid = np.moveaxis(out, 0, axis)
    return np.ascontiguousarray(grid, np.float32)


def _widths(expected: Grid, finer: bool) -> Grid:
    """Size of a step at each node."""
    cell, away = 2 / (len(expected) - 1), abs(expected)
    result = np.maximum(np.float32(cell / FINE), away / np.float32(FAR + FIRST / len(expected)))
    if finer:
        result[away < np.float32(NEAR * cell)] = np.float32(cell / FINER)
    return np.asarray(result, np.float32)


def _stepped(expected: Grid, steps: npt.NDArray[np.int8], finer: bool) -> Grid:
    result = expected + steps.astype(np.float32) * _widths(expected, finer)
    return np.clip(result, -FARTHEST, FARTHEST)


def refine(
    grid: Grid | None, side: int, dimension: int, true: Callable[[Grid], Grid], finer: bool = False
) -> tuple[Grid, npt.NDArray[np.int8]]:
    """The grid of ``side`` nodes along an axis after another one, if any, and its steps.

    ``true`` gives the true distances at the nodes from the expected ones; a last grid may be ``finer``.
    """
    expected = np.zeros((side,) * dimension, np.float32) if grid is None else between(grid)
    steps = np.rint((true(expected) - expected) / _widths(expected, finer))
    clipped = np.clip(steps, -127, 127).astype(np.int8)
    return _stepped(expected, clipped, finer), clipped


def packed(
    name: str, cells: int, steps: list[npt.NDArray[np.int8]], about: Facts, finer: bool = False
) -> Element:
    """The element of a pyramid's steps, the last of them finer or not."""
    raw = b"".join(grid.tobytes() for grid in steps)
    coding, data = ("bzip2", bz2.compress(raw)) if finer else ("deflate", zlib.compress(raw, 9))
    return Element(name, "pyramid", (steps[0].ndim, cells, len(steps)), coding, data, about)


def has_finer(element: Element) -> bool:
    """Return whether the last grid of a pyramid has finer steps near the surface."""
    return element.coding == "bzip2"


def unpacked(element: Element) -> Grid:
    """The finest grid of an element, as it is drawn; any bytes give finite numbers. Raises `TensorError`."""
    flat, first, grid = np.frombuffer(element.inflated(), np.int8), 0, None
    for side in element.sides:
        shape = (side,) * element.dimension
        steps = flat[first : first + side**element.dimension].reshape(shape)
        expected = np.zeros(shape, np.float32) if grid is None else between(grid)
        finer = has_finer(element) and side == element.sides[-1]
        grid, first = _stepped(expected, steps, finer), first + steps.size
    assert grid is not None
    return finest(grid)


def finest(grid: Grid) -> Grid:
    """The last grid of a pyramid as it is drawn: once more refined where it is small."""
    return between(grid) if 2 * len(grid) - 1 <= MOST_SIDE[grid.ndim] else grid


def _turned(matrix: npt.NDArray[np.float32], grid: Grid) -> Grid:
    return np.asarray((matrix @ grid.reshape(3, -1)).reshape(grid.shape), np.float32)


def _colour_widths(element: Element) -> Grid:
    """Size of a step, for luma and for both differences."""
    return np.array([1.0, 2.0, 2.0], np.float32).reshape(3, 1, 1, 1) / np.float32(element.sizes[1])


def packed_colours(name: str, colours: Grid, near: Mask, about: Facts, steps: int = 40) -> Element:
    """The element of colours, 0 to 1; ``near`` (n, n, n) is true where a node counts.

    A node of a coarser grid counts where any around it does; in the coarsest grid all count. There are
    ``steps`` of luma from 0 to 1; nodes that count are off by half a step at most.
    """
    element = Element(name, "colours", (len(near), steps), "bzip2", b"", about)
    true, widths, grid = _turned(_LUMA, colours), _colour_widths(element), None
    result: list[bytes] = []
    for side in element.sides:
        apart = (len(near) - 1) // (side - 1)
        expected = np.zeros((3, side, side, side), np.float32) if grid is None else between(grid, linear=True)
        wanted = np.rint((true[:, ::apart, ::apart, ::apart] - expected) / widths)
        clipped = (wanted.clip(-127, 127) * (_around(near, apart) if result else True)).astype(np.int8)
        grid = expected + clipped * widths
        result.append(clipped.tobytes())
    return replace(element, data=bz2.compress(b"".join(result), 9))


def _around(near: Mask, apart: int) -> Mask:
    """Mask of every ``apart``-th node: true where a node of ``near`` is closer than that along each axis."""
    for axis in (0, 1, 2) if apart > 1 else ():
        padded = np.pad(np.moveaxis(near, axis, 0), [(apart - 1, apart - 1), (0, 0), (0, 0)])
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * apart - 1, axis=0)
        near = np.moveaxis(np.asarray(windows[::apart].any(-1)), 0, axis)
    return near


def unpacked_colours(element: Element) -> Grid:
    """The colours (3, n, n, n), 0 to 1; any bytes give finite numbers. Raises `TensorError` for damage."""
    flat, first, grid = np.frombuffer(element.inflated(), np.int8), 0, None
    widths = _colour_widths(element)
    for side in element.sides:
        shape = (3, side, side, side)
        steps = flat[first : first + 3 * side**3].reshape(shape)
        expected = np.zeros(shape, np.float32) if grid is None else between(grid, linear=True)
        grid, first = expected + steps * widths, first + steps.size
    assert grid is not None
    return _turned(np.linalg.inv(_LUMA), grid).clip(0.0, 1.0)


def curves_of(element: Element) -> npt.NDArray[np.float64]:
    """Curves (n, 3, 2) of what is `curved`: start, control point and end, leaf units; any bytes of an outline
    give some. Those of a spline lie within `SPLINE` of it.
    """
    if element.form == "polygon":
        points = np.array(element.points)
        ends = np.roll(points, -1, 0)
        return np.stack([points, (points + ends) / 2, ends], 1)
    if element.form == "spline":
        return _quadratic(np.array(splined(element.points)))
    curves = np.frombuffer(element.data, "<i2").reshape(-1, 3, 2) / GRAIN
    straight = (curves[:, 1] == curves[:, 0]).all(1) | (curves[:, 1] == curves[:, 2]).all(1)
    curves[straight, 1] = curves[straight][:, ::2].mean(1)
    return curves


def _quadratic(cubics: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Quadratic curves (n, 3, 2) along cubic ones (m, 4, 2)."""
    a, b, c, d = cubics.swapaxes(0, 1)
    # |s (s - 1/2) (s - 1)|, by which the term of t^3 leaves the quadratic through three points, is below this
    count = np.ceil(np.cbrt(np.hypot(*(d - 3 * c + 3 * b - a).T) * 3**0.5 / 36 / SPLINE)).astype(int).clip(1)
    which = np.repeat(np.arange(len(cubics)), count)
    step = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    terms = np.stack([a, 3 * (b - a), 3 * (a - 2 * b + c), d - 3 * c + 3 * b - a])[:, which]

    def at(t: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return np.asarray(terms[0] + t * (terms[1] + t * (terms[2] + t * terms[3])))

    size = 1 / count[which, None]
    begins = at(step[:, None] * size)
    ends = np.roll(begins, -1, 0)  # so that curves meet to the last digit
    middle = at((step[:, None] + 0.5) * size)
    return np.stack([begins, 2 * middle - (begins + ends) / 2, ends], 1)
