"""Surfaces that glow, as light for others: what is small and bright is what cones and few rays miss.

Nodes on what glows (`nodes.py`) are put together to discs, and these to clusters. A point receives the form
factors of a cluster's discs where a ray to one of them, which change from point to point, is free.

Letters: J nodes, K points, G clusters, m discs of each.
"""

from __future__ import annotations

import numpy as np

from scenelang.compiler.spaces import LIFT
from scenelang.drawing.arrays import Array
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import march
from scenelang.drawing.solid.nodes import SCATTER, Nodes
from scenelang.drawing.solid.passes import INF

DISCS, CLUSTER = 1024, 16  # of all that glows, and of one cluster
TURNED = 0.3  # how far apart opposite normals count, twice
BAND = 1024  # points at once
CLEAR = 0.02  # world units before a disc where rays to it end
GOLDEN = 0.618034
DIM = 1e-5  # light that no ray is worth
GAP = 0.002  # world units, as of `MarchSettings`


class Emitters:
    """The nodes that glow, as discs in clusters."""

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
        discs = []
        for group in groups:
            own, faces = area[group], (n[:, group] * area[group]).sum(1)
            size = float(np.linalg.norm(faces))
            centre, light = ((part[:, group] * own).sum(1) / max(own.sum(), 1e-12) for part in (p, glow))
            discs.append(np.concatenate([centre, faces / max(size, 1e-12), light, [own.sum()]]))
        shape = (10, -1, CLUSTER)  # siblings are neighbours
        discs = self.xp.array(np.reshape(np.array(discs, np.float32).T, shape), nodes.p) if discs else nodes.p
        self.p, self.n, self.glow, self.area = discs[:3], discs[3:6], discs[6:9], discs[-1]

    def received(self, p: Array, n: Array, every: int = 1) -> tuple[Array, Array]:
        """The light (3, K) that points with unit normals (3, K) receive straight from what glows if nothing
        hides it, and the part (K,) that arrives; ``every`` as of `seen`.
        """
        result, part = 0 * p, 0 * p[0]
        for start in range(0, p.shape[1] if self.there else 0, BAND):
            band = slice(start, start + BAND)
            point, _, light, clear = self.seen(p[:, band], n[:, band], every)
            self.xp.add(result[:, band], point, light)
            self.xp.add(part[None, band], point, (light.sum(0) * clear)[None])
        return result, part / result.sum(0).clip(1e-9)

    def seen(self, p: Array, n: Array | None, every: int = 1) -> tuple[Array, Array, Array, Array]:
        """Clusters that points (3, K) see: numbers (k,) of the points, unit directions (3, k), and what
        surfaces with unit normals (3, K) receive of them if nothing hides them (3, k), without normals those
        that face them, and the part of it (k,) that arrives.

        Rays go to each ``every``th cluster, by turns; others are hidden as much as these, and none with 0.
        """
        xp = self.xp
        to = [self.p[axis] - p[axis][:, None, None] for axis in range(3)]  # (K, G, m) each
        square = np.pi * (to[0] * to[0] + to[1] * to[1] + to[2] * to[2])
        there = -sum(to[axis] * self.n[axis] for axis in range(3)).clip(None, 0.0)
        # where it is as near as it is wide, a disc sends light from below the point rather than its middle
        far = square / (square + self.area).clip(1e-12)
        to = [far * to[axis] - (1 - far) * there * self.n[axis] for axis in range(3)]
        square = to[0] * to[0] + to[1] * to[1] + to[2] * to[2]
        if n is None:
            here = xp.sqrt(square)
        else:
            here = sum(to[axis] * n[axis][:, None, None] for axis in range(3)).clip(0.0)
        form = self.area * here * there / (square * (np.pi * square + self.area)).clip(1e-12)
        light = xp.stack([(form * row).sum(2) for row in self.glow], 0)  # (3, K, G)
        turn = (SCATTER @ np.asarray(xp.to_numpy(p), np.float64))[:, None] + GOLDEN * np.arange(form.shape[1])
        sums = form.cumsum(2)  # each point asks for one of a cluster's discs, by what they send
        below = sums < (sums[..., -1] * xp.array((turn % 1.0).astype(np.float32), p))[..., None]
        chosen = below.sum(2).clip(None, form.shape[2] - 1)
        some = xp.where(light.sum(0).reshape(-1) > DIM)
        groups, size = self.area.shape
        point, cluster = some // groups, some % groups
        disc = cluster * size + xp.take(chosen.reshape(-1), some)
        begin = xp.take(p if n is None else p + LIFT * n, point)
        way = xp.take(self.p.reshape(3, -1), disc) - begin
        far = xp.sqrt((way * way).sum(0)).clip(1e-6)
        way, light = way / far, xp.take(light.reshape(3, -1), some)
        if not every:
            return point, way, light, 0 * far + 1
        asked = xp.where((point + cluster) % every == 0)
        begin, ways = xp.take(begin, asked), xp.take(way, asked)
        trail = march(self.field, begin, ways, xp.take(far, asked) - CLEAR, 0, GAP, True)
        clear = (trail.hit == INF) * xp.exp(-trail.depth)
        if every > 1:
            sums, at, bright = xp.full((2, p.shape[1]), 0.0, p), xp.take(point, asked), light.sum(0)[asked]
            xp.add(sums, at, xp.stack([bright * clear, bright], 0))
            clear = xp.take(sums[0] / sums[1].clip(1e-9), point)
        return point, way, light, clear
