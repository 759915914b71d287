"""Grids of distances, which users bring, at points of the plane or of space."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from scenelang.elements.element import Element
from scenelang.elements.pyramid import unpacked
from scenelang.program.program import ProgramError
from scenelang.renderers.arrays import Array, Arrays
from scenelang.tensors import TensorError


class GridShape:
    """A grid of distances over [-1, 1]^d, linear between its nodes.

    Outside the cube a distance is the least that what lies inside can have.

    Args:
        xp: the library.
        flat: distances (n^d,), the last axis first to change.
        side: n.
        d: 2 or 3.
    """

    def __init__(self, xp: Arrays, flat: Array, side: int, d: int) -> None:
        self._xp, self._flat, self._side, self._d = xp, flat, side, d
        self._half = (side - 1) / 2
        self._corners = [0, side] if d == 2 else [0, side, side * side, side * side + side]

    def distance(self, q: Array) -> Array:
        """Distances (M,), in leaf units, at leaf coordinates (d, M)."""
        xp, n, d, flat = self._xp, self._side, self._d, self._flat
        at = q.clip(-1.0, 1.0)
        place = (at + 1.0) * self._half
        cell = xp.whole(place).clip(0, n - 2)
        share = place - xp.narrow(cell)
        first = cell[0]
        for axis in range(1, d):
            first = first * n + cell[axis]
        values = []
        for corner in self._corners:
            row = first + corner
            a = xp.take(flat, row)
            values.append(a + (xp.take(flat, row + 1) - a) * share[d - 1])
        for axis in range(d - 2, -1, -1):
            pairs = zip(values[::2], values[1::2], strict=True)
            values = [a + (b - a) * share[axis] for a, b in pairs]
        off = q - at
        beyond = (off * off).sum(0)
        return xp.select(beyond > 0, xp.sqrt(values[0] * values[0] + beyond), values[0])

    def field(self, q: Array, gradient: bool) -> Array:
        """Distances (1, M), or these and how they change (1 + d, M).

        The change is that over a cell, as the edges of one would show in the light.
        """
        xp, step, rows = self._xp, 0.5 / self._half, [self.distance(q)]
        for axis in range(self._d) if gradient else ():
            moved = [*q]
            moved[axis] = q[axis] + step
            ahead = self.distance(xp.stack(moved, 0))
            moved[axis] = q[axis] - step
            rows.append((ahead - self.distance(xp.stack(moved, 0))) / (2 * step))
        return xp.stack(rows, 0)


@lru_cache(maxsize=8)
def _grid(element: Element) -> np.ndarray:
    try:
        return unpacked(element)
    except TensorError as error:
        raise ProgramError(str(error)) from None


def grid_shape(element: Element, xp: Arrays, like: Array) -> GridShape:
    """The shape of an element, where an array lies.

    Raises:
        ProgramError: the element is damaged.
    """
    grid = _grid(element)
    return GridShape(xp, xp.array(grid.reshape(-1), like), len(grid), grid.ndim)
