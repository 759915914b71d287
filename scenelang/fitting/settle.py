"""Grids of distances that are 0 where the surface is.

A grid that is true at its nodes cuts the edges and corners of a shape between them. Moving its nodes by what
it says at points of the surface, in some rounds (SIRT; Gilbert 1972), halves its error there.
"""

from __future__ import annotations

from itertools import product
from typing import Final

import numpy as np

from scenelang.elements.pyramid import Grid, finest
from scenelang.fitting.mesh import Points
from scenelang.renderers.arrays import NUMPY
from scenelang.renderers.grid import GridShape

ROUNDS: Final = 8


def settled(grid: Grid, points: Points) -> Grid:
    """The grid with nodes moved so that what is drawn of it is nearer to 0 at points (M, d)."""
    place = (points + 1) * ((len(grid) - 1) / 2)
    cell = np.clip(place.astype(np.int64), 0, len(grid) - 2)
    share = place - cell
    corners = [
        (np.ravel_multi_index(tuple((cell + at).T), grid.shape), np.where(at, share, 1 - share).prod(1))
        for at in product((0, 1), repeat=grid.ndim)
    ]
    shares = sum(np.bincount(node, weight, grid.size) for node, weight in corners)
    grid, asked = grid.copy(), np.ascontiguousarray(points.T, np.float32)
    for _ in range(ROUNDS):
        drawn = finest(grid)
        off = GridShape(NUMPY, drawn.reshape(-1), len(drawn), grid.ndim).distance(asked)
        move = sum(np.bincount(node, weight * off, grid.size) for node, weight in corners)
        grid -= np.asarray(move / np.maximum(shares, 1e-9), np.float32).reshape(grid.shape)
    return grid
