"""Materials of elements in scenes: as text, as values, in modules, in JSON and in Python."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import scenelang as nsg
from scenelang.assets.zoo import zoo_bytes
from scenelang.compiler.check import check
from scenelang.compiler.compile import compile_scene
from scenelang.editors.dumps import scene_schema
from scenelang.language.formatting import format_text
from tests.assets.scenes import IMPORT, good, load
from tests.assets.shapes import element, noise, torus


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = [
        element(torus, "cow", levels=3),
        noise(4, 6),
        noise(2, 2, name="stone"),
        noise(2, 2, 2, name="cow"),
    ]
    (tmp_path / "zoo.safetensors").write_bytes(zoo_bytes(made))
    return tmp_path


def worn(folder: Path, text: str, **files: str) -> list[nsg.Material | None]:
    scene = good(folder, IMPORT + text, **files)
    again = good(folder, scene.to_nsg())
    assert again.nodes == scene.nodes
    assert nsg.Scene.from_json(scene.to_json(), root=folder) == scene
    assert compile_scene(again).digest() == compile_scene(scene).digest()
    return [node.material for node in scene.nodes]


FLIP, TURN = nsg.Flip(), nsg.Hue.degrees(36)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("square { material zoo.bark; }", nsg.Material("zoo.bark")),
        ("square { material zoo.bark { flip(); hue(0.1turn); } }", nsg.Material("zoo.bark", (FLIP, TURN))),
        ("square { material flat zoo.bark { flip(); } }", nsg.Material("zoo.bark", FLIP, "flat")),
        ("torus { material volumetric zoo.bark; }", nsg.Material("zoo.bark", (), "volumetric")),
        ("zoo.cow { material zoo.cow { hue(0.1turn); } }", nsg.Material("zoo.cow", TURN)),
        (
            "let mist = material volumetric zoo.bark { flip(); }; torus { mist { hue(0.1turn); } }",
            nsg.Material("zoo.bark", (FLIP, TURN), "volumetric"),
        ),
        (
            "module ball(m) { sphere { m { flip(); } } } ball(material zoo.stone);",
            nsg.Material("zoo.stone", FLIP),
        ),
        (
            "let flat = 1; for (m in [material flat zoo.bark]) { square { m; } }",
            nsg.Material("zoo.bark", (), "flat"),
        ),
    ],
)
def test_materials_of_elements(folder: Path, text: str, expected: nsg.Material) -> None:
    assert worn(folder, text) == [expected]
    assert format_text(format_text(text)) == format_text(text)


def test_materials_come_through_other_files(folder: Path) -> None:
    library = f"{IMPORT} let bark = material zoo.bark {{ flip(); }}; module tile() {{ square {{ bark; }} }}"
    text = 'import "lib.nsg" as lib; square { lib.bark { hue(0.1turn); } } lib.tile();'
    found = worn(folder, text, lib=library)
    assert found == [nsg.Material("zoo.bark", (FLIP, TURN)), nsg.Material("zoo.bark", FLIP)]


def test_equal_materials_are_equal_values(folder: Path) -> None:
    text = "let a = material zoo.bark == material flat zoo.bark; square { scale(a ? 1 : 0.5); }"
    scene, _ = load(folder, IMPORT + text)
    assert scene is not None
    assert scene.nodes[0].transforms == (nsg.Scale(0.5),)


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("square { material zoo.brak; }", "E0212", "`zoo` has no material `brak`"),
        ("square { material zo.bark; }", "E0201", "unknown name `zo`"),
        (
            "let zo = 2; square { scale(zo); material zo.bark; }",
            "E0213",
            "`zo` is a value, not an imported file",
        ),
        ("zoo.bark { }", "E0213", "`zoo.bark` is the name of a material"),
        ("square { zoo.bark; }", "E0213", "`zoo.bark` is the name of a material"),
        ("let a = zoo.bark;", "E0213", "`zoo.bark` is the name of a material"),
        ("square { material flat square; }", "E0213", "`square` is a geometry, not a material"),
        ("square { material mist zoo.bark; }", "E0208", "unknown material `mist`"),
        ("torus { material diffuse volumetric; }", "E0213", "`volumetric` is not a texture"),
        ("square { material zoo.bark; material zoo.stone; }", "E0332", "a second material in one block"),
    ],
)
def test_mistakes(folder: Path, text: str, code: str, message: str) -> None:
    assert load(folder, IMPORT + text)[1] == [(code, message)]


def test_a_geometry_is_not_a_material(folder: Path) -> None:
    (folder / "zoo.safetensors").write_bytes(zoo_bytes([element(torus, "cow", levels=2), noise(2, 2)]))
    found = load(folder, IMPORT + "square { material zoo.cow; }")[1]
    assert found == [("E0213", "`zoo.cow` is a geometry, not a material")]
    library = "let bark = material flat;"
    found = load(folder, 'import "lib.nsg" as lib; square { material lib.bark; }', lib=library)[1]
    assert found == [("E0213", "`lib.bark` is a value, not a material's name")]


def test_misspelt_materials_are_mended(folder: Path) -> None:
    (folder / "scene.nsg").write_text(IMPORT + "square { material zoo.brak; }")
    (found,) = check(folder / "scene.nsg")
    assert found.fix is not None
    assert [edit.replacement for edit in found.fix.edits] == ["bark"]


def test_json_says_how_a_texture_is_lit(folder: Path) -> None:
    scene, _ = load(folder, IMPORT + "torus { material volumetric zoo.bark; }")
    assert scene is not None
    (node,) = json.loads(scene.to_json())["nodes"]
    assert (node["material"]["name"], node["material"]["shading"]) == ("zoo.bark", "volumetric")
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.validate(json.loads(scene.to_json()), scene_schema())
