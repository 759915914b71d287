"""Surfaces that glow, as light for others: what is small and bright is what cones and few rays miss.

Nodes on what glows (`nodes.py`) are put together to discs. A point receives the form factors of these. Rays
to some, drawn by what they send there and anew from point to point, tell how much of that is free.

Letters: J nodes, K points, D discs.
"""

from __future__ import annotations

import numpy as np

from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.nodes import Nodes

DISCS = 1024  # of all that glows
TURNED = 0.3  # how far apart opposite normals count, twice


class Emitters:
    """The nodes that glow, as discs."""

    def __init__(self, field: SolidField, nodes: Nodes) -> None:
        self.field, self.xp = field, field.xp
        parts = (nodes.p, nodes.n, nodes.glow, nodes.area, nodes.place)
        p, n, glow, area, place = (np.asarray(self.xp.to_numpy(part), np.float64) for part in parts)
        bright = glow.max(0) > 0
        groups = [np.flatnonzero(bright & (place[3] == i)) for i in np.unique(place[3, bright])]
        self.there = len(groups) > 0
        # halved as it is in the objects' spaces, which they take along where they move
        apart = np.concatenate([place[:3], TURNED * place[5:]]).round(3)
        while self.there and len(groups) < DISCS:
            halves = []
            for group in groups:
                if not len(group):
                    halves += [group, group]
                    continue
                axis = np.ptp(apart[:, group], 1).argmax()
                along = apart[axis, group]
                beyond = along > (along.min() + along.max()) / 2
                halves += [group[~beyond], group[beyond]]
            groups = halves
        discs = [np.zeros(10)] * (not groups)
        for group in groups:
            own, faces = area[group], (n[:, group] * area[group]).sum(1)
            size = float(np.linalg.norm(faces))
            centre, light = ((part[:, group] * own).sum(1) / max(own.sum(), 1e-12) for part in (p, glow))
            discs.append(np.concatenate([centre, faces / max(size, 1e-12), light, [own.sum()]]))
        # (D, 10) places, normals, light and areas; siblings are neighbours
        self.discs = np.array(discs, np.float32)
        self.p, self.n = self.discs.T[:3], self.discs.T[3:6]
