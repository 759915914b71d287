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
TURNS, NODES = 8, 4  # of a lamp's disc about the mirrored way, and on each


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


def lobe(xp: Arrays, n: Array, coat: Array, way: Array) -> Array:
    """Lobes times cosines (R, K) along unit ways (3, K)."""
    half = _unit(xp, coat[BACK] + way)
    up, cos, square = (half * n).sum(0), (n * coat[BACK]).sum(0).clip(1e-4), coat[ROUGH] ** 4
    facets = square / (np.pi * (up * up * (square - 1) + 1) ** 2).clip(1e-12)
    both = _masked(xp, cos, square) * _masked(xp, (n * way).sum(0), square)
    return facets * both / (4 * cos) * _fresnel(coat[STRAIGHT], (half * way).sum(0))


def from_lamp(xp: Arrays, at: Array, radius: float, p: Array, n: Array, coat: Array) -> Array:
    """The light (R, K) of a lamp of power 1 that lobes at points send back if nothing is in its way."""
    axis, square, total = at[:, None] - p, coat[ROUGH] ** 4, 0.0
    far = xp.sqrt((axis * axis).sum(0)).clip(1e-3)
    axis = axis / far
    if not radius:
        return lobe(xp, n, coat, axis) * (np.pi / (far * far))
    r = 2 * (n * coat[BACK]).sum(0) * n - coat[BACK]
    x, sin = (r * axis).sum(0), (radius / far).clip(0.0, 1.0)
    u, aside, rim = _unit(xp, axis - x * r), xp.sqrt((1 - x * x).clip(1e-12)), xp.sqrt(1 - sin * sin)
    v = _cross(xp, r, u)
    widest = xp.select(x > rim, 0 * x + np.pi, xp.acos(xp.sqrt(1 - (sin / aside).clip(0.0, 1.0) ** 2)))
    for place in ((np.arange(TURNS) * 2 + 1 - TURNS) * (np.pi / 2 / TURNS)).tolist():
        turn, ends = widest * float(np.sin(place)), []
        y = aside * xp.cos(turn)
        size = xp.length([x, y]).clip(1e-6)
        cos = (rim / size).clip(0.0, 1.0)
        half = xp.sqrt(1 - cos * cos)
        for side in (-1, 1):  # tangents of half the angles from r, and of how many facets lie before
            t = ((y * cos + side * x * half) / (size + x * cos - side * y * half).clip(1e-4)).clip(0.0) ** 2
            ends.append(t / (t + square))
        part = (ends[1] - ends[0]) * widest * float(2 * np.pi / TURNS / NODES * np.cos(place)) / square
        for node in ((np.arange(NODES) + 0.5) / NODES).tolist():
            share = (ends[0] + (ends[1] - ends[0]) * node).clip(0.0, 1 - 1e-6)
            t = square * share / (1 - share)
            way = ((1 - t) * r + 2 * xp.sqrt(t) * (xp.cos(turn) * u + xp.sin(turn) * v)) / (1 + t)
            total = total + lobe(xp, n, coat, way) * (part * ((t + square) / (1 + t)) ** 2)
    return total * (far > radius) / radius**2


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
