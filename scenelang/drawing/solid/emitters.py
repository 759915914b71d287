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
        if self.there:
            group = _halved(apart, group, ceil(log2(DISCS / (group.max() + 1))))
        count = int(group.max(initial=-1)) + 1

        def total(values: np.ndarray) -> np.ndarray:
            return np.stack([1.0 * np.bincount(group, row[bright] * area[bright], count) for row in values])

        whole, faces = total(0 * area[None] + 1), total(n)
        faces /= np.linalg.norm(faces, axis=0).clip(1e-12)
        rows = np.concatenate([total(p) / whole.clip(1e-12), faces, total(glow) / whole.clip(1e-12), whole])
        # (D, 10) places, normals, light and areas; siblings are neighbours
        self.discs = np.ascontiguousarray(rows.T, np.float32)
        self.p, self.n = self.discs.T[:3], self.discs.T[3:6]


def _halved(apart: np.ndarray, group: np.ndarray, times: int) -> np.ndarray:
    """Groups (K,) of points (R, K), each halved so often at the middle of its longest side."""
    order = np.argsort(group, kind="stable")  # of points, group by group
    first, at = np.flatnonzero(np.diff(group[order], prepend=-1)), np.arange(len(group))
    apart = apart[:, order]
    for _ in range(times):
        size = np.diff(first, append=len(at))
        least, most = (each.reduceat(apart, first, 1) for each in (np.minimum, np.maximum))
        axis, own = (most - least).argmax(0), np.repeat(np.arange(len(first)), size)
        middle = (least + most)[axis, np.arange(len(first))] / 2
        below = apart[axis[own], at] <= middle[own]
        count = np.add.reduceat(below, first, dtype=int)
        before = np.cumsum(below) - below - (np.cumsum(count) - count)[own]  # those of the group
        place = first[own] + np.where(below, before, count[own] + at - first[own] - before)
        moved = np.empty_like(order)
        moved[place] = at
        order, apart = order[moved], apart[:, moved]
        first = np.stack([first, first + count], 1)[np.stack([count, size - count], 1) > 0]
    result = np.empty_like(order)
    result[order] = np.repeat(np.arange(len(first)), np.diff(first, append=len(at)))
    return result
