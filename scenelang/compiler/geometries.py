"""The table of geometries: a row for each leaf, with all but its name and weights.

Formulas work on numpy arrays, torch tensors and floats alike, and import neither: points are one array
(d, …), or a sequence of its d coordinates.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from functools import reduce
from typing import Any, Final

from scenelang.assets.records import Record

Array = Any  # numpy array, torch tensor or float
Corner = tuple[float, float]
Points = Any  # an array (d, …), or a sequence of d coordinates


class Geometry(Record):
    """A leaf within the unit disc or ball of its space; ``distance`` of points (d, …) is exact and signed.

    A disc or ball of radius ``inner``, 0 for none, about the origin lies within it. In space ``slopes`` are
    the distance and its gradient (4, …), ``half`` is half the sides of a box around it, ``thickness`` its
    least thickness, ``edged`` whether it has edges. In the plane ``sectors`` of a shape of dihedral symmetry
    are its order n, direction of a vertex, outer radius, and the radius at half a sector, where the edge from
    the vertex ends (for the star an inner vertex); ``corners`` are those of a convex polygon around it, none
    for the unit disc.
    """

    distance: Callable[[Points], Array]
    inner: float = 0.0
    slopes: Callable[[Points], tuple[Array, ...]] | None = None
    half: tuple[float, float, float] = (1.0, 1.0, 1.0)
    thickness: float = math.inf
    edged: bool = False
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
_CORNERS: Final = (_SIDE, _SIDE), (-_SIDE, _SIDE), (-_SIDE, -_SIDE), (_SIDE, -_SIDE)
_UP: Final = math.pi / 2
_TINY: Final = 1e-12  # least length that something is divided by


def _sphere(p: Points) -> Array:
    x, y, z = p
    return namespace(x).sqrt(x * x + y * y + z * z) - 1.0


def _sphere_slopes(p: Points) -> tuple[Array, ...]:
    x, y, z = p
    length = namespace(x).sqrt(x * x + y * y + z * z).clip(_TINY)
    return length - 1.0, x / length, y / length, z / length


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


def _above(a: Array) -> Array:
    """The part above zero."""
    return (a + abs(a)) / 2


def _corner(*levels: Array) -> Array:
    """Distance to where several levels, distances from orthogonal planes or lines, are all below zero."""
    xp = namespace(levels[0])
    highest = reduce(xp.maximum, levels)
    return xp.sqrt(sum(_above(level) ** 2 for level in levels)) + (highest - abs(highest)) / 2


def _corner_slopes(*levels: Array) -> tuple[Array, ...]:
    """`_corner`, and its derivatives by the levels: along the way out of the nearest point."""
    xp = namespace(levels[0])
    highest = reduce(xp.maximum, levels)
    ways = [xp.where(highest > 0, _above(level), 1.0 * (level == highest)) for level in levels]
    length = xp.sqrt(sum(way * way for way in ways))
    return _corner(*levels), *(way / length for way in ways)


def _around(p: Points, d: Array, by_rho: Array, by_y: Array) -> tuple[Array, ...]:
    """A distance and its gradient by its derivatives along y and away from the axis."""
    x, _, z = p
    rho = namespace(x).sqrt(x * x + z * z).clip(_TINY)
    return d, by_rho * x / rho, by_y, by_rho * z / rho


_CUBE: Final = 1 / math.sqrt(3)  # half of a box's side
_CAN: Final = 1 / math.sqrt(2)  # radius and half-height of a cylinder
_LEAN: Final = math.sqrt(3) / 2  # radius of a cone's base
_LONG, _PILL = 0.5, 0.5  # half of the segment in a capsule, and its radius


def _box_slopes(p: Points) -> tuple[Array, ...]:
    xp = namespace(p[0])
    d, *by = _corner_slopes(*(abs(a) - _CUBE for a in p))
    return d, *(xp.sign(a) * slope for a, slope in zip(p, by, strict=True))


def _cylinder_levels(p: Points) -> tuple[Array, Array]:
    x, y, z = p
    return namespace(x).sqrt(x * x + z * z) - _CAN, abs(y) - _CAN


def _cylinder_slopes(p: Points) -> tuple[Array, ...]:
    d, by_rho, by_y = _corner_slopes(*_cylinder_levels(p))
    return _around(p, d, by_rho, namespace(p[1]).sign(p[1]) * by_y)


def _cone_levels(p: Points) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Levels of two corners that meet in the cone: its side between apex and rim; its base up to the rim."""
    x, y, z = p
    rho = namespace(x).sqrt(x * x + z * z)
    along = rho / 2 - _LEAN * y  # the side, from -sqrt(3) / 2 to sqrt(3) / 2
    return (_LEAN * rho + y / 2 - 0.5, abs(along) - _LEAN), (-y - 0.5, rho - _LEAN)


def _cone(p: Points) -> Array:
    side, base = _cone_levels(p)
    return namespace(p[0]).maximum(_corner(*side), _corner(*base))


def _cone_slopes(p: Points) -> tuple[Array, ...]:
    xp, (side, base) = namespace(p[0]), _cone_levels(p)
    (a, out, along), (b, down, over) = _corner_slopes(*side), _corner_slopes(*base)
    x, y, z = p
    along = xp.where(xp.sqrt(x * x + z * z) / 2 > _LEAN * y, along, -along)
    by_rho = xp.where(a >= b, _LEAN * out + along / 2, over)
    by_y = xp.where(a >= b, out / 2 - _LEAN * along, -down)
    return _around(p, xp.maximum(a, b), by_rho, by_y)


def _capsule(p: Points) -> Array:
    x, y, z = p
    beyond = _above(abs(y) - _LONG)
    return namespace(x).sqrt(x * x + beyond * beyond + z * z) - _PILL


def _capsule_slopes(p: Points) -> tuple[Array, ...]:
    x, y, z = p
    return _capsule(p), *_sphere_slopes([x, namespace(y).sign(y) * _above(abs(y) - _LONG), z])[1:]


def _octahedron_ways(p: Points) -> tuple[Array, Array]:
    """How far above its plane a point is, by its coordinates' sum; and how far from it the nearest point of
    the octahedron is along each axis at most, outside (Duchi et al. 2008, projection onto the simplex).
    """
    a, b, c = map(abs, p)
    xp = namespace(a)
    above, most, least = a + b + c - 1, xp.maximum(xp.maximum(a, b), c), xp.minimum(xp.minimum(a, b), c)
    return above, xp.maximum(xp.maximum(most - 1, (above - least) / 2), above / 3)


def _octahedron(p: Points) -> Array:
    xp, (above, way) = namespace(p[0]), _octahedron_ways(p)
    outside = xp.sqrt(sum(xp.minimum(abs(a), abs(way)) ** 2 for a in p))
    inside = (above - abs(above)) / 2 / math.sqrt(3)
    return outside * (above > 0) + inside


def _octahedron_slopes(p: Points) -> tuple[Array, ...]:
    xp, (above, way) = namespace(p[0]), _octahedron_ways(p)
    ways = [xp.where(above > 0, xp.minimum(abs(a), way), 1.0) for a in p]
    length = xp.sqrt(sum(own * own for own in ways))
    return _octahedron(p), *(xp.sign(a) * own / length for a, own in zip(p, ways, strict=True))


GEOMETRIES: Final[dict[str, Geometry]] = {
    "square": _sectored(4, math.pi / 4, math.cos(math.pi / 4), _SIDE, _CORNERS),
    "triangle": _sectored(3, _UP, math.cos(math.pi / 3), 0.5),
    "star": _sectored(5, _UP, 0.381966),
    "pentagon": _sectored(5, _UP, math.cos(math.pi / 5)),
    "disc": Geometry(lambda p: namespace(p[0]).sqrt(p[0] * p[0] + p[1] * p[1]) - 1.0, 1.0),
    "hexagon": _sectored(6, _UP, math.cos(math.pi / 6)),
    "sphere": Geometry(_sphere, 1.0, _sphere_slopes, thickness=2.0),
    "torus": Geometry(_torus, 0.0, _torus_slopes, (1.0, _TUBE, 1.0), 2.0 * _TUBE),
    "box": Geometry(
        lambda p: _corner(*(abs(a) - _CUBE for a in p)), _CUBE, _box_slopes, (_CUBE,) * 3, 2.0 * _CUBE, True
    ),
    "cylinder": Geometry(
        lambda p: _corner(*_cylinder_levels(p)), _CAN, _cylinder_slopes, (_CAN,) * 3, 2.0 * _CAN, True
    ),
    "cone": Geometry(_cone, 0.5, _cone_slopes, (_LEAN, 1.0, _LEAN), 1.0, True),
    "capsule": Geometry(_capsule, _PILL, _capsule_slopes, (_PILL, 1.0, _PILL), 2.0 * _PILL),
    "octahedron": Geometry(_octahedron, _CUBE, _octahedron_slopes, thickness=2.0 * _CUBE, edged=True),
}
"""All of them; their dimensions and meaning are in `scenelang.language.words.LEAVES`."""
SECTORS: Final = {name: row.sectors for name, row in GEOMETRIES.items() if row.sectors is not None}
