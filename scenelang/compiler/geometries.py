"""The table of geometries: a row for each leaf, with all but its name and weights.

Formulas work on numpy arrays, torch tensors and floats alike, and import neither: points are one array
(d, …), or a sequence of its d coordinates.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from typing import Any, Final

from scenelang.assets.records import Record

Array = Any  # numpy array, torch tensor or float
Corner = tuple[float, float]
Points = Any  # an array (d, …), or a sequence of d coordinates


class Geometry(Record):
    """A leaf within the unit disc or ball of its space; ``distance`` of points (d, …) is exact and signed.

    A disc or ball of radius ``inner``, 0 for none, about the origin lies within it. In space ``slopes`` are
    the distance and its gradient (4, …), ``surface`` gives points (3, …) from two coordinates in [0, 1),
    ``half`` is half the sides of a box around it, ``thickness`` its least thickness. In the plane ``sectors``
    of a shape of dihedral symmetry are its order n, direction of a vertex, outer radius, and the radius at
    half a sector, where the edge from the vertex ends (for the star an inner vertex); ``corners`` are those
    of a convex polygon around it, none for the unit disc.
    """

    distance: Callable[[Points], Array]
    inner: float = 0.0
    slopes: Callable[[Points], tuple[Array, ...]] | None = None
    surface: Callable[[Points], tuple[Array, ...]] | None = None
    half: tuple[float, float, float] = (1.0, 1.0, 1.0)
    thickness: float = math.inf
    sectors: tuple[int, float, float, float] | None = None
    corners: tuple[Corner, ...] = ()


class _Floats:
    """Functions for floats, under the names that numpy and torch have for them."""

    sqrt, cos, sin, maximum, minimum = math.sqrt, math.cos, math.sin, max, min


def namespace(x: Array) -> Any:
    """The module with functions for ``x``: torch for a tensor, `_Floats` for a float, else numpy."""
    if isinstance(x, float):
        return _Floats
    torch = sys.modules.get("torch")
    return torch if torch is not None and isinstance(x, torch.Tensor) else sys.modules["numpy"]


def sector_distance(p: Points, n: Array, phase: Array, outer: Array, inner: Array) -> Array:
    """Signed distance of points (2, …) to a shape of dihedral symmetry with such `Geometry.sectors`.

    A point is folded into the half sector; by symmetry the nearest boundary point lies in it too.
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


def _sectored(
    n: int, phase: float, edge: float, inner: float | None = None, corners: tuple[Corner, ...] = ()
) -> Geometry:
    """A shape of dihedral symmetry and outer radius 1, by default with corners of a vertex at +y."""
    turns = [math.tau * k / n for k in range(n)]
    return Geometry(
        lambda p: sector_distance(p, n, phase, 1.0, edge),
        edge if inner is None else inner,
        sectors=(n, phase, 1.0, edge),
        corners=corners or tuple([(-math.sin(turn), math.cos(turn)) for turn in turns]),
    )


_SIDE: Final = 1 / math.sqrt(2)  # half of a square's
_UP: Final = math.pi / 2
_TINY: Final = 1e-12  # least length that something is divided by


def _sphere(p: Points) -> Array:
    x, y, z = p
    return namespace(x).sqrt(x * x + y * y + z * z) - 1.0


def _sphere_slopes(p: Points) -> tuple[Array, ...]:
    x, y, z = p
    length = namespace(x).sqrt(x * x + y * y + z * z).clip(_TINY)
    return length - 1.0, x / length, y / length, z / length


def _sphere_surface(at: Points) -> tuple[Array, ...]:
    """Points that are evenly spread, as equal bands of a sphere along y have equal areas."""
    u, v = at
    xp, y = namespace(u), 2.0 * v - 1.0
    around = xp.sqrt(1.0 - y * y)
    return around * xp.cos(math.tau * u), y, around * xp.sin(math.tau * u)


_RING, _TUBE = 0.7, 0.3  # radii of the circle about y and of the tube


def _torus(p: Points) -> Array:
    x, y, z = p
    xp = namespace(x)
    ring = xp.sqrt(x * x + z * z) - _RING
    return xp.sqrt(ring * ring + y * y) - _TUBE


def _torus_slopes(p: Points) -> tuple[Array, ...]:
    x, y, z = p
    xp = namespace(x)
    around = xp.sqrt(x * x + z * z).clip(_TINY)
    ring = around - _RING
    tube = xp.sqrt(ring * ring + y * y).clip(_TINY)
    return tube - _TUBE, ring / tube * x / around, y / tube, ring / tube * z / around


def _torus_surface(at: Points) -> tuple[Array, ...]:
    u, v = math.tau * at[0], math.tau * at[1]
    xp = namespace(u)
    ring = _RING + _TUBE * xp.cos(v)
    return ring * xp.cos(u), _TUBE * xp.sin(v), ring * xp.sin(u)


GEOMETRIES: Final[dict[str, Geometry]] = {
    "square": _sectored(
        4,
        math.pi / 4,
        math.cos(math.pi / 4),
        _SIDE,
        ((_SIDE, _SIDE), (-_SIDE, _SIDE), (-_SIDE, -_SIDE), (_SIDE, -_SIDE)),
    ),
    "triangle": _sectored(3, _UP, math.cos(math.pi / 3), 0.5),
    "star": _sectored(5, _UP, 0.381966),
    "pentagon": _sectored(5, _UP, math.cos(math.pi / 5)),
    "sphere": Geometry(_sphere, 1.0, _sphere_slopes, _sphere_surface, thickness=2.0),
    "torus": Geometry(
        _torus, 0.0, _torus_slopes, _torus_surface, half=(1.0, _TUBE, 1.0), thickness=2.0 * _TUBE
    ),
}
"""All of them; their dimensions and meaning are in `scenelang.language.words.LEAVES`."""
SECTORS: Final = {name: row.sectors for name, row in GEOMETRIES.items() if row.sectors is not None}
