"""Files of meshes, which trimesh reads: the solids in them, where they lie, and what they look like."""

from __future__ import annotations

import io
import json
import logging
import re
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.fitting.looks import Look, Points, joined, look_of, white
from scenelang.fitting.mesh import MOST_TRIANGLES, FitError, Mesh, Sign, mesh_of, needed

MOST_OF_MESH: Final = dict.fromkeys((".obj", ".ply", ".stl", ".glb"), 1 << 30)  # bytes of a file
_MOST_PIECES: Final = (
    10_000  # objects, groups and changes of material of a file; nodes and primitives of glTF
)
_MOST_CORNERS: Final = 1000  # of a face
_MOST_DEPTH: Final = 100  # of nodes within nodes
_MOST_NUMBERS: Final = 10 * MOST_TRIANGLES  # elements of all accessors, which may be more than their bytes
_UNDERSTOOD: Final = re.compile("KHR_(materials|lights|node|xmp)|EXT_texture_webp")
_IGNORED: Final = ("animations", "cameras", "skins")


class Solid(NamedTuple):
    """What has a name of its own in a file.

    Args:
        vertices: (V, 3), where they lie in the whole.
        triangles: (F, 3) indices.
        look: None where the file says nothing of it.
    """

    name: str
    vertices: Points
    triangles: npt.NDArray[np.int64]
    look: Look | None = None


def whole(solids: Sequence[Solid], sign: Sign = "auto") -> Mesh:
    """All solids as one mesh; as `mesh_of`."""
    if not solids:
        raise FitError("it holds no triangles")
    _, vertices, triangles, look = _joined("", solids)
    return mesh_of(vertices, triangles, sign, look)


def read_solids(
    data: bytes, suffix: str, files: Mapping[str, bytes] | None = None
) -> tuple[list[Solid], list[str]]:
    """The solids in the bytes of a file with a suffix of `MOST_OF_MESH`, and what there is to say of it.

    Args:
        files: materials and textures by the names that it has for them; if left out, looks are not read.

    Raises:
        FitError: it is damaged or too large, or has what cannot be read.
    """
    with needed("trimesh"):
        import trimesh
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    beside = _beside(files)
    try:  # a reader of many formats, which a stranger's file may break in many ways
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            notes = _notes(data) if suffix == ".glb" else []
            if suffix == ".obj":
                _few(data)
            objects = {"split_objects": True} if re.search(rb"^o ", data, re.M) else {"split_groups": True}
            kind = {"file_type": suffix[1:], "resolver": beside, **(objects if suffix == ".obj" else {})}
            found = trimesh.load_scene(io.BytesIO(data), skip_materials=files is None, **kind)
            solids = _solids(found, suffix, files is not None)
    except (FitError, MemoryError):
        raise
    except Exception as error:
        raise FitError(f"damaged or not a mesh: {str(error) or type(error).__name__}"[:200]) from error
    return solids, [*notes, *(f"`{name}` not found beside it" for name in sorted(beside.missing))]


def _few(data: bytes) -> None:
    """Refuse an OBJ that trimesh would read for minutes.

    Raises:
        FitError: it has too many pieces, or a face of too many corners.
    """
    if len(re.findall(rb"^[ \t]*(?:o|g|usemtl)\b", data, re.M)) > _MOST_PIECES:
        raise FitError(f"more than {_MOST_PIECES:,} objects, groups and changes of material")
    if re.search(rb"^[ \t]*f(?:[ \t]+[^\s]+){%d}" % (_MOST_CORNERS + 1), data, re.M):
        raise FitError(f"a face of more than {_MOST_CORNERS:,} corners")


def _notes(data: bytes) -> list[str]:
    """What of a glTF is left out.

    Raises:
        FitError: it cannot be read without an extension.
    """
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
    if any("targets" in part for part in primitives):
        notes.append("morph targets left out")
    if any(part.get("mode", 4) not in (4, 5) for part in primitives):
        notes.append("points, lines and fans left out")
    if "KHR_lights_punctual" in header.get("extensions", {}):
        notes.append("lights left out")
    if "KHR_texture_transform" in header.get("extensionsUsed", ()):
        notes.append("moves of textures left out")
    if len(header.get("scenes", ())) > 1:
        notes.append(f"{len(header['scenes'])} scenes, of which it takes number {header.get('scene', 0) + 1}")
    return notes


def _beside(files: Mapping[str, bytes] | None) -> Any:
    """What has the files that a file names, and notes which are missing."""
    import trimesh

    class Beside(trimesh.resolvers.Resolver):
        def __init__(self) -> None:
            self.missing: set[str] = set()

        def get(self, name: str) -> bytes:
            if files is not None and name not in files:
                self.missing.add("".join(c for c in name if c.isprintable())[:80])
            return (files or {})[name]

        def keys(self) -> tuple[str, ...]:
            return ()

        def namespaced(self, namespace: str) -> Any:
            return self

        def write(self, name: str, data: Any) -> None:
            raise PermissionError(f"`{name}` is only read")

    return Beside()


def _solids(scene: Any, suffix: str, looks: bool) -> list[Solid]:
    """The solids of a scene, those of one name joined, in the order of the file."""
    named: dict[str, list[Solid]] = {}
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
        named.setdefault(name, []).append(Solid(name, vertices, triangles, look))
    return [_joined(name, solids) for name, solids in named.items()]


def _joined(name: str, solids: Sequence[Solid]) -> Solid:
    first = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
    looks = [solid.look or white(len(solid.triangles)) for solid in solids]
    return Solid(
        name,
        np.concatenate([solid.vertices for solid in solids]),
        np.concatenate([s.triangles + at for s, at in zip(solids, first, strict=False)]),
        joined(looks) if any(solid.look for solid in solids) else None,
    )
