"""Surfaces that mirror, glossy and metal, under a sky.

Lobes are summed along ways fixed about the normal and the way back, without noise. A way ends at the sky, the
ground or an object; where that mirrors it goes on once more. Lamps, which rays do not see, are summed over
their discs about the mirrored way, as evenly as facets lie there. Letters: K points, R rows of colours.

Source: Walter et al., Microfacet Models for Refraction through Rough Surfaces, 2007; Dupuy and Benyoub,
Sampling Visible GGX Normals with Spherical Caps, 2023.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scenelang.drawing.arrays import Array, Arrays
from scenelang.drawing.solid.around import GOLDEN, to_ground

GLAZE = 0.04  # of light along the normal, that what is glossy reflects
ROUGH, BACK, STRAIGHT = 0, slice(1, 4), slice(4, None)  # rows of coats
FEWEST, MOST, WAYS = 4, 20, 60  # ways of a lobe, WAYS times its roughness
MIRRORS = 2  # times that light is mirrored before a lobe counts as a diffuse surface
OFF, STEP = 1e-3, 0.02  # world units off a surface where rays begin, and their `MarchSettings.gap`
BATCH = 1 << 14  # rays at once


def coated(xp: Arrays, n: Array, back: Array, colour: Array, rough: Array) -> tuple[Array, Array]:
    """Colours (R, K) of diffuse bases, and coats (4 + R, K): roughness, 0 for none, unit way back, and what
    is reflected along the normal. ``rough`` is that of `Material`.
    """
    straight = xp.select(rough < 0, colour, GLAZE * (0 * colour + (rough > 0)))
    left = (1 - _fresnel(straight, (n * back).sum(0))) * (rough > 0) + (rough == 0)
    return colour * left, xp.concat([abs(rough)[None], back, straight], 0)


def _fresnel(straight: Array, cos: Array) -> Array:
    return straight + (1 - straight) * (1 - cos.clip(0.0, 1.0)) ** 5


def _masked(xp: Arrays, cos: Array, square: Array) -> Array:
    return 2 * cos / (cos + xp.sqrt(square + (1 - square) * cos * cos)).clip(1e-9) * (cos > 0)


def _unit(xp: Arrays, a: Array) -> Array:
    return a / xp.sqrt((a * a).sum(0)).clip(1e-9)


def _cross(xp: Arrays, a: Array, b: Array) -> Array:
    return xp.stack([a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)], 0)


def reflected(lighting: Any, p: Array, n: Array, coat: Array, received: Array, mirrors: int) -> Array:
    """The light (R, K) that lobes at points send back, but for that of lamps: along many ways the first time,
    then along one, at last by what points have ``received`` (R, K).
    """
    xp, some = lighting.xp, lighting.xp.where(coat[ROUGH] > 0)
    if not (mirrors and len(some)):
        return coat[STRAIGHT] * received
    result, first, wanted = 0 * received, mirrors == MIRRORS, WAYS * xp.to_numpy(xp.take(coat[ROUGH], some))
    count = np.ceil(np.asarray(wanted).clip(FEWEST, MOST)).astype(int) if first else np.ones(len(some), int)
    point = np.repeat(np.arange(len(some)), count)
    each = np.arange(len(point)) - np.repeat(np.cumsum(count) - count, count)
    numbers = np.stack([(each + 0.5) / count[point] * first, GOLDEN * each, 1 / count[point]])
    numbers, point = xp.array(numbers.astype(np.float32), p), xp.take(some, xp.array(point, p))
    for start in range(0, len(point), BATCH):
        index, (u, turn, part) = point[start : start + BATCH], numbers[:, start : start + BATCH]
        way, share = _ways(xp, xp.take(n, index), xp.take(coat, index), u, turn)
        light = arriving(lighting, xp.take(p + OFF * n, index), way, mirrors - 1)
        xp.add(result, index, light * share * part)
    return result


def _ways(xp: Arrays, n: Array, coat: Array, u: Array, turn: Array) -> tuple[Array, Array]:
    """Unit ways (3, K) from which light comes, and what it counts (R, K), by parts and turns (K,)."""
    back, alpha, cos = coat[BACK], coat[ROUGH] ** 2, (n * coat[BACK]).sum(0).clip(1e-4, 1.0)
    x, aside = _unit(xp, back - cos * n + 1e-6), alpha * xp.sqrt(1 - cos * cos)
    # Facets that the way back sees are even on a cap of the ball that they are when stretched.
    size = xp.sqrt(aside * aside + cos * cos)
    z = (1 - u) * (1 + cos / size) - cos / size
    sin = xp.sqrt((1 - z * z).clip(0.0))
    flat = (sin * xp.cos(turn) + aside / size) * x + sin * xp.sin(turn) * _cross(xp, n, x)
    half = _unit(xp, alpha * flat + (z + cos / size) * n)
    met = (half * back).sum(0)
    way = _unit(xp, 2 * met * half - back)
    return way, _fresnel(coat[STRAIGHT], met) * _masked(xp, (n * way).sum(0), coat[ROUGH] ** 4)


def arriving(lighting: Any, p: Array, way: Array, mirrors: int) -> Array:
    """The light (R, K) that comes to points (3, K) from unit directions, and is mirrored so often at most."""
    xp, around = lighting.xp, lighting.around
    light, limit = lighting._twice(around.sky(way)), to_ground(xp, lighting.stage.ground, p[1], way)
    trail = lighting.field.march(p, way, limit, halvings=0, gap=STEP)
    _, both, met = lighting._met(way, trail, limit, origin=p)
    if met:
        points = lighting._reflecting(met, None, mirrors)
        xp.put(light, both, lighting._lit(points, p[0, :0])[0])
    if around.mist is not None:
        mist = around.mist.along(p, way, xp.minimum(trail.hit, limit))[0]
        light = light * xp.exp(-trail.depth) + lighting._twice(mist)
    return light
