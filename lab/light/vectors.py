"""Vectors of three numbers as tuples, and directions about one, compiled by numba."""

from __future__ import annotations

import math
from typing import Any

from lab.light.field import Array, compiled


@compiled
def frame(n: Any) -> Any:
    """Two unit vectors across a unit vector (Duff et al. 2017)."""
    sign = 1.0 if n[2] >= 0.0 else -1.0
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return (1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]), (b, sign + n[1] * n[1] * a, -n[1])


@compiled
def turned(n: Any, x: float, y: float, z: float) -> Any:
    """A vector of the frame about ``n`` in the world."""
    t, b = frame(n)
    return (
        x * t[0] + y * b[0] + z * n[0],
        x * t[1] + y * b[1] + z * n[1],
        x * t[2] + y * b[2] + z * n[2],
    )


@compiled
def dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def plus(a: Any, s: float, b: Any) -> Any:
    return (a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2])


@compiled
def times(a: Any, s: float, b: Any) -> Any:
    return (a[0] * s * b[0], a[1] * s * b[1], a[2] * s * b[2])


@compiled
def gains(light: Array, a: Any, s: float, b: Any) -> None:
    """Add ``a`` times ``s`` times ``b`` to light."""
    for c in range(3):
        light[c] += a[c] * s * b[c]


@compiled
def across(n: Any, a: float, b: float) -> Any:
    """A direction by the cosine with ``n``."""
    r, phi = math.sqrt(a), 2 * math.pi * b
    return turned(n, r * math.cos(phi), r * math.sin(phi), math.sqrt(1.0 - a))


@compiled
def around(a: float, b: float) -> Any:
    """A direction of the sphere."""
    z = 1.0 - 2.0 * a
    r = math.sqrt(max(1.0 - z * z, 0.0))
    return (r * math.cos(2 * math.pi * b), r * math.sin(2 * math.pi * b), z)
