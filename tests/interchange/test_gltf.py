"""glTF hierarchies: world matrices as trimesh has them, colours, names, and files that mean harm."""

from __future__ import annotations

import json
import math
import random
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

import scenelang as nsg
from scenelang.graph.affine import compose
from scenelang.graph.steps import IDENTITY, Affine, Rows
from scenelang.graph.transforms import step_of
from scenelang.interchange import gltf as module
from scenelang.interchange.gltf import GltfError, geometry_of, import_gltf, load_gltf, srgb
from scenelang.interchange.gltf_file import MOST_BYTES, parse_gltf
from scenelang.models.manifest import load_manifest
from tests.interchange.documents import Json, document, write
from tests.models import SOLIDS


def read(data: Json, **options: Any) -> module.Imported:
    return import_gltf(parse_gltf(json.dumps(data).encode()), **options)


def world(node: Any, dimension: int, outer: Rows = IDENTITY) -> list[tuple[str, np.ndarray]]:
    """Geometry and world matrix of every object, in order, through the compiler's own steps."""
    rows = IDENTITY
    for transform in node.transforms:
        step = step_of(transform, dimension)
        assert isinstance(step, Affine), step
        rows = compose(step.rows, rows)
    rows = compose(outer, rows)
    if isinstance(node, nsg.Object):
        return [(node.geometry, np.array([*rows, 0, 0, 0, 1]).reshape(4, 4))]
    return [found for child in node.children for found in world(child, dimension, rows)]


def objects(scene: nsg.Scene, dimension: int = 2) -> list[tuple[str, np.ndarray]]:
    return [found for node in scene.nodes for found in world(node, dimension)]


def oracle(path: Path) -> dict[str, np.ndarray]:
    """World matrices of the nodes with geometry, by name, as trimesh reads them."""
    scene = trimesh.load_scene(path)
    return {name: scene.graph.get(name)[0] for name in scene.graph.nodes_geometry}


@pytest.fixture
def solids(monkeypatch: pytest.MonkeyPatch) -> None:
    """A 3D model beside the shipped ones."""
    monkeypatch.setattr(module, "available", lambda: ["shapes2d", "solids3d"])
    monkeypatch.setattr(module, "load_manifest", lambda n: SOLIDS if n == "solids3d" else load_manifest(n))


def random_tree(rng: random.Random, leaf: str, flat: bool) -> list[Json]:
    """Nodes of a random hierarchy; every node without children has a mesh."""
    nodes: list[Json] = [{"name": "root"}]
    for at in range(1, rng.randrange(3, 14)):
        node: Json = {"name": f"{leaf}.{at:03}"}
        if rng.random() < 0.7:
            node["translation"] = [rng.uniform(-2, 2) for _ in range(3)]
        if rng.random() < 0.7:
            q = np.array(
                [0, 0, rng.gauss(0, 1), rng.gauss(0, 1)] if flat else [rng.gauss(0, 1) for _ in range(4)]
            )
            node["rotation"] = (q / np.linalg.norm(q)).tolist()
        if rng.random() < 0.7:
            node["scale"] = [rng.choice([-1, 1]) * rng.uniform(0.2, 2) for _ in range(3)]
        if rng.random() < 0.2 and not flat:
            matrix = np.eye(4)
            matrix[:3, :3] = np.array([[rng.gauss(0, 1) for _ in range(3)] for _ in range(3)]) + 3 * np.eye(3)
            matrix[:3, 3] = [rng.gauss(0, 1) for _ in range(3)]
            node = {"name": node["name"], "matrix": matrix.T.flatten().tolist()}
        parent = rng.randrange(at)
        nodes[parent].setdefault("children", []).append(at)
        nodes.append(node)
    for node in nodes:
        if "children" not in node:
            node["mesh"] = 0
    return nodes


@pytest.mark.usefixtures("solids")
@pytest.mark.parametrize("seed", range(25))
def test_world_matrices_in_space(seed: int, tmp_path: Path) -> None:
    nodes = random_tree(random.Random(seed), "Sphere", flat=False)
    path = write(tmp_path, document(nodes))
    found = load_gltf(path)
    assert found.scene.model == "solids3d"
    assert found.left_out == []
    wanted = oracle(path)
    made = objects(found.scene, 3)
    assert len(made) == len(wanted)
    # trimesh tells leaves by name, scenelang by order: the nearest of each
    left = dict(wanted)
    for _, matrix in made:
        name = min(left, key=lambda n: np.abs(left[n] - matrix).max())
        assert np.allclose(left.pop(name), matrix, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(25))
def test_world_matrices_in_the_plane(seed: int, tmp_path: Path) -> None:
    nodes = random_tree(random.Random(seed), "star", flat=True)
    path = write(tmp_path, document(nodes))
    found = load_gltf(path, model="shapes2d")
    wanted = oracle(path)
    left = {name: matrix[np.ix_([0, 1, 3], [0, 1, 3])] for name, matrix in wanted.items()}
    for _, matrix in objects(found.scene):
        own = matrix[np.ix_([0, 1, 3], [0, 1, 3])]
        name = min(left, key=lambda n: np.abs(left[n] - own).max())
        assert np.allclose(left.pop(name), own, rtol=1e-9, atol=1e-9)
    assert not left
    again = nsg.loads(found.scene.to_nsg())
    assert again == found.scene


@pytest.mark.parametrize("seed", range(15))
def test_drawings_on_the_ground(seed: int, tmp_path: Path) -> None:
    """A drawing in x, z with y up, seen from above, is the drawing in x, -z."""
    nodes = random_tree(random.Random(seed), "star", flat=True)
    for node in nodes:  # the same tree, laid down
        if "translation" in node:
            x, y, z = node["translation"]
            node["translation"] = [x, z, -y]
        if "rotation" in node:
            i, j, k, w = node["rotation"]
            node["rotation"] = [i, k, -j, w]
        if "scale" in node:
            u, v, s = node["scale"]
            node["scale"] = [u, s, v]
    path = write(tmp_path, document(nodes))
    up = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    left = {n: (up @ m @ up.T)[np.ix_([0, 1, 3], [0, 1, 3])] for n, m in oracle(path).items()}
    for _, matrix in objects(load_gltf(path, plane="xz").scene):
        own = matrix[np.ix_([0, 1, 3], [0, 1, 3])]
        name = min(left, key=lambda n: np.abs(left[n] - own).max())
        assert np.allclose(left.pop(name), own, rtol=1e-9, atol=1e-9)
    assert not left


def test_quaternions_turn_counter_clockwise() -> None:
    half = math.radians(15)
    scene = read(
        document([{"name": "star", "mesh": 0, "rotation": [0, 0, math.sin(half), math.cos(half)]}])
    ).scene
    (turn,) = scene.nodes[0].transforms
    assert isinstance(turn, nsg.Rotate)
    assert math.degrees(turn.angle) == pytest.approx(30, abs=1e-12)
    assert turn.axis == (0, 0, 1)
    negated = read(document([{"name": "star", "rotation": [0, 0, -math.sin(half), -math.cos(half)]}])).scene
    assert negated.nodes[0].transforms[0].angle == pytest.approx(turn.angle)  # type: ignore[union-attr]


def test_scale_then_turn_then_move() -> None:
    node = {
        "name": "square",
        "mesh": 0,
        "translation": [1, 2, 0],
        "rotation": [0, 0, 0.6, 0.8],
        "scale": [2, 3, 1],
    }
    kinds = [t.kind for t in read(document([node])).scene.nodes[0].transforms]
    assert kinds == ["scale", "rotate", "translate"]


def test_a_turn_out_of_the_plane_and_back() -> None:
    down, up = [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)], [math.sqrt(0.5), 0, 0, math.sqrt(0.5)]
    nodes = [
        {"name": "root", "rotation": down, "children": [1]},
        {"name": "star", "rotation": up, "mesh": 0, "translation": [1, 0, 2]},
    ]
    ((_, matrix),) = objects(read(document(nodes)).scene)
    assert np.allclose(matrix[:2, 3], [1, 2])
    assert np.allclose(matrix[:2, :2], np.eye(2), atol=1e-12)
    nodes[1]["rotation"] = [0, 0, 0, 1]
    with pytest.raises(GltfError, match=r"^/root/star: a 2D model cannot draw"):
        read(document(nodes))


def test_layers_along_z_are_dropped() -> None:
    nodes = [
        {"name": "root", "children": [1], "translation": [0, 0, 5]},
        {"name": "star", "translation": [1, 0, -3]},
    ]
    assert read(document(nodes)).scene.nodes[0].transforms == (nsg.Translate(x=1, y=0),)


@pytest.mark.parametrize(
    ("name", "geometry"),
    [
        ("star", "star"), ("Star", "star"), ("STAR.001", "star"), ("star_1", "star"), ("star-12", "star"),
        ("star 3", "star"), ("Star.001_2", "star"), ("star12", "star"), ("starfish", None), ("", None),
        (None, None), ("superstar", None), ("star_mesh", "star"), ("StarShape.003", None),
        ("star.copy.1", "star"),
    ],
)  # fmt: skip
def test_names(name: str | None, geometry: str | None) -> None:
    assert geometry_of([name], ("square", "star")) == geometry


def test_names_of_meshes_come_second() -> None:
    meshes = [{"name": "Star.002", "primitives": []}, {"name": "blob", "primitives": []}]
    nodes = [
        {"name": "root", "children": [1, 2, 3, 4]},
        {"name": "left eye", "mesh": 0},
        {"name": "square.1", "mesh": 0},
        {"name": "nose", "mesh": 1},
        {"name": "cam", "camera": 0},
    ]
    found = read(document(nodes, meshes=meshes))
    assert [name for name, _ in objects(found.scene)] == ["star", "square"]
    assert found.left_out == [
        "/root/nose with mesh `blob`: no geometry of shapes2d is named so",
        "/root/cam: a camera",
    ]
    assert set(found.names.values()) == {"/root", "/root/left eye", "/root/square.1"}


def test_colours_are_encoded() -> None:
    """A material's linear red is what sRGB #d33 decodes to, in float32 as files have it."""

    def linear(level: int) -> float:
        v = level / 255
        return float(np.float32(v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4))

    for level in range(256):
        assert srgb(linear(level)) == level / 255
    assert srgb(0.5) == pytest.approx(0.7353569830524495, abs=1e-12)
    factor = [linear(0xDD), linear(0x33), linear(0x33), 0.5]
    look = {
        "name": "red",
        "pbrMetallicRoughness": {"baseColorFactor": factor, "baseColorTexture": {"index": 0}},
    }
    meshes = [{"name": "star", "primitives": [{"material": 0}, {"material": 1}]}]
    found = read(document([{"mesh": 0}], meshes=meshes, materials=[look, {}]))
    assert found.scene.nodes[0].material == nsg.Material("flat", ops=(nsg.Color.hex("#d33"),))
    assert found.left_out == [
        "/node 0: all but the first of its 2 materials",
        "material `red`: its alpha of 0.5",
        "material `red`: its texture",
    ]


def test_a_glb_of_pygltflib(tmp_path: Path) -> None:
    made = pygltflib.GLTF2(
        scene=0,
        scenes=[pygltflib.Scene(nodes=[0])],
        nodes=[
            pygltflib.Node(name="flower", children=[1, 2], scale=[0.5, 0.5, 0.5]),
            pygltflib.Node(name="petal", mesh=0, translation=[1, 0, 0]),
            pygltflib.Node(name="petal.001", mesh=0, translation=[-1, 0, 0]),
        ],
        meshes=[pygltflib.Mesh(name="Pentagon", primitives=[pygltflib.Primitive(material=0)])],
        materials=[
            pygltflib.Material(
                pbrMetallicRoughness=pygltflib.PbrMetallicRoughness(baseColorFactor=[1, 0, 0, 1])
            )
        ],
        buffers=[pygltflib.Buffer(byteLength=4)],
    )
    made.set_binary_blob(b"\0" * 4)
    path = tmp_path / "flower.glb"
    made.save(str(path))
    found = load_gltf(path)
    red = nsg.Material("flat", ops=(nsg.Color(rgb=(1, 0, 0)),))
    assert found.scene.nodes == (
        nsg.Group(
            children=(
                nsg.Object("pentagon", transforms=(nsg.Translate(x=1, y=0),), material=red),
                nsg.Object("pentagon", transforms=(nsg.Translate(x=-1, y=0),), material=red),
            ),
            transforms=(nsg.Scale.uniform(0.5),),
        ),
    )


def test_a_glb_of_trimesh(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(0.3, [0, 0, 1], [0.2, 0.1, 0])
    scene.add_geometry(trimesh.creation.box(), node_name="square_7", geom_name="box", transform=turn)
    path = tmp_path / "a.glb"
    scene.export(path)
    ((name, matrix),) = objects(load_gltf(path).scene)
    assert name == "square"
    assert np.allclose(matrix[:2, [0, 1, 3]], turn[:2, [0, 1, 3]], atol=1e-6)


GOOD = document([{"name": "star", "mesh": 0}])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"nodes": [{"children": [0]}]}, "met a second time"),
        ({"nodes": [{"children": [1]}, {"children": [0]}]}, "met a second time"),
        ({"nodes": [{"children": [1, 1]}, {"name": "star"}]}, "met a second time"),
        ({"nodes": [{"children": [1, 2]}, {"children": [2]}, {"name": "star"}]}, "met a second time"),
        ({"nodes": [{"children": [1]}, {"children": [0]}], "scenes": [], "scene": None}, "cycle"),
        ({"nodes": [{"children": [7]}]}, "names node 7"),
        ({"nodes": [{"children": [-1]}]}, "greater than or equal"),
        ({"nodes": [{"children": [1e300]}]}, "not glTF: nodes[0].children[0]"),
        ({"nodes": [{"mesh": 3}]}, "names mesh 3"),
        ({"nodes": [{"mesh": True}]}, "nodes[0].mesh"),
        ({"nodes": "star"}, "not glTF: nodes"),
        ({"nodes": [None]}, "not glTF: nodes[0]"),
        ({"nodes": [{"name": 3}]}, "nodes[0].name"),
        ({"nodes": [{"name": "star", "translation": [1, 2]}]}, "translation"),
        ({"nodes": [{"name": "star", "translation": [1, 2, "3"]}]}, "translation"),
        ({"nodes": [{"name": "star", "rotation": [0, 0, 0, 0]}]}, "/star: a quaternion of length 0"),
        ({"nodes": [{"name": "star", "matrix": [1] * 15}]}, "matrix"),
        ({"nodes": [{"name": "star", "matrix": [1] * 16}]}, "last row"),
        ({"scene": 4}, "scene 4"),
        ({"scenes": [{"nodes": [9]}]}, "names node 9"),
        ({"asset": {}}, "asset.version"),
        ({"asset": {"version": "1.0"}}, "version '1.0'"),
        ({"materials": [{"pbrMetallicRoughness": {"baseColorFactor": [2, 0, 0, 1]}}]}, "baseColorFactor"),
        ({"nodes": [{"children": [at + 1]} for at in range(999)] + [{}]}, "deeper than 150"),
        ({"nodes": [{}] * 100_001}, "at most 100000"),
    ],
)  # fmt: skip
def test_hostile_documents(change: Json, said: str) -> None:
    with pytest.raises(GltfError) as caught:
        read({**GOOD, **change})
    assert said in str(caught.value)
    assert len(str(caught.value)) < 500


def glb(text: bytes, length: int | None = None, version: int = 2, kind: bytes = b"JSON") -> bytes:
    size = len(text) if length is None else length
    return b"glTF" + struct.pack("<III4s", version, 20 + len(text), size, kind) + text


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "not glTF"),
        (b"\xff\xfe", "not glTF"),
        (b"[" * 100_000, "deeper than"),
        (b'{"a": 1, "a": 2}', "given twice"),
        (b'{"a": NaN}', "NaN"),
        (b'{"a": ' + b"9" * 5000 + b"}", "not glTF"),
        (b'"' + b'\\"' * 400_000, "not glTF"),
        (b" " * (MOST_BYTES + 1), "10 MB"),
        (b"glTF", "ends in its header"),
        (glb(b"{}", version=1), "version 1"),
        (glb(b"{}", kind=b"BIN\0"), "begin with JSON"),
        (glb(b"{}", length=100), "ends within"),
        (glb(b"{}", length=0xFFFFFFFF), "10 MB"),
        (glb(b"{}"), "asset"),
    ],
)
def test_hostile_bytes(data: bytes, said: str) -> None:
    with pytest.raises(GltfError) as caught:
        parse_gltf(data)
    assert said in str(caught.value)


KEYS = ["asset", "version", "nodes", "scenes", "children", "mesh", "meshes", "name", "matrix", "rotation"]
KEYS += ["scale", "materials", "primitives"]
ATOMS = st.none() | st.booleans() | st.floats() | st.integers(-3, 9) | st.text(max_size=5)


@settings(max_examples=200)
@given(
    st.recursive(
        ATOMS,
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(KEYS), inner, max_size=5),
    )
)
def test_any_json_is_a_scene_or_an_error(value: Any) -> None:
    for data in (value, {**GOOD, **value} if isinstance(value, dict) else {**GOOD, "nodes": value}):
        try:
            import_gltf(parse_gltf(json.dumps(data).encode()))
        except GltfError:
            continue


def test_no_uri_is_followed(tmp_path: Path) -> None:
    """Whatever URIs a file has, only the file itself is opened."""
    uris = ["../secret.bin", "/etc/passwd", "file:///etc/passwd", "http://localhost:1/x", "data:,x", "pipe"]
    data = document([{"name": "star", "mesh": 0}], buffers=[{"byteLength": 1, "uri": uri} for uri in uris])
    data["images"] = [{"uri": uri} for uri in uris]
    path = write(tmp_path, data)
    opened: list[str] = []
    watching = True

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if watching and event in ("open", "socket.connect", "socket.getaddrinfo"):
            opened.append(str(arguments[0]))

    sys.addaudithook(watch)
    try:
        load_gltf(path, model="shapes2d")
    finally:
        watching = False
    assert [name for name in opened if not name.isdigit() and "manifest.json" not in name] == [str(path)]


def test_singular_nodes_are_left_out() -> None:
    nodes = [
        {"name": "root", "children": [1, 2]},
        {"name": "hidden", "scale": [0, 0, 0], "children": [3]},
        {"name": "star", "scale": [1, 1, 0]},
        {"name": "square"},
    ]
    found = read(document(nodes))
    assert [name for name, _ in objects(found.scene)] == ["star"]
    assert found.left_out == ["/root/hidden: a scale of 0, or one that float32 cannot undo"]
