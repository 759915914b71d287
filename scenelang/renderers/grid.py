"""Grids that users bring, at points of the plane or of space: of distances, and whatever lies at nodes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from scenelang.elements.element import Element
from scenelang.elements.pyramid import unpacked
from scenelang.program.program import ProgramError
from scenelang.renderers.arrays import Array, Arrays
from scenelang.renderers.network import RADIUS
from scenelang.renderers.slopes import CELLS, NODE, RADII, STEEP, Slopes, around
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
        found, off = self.at(at), q - at
        beyond = (off * off).sum(0)
        return self.xp.select(beyond > 0, self.xp.sqrt(found * found + beyond), found)

    def slopes(self) -> Slopes:
        """How fast the distance in the plane changes; nothing is known of grids that end inside."""
        n, side = self.side, 2 * RADIUS / CELLS
        grid = self.xp.to_numpy(self.nodes).astype(np.float64).reshape(n, n)
        rows, columns = (abs(np.diff(grid, axis=axis)) * self.half for axis in (0, 1))
        # of each cell the largest slopes along x and along y: along each they change linearly over a cell
        steep = np.hypot(np.maximum(rows[:, 1:], rows[:, :-1]), np.maximum(columns[1:], columns[:-1]))
        if min(grid[[0, -1]].min(), grid[:, [0, -1]].min()) < 0:
            steep = np.full_like(steep, np.inf)
        first = np.clip((-RADIUS + side * np.arange(CELLS) + 1.0) * self.half, 0, n - 1)
        last = np.clip((-RADIUS + side * np.arange(1, CELLS + 1) + 1.0) * self.half, 0, n - 1)
        spans = [(int(a), max(int(np.ceil(b)), int(a) + 1)) for a, b in zip(first, last, strict=True)]
        spans = [(min(a, n - 2), max(min(b, n - 1), min(a, n - 2) + 1)) for a, b in spans]
        across = np.stack([steep[:, a:b].max(1) for a, b in spans], 1)
        found = np.stack([across[a:b].max(0) for a, b in spans])
        found = np.maximum(found.T, 1.0)  # outside, one along the way there
        more = [
            (around(found, int(np.ceil(radius / side))) - STEEP).clip(0.0) * np.hypot(radius, NODE)
            for radius in RADII
        ]
        return Slopes(np.stack(more), 1.0)

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
