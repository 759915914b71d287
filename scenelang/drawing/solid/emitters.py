"""Surfaces that glow, as light for others: what is small and bright is what cones and few rays miss.

Nodes on what glows (`nodes.py`) are put together to discs. A point receives the form factors of these. Rays
to some, drawn by what they send there and anew from point to point, tell how much of that is free.

Letters: J nodes, K points, D discs.
"""

from __future__ import annotations

import numpy as np

from scenelang.compiler.spaces import LIFT
from scenelang.drawing.arrays import Array
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import INF
from scenelang.drawing.solid.nodes import SCATTER, Nodes

DISCS = 1024  # of all that glows
RAYS, LEAST = 32, 4  # to some of these from each point, where it is bright, and at least
TURNED = 0.3  # how far apart opposite normals count, twice
BAND = 256  # points at once
CLEAR = 0.02  # world units before a disc where rays to it end
DIM = 1e-4  # light that is worth few rays
GAP = 0.01  # world units, as of `MarchSettings`


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
        each = self.xp.array(np.array(discs, np.float32).T.copy(), nodes.p)  # siblings are neighbours
        self.p, self.n, self.glow, self.area = each[:3], each[3:6], each[6:9], each[-1]

    def received(self, p: Array, n: Array, worth: float = 0.0) -> tuple[Array, Array]:
        """The light (3, K) that points with unit normals (3, K) receive straight from what glows if nothing
        hides it, and the parts (3, K) that arrive; ``worth`` as of `seen`.
        """
        result, both = 0 * p, self.xp.concat([0 * p] * 2, 0)  # of all rays, and of those that arrive
        for start in range(0, p.shape[1] if self.there else 0, BAND):
            band = slice(start, start + BAND)
            result[:, band], point, _, light, clear = self.seen(p[:, band], n[:, band], worth)
            self.xp.add(both[:, band], point, self.xp.concat([light, light * clear], 0))
        # of a channel that hardly any ray has all of them tell
        drawn, free = (each + each.sum(0) / 1000 for each in (both[:3], both[3:]))
        return result, free / drawn.clip(1e-9)

    def seen(self, p: Array, n: Array | None, worth: float) -> tuple[Array, Array, Array, Array, Array]:
        """Light (3, K) that surfaces receive at points (3, K) with unit normals (3, K) if nothing hides it;
        without normals, surfaces that face each disc. Of some rays from each point numbers (k,) of points,
        unit directions (3, k), light of the discs there (3, k), in sum what is received, and the part of it
        (k,) that arrives. There are fewer where less is received than ``worth``, none where that is inf.
        """
        xp = self.xp
        to = [self.p[axis] - p[axis][:, None] for axis in range(3)]  # (K, D) each
        square = np.pi * (to[0] * to[0] + to[1] * to[1] + to[2] * to[2])
        there = -sum(to[axis] * self.n[axis] for axis in range(3)).clip(None, 0.0)
        # where it is as near as it is wide, a disc sends light from below the point rather than its middle
        far = square / (square + self.area).clip(1e-12)
        to = [far * to[axis] - (1 - far) * there * self.n[axis] for axis in range(3)]
        square = to[0] * to[0] + to[1] * to[1] + to[2] * to[2]
        here = xp.sqrt(square) if n is None else sum(to[i] * n[i][:, None] for i in range(3)).clip(0.0)
        form = self.area * here * there / (square * (np.pi * square + self.area)).clip(1e-12)
        light = xp.stack([(form * row).sum(1) for row in self.glow], 0)
        if worth == INF:
            return light, xp.whole(0 * p[0, :0]), p[:, :0], p[:, :0], p[0, :0]
        sums, bright = (form * self.glow.sum(0)).cumsum(1), self.glow.sum(0).clip(1e-9)
        turn = (SCATTER @ np.asarray(xp.to_numpy(p), np.float64) % 1.0)[:, None].astype(np.float32)
        # a disc has as many rays as there are whole numbers that the sum passes with it
        whole = sums[:, -1:]
        each = (whole * (RAYS / max(worth, DIM))).clip(LEAST, RAYS)
        passed = xp.floor(sums * (each / whole.clip(DIM)) + xp.array(turn, p))
        many = xp.concat([passed[:, :1], passed[:, 1:] - passed[:, :-1]], 1).reshape(-1)
        some = xp.where(many > 0)
        point, disc = some // len(self.area), some % len(self.area)
        begin = xp.take(p if n is None else p + LIFT * n, point)
        way = xp.take(self.p, disc) - begin
        far = xp.sqrt((way * way).sum(0)).clip(1e-6)
        trail = self.field.march(begin, way / far, far - CLEAR, halvings=0, gap=GAP, whole=True)
        share = xp.take(many, some) * xp.take(sums[:, -1] / passed[:, -1].clip(1.0), point)
        sent = xp.take(self.glow / bright, disc) * share
        return light, point, way / far, sent, (trail.hit == INF) * xp.exp(-trail.depth)
