"""Signed distances as a pyramid of grids over [-1, 1]^d, and the codec that makes it small.

Each grid has twice as many cells as the one before. What it adds to that one is a step at each node: a whole
number from -127 to 127, times a width that grows with the distance, so that nodes far from the surface mostly
have the step 0, and packing makes little of them. Between the nodes of a grid the next one expects what the
cubic through four of them gives (Deslauriers and Dubuc 1989). Nothing here is learned.

Of two codings, ``deflate`` has one width for all grids; ``bzip2`` has finer steps in the last grid, at the
nodes that normals on the surface are made of. Without, a smooth surface looks hammered in the light.
"""

from __future__ import annotations

import bz2
import zlib
from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import MOST_SIDE, Element, Facts

Grid = npt.NDArray[np.float32]
FINE: Final = 24.0  # steps in a cell's side near the surface
FINER: Final = 64.0  # the same in the last grid of the coding with finer steps,
NEAR: Final = 2.0  # within so many cells of the surface
# far from the surface a distance has FAR + FIRST / n steps, n nodes along an axis: coarse grids shape blends
FAR: Final = 8.0
FIRST: Final = 400.0
FARTHEST: Final = 4.0  # larger than any distance in the cube


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
