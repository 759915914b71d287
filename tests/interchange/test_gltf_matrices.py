"""World matrices of glTF hierarchies, held to those that trimesh reads."""

from __future__ import annotations

import math
import random
from pathlib import Path

import numpy as np
import pytest
import trimesh

import scenelang as nsg
from scenelang.interchange import gltf as module
from scenelang.interchange.gltf import GltfError, load_gltf
from tests.interchange.documents import Json, document, objects, read, write


def oracle(path: Path) -> dict[str, np.ndarray]:
    """World matrices of the nodes with geometry, by name, as trimesh reads them."""
    scene = trimesh.load_scene(path)
    return {name: scene.graph.get(name)[0] for name in scene.graph.nodes_geometry}


@pytest.fixture
def solids(monkeypatch: pytest.MonkeyPatch) -> None:
    """A 3D model beside the shipped ones."""
    monkeypatch.setattr(module, "available", lambda: ["shapes2d", "solids3d"])


@pytest.fixture
def exact(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers as they are computed, not as they are written."""
    monkeypatch.setattr("scenelang.interchange.gltf_file.DIGITS", 17)


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


@pytest.mark.usefixtures("solids", "exact")
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


@pytest.mark.usefixtures("exact")
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


@pytest.mark.usefixtures("exact")
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


def test_numbers_are_short() -> None:
    """What a program writes as float32 is read as the number that was meant."""
    third, half = float(np.float32(1 / 3)), np.float32(math.radians(15))
    star = {
        "name": "star",
        "scale": [float(np.float32(0.2)), float(np.float32(0.2000000149)), 1],
        "rotation": [0, 0, float(np.sin(half)), float(np.cos(half))],
        "translation": [float(np.float32(0.3)), third, 0],
        "mesh": 0,
    }
    steep = [1, 1, 0, 0, third, 1.3333333, 0, 0, 0, 0, 1, 0, 0, float(np.float32(-0.1)), 0, 1]
    text = "".join(
        read(document([node])).scene.to_nsg() for node in (star, {"name": "star", "matrix": steep, "mesh": 0})
    )
    assert "scale(0.2); rotate(30deg); translate(0.3, 0.333333);" in text
    assert "matrix([[1, 0.333333, 0, 0], [1, 1.33333, 0, -0.1]," in text


def test_a_matrix_that_few_digits_would_flatten_keeps_them() -> None:
    steep = [1, 1, 0, 0, 1, 1.0000001, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    (star,) = read(document([{"name": "star", "matrix": steep, "mesh": 0}])).scene.nodes
    assert star.transforms[0].rows[1][1] == 1.0000001


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
