"""Surfaces that glow, as light for others: what is small and bright is what cones and few rays miss.

Nodes on what glows (`nodes.py`) are put together to discs. A point receives the form factors of these. Rays
to some, drawn by what they send there and anew from point to point, tell how much of that is free; the
kernel sums both (`light.h`).

Letters: J nodes, D discs.
"""

from __future__ import annotations

from math import ceil, log2

import numpy as np

from scenelang.drawing.solid.nodes import Nodes

DISCS = 1024  # of all that glows
TURNED = 0.3  # how far apart opposite normals count, twice


class Emitters:
    """The nodes that glow, as discs."""

    def __init__(self, nodes: Nodes) -> None:
        parts = (nodes.p, nodes.n, nodes.glow, nodes.area, nodes.place)
        p, n, glow, area, place = (np.asarray(part, np.float64) for part in parts)
        bright = np.flatnonzero(glow.max(0) > 0)
        # halved as it is in the objects' spaces, which they take along where they move
        apart = np.concatenate([place[:3], TURNED * place[5:]]).round(3)[:, bright]
        group = np.unique(place[3, bright], return_inverse=True)[1]
        self.there = len(bright) > 0
        for _ in range(ceil(log2(DISCS / (group.max() + 1))) if self.there else 0):
            order = np.argsort(group, kind="stable")
            first = np.flatnonzero(np.diff(group[order], prepend=-1))
            least, most = (each.reduceat(apart[:, order], first, 1) for each in (np.minimum, np.maximum))
            axis, every = (most - least).argmax(0)[group], np.arange(len(group))
            beyond = apart[axis, every] > (least + most)[axis, group] / 2
            group = np.unique(2 * group + beyond, return_inverse=True)[1]
        count = int(group.max(initial=-1)) + 1

        def total(values: np.ndarray) -> np.ndarray:
            return np.stack([1.0 * np.bincount(group, row[bright] * area[bright], count) for row in values])

        whole, faces = total(0 * area[None] + 1), total(n)
        faces /= np.linalg.norm(faces, axis=0).clip(1e-12)
        rows = np.concatenate([total(p) / whole.clip(1e-12), faces, total(glow) / whole.clip(1e-12), whole])
        # (D, 10) places, normals, light and areas; siblings are neighbours
        self.discs = np.ascontiguousarray(rows.T, np.float32)
        self.p, self.n = self.discs.T[:3], self.discs.T[3:6]
