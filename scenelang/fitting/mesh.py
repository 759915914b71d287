"""Triangle meshes as solids: put into the unit ball, and asked for distances and colours.

Needs trimesh and libigl, which measures. Every mesh is taken for a stranger's: what libigl would not survive
is refused here.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Final, Literal, Protocol

import numpy as np
import numpy.typing as npt

from scenelang.diagnostics.suggest import plural
from scenelang.fitting.looks import Look, Points

Sign = Literal["auto", "winding", "closed"]
MOST_TRIANGLES: Final = 4_000_000
_ENCLOSED: Final = 0.5  # share of a surface that has to have an inside
_BESIDE: Final = 2e-3  # leaf units from a surface to where its sides are asked
_SLOW_S: Final = 2e-3  # of processor time that a point's distances may take: there are some 500,000
_TOUCHING: Final = 1e-6  # leaf units from a surface to where its normals are those of its triangles


class FitError(ValueError):
    """What cannot be made an element, or which scene cannot be fitted to a picture, and why."""


class Shape(Protocol):
    """What is to be made an element, in the unit ball or disc."""

    @property
    def dimension(self) -> int:
        """2 or 3."""

    @property
    def centre(self) -> tuple[float, ...]:
        """Of the ball, in the file's own coordinates."""

    @property
    def size(self) -> float:
        """Radius of the ball there."""

    def distances(self, p: Points) -> Points:
        """Signed distances (M,) of points (M, d), negative inside."""

    def surface(self, count: int) -> tuple[Points, Points, float]:
        """Points (K, d) of the surface, ``count`` at most, outward normals, and what share is too thin."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A solid in the unit ball: the midpoint of its bounding box is the origin, its farthest point at 1.

    Args:
        vertices: (V, 3).
        triangles: (F, 3) indices.
        closed: tell inside by the nearest surface's normal, otherwise by winding numbers.
        centre, size: of the ball in the file's own coordinates.
        notes: what was found and mended.
        look: the colours of its triangles, where they have any.
    """

    vertices: Points
    triangles: npt.NDArray[np.int64]
    closed: bool
    centre: tuple[float, float, float]
    size: float
    notes: tuple[str, ...] = ()
    look: Look | None = None
    dimension: ClassVar[int] = 3

    @cached_property
    def _trees(self) -> tuple[Any, Any]:
        """What finds the nearest triangle, and winding numbers."""
        igl = _igl()
        boxes, windings = igl.AABB(), igl.FastWindingNumberBVH()
        boxes.init(self.vertices, self.triangles)
        windings.init(self.vertices, self.triangles)
        return boxes, windings

    def distances(self, p: Points) -> Points:
        """Signed distances (M,) of points, negative inside."""
        return self._nearest(p)[0]

    def slopes(self, p: Points) -> Points:
        """Gradients (M, 3) of `distances`."""
        d, triangle, at = self._nearest(p)
        a, b, c = self.vertices[self.triangles[triangle]].swapaxes(0, 1)
        normal, off = np.cross(b - a, c - a), p - at
        normal *= np.sign((normal * off).sum(1))[:, None]  # to the side that the point is on
        way = np.where(abs(d)[:, None] < _TOUCHING, normal, off)
        way *= np.where(d < 0, -1.0, 1.0)[:, None] / np.maximum(np.linalg.norm(way, axis=1), 1e-300)[:, None]
        return np.asarray(way, float)

    def _nearest(self, p: Points) -> tuple[Points, npt.NDArray[np.int64], Points]:
        """Signed distances (M,) of points, the nearest triangle (M,) and the nearest point (M, 3) on it."""
        if not len(p):
            return np.zeros(0), np.zeros(0, np.int64), np.zeros((0, 3))
        igl, mesh, p = _igl(), (self.vertices, self.triangles), np.ascontiguousarray(p, float)
        if self.closed:
            kind = igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
            d, triangle, at, _ = igl.signed_distance(p, *mesh, sign_type=kind)
            return d, triangle, at
        boxes, windings = self._trees
        square, triangle, at = boxes.squared_distance(*mesh, p)
        return np.where(abs(windings.winding_number(p)) > 0.5, -1.0, 1.0) * np.sqrt(square), triangle, at

    def spread(self, count: int, seed: int) -> tuple[npt.NDArray[np.int64], Points]:
        """Triangles (M,) and barycentric shares (M, 3) of points spread evenly on all of the surface."""
        random = np.random.default_rng(seed)
        a, b, c = self.vertices[self.triangles].swapaxes(0, 1)
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        at = random.choice(len(area), count, p=area / area.sum())
        u, v = random.random((2, count))
        u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
        return at, np.stack([1 - u - v, u, v], 1)

    def points(self, triangles: npt.NDArray[np.int64], share: Points) -> Points:
        """Points (M, 3) of triangles (M,), by barycentric shares (M, 3)."""
        return np.asarray((self.vertices[self.triangles[triangles]] * share[..., None]).sum(1))

    def touched(self, p: Points) -> tuple[npt.NDArray[np.int64], Points]:
        """Triangles (M,) and barycentric shares (M, 3) of the points of the surface nearest to points."""
        from trimesh.triangles import points_to_barycentric

        _, triangle, at = self._nearest(p)
        share = points_to_barycentric(self.vertices[self.triangles[triangle]], at, "cross").clip(0, 1)
        return triangle, share / share.sum(1, keepdims=True)

    def surface(self, count: int) -> tuple[Points, Points, float]:
        """Points (K, 3) spread evenly on the outside of the solid, K at most ``count``, and normals there.

        Also the share of the surface that has no inside on either side.

        Raises:
            FitError: most of the surface has no inside.
        """
        at, share = self.spread(count, 1)
        a, b, c = self.vertices[self.triangles[at]].swapaxes(0, 1)
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        points = self.points(at, share)
        _ = None if self.closed else self._trees
        for few, least in ((16, 0.0), (500, _ENCLOSED - 0.1), (count, _ENCLOSED)):
            started = time.process_time()
            found, out, thin = outer(self.distances, points[:few], normals[:few], _BESIDE)
            spent_s, enclosed = time.process_time() - started, len(found) / len(points[:few])
            if few < count and not self.closed and spent_s > 1 + _SLOW_S * few:
                raise FitError("its triangles overlap so much that distances to it would take minutes")
            if enclosed < least:
                open_ = f"{100 * (1 - enclosed):.0f} % of the surface has no inside"
                raise FitError(f"{open_} {_BESIDE:g} radii below it: it encloses no solid")
        return found, out, thin


def outer(
    distances: Callable[[Points], Points], points: Points, normals: Points, beside: float
) -> tuple[Points, Points, float]:
    """Of points of surfaces (M, d) those with an inside on one side alone (K, d), and outward normals.

    Also the share of those that have none on either side.

    Args:
        distances: signed, of points.
        normals: (M, d), to either side.
        beside: how far from a surface its sides are asked.
    """
    sides = [distances(points + way * beside * normals) < 0 for way in (1, -1)]
    chosen = sides[0] != sides[1]
    turned = np.where(sides[0], -1.0, 1.0)[:, None]
    return points[chosen], (normals * turned)[chosen], float((~(sides[0] | sides[1])).mean())


def _once(triangles: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Which of triangles (F, 3) are the first with their corners in their order round."""
    from trimesh.grouping import unique_rows

    turned = np.take_along_axis(triangles, (triangles.argmin(1)[:, None] + np.arange(3)) % 3, 1)
    return np.isin(np.arange(len(triangles)), unique_rows(turned)[0])


def _igl() -> Any:
    with needed("libigl"):
        import igl
    return igl


@contextmanager
def needed(name: str) -> Iterator[None]:
    """Say which package is missing where an import fails."""
    try:
        yield
    except ImportError as error:
        message = f"this needs {name}, which is not installed; pip install 'scenelang[learn]'"
        raise FitError(message) from error


def mesh_of(
    vertices: Points, triangles: npt.NDArray[np.int64], sign: Sign = "auto", look: Look | None = None
) -> Mesh:
    """The solid that triangles enclose, and what it looks like.

    Args:
        sign: what tells inside: ``winding`` numbers, which take any mesh, or normals, for ``closed`` ones
            whose surface nowhere passes through itself; ``auto`` is ``winding``.

    Raises:
        FitError: it is empty, too large or damaged.
    """
    with needed("trimesh"):
        import trimesh
    notes = []
    if vertices.shape[1:] != (3,) or triangles.shape[1:] != (3,) or not len(triangles):
        raise FitError("it holds no triangles")
    if len(triangles) > MOST_TRIANGLES:
        raise FitError(f"{len(triangles):,} triangles, at most {MOST_TRIANGLES:,}")
    if not np.isfinite(vertices).all() or not abs(vertices).max() < 1e100:
        raise FitError("a vertex is not finite")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise FitError("a triangle has a corner that it does not hold")
    used = vertices[np.unique(triangles)]
    low, high = used.min(0), used.max(0)
    centre = (low + high) / 2
    size = float(np.linalg.norm(used - centre, axis=1).max())
    if not size > 1e-12 * (1 + abs(centre).max()):
        raise FitError("all of its vertices lie at one point")
    mesh = trimesh.Trimesh((vertices - centre) / size, triangles, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    sound = mesh.area_faces > 1e-12
    if not sound.any():
        raise FitError("all of its triangles are flat")
    if not sound.all():
        notes.append(f"{plural((~sound).sum(), 'flat triangle')} left out")
        mesh.update_faces(sound)
        look = look and look.of(sound)
    if not (once := _once(mesh.faces)).all():  # many at one place would all be asked, for each point
        notes.append(f"{plural((~once).sum(), 'repeated triangle')} left out")
        mesh.update_faces(once)
        look = look and look.of(once)
    closed = bool(mesh.is_watertight and mesh.is_winding_consistent)
    if sign == "closed" and not closed:
        raise FitError("it is not closed; tell inside by winding numbers: --sign winding")
    by_normals = sign == "closed"
    if by_normals and mesh.volume < 0:
        notes.append("inside out, turned")
        mesh.invert()
        look = look and replace(look, tint=look.tint[:, ::-1], uv=look.uv[:, ::-1])
    told = "normals" if by_normals else "winding numbers"
    kind = "closed" if closed else "not closed, filled where the winding number is over a half"
    notes = [plural(len(mesh.faces), "triangle"), kind, *notes, f"inside by {told}"]
    return Mesh(
        np.ascontiguousarray(mesh.vertices, float),
        np.ascontiguousarray(mesh.faces, np.int64),
        by_normals,
        (float(centre[0]), float(centre[1]), float(centre[2])),
        size,
        tuple(notes),
        look,
    )
