"""Grids of distances that are 0 where the surface is.

A grid that is true at its nodes cuts the edges and corners of a shape between them. Moving its nodes by what
it says at points of the surface, in some rounds (SIRT; Gilbert 1972), halves its error there.
"""

from __future__ import annotations

from itertools import product
from typing import Final

import numpy as np
import numpy.typing as npt

from scenelang.elements.pyramid import Grid, finest
from scenelang.fitting.looks import Points
from scenelang.renderers.arrays import NUMPY
from scenelang.renderers.grid import GridShape

ROUNDS: Final = 8
Corner = tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]


def corners(points: Points, side: int) -> list[Corner]:
    """Nodes around points (M, d) of a grid over [-1, 1]^d, and what each counts between them.

    Args:
        side: nodes along an axis.

    Returns:
        Indices (M,) of flattened nodes and their weights (M,), for each corner of a cell.
    """
    d = points.shape[1]
    place = (points + 1) * ((side - 1) / 2)
    cell = np.clip(place.astype(np.int64), 0, side - 2)
    share = place - cell
    return [
        (np.ravel_multi_index(tuple((cell + at).T), (side,) * d), np.where(at, share, 1 - share).prod(1))
        for at in product((0, 1), repeat=d)
    ]


def settled(grid: Grid, points: Points) -> Grid:
    """The grid with nodes moved so that what is drawn of it is nearer to 0 at points (M, d)."""
    around = corners(points, len(grid))
    shares = sum(np.bincount(node, weight, grid.size) for node, weight in around)
    grid, asked = grid.copy(), np.ascontiguousarray(points.T, np.float32)
    for _ in range(ROUNDS):
        drawn = finest(grid)
        off = GridShape(NUMPY, drawn.reshape(-1), len(drawn), grid.ndim).distance(asked)
        move = sum(np.bincount(node, weight * off, grid.size) for node, weight in around)
        grid -= np.asarray(move / np.maximum(shares, 1e-9), np.float32).reshape(grid.shape)
    return grid
