"""Parts of files: where they lie, which are copies, and what glTF has besides."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("igl")
trimesh = pytest.importorskip("trimesh")

from scenelang.assets.element import Part
from scenelang.assets.zoo import load_zoo
from scenelang.drawing.exact import originals
from scenelang.drawing.exact.mesh import FitError, Mesh, read_solids, whole
from scenelang.inverse import learn as making
from scenelang.inverse.learn import LearnOptions, learn_files

RED, BLUE = [255, 0, 0, 255], [0, 0, 255, 255]


def coloured(mesh: Any, factor: list[int]) -> Any:
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=factor)
    mesh.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(mesh.vertices), 2)), material=material)
    return mesh


def moved(angle: float = 0, scale: float = 1, at: tuple[float, ...] = (0, 0, 0), flip: bool = False) -> Any:
    turn = trimesh.transformations.rotation_matrix(angle, (0, 0, 1))
    turn[:3, :3] *= scale
    if flip:
        turn[:, 0] *= -1
    turn[:3, 3] = at
    return turn


def wedge() -> Any:
    """A solid without symmetry."""
    points = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)]
    return trimesh.Trimesh(points, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)], process=False)


PLACES = [
    moved(at=(3, 0, 0)),
    moved(0.7, 1, (-3, 0, 0)),
    moved(2.0, 0.5, (0, 4, 0)),
    moved(1.0, 1, (0, -4, 1), flip=True),
]


@pytest.fixture
def car() -> bytes:
    scene = trimesh.Scene()
    scene.add_geometry(
        coloured(trimesh.creation.box((4, 2, 1)), BLUE), node_name="the body", geom_name="body"
    )
    for k, place in enumerate(PLACES):
        shape = coloured(wedge(), RED)
        scene.add_geometry(shape, node_name=f"wheel {k}", geom_name="wheel", transform=place)
    data: bytes = scene.export(file_type="glb")
    return data


def lies(part: Part, p: np.ndarray) -> np.ndarray:
    """Points of a part's own unit ball, where they lie in that of the whole."""
    turn = np.array(part.turn) if part.turn else np.eye(3)
    return np.asarray(part.size * p @ turn.T + part.place)


def test_parts_lie_where_they_were_and_copies_share_a_shape(car: bytes) -> None:
    solids, _ = read_solids(car, ".glb", {})
    assert {solid.name for solid in solids} == {"the body", *(f"wheel {k}" for k in range(4))}
    found = originals.solid_parts(solids, "car", "auto", True)
    wheel = next(name for name in found.shapes if "wheel" in name)
    assert list(found.shapes) == [*dict.fromkeys(part.geometry for part in found.group), "car"]
    assert sorted(part.geometry for part in found.group) == ["car_the_body", *[wheel] * 4]
    assert sum(part.turn == () for part in found.group) in (2, 3)  # of the wheels the first, and its shift
    together = found.shapes["car"]
    assert isinstance(together, Mesh)
    for solid, part in zip(solids, found.group, strict=True):
        shape = found.shapes[part.geometry]
        assert isinstance(shape, Mesh)
        there = lies(part, shape.vertices)
        true = (solid.vertices - together.centre) / together.size
        away = np.linalg.norm(there[:, None] - true[None], axis=2)
        assert away.min(0).max() < 1e-5
        assert away.min(1).max() < 1e-5
        assert abs(np.linalg.norm(shape.vertices, axis=1).max() - 1) < 1e-9
    assert {part.color for part in found.group} == {(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)}


def test_without_parts_the_whole_is_a_group_of_its_own(car: bytes) -> None:
    solids, _ = read_solids(car, ".glb", {})
    found = originals.solid_parts(solids, "car", "auto", False)
    assert list(found.shapes) == ["car"]
    assert found.group == (Part("car", (0, 0, 0), 1.0, (), (), "car"),)  # of two colours
    plain = originals.solid_parts([solid._replace(look=None) for solid in solids], "car", "auto", False)
    assert plain.group == ()


def test_what_is_learned_says_which_part_it_is(car: bytes, tmp_path: Path) -> None:
    (tmp_path / "car.glb").write_bytes(car)
    out = tmp_path / "zoo.safetensors"
    said: list[str] = []
    made = learn_files([tmp_path / "car.glb"], out, LearnOptions(steps=2, parts=True), say=said.append)
    zoo = load_zoo(out)
    assert {*zoo.geometries} == {"car", *(part.geometry for part in zoo.groups["car"])}
    assert {element.name for element in made} == {*zoo.geometries}
    for name, element in zoo.geometries.items():
        shape = originals.shape_in(car, ".glb", "auto", int(element.about.get("part", 0)))
        points, *_ = shape.surface(100)
        assert abs(shape.distances(points)).max() < 1e-6
        assert shape.size == pytest.approx(element.about["size"]), name
    learn_files([tmp_path / "car.glb"], out, LearnOptions(steps=2, parts=True), say=said.append)
    assert said[-1] == "car: made before of this file"
    learn_files([tmp_path / "car.glb"], out, LearnOptions(steps=1))
    assert load_zoo(out).groups["car"] == (Part("car", (0, 0, 0), 1.0, (), (), "car"),)
    with pytest.raises(FitError, match="no part 9"):
        originals.shape_in(car, ".glb", "auto", 9)


def test_a_part_that_encloses_nothing_is_left_out() -> None:
    scene = trimesh.Scene([trimesh.creation.box()])
    sheet = trimesh.Trimesh([(2, 0, 0), (3, 0, 0), (2, 1, 0)], [(0, 1, 2)], process=False)
    scene.add_geometry(sheet, node_name="sheet")
    said: list[Any] = []
    request: dict[str, Any] = {"suffix": ".glb", "name": "a", "about": {}, "files": {}}
    options = {"steps": 1, "parts": True}
    made = making.make(
        {**request, "options": options}, scene.export(file_type="glb"), lambda *told: said.append(told)
    )
    assert any("a_sheet: left out" in told[1] for told in said if told[0] == "say")
    assert b"a_geometry_0" in made


def changed(data: bytes, change: dict[str, Any]) -> bytes:
    """A glTF with other fields in its header."""
    length = struct.unpack("<I", data[12:16])[0]
    text = json.dumps(json.loads(data[20 : 20 + length]) | change).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
    return head + text + rest


def test_what_of_gltf_is_not_read(car: bytes) -> None:
    for change, words in (
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "compressed.*KHR_draco_mesh_compression"),
        ({"extensionsRequired": ["EXT_meshopt_compression"]}, "EXT_meshopt_compression; export it without"),
        ({"extensionsRequired": ["KHR_mesh_quantization"]}, "KHR_mesh_quantization"),
    ):
        with pytest.raises(FitError, match=words):
            read_solids(changed(car, change), ".glb")


def test_what_of_gltf_is_left_out(car: bytes) -> None:
    for change, note in (
        ({"skins": [{"joints": [0]}]}, "skins left out"),
        ({"cameras": [{"type": "perspective"}]}, "cameras left out"),
        ({"extensions": {"KHR_lights_punctual": {"lights": []}}}, "lights left out"),
        ({"extensionsRequired": ["KHR_materials_unlit"]}, None),
        ({"extensionsUsed": ["KHR_texture_transform"]}, "moves of textures left out"),
    ):
        solids, notes = read_solids(changed(car, change), ".glb")
        assert (len(solids), notes) == (5, [note] if note else [])


def test_objects_of_obj_are_parts() -> None:
    text = "".join(
        f"o thing {k}\n"
        + "".join(f"v {x + 3 * k} {y} {z}\n" for x, y, z in wedge().vertices)
        + "".join("f " + " ".join(str(4 * k + i + 1) for i in face) + "\n" for face in wedge().faces)
        for k in range(2)
    )
    solids, _ = read_solids(text.encode(), ".obj")
    found = originals.solid_parts(solids, "a", "auto", True)
    assert len(found.group) == 2
    assert len(found.shapes) == 2
    assert whole(solids).size > 2


def test_a_drawing_is_parts_in_its_colours(tmp_path: Path) -> None:
    rows = ("#f00", 0, 0, 8), ("#00f", 2, 2, 4), ("#f00", 20, 0, 4)
    shapes = "".join(f'<rect fill="{c}" x="{x}" y="{y}" width="{a}" height="{a}"/>' for c, x, y, a in rows)
    (tmp_path / "logo.svg").write_text(f"<svg>{shapes}</svg>")
    out = tmp_path / "zoo.safetensors"
    learn_files([tmp_path / "logo.svg"], out, LearnOptions(steps=1))
    zoo = load_zoo(out)
    assert list(zoo.geometries) == ["logo", "logo_1", "logo_2"]
    first, second = zoo.groups["logo"]
    half = (24**2 + 8**2) ** 0.5 / 2
    assert first == Part("logo_1", (0, 0), 1.0, (), (1, 0, 0))  # both red squares reach as far as the whole
    assert second.place == pytest.approx(((4 - 12) / half, (4 - 4) / half))
    assert second.size == pytest.approx(8**0.5 / half)
    shape = originals.shape_in((tmp_path / "logo.svg").read_bytes(), ".svg", "auto", 2)
    assert shape.size == pytest.approx(8**0.5)
    learn_files([tmp_path / "logo.svg"], out, LearnOptions(steps=1, parts=False))
    assert "logo" not in load_zoo(out).groups
