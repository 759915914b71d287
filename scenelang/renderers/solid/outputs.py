"""Depth, normal, object and alpha of solids: what rays from the eye meet, without any light."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from scenelang.graph.stage import EXTINCTION, Stage
from scenelang.outputs import DEEP, Outputs
from scenelang.renderers.arrays import Array
from scenelang.renderers.solid.draw import TILE, directions, rough
from scenelang.renderers.solid.field import SolidField
from scenelang.renderers.solid.light import Lighting
from scenelang.renderers.solid.lookups import INTO
from scenelang.renderers.solid.march import march
from scenelang.renderers.solid.network import Wanted
from scenelang.renderers.solid.passes import INF
from scenelang.renderers.solid.rays import Trail

ROWS = 6  # of what a ray tells: depth, normal, object and alpha


def solid_outputs(field: SolidField, stage: Stage, canvas: tuple[int, int], *, threads: int = 1) -> Outputs:
    """What the pixels of a field of solids show; objects are numbered as the field has them, from 1.

    Alpha is the mean of four samples where it changes from pixel to pixel, the rest is of the centre.

    Args:
        field: the solids.
        stage: camera and ground.
        canvas: width and height in pixels.
        threads: parts drawn at the same time.
    """
    width, height = canvas
    lighting = Lighting(field, stage)
    found = np.empty((ROWS, height, width), np.float32)
    every = max(1, min(TILE // width, -(-height // threads)))

    def row(top: int) -> None:
        y = np.arange(top, min(top + every, height))[:, None] + 0.5
        found[:, top : top + every] = _shown(lighting, directions(stage.camera, canvas, x_centres, y))

    def four(start: int) -> None:
        at = slice(start, start + TILE // 4)
        way = directions(stage.camera, canvas, across[at, None] + quarter[0], down[at, None] + quarter[1])
        alpha = _alpha(lighting, way.reshape(3, -1))[1]
        found[5, down[at], across[at]] = field.xp.to_numpy(alpha).reshape(-1, 4).mean(1)

    x_centres = np.arange(width) + 0.5
    quarter = np.array([[0.25, 0.75, 0.25, 0.75], [0.25, 0.25, 0.75, 0.75]])
    with ThreadPoolExecutor(threads, initializer=field.xp.one_core) as pool:
        list(pool.map(row, range(0, height, every)))
        down, across = np.nonzero(rough(found[5:]))
        list(pool.map(four, range(0, len(down), TILE // 4)))
    return Outputs(found[0], np.moveaxis(found[1:4], 0, 2), found[4].astype(np.int32), found[5])


def _alpha(lighting: Lighting, way: Array) -> tuple[Trail, Array]:
    """What rays (3, M) from the eye meet, and how much of what is behind objects hide (M,)."""
    with lighting.xp.inference():
        trail = march(lighting.field, lighting.eye, way, lighting.limit(way))
        return trail, 1 - (trail.hit == INF) * lighting.xp.exp(-EXTINCTION * trail.length)


def _shown(lighting: Lighting, ways: np.ndarray) -> np.ndarray:
    """Depth, normal, object and alpha (6, …) along rays (3, …)."""
    xp, field, axis = lighting.xp, lighting.field, lighting.stage.camera.axes()[0]
    way = xp.array(ways.reshape(3, -1), field.network.codes)
    forward = xp.array(np.asarray(axis, np.float32), way)
    with xp.inference():
        trail, alpha = _alpha(lighting, way)
        depth = lighting.limit(way) * (forward @ way)
        out = xp.concat([depth[None], 0 * way, 0 * alpha[None], alpha[None]], 0)
        ground = xp.where(out[0] < INF)
        out[2, ground] = 1.0
        for ray, begin, end, before in reversed(trail.pieces):
            first = xp.where(before == 0)  # a ray's pieces come in order
            ray, t = xp.take(ray, first), xp.take(xp.minimum((begin + end) / 2, begin + DEEP), first)
            out[4, ray] = field.meet(trail.at(xp, ray), t, Wanted.KIND, owners=True).owner
        solid = xp.where(trail.hit < INF)
        if len(solid):
            to = xp.take(way, solid)
            p, n, *_ = lighting.surface(to, solid, trail)
            away = p - lighting.eye[:, None]
            out[0, solid], out[1:4, solid] = forward @ away, n
            t = xp.length(list(away)) + INTO
            out[4, solid] = field.meet(trail.at(xp, solid), t, Wanted.KIND, owners=True).owner
    return np.asarray(xp.to_numpy(out)).reshape(ROWS, *ways.shape[1:])
