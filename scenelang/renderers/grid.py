"""Grids that users bring, at points of the plane or of space: of distances, and whatever lies at nodes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from scenelang.elements.element import Element
from scenelang.elements.pyramid import unpacked
from scenelang.program.program import ProgramError
from scenelang.renderers.arrays import Array, Arrays
from scenelang.tensors import TensorError


def blended(xp: Arrays, flat: Array, first: Array, share: Sequence[Array], corners: Sequence[int]) -> Array:
    """Values (…, M) inside cells of a grid, linear along each axis.

    Args:
        xp: the library.
        flat: values at nodes (…, K), the last axis first to change.
        first: the least node (M,) of each cell.
        share: how far into the cell a point lies, d times (M,).
        corners: where from there the 2^(d - 1) edges along the last axis begin.
    """
    values = []
    for corner in corners:
        row = first + corner
        values.append(_between(xp.take(flat, row), xp.take(flat, row + 1), share[-1]))
    for along in reversed(share[:-1]):
        pairs = zip(values[::2], values[1::2], strict=True)
        values = [_between(a, b, along) for a, b in pairs]
    return values[0]


def _between(a: Array, b: Array, share: Array) -> Array:
    """``a + (b - a) share``, in place of b."""
    b -= a
    b *= share
    b += a
    return b


class Lattice:
    """Values at nodes of [-1, 1]^d, linear between them.

    Args:
        xp: the library.
        flat: values (…, n^d), the last axis first to change.
        side: n.
        d: 2 or 3.
    """

    def __init__(self, xp: Arrays, flat: Array, side: int, d: int) -> None:
        self.xp, self.d, self.half = xp, d, (side - 1) / 2
        self._flat, self._side = flat, side
        self._corners = [0, side] if d == 2 else [0, side, side * side, side * side + side]

    def at(self, q: Array) -> Array:
        """Values (…, M) at points (d, M) of the cube."""
        place = (q + 1.0) * self.half
        cell = self.xp.whole(place).clip(0, self._side - 2)
        first = cell[0]
        for axis in range(1, self.d):
            first = first * self._side + cell[axis]
        return blended(self.xp, self._flat, first, [*(place - self.xp.narrow(cell))], self._corners)


class GridShape(Lattice):
    """A grid of distances. Outside the cube a distance is the least that what lies inside can have."""

    def distance(self, q: Array) -> Array:
        """Distances (M,), in leaf units, at leaf coordinates (d, M)."""
        at = q.clip(-1.0, 1.0)
        found, off = self.at(at), q - at
        beyond = (off * off).sum(0)
        return self.xp.select(beyond > 0, self.xp.sqrt(found * found + beyond), found)

    def field(self, q: Array, gradient: bool) -> Array:
        """Distances (1, M), or these and how they change (1 + d, M).

        The change is that over a cell, as the edges of one would show in the light.
        """
        xp, step, rows = self.xp, 0.5 / self.half, [self.distance(q)]
        for axis in range(self.d) if gradient else ():
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
