"""What the language says about the extent of its leaves in the plane.

Bounds only need a convex hull around a leaf and a disc inside it. A leaf that is not listed is only known
to stay within the unit disc.
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt

Points = tuple[tuple[float, float], ...]


def _regular(corners: int) -> Points:
    return tuple((-sin(2 * pi * i / corners), cos(2 * pi * i / corners)) for i in range(corners))


_H = 1.0 / sqrt(2.0)
HULLS: dict[str, Points] = {
    "square": ((_H, _H), (-_H, _H), (-_H, -_H), (_H, -_H)),
    "triangle": _regular(3),
    "pentagon": _regular(5),
    "star": _regular(5),
}
"""Corners of a convex polygon that contains the leaf, all at distance 1 from the origin."""

INNER_RADII: dict[str, float] = {
    "square": _H,
    "triangle": 0.5,
    "pentagon": cos(pi / 5.0),
    "star": 0.381966,
}
"""Radius of a disc about the origin that lies inside the leaf."""
