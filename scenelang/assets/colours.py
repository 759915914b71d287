"""Colours over [-1, 1]^3 as a pyramid of grids, and the codec that makes it small.

Each grid has twice as many cells as the one before, from whose nodes those between are expected linearly.
What a grid adds is a step at each node, a whole number from -127 to 127, for luma and for both differences of
colour (YCoCg, Malvar and Sullivan 2003), which take steps twice as wide. Only nodes beside a surface take any
but 0, so that bzip2 makes little of the others.
"""

from __future__ import annotations

import bz2
from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import Element

Grid = npt.NDArray[np.float32]  # (3, n, n, n)
_LUMA: Final = np.array([[0.25, 0.5, 0.25], [1.0, 0.0, -1.0], [-0.5, 1.0, -0.5]], np.float32)


def between(grid: Grid) -> Grid:
    """The grid (3, 2 n - 1, …) of a grid's nodes and of what lies linearly between them."""
    for axis in (1, 2, 3):
        a = np.moveaxis(grid, axis, 0)
        out = np.empty((2 * len(a) - 1, *a.shape[1:]), np.float32)
        out[0::2] = a
        out[1::2] = (a[:-1] + a[1:]) / 2
        grid = np.moveaxis(out, 0, axis)
    return np.ascontiguousarray(grid)


def _turned(matrix: npt.NDArray[np.float32], grid: Grid) -> Grid:
    return np.asarray((matrix @ grid.reshape(3, -1)).reshape(grid.shape), np.float32)


def _widths(element: Element) -> Grid:
    """How much a step is, for luma and for both differences."""
    return np.array([1.0, 2.0, 2.0], np.float32).reshape(3, 1, 1, 1) / np.float32(element.sizes[1])


def packed(
    name: str, colours: Grid, near: npt.NDArray[np.bool_], about: dict[str, str | float], steps: int = 40
) -> Element:
    """The element of colours, 0 to 1.

    Args:
        near: (n, n, n), whether a node counts. One of a coarser grid does where any around it do, and of the
            coarsest all.
        steps: of luma from 0 to 1; half a step is the farthest that a node that counts comes to lie off.
    """
    element = Element(name, "colours", (len(near), steps), "bzip2", b"", about)
    true, widths, grid = _turned(_LUMA, colours), _widths(element), None
    found: list[bytes] = []
    for side in element.sides:
        apart = (len(near) - 1) // (side - 1)
        expected = np.zeros((3, side, side, side), np.float32) if grid is None else between(grid)
        wanted = np.rint((true[:, ::apart, ::apart, ::apart] - expected) / widths)
        kept = (wanted.clip(-127, 127) * (_around(near, apart) if found else True)).astype(np.int8)
        grid = expected + kept * widths
        found.append(kept.tobytes())
    return replace(element, data=bz2.compress(b"".join(found), 9))


def _around(near: npt.NDArray[np.bool_], apart: int) -> npt.NDArray[np.bool_]:
    """Which of the nodes that are so far apart have one of ``near`` closer than that, along each axis."""
    for axis in (0, 1, 2) if apart > 1 else ():
        a = np.moveaxis(near, axis, 0)
        padded = np.pad(a, [(apart - 1, apart - 1), (0, 0), (0, 0)])
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * apart - 1, axis=0)
        near = np.moveaxis(np.asarray(windows[::apart].any(-1)), 0, axis)
    return near


def unpacked(element: Element) -> Grid:
    """The colours (3, n, n, n), 0 to 1; any bytes give finite numbers.

    Raises:
        TensorError: the element is damaged.
    """
    flat, first, grid = np.frombuffer(element.inflated(), np.int8), 0, None
    widths = _widths(element)
    for side in element.sides:
        shape = (3, side, side, side)
        steps = flat[first : first + 3 * side**3].reshape(shape)
        expected = np.zeros(shape, np.float32) if grid is None else between(grid)
        grid, first = expected + steps * widths, first + steps.size
    assert grid is not None
    return _turned(np.linalg.inv(_LUMA), grid).clip(0.0, 1.0)
