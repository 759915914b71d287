"""How fast an object's distance changes, proved: what the renderer rules out whole blocks of pixels by.

For the distance f of a leaf, with leaf coordinates p of a cell and q within a radius of p,

    |f(p) - f(q)| <= STEEP sqrt(|p - q|^2 + NODE^2) + s.

s hangs on the cell and the radius. `lab.slopes` proves it of learned leaves, and it is shipped
beside the weights. That of elements is read off their nodes. Of what nothing is known it is infinite.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.renderers.network import RADIUS

Floats = npt.NDArray[np.float64]
STEEP = 1.05  # that of a true distance is 1
NODE = 1 / 128  # leaf units: of the grid in the proof
CELLS = 32  # along a side of [-RADIUS, RADIUS]
RADII = 1 / 16, 1 / 8, 1 / 4  # leaf units
SIDE = 2 * RADIUS / CELLS


class Slopes:
    """s by place and radius.

    Args:
        slack: s (radii, CELLS, CELLS) for `RADII`, rows from the least y up.
        far: by how much faster f may change where points may lie beyond `RADIUS`, which are seen at its rim.
    """

    def __init__(self, slack: npt.NDArray[Any], far: float) -> None:
        self.far, levels, radius = far, [*np.asarray(slack, np.float64)], RADII[-1]
        while radius < 2 * RADIUS:  # half of the way from p, and the other half from its middle
            levels.append(levels[-1] + around(levels[-1], int(np.ceil(radius / SIDE))))
            radius *= 2
        self._levels = np.stack([*levels, np.full_like(levels[0], np.inf)])
        self._radii = RADII[0] * 2.0 ** np.arange(len(levels))

    def rise(self, q: Floats, radius: Floats) -> Floats:
        """By how much f at leaf coordinates (2, M) differs at most (M,) from f within radii (M,)."""
        squared = radius * radius
        length = np.sqrt(q[0] * q[0] + q[1] * q[1])
        level = self._radii.searchsorted(radius) if radius.max() > RADII[0] else 0
        seen = q * (RADIUS / SIDE / np.maximum(length, RADIUS)) + CELLS / 2
        # beyond all numbers nothing is known
        wild = ~(length < np.inf)
        x, y = np.where(wild, 0.0, seen).astype(np.intp).clip(0, CELLS - 1)
        slack = self._levels[level, y, x]
        root = np.sqrt(squared + NODE**2)
        rise: Floats = STEEP * root + slack + np.where(length + radius > RADIUS, self.far * root, 0.0)
        return np.where(wild | (rise != rise), np.inf, rise)


def around(values: Floats, rings: int) -> Floats:
    """The largest of each cell and those in so many rings about it."""
    for _ in range(rings):
        edge = np.pad(values, 1)
        rows = np.maximum(np.maximum(edge[:-2], edge[1:-1]), edge[2:])
        values = np.maximum(np.maximum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])
    return values
