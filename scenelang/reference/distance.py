"""Exact signed distances of the 2D leaves, and the way of a point back through steps.

Works on numpy arrays and torch tensors alike: the functions use only names that both offer, so that
training makes its data on any device with the same formulas that the reference image is drawn with.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np

Array = Any  # numpy array or torch tensor

STAR_INNER = 0.381966

# Dihedral symmetry of each leaf: order n, direction of a vertex, outer radius, and the radius at half a
# sector, where the edge from the vertex ends (an edge midpoint, for the star an inner vertex).
SECTORS: dict[str, tuple[int, float, float, float]] = {
    "square": (4, math.pi / 4, 1.0, math.cos(math.pi / 4)),
    "triangle": (3, math.pi / 2, 1.0, math.cos(math.pi / 3)),
    "star": (5, math.pi / 2, 1.0, STAR_INNER),
    "pentagon": (5, math.pi / 2, 1.0, math.cos(math.pi / 5)),
}


def namespace(x: Array) -> Any:
    """numpy, or torch where ``x`` is a tensor (without importing torch)."""
    torch = sys.modules.get("torch")
    return torch if torch is not None and isinstance(x, torch.Tensor) else np


def sector_distance(x: Array, y: Array, n: Array, phase: Array, outer: Array, inner: Array) -> Array:
    """Signed distance to a shape of dihedral symmetry whose boundary in half a sector is one segment.

    A point is folded into the half sector; by symmetry the nearest boundary point lies in it too.

    Args:
        x, y: coordinates in leaf units, any shape.
        n, phase, outer, inner: entries of `SECTORS`, numbers or arrays that broadcast against x.

    Returns:
        Distance, negative inside, shape of x.
    """
    xp = namespace(x)
    half = math.pi / n
    theta = xp.atan2(y, x) - phase + half
    theta = abs(theta - xp.floor(theta / (2 * half)) * (2 * half) - half)
    radius = xp.sqrt(x * x + y * y)
    u, v = radius * xp.cos(theta), radius * xp.sin(theta)
    cos, sin = (math.cos(half), math.sin(half)) if isinstance(half, float) else (xp.cos(half), xp.sin(half))
    edge_u, edge_v = inner * cos - outer, inner * sin
    u = u - outer
    along = xp.clip((u * edge_u + v * edge_v) / (edge_u * edge_u + edge_v * edge_v), 0.0, 1.0)
    gap_u, gap_v = u - along * edge_u, v - along * edge_v
    distance = xp.sqrt(gap_u * gap_u + gap_v * gap_v)
    outside = edge_u * v - edge_v * u < 0
    return xp.where(outside, distance, -distance)


def leaf_distance(geometry: str, x: Array, y: Array) -> Array:
    """Exact Euclidean signed distance of a 2D leaf in its own space; raises KeyError if unknown."""
    n, phase, outer, inner = SECTORS[geometry]
    return sector_distance(x, y, n, phase, outer, inner)


def carry_back_affine(rows: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Apply a 2 x 3 frame ``[[a, b, c], [d, e, f]]`` (already inverted, entries broadcast) to points."""
    (a, b, c), (d, e, f) = rows
    return a * x + b * y + c, d * x + e * y + f


def carry_back_warp(twirl: Array, bend_x: Array, bend_y: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """``p -> R(twirl |p| + bend . p) p`` with ``R(a) p = (cos a x + sin a y, -sin a x + cos a y)``."""
    xp = namespace(x)
    angle = twirl * xp.sqrt(x * x + y * y) + bend_x * x + bend_y * y
    cos, sin = xp.cos(angle), xp.sin(angle)
    return cos * x + sin * y, cos * y - sin * x
