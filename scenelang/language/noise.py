"""Gradient noise (Perlin, "Improving Noise", 2002) over a hash of whole numbers, the same everywhere."""

from __future__ import annotations

import math
from typing import Final

FACTORS: Final = 0x8DA6B343, 0xD8163841, 0xCB1AB31F, 0x9E3779B9
"""Factors of i, j, k and the seed."""
ROUNDS: Final = (16, 0x21F0AAAD), (15, 0x735A2D97), (15, 1)
"""Each takes h to (h ^ h >> shift) * factor."""
MASK: Final = 0xFFFFFFFF


def hashed(i: int, j: int, k: int, seed: int) -> int:
    """The hash of a lattice point in 32 bits; the arguments count modulo 2³²."""
    h = i * FACTORS[0] & MASK ^ j * FACTORS[1] & MASK ^ k * FACTORS[2] & MASK ^ seed * FACTORS[3] & MASK
    for shift, factor in ROUNDS:
        h = (h ^ h >> shift) * factor & MASK
    return h


def fade(t: float) -> float:
    """t³ (t (6 t − 15) + 10), flat at 0 and 1."""
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


def noise(x: float, y: float, z: float, seed: int) -> float:
    """Noise at a point, about −1 to 1; 0 where all coordinates are whole."""
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    x, y, z = x - i, y - j, z - k
    u, v, w = fade(x), fade(y), fade(z)
    layers = []
    for dz in (0, 1):
        rows = []
        for dy in (0, 1):
            a = _slope(hashed(i, j + dy, k + dz, seed), x, y - dy, z - dz)
            b = _slope(hashed(i + 1, j + dy, k + dz, seed), x - 1.0, y - dy, z - dz)
            rows.append(a + u * (b - a))
        layers.append(rows[0] + v * (rows[1] - rows[0]))
    return layers[0] + w * (layers[1] - layers[0])


def _slope(h: int, x: float, y: float, z: float) -> float:
    """A corner's gradient, (±1, ±1, 0), (±1, 0, ±1) or (0, ±1, ±1), times (x, y, z), in order."""
    index = h % 12
    a, b = ((x, y), (x, z), (y, z))[index >> 2]
    return (-a if index & 2 else a) + (-b if index & 1 else b)
