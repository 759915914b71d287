"""A glTF node hierarchy as a Scene: nodes become groups, leaves named like geometries become objects.

A solids' model has a camera and a light too (`gltf_stage.py`): the first of the file.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final, Literal

from scenelang.graph import affine
from scenelang.graph.spaces import SPACES, flattened
from scenelang.graph.steps import IDENTITY, Rows
from scenelang.interchange.gltf_file import Gltf, GltfError, Node, read_gltf, short, srgb
from scenelang.interchange.gltf_stage import camera_of, light_of
from scenelang.models.manifest import Manifest, available, load_manifest
from scenelang.scene import schema

Plane = Literal["xy", "xz"]
Steps = tuple[schema.Transform, ...]
MOST_DEPTH: Final = 150  # nodes within nodes; text nests 200 levels

_ENDING: Final = re.compile(r"[._ -]?(?<!\d)\d+$|[._ -](?:copy|instance|mesh|geo|shape|obj)$")
"""One ending of a node's name; several are taken off one at a time."""
_MOST_LETTERS: Final = 200  # a longer name is not compared with those of geometries
_FLAT: Final = 1e-6
"""How far the entries of a matrix that mix z with x and y may be from 0: they are written in float32."""
_MOST_NAME: Final = 40


@dataclass(slots=True)
class Imported:
    """A Scene made of a file, and what of the file it lacks.

    Args:
        scene: the scene; without nodes where nothing fitted.
        names: node paths by the `id` of the scene's nodes.
        left_out: a line for each node or property that is not in the scene.
        objects: number of objects.
    """

    scene: schema.Scene
    names: dict[int, str] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    objects: int = 0


def load_gltf(path: str | os.PathLike[str], *, model: str | None = None, plane: Plane = "xy") -> Imported:
    """Read a .gltf or .glb file; arguments as for `import_gltf`.

    Raises:
        GltfError: it is not glTF 2.0, or no scene can be made of it.
        OSError: it cannot be read.
    """
    return import_gltf(read_gltf(path), model=model, plane=plane)


def import_gltf(gltf: Gltf, *, model: str | None = None, plane: Plane = "xy") -> Imported:
    """Make a Scene of a node hierarchy.

    Args:
        gltf: the file.
        model: name of the model to draw with; by default the one that has most of the leaves' names.
        plane: the plane that 2D drawings lie in: ``xy``, seen from +z, or ``xz``, seen from +y, which is
            the ground in modelling software.

    Raises:
        GltfError: nodes are no tree, a leaf leaves the plane of a 2D model, or there is no such model.
    """
    return _Import(gltf, _manifest(gltf, model), plane).run()


def geometry_of(names: Iterable[str | None], geometries: Iterable[str]) -> str | None:
    """The geometry that the first fitting name means: case and endings such as ``.001`` do not count."""
    known = {name.casefold(): name for name in geometries}
    for name in names:
        rest = (name or "").strip().casefold()
        while rest and len(rest) <= _MOST_LETTERS:
            if rest in known:
                return known[rest]
            ending = _ENDING.search(rest)
            rest = rest[: ending.start()] if ending else ""
    return None


def _manifest(gltf: Gltf, model: str | None) -> Manifest:
    if model is not None:
        if model not in available():
            raise GltfError(f"unknown model `{model}`; there is {', '.join(available())}")
        return load_manifest(model)
    leaves = [_names(gltf, node) for node in gltf.nodes if node.mesh is not None or not node.children]
    manifests = [load_manifest(name) for name in available()]

    def rank(manifest: Manifest) -> tuple[int, int, int]:
        fitting = sum(geometry_of(names, manifest.geometries) is not None for names in leaves)
        return -fitting, manifest.dimension, len(manifest.geometries)

    return min(manifests, key=rank)


def _names(gltf: Gltf, node: Node) -> tuple[str | None, ...]:
    return (node.name,) if node.mesh is None else (node.name, gltf.meshes[node.mesh].name)


@dataclass(slots=True)
class _Import:
    gltf: Gltf
    manifest: Manifest
    plane: Plane
    names: dict[int, str] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    objects: int = 0
    stage: dict[str, Any] = field(default_factory=dict)
    _met: set[int] = field(default_factory=set)
    _looks: dict[int, schema.Material | None] = field(default_factory=dict)

    def run(self) -> Imported:
        if self.gltf.scenes:
            roots = self.gltf.scenes[self.gltf.scene or 0].nodes
        else:
            inner = {child for node in self.gltf.nodes for child in node.children}
            roots = tuple(at for at in range(len(self.gltf.nodes)) if at not in inner)
            if self.gltf.nodes and not roots:
                raise GltfError("the nodes form a cycle")
        made = [self.node(root, IDENTITY, IDENTITY, "", 1) for root in roots]
        nodes = tuple(node for node in made if node is not None)
        scene = schema.Scene(model=self.manifest.name, nodes=nodes, **self.stage)
        return Imported(scene, self.names, self.left_out, self.objects)

    @property
    def flat(self) -> bool:
        return self.manifest.dimension == 2

    def node(self, index: int, waiting: Rows, outer: Rows, above: str, depth: int) -> schema.SceneNode | None:
        """A node with all below it; of the maps above it, ``outer``, those ``waiting`` leave the plane."""
        node = self.gltf.nodes[index]
        path = f"{above}/{_shown(node.name, index)}"
        if index in self._met:
            raise GltfError(f"{path}: the nodes are not a tree: node {index} is met a second time")
        self._met.add(index)
        if depth > MOST_DEPTH:
            raise GltfError(f"{path[:200]}: nodes nested deeper than {MOST_DEPTH}")
        own_rows, own_steps = self.local(node, path)
        if not SPACES[2 if self.flat and _keeps_plane(own_rows) else 3].usable(own_rows):
            self.left_out.append(f"{path}: a scale of 0, or one that float32 cannot undo")
            self._met.update(self.below(index))
            return None
        rows = own_rows if waiting is IDENTITY else affine.compose(waiting, own_rows)
        if not self.flat or _keeps_plane(rows):
            steps = own_steps if waiting is IDENTITY else self.matrix(rows)
            below = IDENTITY
        else:  # what turns out of the plane here may be turned back below
            steps, below = (), rows
        world = affine.compose(outer, own_rows)
        if not self.flat:
            self.staged(node, world, path)
        own = self.leaf(node, path, below)
        inside = [self.node(child, below, world, path, depth + 1) for child in node.children]
        nodes = [child for child in (own, *inside) if child is not None]
        if not nodes:
            return None
        if len(nodes) == 1:
            return self.with_steps(nodes[0], steps, path)
        group = schema.Group(children=tuple(nodes), transforms=steps)
        self.names[id(group)] = path
        return group

    def staged(self, node: Node, world: Rows, path: str) -> None:
        """Take in a node's camera and light if they are the first."""
        try:
            if node.camera is not None and "camera" in self.stage:
                raise GltfError("a further camera")
            if node.camera is not None:
                camera, canvas, lost = camera_of(self.gltf.cameras[node.camera], world)
                self.stage |= {"camera": camera, "canvas": canvas}
                self.left_out += [f"{path}: {what}" for what in lost]
            if node.light is not None and "light" in self.stage:
                raise GltfError("a further light")
            if node.light is not None:
                self.stage["light"], lost = light_of(self.gltf.lights[node.light], world)
                self.left_out += [f"{path}: {what}" for what in lost]
        except GltfError as error:
            self.left_out.append(f"{path}: {error}")

    def with_steps(self, node: schema.SceneNode, steps: Steps, path: str) -> schema.SceneNode:
        """A single child needs no group: the maps above it come after its own."""
        moved = node.model_copy(update={"transforms": (*node.transforms, *steps)}) if steps else node
        self.names[id(moved)] = self.names.pop(id(node), path)
        return moved

    def below(self, index: int) -> set[int]:
        """All nodes under a node."""
        found: set[int] = set()
        stack = list(self.gltf.nodes[index].children)
        while stack:
            child = stack.pop()
            if child not in found:
                found.add(child)
                stack += self.gltf.nodes[child].children
        return found

    def leaf(self, node: Node, path: str, below: Rows) -> schema.Object | None:
        """The object that a node draws itself, before its transforms; None after a note."""
        for name in sorted(node.extensions):
            if "instancing" in name:
                self.left_out.append(f"{path}: its instances ({name[:_MOST_NAME]}); only one is drawn")
        stands = node.camera is not None or node.light is not None
        if node.mesh is None and (node.children or (stands and not self.flat)):
            return None
        names = _names(self.gltf, node)
        geometry = geometry_of(names, self.manifest.geometries)
        if geometry is None:
            mesh = f" with mesh `{_clean(names[1])}`" if len(names) > 1 and names[1] else ""
            if node.camera is not None:
                what = "a camera"
            elif node.light is not None:
                what = "a light"
            else:
                what = "empty" if node.mesh is None else f"no geometry of {self.manifest.name} is named so"
            self.left_out.append(f"{path}{mesh}: {what}")
            return None
        if below is not IDENTITY:
            raise GltfError(
                f"{path}: a 2D model cannot draw what leaves the plane: it is turned, sheared or mirrored "
                f"out of {self.plane} (a drawing in the other plane needs --plane)"
            )
        if node.skin is not None:
            self.left_out.append(f"{path}: its skin")
        found = schema.Object(geometry, material=self.look(node, path))
        self.objects += 1
        self.names[id(found)] = path
        return found

    def look(self, node: Node, path: str) -> schema.Material | None:
        """The colour of a mesh's material; several in one mesh are more than an object has."""
        primitives = self.gltf.meshes[node.mesh].primitives if node.mesh is not None else ()
        used = list(dict.fromkeys(primitive.material for primitive in primitives))
        if len(used) > 1:
            self.left_out.append(f"{path}: all but the first of its {len(used)} materials")
        if not used or used[0] is None:
            return None
        if used[0] not in self._looks:
            self._looks[used[0]] = self.colour(used[0])
        return self._looks[used[0]]

    def colour(self, index: int) -> schema.Material | None:
        material = self.gltf.materials[index]
        red, green, blue, alpha = material.pbr.factor
        name = f"material `{_shown(material.name, index)}`"
        if alpha < 1.0:
            self.left_out.append(f"{name}: its alpha of {alpha:g}")
        if material.pbr.texture is not None:
            self.left_out.append(f"{name}: its texture")
        if (red, green, blue) == (1.0, 1.0, 1.0):
            return None
        paint = schema.Color(rgb=(srgb(red), srgb(green), srgb(blue)))
        return schema.Material(self.manifest.materials[0], ops=(paint,))

    def local(self, node: Node, path: str) -> tuple[Rows, Steps]:
        """A node's transform in the axes of the scene, as a matrix and as it was written."""
        if node.matrix is not None:
            if any(abs(node.matrix[at] - want) > _FLAT for at, want in ((3, 0), (7, 0), (11, 0), (15, 1))):
                raise GltfError(f"{path}: a matrix whose last row is not 0, 0, 0, 1")
            columns = node.matrix
            rows: Rows = tuple(columns[4 * c + r] for r in range(3) for c in range(4))  # type: ignore[assignment]
            if self.plane == "xz":
                rows = affine.compose(_UP, affine.compose(rows, _DOWN))
            return rows, self.matrix(rows)
        (x, y, z), (i, j, k, w), (u, v, s) = node.translation, node.rotation, node.scale
        if self.plane == "xz":  # (x, y, z) becomes (x, -z, y)
            (x, y, z), (i, j, k), (u, v, s) = (x, -z, y), (i, -k, j), (u, s, v)
        length = math.hypot(i, j, k, w)
        if length < _FLAT:
            raise GltfError(f"{path}: a quaternion of length 0")
        if abs(length - 1.0) > 1e-3:
            self.left_out.append(f"{path}: the length of its quaternion, {length:g}, is taken as 1")
        angle, axis = affine.turn(i, j, k, w)
        rows = affine.compose(affine.rotation(angle, axis), affine.scaling(u, v, s))
        rows = affine.compose(affine.translation(x, y, z), rows)
        if self.flat and any(axis[:2]):
            return rows, self.matrix(rows)
        steps: list[schema.Transform] = []
        if (u, v, s) != (1.0, 1.0, 1.0) and all((u, v, s)):
            steps.append(_scale(u, v, 1.0 if self.flat else s, self.flat))
        if angle != 0.0:
            turn = math.radians(short(math.degrees(angle)))
            steps.append(schema.Rotate(angle=turn, axis=(short(axis[0]), short(axis[1]), short(axis[2]))))
        steps += self.shift(x, y, z)
        return rows, tuple(steps)

    def matrix(self, rows: Rows) -> Steps:
        """A map as the simplest transforms that are it, in the plane for a 2D model."""
        if self.flat:
            rows = flattened(rows)
        linear = (rows[1], rows[2], rows[4], rows[6], rows[8], rows[9])
        if any(linear) or not all((rows[0], rows[5], rows[10])):
            if not SPACES[3].usable(rows):
                return ()  # left out by whoever asks for it
            brief: Rows = tuple(map(short, rows))  # type: ignore[assignment]
            rows = brief if SPACES[3].usable(brief) else rows
            return (schema.Matrix(rows=(rows[0:4], rows[4:8], rows[8:12], (0.0, 0.0, 0.0, 1.0))),)
        scale = (rows[0], rows[5], rows[10])
        return (
            *((_scale(*scale, self.flat),) if scale != (1.0, 1.0, 1.0) else ()),
            *self.shift(rows[3], rows[7], rows[11]),
        )

    def shift(self, x: float, y: float, z: float) -> Steps:
        z = 0.0 if self.flat else z
        return (schema.Translate(x=short(x), y=short(y), z=short(z)),) if x or y or z else ()


_UP: Final[Rows] = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0)
"""(x, y, z) to (x, -z, y): the ground becomes the picture."""
_DOWN: Final[Rows] = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0)


def _scale(x: float, y: float, z: float, flat: bool) -> schema.Scale:
    x, y, z = short(x), short(y), short(z)
    return schema.Scale.uniform(x) if x == y and (flat or x == z) else schema.Scale(x=x, y=y, z=z)


def _keeps_plane(rows: Rows) -> bool:
    """Whether a map neither mixes z into x and y nor tilts the plane."""
    size = max(map(abs, (rows[0], rows[1], rows[4], rows[5])))
    return all(abs(rows[at]) <= _FLAT * size for at in (2, 6, 8, 9))


def _shown(name: str | None, index: int) -> str:
    return _clean(name) if name else f"node {index}"


def _clean(name: str | None) -> str:
    """A name that cannot break a line or a comment."""
    text = "".join(c if c.isprintable() else "�" for c in name or "").replace("*/", "* /")
    return text if len(text) <= _MOST_NAME else f"{text[:_MOST_NAME]}…"
