"""Triangle meshes as solids: read, put into the unit ball, asked for distances and colours of sRGB.

No mesh is trusted: those that would crash libigl are refused here.
"""

from __future__ import annotations

import io
import json
import logging
import re
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.records import Record
from scenelang.drawing.image import decoded, encoded
from scenelang.language.diagnostics import plural

MOST_PIXELS: Final = 1 << 26
FINEST: Final = 2048  # pixels along a side of a texture; finer ones are made smaller
Points = npt.NDArray[np.float64]  # (M, 3)
Rows = npt.NDArray[Any]


class Tints(Record, frozen=False):
    """The colours of F triangles."""

    tint: npt.NDArray[np.float32]  # (F, 3, 3), at corners; of a texture what multiplies it
    linear: npt.NDArray[np.bool_]  # whether tints are, as those of glTF
    uv: npt.NDArray[np.float32]  # (F, 3, 2), at corners, v up
    image: npt.NDArray[np.int32]  # (F,) which texture, -1 for none
    images: tuple[npt.NDArray[np.uint8], ...] = ()  # textures (h, w, 3), 0 to 255

    def of(self, chosen: Rows) -> Tints:
        """The look of some of the triangles."""
        return Tints(self.tint[chosen], self.linear[chosen], self.uv[chosen], self.image[chosen], self.images)

    def at(self, triangles: Rows, share: Points) -> Points:
        """Colours (M, 3) of sRGB, 0 to 1, at points of triangles (M,), by barycentric shares (M, 3)."""
        result = (self.tint[triangles] * share[..., None]).sum(1)
        linear = self.linear[triangles]
        texel = np.ones_like(result)
        uv = (self.uv[triangles] * share[..., None]).sum(1)
        for k, image in enumerate(self.images):
            on = self.image[triangles] == k
            texel[on] = _looked_up(image, uv[on])
        result[linear] = encoded(result[linear] * decoded(texel[linear]))
        result[~linear] *= texel[~linear]
        return np.asarray(result.clip(0, 1))

    @property
    def plain(self) -> tuple[float, float, float] | None:
        """The one colour of all, if it is one."""
        first = self.tint[:1, :1]
        if (self.image >= 0).any() or (abs(self.tint - first) > 1 / 512).any() or len(set(self.linear)) > 1:
            return None
        r, g, b = self.at(np.zeros(1, int), np.full((1, 3), 1 / 3))[0].round(4).tolist()
        return r, g, b


def _looked_up(image: npt.NDArray[np.uint8], uv: Points) -> Points:
    """Texels, 0 to 1, bilinear between centres, repeated."""
    from scipy.ndimage import map_coordinates

    place = np.stack([1 - uv[:, 1], uv[:, 0]]) % 1.0 * np.array([image.shape[:2]]).T - 0.5
    channels = np.moveaxis(image, -1, 0)
    result = [map_coordinates(c, place, np.float64, order=1, mode="grid-wrap") for c in channels]
    return np.stack(result, 1) / 255


def look_of(mesh: Any, linear: bool, textures: dict[int, npt.NDArray[np.uint8]]) -> Tints | None:
    """Colours of a mesh as trimesh reads it, None where its file has none; ``textures`` were read before."""
    visual, faces = mesh.visual, np.asarray(mesh.faces)
    tint = np.ones((len(faces), 3, 3), np.float32)
    uv = np.zeros((len(faces), 3, 2), np.float32)
    images: tuple[npt.NDArray[np.uint8], ...] = ()
    if visual.kind in ("vertex", "face"):
        by_face = visual.kind == "face"
        tint *= _shares(visual.face_colors[:, None] if by_face else visual.vertex_colors[faces])
    elif visual.kind == "texture":
        material, corner = visual.material, visual.vertex_attributes.get("color")
        texture = getattr(material, "baseColorTexture" if linear else "image", None)
        factor = getattr(material, "baseColorFactor" if linear else "diffuse", None)
        if texture is not None and texture.format is None:
            return None  # trimesh's own, where a file names no material
        if texture is not None and visual.uv is not None:
            images = (textures.setdefault(id(texture), _texture(texture)),)
            uv = np.asarray(visual.uv, np.float32)[faces]
        if factor is not None and (linear or not images):
            tint *= _shares(factor)
        if corner is not None:
            tint *= _shares(corner[faces])
    else:
        return None
    image = np.full(len(faces), len(images) - 1, np.int32)
    return Tints(tint, np.full(len(faces), linear), uv, image, images)


def _shares(colour: Rows) -> Rows:
    """Red, green and blue of colours whose last axis has them first, 0 to 1."""
    most = np.iinfo(colour.dtype).max if np.issubdtype(colour.dtype, np.integer) else 1
    return np.asarray(colour[..., :3] / np.float32(most), np.float32)


def _texture(image: Any) -> npt.NDArray[np.uint8]:
    if image.width * image.height > MOST_PIXELS:
        raise ValueError(f"a texture of more than {MOST_PIXELS:,} pixels")
    picture = image.convert("RGB")
    picture.thumbnail((FINEST, FINEST))
    return np.asarray(picture)


def white(count: int) -> Tints:
    """The look of triangles of which nothing is said."""
    tint, uv = np.ones((count, 3, 3), np.float32), np.zeros((count, 3, 2), np.float32)
    return Tints(tint, np.zeros(count, bool), uv, np.full(count, -1, np.int32))


def joined(looks: Sequence[Tints]) -> Tints:
    """The look of the triangles of all, in order."""
    shift = np.cumsum([0, *(len(look.images) for look in looks)])
    image = [np.where(a.image >= 0, a.image + s, -1) for a, s in zip(looks, shift, strict=False)]
    tint, linear, uv = (np.concatenate([getattr(a, n) for a in looks]) for n in ("tint", "linear", "uv"))
    images = tuple(image for look in looks for image in look.images)
    return Tints(tint, linear, uv, np.concatenate(image).astype(np.int32), images)


Sign = Literal["auto", "winding", "closed"]
MOST_TRIANGLES: Final = 4_000_000
_ENCLOSED: Final = 0.5  # share of a surface that has to have an inside
_BESIDE: Final = 2e-3  # leaf units from a surface to where its sides are asked
_SLOW_S: Final = 2e-3  # of processor time that a point's distances may take: there are some 500,000
_TOUCHING: Final = 1e-6  # leaf units from a surface to where its normals are those of its triangles


class FitError(ValueError):
    """A file cannot be made an element, or a scene cannot be fitted to a picture."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A solid in the unit ball: the midpoint of its bounding box is the origin, its farthest point at 1.

    A drawing has the like in the plane, `scenelang.drawing.exact.outline.Outline`.
    """

    vertices: Points  # (V, 3)
    triangles: npt.NDArray[np.int64]  # (F, 3) indices
    closed: bool  # tell inside by the nearest surface's normal, otherwise by winding numbers
    centre: tuple[float, float, float]  # of the ball in the file's own coordinates
    size: float  # radius of the ball there
    notes: tuple[str, ...] = ()  # what was found and mended
    look: Tints | None = None  # the colours of its triangles, where they have any
    dimension: ClassVar[int] = 3

    @cached_property
    def _trees(self) -> tuple[Any, Any]:
        """Search trees for the nearest triangle and for winding numbers."""
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
        """At most ``count`` points (K, d) all over, outward normals, and the share with no inside; raises
        `FitError` where that is most of it.
        """
        at, share = self.spread(count, 1)
        a, b, c = self.vertices[self.triangles[at]].swapaxes(0, 1)
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        points = self.points(at, share)
        _ = None if self.closed else self._trees
        for few, least in ((16, 0.0), (500, _ENCLOSED - 0.1), (count, _ENCLOSED)):
            started = time.process_time()
            result, out, thin = outer(self.distances, points[:few], normals[:few], _BESIDE)
            spent_s, enclosed = time.process_time() - started, len(result) / len(points[:few])
            if few < count and not self.closed and spent_s > 1 + _SLOW_S * few:
                raise FitError("its triangles overlap so much that distances to it would take minutes")
            if enclosed < least:
                open_ = f"{100 * (1 - enclosed):.0f} % of the surface has no inside"
                raise FitError(f"{open_} {_BESIDE:g} radii below it: it encloses no solid")
        return result, out, thin


def outer(
    distances: Callable[[Points], Points], points: Points, normals: Points, beside: float
) -> tuple[Points, Points, float]:
    """`Mesh.surface` of points and normals to either side (M, d), whose sides are asked at ``beside``."""
    sides = [distances(points + way * beside * normals) < 0 for way in (1, -1)]
    chosen = sides[0] != sides[1]
    turned = np.where(sides[0], -1.0, 1.0)[:, None]
    return points[chosen], (normals * turned)[chosen], float((~(sides[0] | sides[1])).mean())


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
    vertices: Points, triangles: npt.NDArray[np.int64], sign: Sign = "auto", look: Tints | None = None
) -> Mesh:
    """The solid that triangles enclose, and what it looks like; raises `FitError`.

    ``sign`` tells inside: ``winding`` numbers take any mesh, ``closed`` ones, which nowhere pass through
    themselves, have normals; ``auto`` is ``winding``.
    """
    with needed("trimesh"):
        import trimesh
        from trimesh.grouping import unique_rows
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
    # triangles that are the first with their corners in their order round; of many at one place all would be
    # asked, for each point
    turned = (mesh.faces.argmin(1)[:, None] + np.arange(3)) % 3
    first, _ = unique_rows(np.take_along_axis(mesh.faces, turned, 1))
    if not (once := np.isin(np.arange(len(turned)), first)).all():
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
    kind = "closed" if closed else "not closed, filled where the winding number is over a half"
    rule = "normals" if by_normals else "winding numbers"
    notes = [plural(len(mesh.faces), "triangle"), kind, *notes, f"inside by {rule}"]
    vertices, faces = np.ascontiguousarray(mesh.vertices, float), np.ascontiguousarray(mesh.faces, np.int64)
    x, y, z = centre.tolist()
    return Mesh(vertices, faces, by_normals, (x, y, z), size, tuple(notes), look)


MOST_OF_MESH: Final = dict.fromkeys((".obj", ".ply", ".stl", ".glb"), 1 << 30)  # bytes of a file
_MOST_PIECES: Final = 10_000  # objects, groups and changes of material; nodes and primitives of glTF
_MOST_CORNERS: Final = 1000  # of a face
_MOST_DEPTH: Final = 100  # of nodes within nodes
_MOST_NUMBERS: Final = 10 * MOST_TRIANGLES  # elements of all accessors, which may be more than their bytes
_UNDERSTOOD: Final = re.compile("KHR_(materials|lights|node|xmp)|EXT_texture_webp")
_IGNORED: Final = ("animations", "cameras", "skins")


class NamedMesh(NamedTuple):
    """A named mesh of a file."""

    name: str
    vertices: Points  # (V, 3), where they lie in the whole
    triangles: npt.NDArray[np.int64]  # (F, 3) indices
    look: Tints | None = None  # None where the file says nothing of it


def whole(solids: Sequence[NamedMesh], sign: Sign = "auto") -> Mesh:
    """All solids as one mesh; as `mesh_of`."""
    if not solids:
        raise FitError("it holds no triangles")
    _, vertices, triangles, look = _joined("", solids)
    return mesh_of(vertices, triangles, sign, look)


def read_solids(
    data: bytes, suffix: str, files: Mapping[str, bytes] | None = None
) -> tuple[list[NamedMesh], list[str]]:
    """The solids in the bytes of a file with a suffix of `MOST_OF_MESH`, and what there is to say of it;
    without ``files``, materials and textures by name, looks are not read. Raises `FitError`.
    """
    with needed("trimesh"):
        import trimesh
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    beside = _beside(files)
    try:  # a reader of many formats, which a stranger's file may break in many ways
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            notes = _notes(data) if suffix == ".glb" else []
            if suffix == ".obj":  # what trimesh would read for minutes
                if len(re.findall(rb"^[ \t]*(?:o|g|usemtl)\b", data, re.M)) > _MOST_PIECES:
                    raise FitError(f"more than {_MOST_PIECES:,} objects, groups and changes of material")
                if re.search(rb"^[ \t]*f(?:[ \t]+[^\s]+){%d}" % (_MOST_CORNERS + 1), data, re.M):
                    raise FitError(f"a face of more than {_MOST_CORNERS:,} corners")
            objects = {"split_objects": True} if re.search(rb"^o ", data, re.M) else {"split_groups": True}
            kind = {"file_type": suffix[1:], "resolver": beside, **(objects if suffix == ".obj" else {})}
            result = trimesh.load_scene(io.BytesIO(data), skip_materials=files is None, **kind)
            solids = _solids(result, suffix, files is not None)
    except (FitError, MemoryError):
        raise
    except Exception as error:
        raise FitError(f"damaged or not a mesh: {str(error) or type(error).__name__}"[:200]) from error
    return solids, [*notes, *(f"`{name}` not found beside it" for name in sorted(beside.missing))]


def _notes(data: bytes) -> list[str]:
    """Notes on parts of a glTF that are left out; raises `FitError` where it cannot be read."""
    header = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    strange = [name for name in header.get("extensionsRequired", ()) if not _UNDERSTOOD.match(name)]
    if strange:
        message = f"it is compressed or needs what is not read here: {', '.join(strange)}"
        raise FitError(f"{message}; export it without")
    meshes, notes = header.get("meshes", ()), [f"{name} left out" for name in _IGNORED if header.get(name)]
    primitives = [part for mesh in meshes for part in mesh.get("primitives", ())]
    nodes = header.get("nodes", ())
    if len(primitives) + len(nodes) > _MOST_PIECES:
        raise FitError(f"more than {_MOST_PIECES:,} nodes and primitives")
    above = {child: at for at, node in enumerate(nodes) for child in node.get("children", ())}
    level = [*range(len(nodes))]
    for _ in range(_MOST_DEPTH):
        level = [above[at] for at in level if at in above]
    if level:
        raise FitError(f"nodes within nodes, more than {_MOST_DEPTH} deep")
    if sum(accessor.get("count", 0) for accessor in header.get("accessors", ())) > _MOST_NUMBERS:
        raise FitError(f"accessors of more than {_MOST_NUMBERS:,} elements")
    others = {
        "morph targets": any("targets" in part for part in primitives),
        "points, lines and fans": any(part.get("mode", 4) not in (4, 5) for part in primitives),
        "lights": "KHR_lights_punctual" in header.get("extensions", {}),
        "moves of textures": "KHR_texture_transform" in header.get("extensionsUsed", ()),
    }
    notes += [f"{name} left out" for name, there in others.items() if there]
    if len(header.get("scenes", ())) > 1:
        notes.append(f"{len(header['scenes'])} scenes, of which it takes number {header.get('scene', 0) + 1}")
    return notes


def _beside(files: Mapping[str, bytes] | None) -> Any:
    """A resolver, for trimesh, of the files that a file names; it notes the missing ones."""
    import trimesh

    class Beside(trimesh.resolvers.ZipResolver):  # of an empty archive
        missing: ClassVar[set[str]] = set()

        def get(self, name: str) -> bytes:
            if files is not None and name not in files:
                self.missing.add("".join(c for c in name if c.isprintable())[:80])
            return (files or {})[name]

    return Beside({})


def _solids(scene: Any, suffix: str, looks: bool) -> list[NamedMesh]:
    """The solids of a scene, those of one name joined, in the order of the file."""
    named: dict[str, list[NamedMesh]] = {}
    textures: dict[int, npt.NDArray[np.uint8]] = {}
    count = 0
    for node in reversed(scene.graph.nodes_geometry):
        matrix, geometry = scene.graph[node]
        mesh = scene.geometry[geometry]
        if not hasattr(mesh, "faces"):
            continue  # points or lines
        count += len(mesh.faces)
        if count > MOST_TRIANGLES:
            raise FitError(f"more than {MOST_TRIANGLES:,} triangles")
        vertices = np.asarray(mesh.vertices, float) @ matrix[:3, :3].T + matrix[:3, 3]
        triangles = np.asarray(mesh.faces, np.int64)
        look = look_of(mesh, suffix == ".glb", textures) if looks else None
        name = str(node)
        if mesh.metadata.get("from_gltf_primitive"):
            name = str(scene.graph.transforms.parents[node])
        elif suffix == ".obj" and mesh.visual.kind == "texture":
            name = name.removesuffix(f"_{mesh.visual.material.name}")
        named.setdefault(name, []).append(NamedMesh(name, vertices, triangles, look))
    return [_joined(name, solids) for name, solids in named.items()]


def _joined(name: str, solids: Sequence[NamedMesh]) -> NamedMesh:
    first = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
    looks = [solid.look or white(len(solid.triangles)) for solid in solids]
    return NamedMesh(
        name,
        np.concatenate([solid.vertices for solid in solids]),
        np.concatenate([s.triangles + at for s, at in zip(solids, first, strict=False)]),
        joined(looks) if any(solid.look for solid in solids) else None,
    )
