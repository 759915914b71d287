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

from scenelang.assets.element import Element, Facts
from scenelang.assets.pyramid import between

Grid = npt.NDArray[np.float32]  # (3, n, n, n)
Mask = npt.NDArray[np.bool_]
_LUMA: Final = np.array([[0.25, 0.5, 0.25], [1.0, 0.0, -1.0], [-0.5, 1.0, -0.5]], np.float32)


def _turned(matrix: npt.NDArray[np.float32], grid: Grid) -> Grid:
    return np.asarray((matrix @ grid.reshape(3, -1)).reshape(grid.shape), np.float32)


def _widths(element: Element) -> Grid:
    """Size of a step, for luma and for both differences."""
    return np.array([1.0, 2.0, 2.0], np.float32).reshape(3, 1, 1, 1) / np.float32(element.sizes[1])


def packed(name: str, colours: Grid, near: Mask, about: Facts, steps: int = 40) -> Element:
    """The element of colours, 0 to 1; ``near`` (n, n, n) is true where a node counts.

    A node of a coarser grid counts where any around it does; in the coarsest grid all count. There are
    ``steps`` of luma from 0 to 1; nodes that count are off by half a step at most.
    """
    element = Element(name, "colours", (len(near), steps), "bzip2", b"", about)
    true, widths, grid = _turned(_LUMA, colours), _widths(element), None
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


def unpacked(element: Element) -> Grid:
    """The colours (3, n, n, n), 0 to 1; any bytes give finite numbers. Raises `TensorError` for damage."""
    flat, first, grid = np.frombuffer(element.inflated(), np.int8), 0, None
    widths = _widths(element)
    for side in element.sides:
        shape = (3, side, side, side)
        steps = flat[first : first + 3 * side**3].reshape(shape)
        expected = np.zeros(shape, np.float32) if grid is None else between(grid, linear=True)
        grid, first = expected + steps * widths, first + steps.size
    assert grid is not None
    return _turned(np.linalg.inv(_LUMA), grid).clip(0.0, 1.0)
