"""Lamps of a radius: how much of one a point sees, without random numbers.

A lamp is a disc as a point sees it, and what is between them a cone. A ray along its axis tells whether
something opaque comes nearer to the axis than the cone is wide, or holds the cone whole: most points are lit
or dark. For the others the disc is cut into parts, each a thinner cone; beside its axis the field is asked
where things were nearest to the ray. The distance, negative within solids, over the thin cone's radius there
tells what share of the part a straight edge at that distance leaves. Planes through what is nearest on both
sides of the place give the edge's distance even where a solid is thin. Edges of several things hide the same,
or other places, as they face alike, or apart.
"""

from __future__ import annotations

import numpy as np

from scenelang.drawing.arrays import Array, Arrays

PARTS = 4  # of the disc,
ASIDE, WIDE = 0.6, 0.55  # in units of its radius, their middles and radii: shares of straight edges are right
SIDE = (0.6, 0.0, -0.8)  # parts are turned alike but for points straight behind the lamp, seen from there
STRIDE = 0.5  # least steps, in units of the cone's radius,
HASTE, HURRY = 0.03, 0.5  # and of the way that is left, but no more of the cone's radius
# points of a unit ball from which rays go through media: a tetrahedron, whose first and second moments are,
# from everywhere, those of a disc
BEAMS = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], np.float32) / 2
# the like of an icosahedron, where the four differ
MORE_BEAMS = np.array(
    [np.roll((0, a, b), k) for k in range(3) for a in (-0.455, 0.455) for b in (-0.737, 0.737)], np.float32
)
FLOOR = 0.012  # what is added to all steps, in world units; rays end so far before a point


def share(xp: Arrays, c: Array) -> Array:
    """The part (M,) of a unit disc on the near side of a straight edge at c from its middle."""
    c = c.clip(-1.0, 1.0)
    return (xp.acos(-c) + c * xp.sqrt(1 - c * c)) / np.pi


def form(xp: Arrays, cos: Array, far: Array, radius: float) -> Array:
    """The light that surfaces receive of a lamp of power 1 that nothing hides, by the cosines at which they
    see its middle and the distances of that, each (K,); 0 within it.

    Source: Snyder, Area Light Sources for Real-Time Graphics, 1996.
    """
    h = (far / radius).clip(1.0)
    x, sin = xp.sqrt(h * h - 1), xp.sqrt((1 - cos * cos).clip(1e-12))
    y = (-x * cos / sin).clip(-1.0, 1.0)
    edge = sin * xp.sqrt(1 - y * y)
    slope = edge / x.clip(1e-6)
    low = (cos * xp.acos(y) - x * edge) / (h * h) + xp.acos(1 / xp.sqrt(1 + slope * slope))
    result = xp.select(cos * h >= 1, cos / (h * h), low / np.pi) / radius**2
    return xp.select((cos * h > -1) & (far > radius), result.clip(0.0), 0 * cos)
