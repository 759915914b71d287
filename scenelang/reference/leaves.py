"""Exact signed distances of the leaves of the plane and of the solid world.

Works on numpy arrays and torch tensors alike, here as in `fold.py` and `field.py`: only names that both offer
are used, so that training makes its data on any device by the formulas of the reference image. Points are one
array (d, …), or a sequence of its d coordinates.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np

Array = Any  # numpy array or torch tensor

# Dihedral symmetry of each leaf: order n, direction of a vertex, outer radius, and the radius at half a
# sector, where the edge from the vertex ends (an edge midpoint, for the star an inner vertex).
SECTORS: dict[str, tuple[int, float, float, float]] = {
    "square": (4, math.pi / 4, 1.0, math.cos(math.pi / 4)),
    "triangle": (3, math.pi / 2, 1.0, math.cos(math.pi / 3)),
    "star": (5, math.pi / 2, 1.0, 0.381966),
    "pentagon": (5, math.pi / 2, 1.0, math.cos(math.pi / 5)),
}

TORUS = (0.7, 0.3)  # radii of the circle about y and of the tube


def namespace(x: Array) -> Any:
    """numpy, or torch where ``x`` is a tensor (without importing torch)."""
    torch = sys.modules.get("torch")
    return torch if torch is not None and isinstance(x, torch.Tensor) else np


def sector_distance(p: Array, n: Array, phase: Array, outer: Array, inner: Array) -> Array:
    """Signed distance to a shape of dihedral symmetry whose boundary in half a sector is one segment.

    A point is folded into the half sector; by symmetry the nearest boundary point lies in it too.

    Args:
        p: points in leaf units, (2, …).
        n, phase, outer, inner: entries of `SECTORS`, numbers or arrays that broadcast against a coordinate.

    Returns:
        Distance, negative inside, of a coordinate's shape.
    """
    x, y = p
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
    return xp.where(edge_u * v - edge_v * u < 0, distance, -distance)


def leaf_distance(geometry: str, p: Array) -> Array:
    """Exact Euclidean signed distance of a leaf in its own space; raises KeyError if unknown.

    Args:
        geometry: name of a leaf.
        p: points in leaf units, (2, …), or (3, …) for the sphere and the torus.
    """
    if geometry in ("sphere", "torus"):
        x, y, z = p
        xp = namespace(x)
        if geometry == "sphere":
            return xp.sqrt(x * x + y * y + z * z) - 1.0
        ring = xp.sqrt(x * x + z * z) - TORUS[0]
        return xp.sqrt(ring * ring + y * y) - TORUS[1]
    return sector_distance(p, *SECTORS[geometry])
