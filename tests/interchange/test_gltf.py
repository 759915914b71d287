"""glTF hierarchies: names, colours, files that other libraries wrote, and what is left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygltflib
import pytest
import trimesh

import scenelang as nsg
from scenelang.interchange.gltf import geometry_of, load_gltf, srgb
from tests.interchange.documents import document, objects, read


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
    found = read(document(nodes, meshes=meshes, cameras=[{"type": "orthographic"}]))
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
    assert srgb(0.5) == pytest.approx(0.7353569830524495, abs=5e-5)
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
