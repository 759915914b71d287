"""Elements, ready groups and materials of elements in scenes: in text, JSON and Python, compiled, drawn."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.assets.element import Part
from scenelang.assets.element_file import element_file_bytes
from scenelang.compiler.compile import check, check_compiles, compile_scene, find_model
from scenelang.compiler.program import parse_program, program_bytes
from scenelang.drawing.metrics import psnr
from scenelang.editors.dumps import scene_schema
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.evaluation import Source
from scenelang.language.formatting import format_text
from tests.assets.scenes import IMPORT, good, load
from tests.assets.shapes import ball, element, noise, square, torus
from tests.test_architecture import loaded_by

RING = "zoo.ring { scale(0.9); rotate(40deg, axis = X); translate(0.2, 0, 0); }"
PURE = RING.replace("zoo.ring", "torus")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    flat = [element(ball, "ball", d=2, levels=3), element(square, "tile", d=2, levels=7)]
    zoo = element_file_bytes([element(torus, "ring", levels=5), *flat])
    (tmp_path / "zoo.safetensors").write_bytes(zoo)
    return tmp_path


@pytest.mark.torch
def test_an_element_is_drawn_as_the_shape_it_is(folder: Path) -> None:
    scene = good(folder, f"{IMPORT}{RING} sphere {{ scale(0.4); translate(-1, 0, 0.5); }}")
    pure = good(folder, f"{PURE} sphere {{ scale(0.4); translate(-1, 0, 0.5); }}")
    scene, pure = scene.sized((128, 128)), pure.sized((128, 128))
    own, exact = nsg.render(scene), nsg.render(pure, backend="reference")
    assert psnr(own, exact) > 42  # 45 at 256 × 256
    ours = np.asarray(nsg.render(scene.sized((64, 64)), device="cpu"))  # torch's
    assert abs(ours - np.asarray(nsg.render(scene.sized((64, 64))))).max() < 1.5 / 255


def test_elements_obey_booleans_warps_and_media(folder: Path) -> None:
    wrong = []
    for body in (
        "chain { sphere { scale(0.8); } subtract @ }",
        "chain { sphere { scale(0.8); } smooth(k = 0.3) @ }",
        "chain { sphere { scale(0.8); } intersect @ }",
        "@ sphere { scale(0.5); material volumetric { color(#48c); } }",
        "group { @ twist(0.6); bend(0.3); twirl(0.4); }",
    ):
        texts = ("canvas(64, 64);" + IMPORT + body.replace("@", text) for text in (RING, PURE))
        near = psnr(*(nsg.render(good(folder, text)) for text in texts))
        wrong += [(body, near)] if near <= 42 else []
    assert wrong == []


@pytest.mark.torch
def test_flat_elements_obey_booleans_and_warps(folder: Path) -> None:
    head = f'model "shapes2d"; canvas(96, 96); {IMPORT} background(#9c9);'
    tile, wrong = "{ scale(0.8, 0.5); rotate(20deg); material flat { color(#c36); } }", []
    for body in (
        "@ star { scale(0.4); translate(0.5, 0.3); }",
        "chain { pentagon { material flat { color(#36c); } } subtract @ }",
        "chain { pentagon { scale(0.6); translate(0.5, 0); } smooth @ }",
        "chain { pentagon { } intersect @ }",
        "group { @ bend(0.6); twirl(0.8); scale(0.7); }",
    ):
        own, pure = (
            good(folder, head + body.replace("@", f"{name} {tile}")) for name in ("zoo.tile", "square")
        )
        for device in ("auto", "cpu"):
            near = psnr(nsg.render(own, device=device), nsg.render(pure, device=device))
            wrong += [(body, device, near)] if near <= 45 else []
    assert wrong == []


@pytest.mark.torch
def test_an_animation_tells_elements_apart(folder: Path) -> None:
    """Rows of two elements at one place have the same numbers."""
    shown = "zoo.{} {{ material flat {{ color(#111); }} }}"
    either = f"if (frame == 0) {{ {shown.format('tile')} }} else {{ {shown.format('ball')} }}"
    text = f"{IMPORT} animate(seconds = 2, fps = 1); {either}"
    (folder / "scene.nsg").write_text(text, "utf-8")
    frames = [np.asarray(frame) for frame in nsg.render_frames(folder / "scene.nsg")]
    assert abs(frames[0] - frames[1]).max() > 0.5


def test_names_come_through_other_files(folder: Path) -> None:
    (folder / "more").mkdir()
    (folder / "more/zoo.safetensors").write_bytes(element_file_bytes([element(ball, "ring", levels=2)]))
    library = 'import "more/zoo.safetensors" as zoo; module small() { zoo.ring { scale(0.5); } }'
    scene = good(folder, f'{IMPORT} import "lib.nsg" as lib; {RING} lib.small();', lib=library)
    assert [(file.name, file.path) for file in scene.elements] == [
        ("zoo", "zoo.safetensors"),
        ("zoo_2", "more/zoo.safetensors"),
    ]
    assert [node.geometry for node in scene.nodes] == ["zoo.ring", "zoo_2.ring"]  # type: ignore[union-attr]
    again = good(folder, scene.to_nsg())
    assert (again.nodes, again.elements) == (scene.nodes, scene.elements)


def test_the_smallest_model_that_draws_elements_is_chosen(folder: Path) -> None:
    scene = good(folder, IMPORT + RING)
    model = find_model(scene, Diagnostics())
    assert model is not None
    assert model.name == "solids3d"
    with pytest.raises(nsg.SceneError, match=r"does not draw `zoo\.ring`, an element of space"):
        compile_scene(scene, model="shapes2d")
    with pytest.raises(nsg.RenderError, match=r"the exact shape of `zoo\.ring` is not known"):
        nsg.render(scene, backend="reference")
    flat = good(folder, f'model "solids3d"; {IMPORT} zoo.ball {{ }}')
    with pytest.raises(nsg.SceneError, match=r"does not draw `zoo\.ball`, an element of the plane"):
        compile_scene(flat)


def test_an_eye_in_what_an_element_cuts_is_not_said_to_be_inside(folder: Path) -> None:
    for op, codes in (("subtract", []), ("intersect", []), ("union", ["E0408"])):
        scene = good(folder, f"{IMPORT} chain {{ sphere {{ scale(9); }} {op} zoo.ring {{ }} }}")
        found = Diagnostics()
        check_compiles(scene, None, found)
        assert [d.code for d in found.errors] == codes, op


def test_meshes_that_ship_are_at_hand_everywhere(tmp_path: Path) -> None:
    text = 'import "std/meshes" as m; m.bunny { } m.teapot { } m.monkey { material volumetric; }'
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "s.nsg").write_text(text)
    scenes = [
        nsg.loads(text),
        nsg.load(tmp_path / "deep" / "s.nsg"),
        nsg.load(tmp_path / "deep" / "s.nsg", root=tmp_path),
    ]
    scenes += [nsg.Scene.from_json(scenes[0].to_json(), root=tmp_path), nsg.loads(scenes[0].to_nsg())]
    assert all(scene == scenes[0] for scene in scenes)
    assert nsg.load_elements("std/meshes", "m") == scenes[0].elements[0]
    program = compile_scene(scenes[0])
    assert program.model == "solids3d"
    assert [element.name for element in program.elements] == ["bunny", "monkey", "teapot"]
    assert all(element.about["license"] and element.about["source"] for element in program.elements)
    assert sum(len(element.data) for element in program.elements) < 500_000
    with pytest.raises(
        nsg.RenderError, match=r"`bunny\.obj`, which is not in .* `--originals FOLDER` .*lab docs meshes"
    ):
        nsg.render(scenes[0], backend="reference")


def test_json_has_the_file_and_its_digest(folder: Path) -> None:
    scene = good(folder, IMPORT + RING)
    back = nsg.Scene.from_json(scene.to_json(), root=folder)
    assert back == scene
    assert compile_scene(back).digest() == compile_scene(scene).digest()
    with pytest.raises(nsg.SceneError, match="has not been read"):
        compile_scene(nsg.Scene.from_json(scene.to_json()))


def test_json_of_other_files(folder: Path) -> None:
    (folder / "loop").symlink_to("loop")
    text = good(folder, IMPORT + RING).to_json()
    for change, words in (
        ({"path": "../zoo.safetensors"}, "outside the import root"),
        ({"path": "/etc/passwd"}, "outside the import root"),
        ({"path": "none"}, "no such file"),
        ({"path": "loop"}, "loop|too many levels"),
        ({"path": 'a"; sphere { } //'}, "not a possible name"),
        ({"digest": "0" * 64}, "not the file that the scene was made with"),
    ):
        data = json.loads(text)
        data["elements"][0] |= change
        with pytest.raises(nsg.SceneError, match=words):
            nsg.Scene.from_json(json.dumps(data), root=folder)


def test_programs_carry_their_elements(folder: Path) -> None:
    text = f"{IMPORT} {RING} torus {{ translate(1, 0, 0); }} zoo.ring {{ translate(-1, 0, 0); }}"
    program = compile_scene(good(folder, text))
    assert program.objects == ("zoo.ring", "torus", "zoo.ring")
    assert program.brought() == [*program.elements, None, *program.elements]
    data = program_bytes(program)
    back = parse_program(data)
    assert (back.elements, back.digest(), program_bytes(back)) == (program.elements, program.digest(), data)
    assert np.array_equal(nsg.render(back), nsg.render(program))
    old = program_bytes(compile_scene(good(folder, f"{IMPORT} torus {{ }}")))
    assert b'\\"format\\":1' in old
    assert b"forms" not in old


def test_data_of_an_earlier_version_takes_the_meshes_that_ship_now() -> None:
    data = json.loads(nsg.loads('import "std/meshes" as m; m.teapot { }').to_json())
    data["elements"][0]["digest"] = "0" * 64
    assert len(compile_scene(nsg.Scene.from_json(json.dumps(data), root="."))) == 1


# ---------------------------------------------------------------- ready groups

TURN = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
GROUPS = {
    "car": (
        Part("ring", (0.0, 0.5, 0.0), 0.5, material="hide"),
        Part("ring", (0.5, -0.5, 0.0), 0.25, TURN, (1.0, 0.5, 0.0)),
        Part("ball", (0.0, 0.0, 0.0), 1.0),
    ),
    "ring": (Part("ring", (0.0, 0.0, 0.0), 1.0, (), (0.0, 0.0, 1.0)),),
    "logo": (Part("tile", (0.0, 0.0), 1.0, (), (1.0, 0.0, 0.0)), Part("tile", (0.2, 0.0), 0.5)),
}
CAR = """
group {
  zoo.ring { scale(0.5); translate(0, 0.5, 0); material zoo.hide; }
  zoo.ring { rotate(90deg); scale(0.25); translate(0.5, -0.5, 0); material diffuse { color(#ff8000); } }
  zoo.ball { }
  @
}
"""


@pytest.fixture
def garage(tmp_path: Path) -> Path:
    held = [
        element(torus, "ring", levels=2),
        element(ball, "ball", levels=2),
        element(square, "tile", levels=3, d=2),
        noise(3, 3, 3, name="hide"),
        noise(4, 6),
        noise(2, 2, name="stone"),
    ]
    (tmp_path / "zoo.safetensors").write_bytes(element_file_bytes(held, GROUPS))
    return tmp_path


def test_a_call_is_the_parts_in_their_places_and_looks(garage: Path) -> None:
    for block in ("", "rotate(30deg, axis = Y);"):
        ours = compile_scene(good(garage, f"{IMPORT} zoo.car() {{ {block} }}"))
        theirs = compile_scene(good(garage, IMPORT + CAR.replace("@", block)))
        np.testing.assert_allclose(ours.vectors, theirs.vectors, atol=3e-3)  # colours in 8 bits there
        assert ours.brought() == theirs.brought()
        assert [p and p.element.name for p in ours.paints()] == ["hide", None, None]


def test_a_group_of_one_part_is_that_object(garage: Path) -> None:
    own = good(garage, IMPORT + "zoo.ring() { scale(0.5); }")
    same = good(garage, IMPORT + "zoo.ring { scale(0.5); material diffuse { color(#00f); } }")
    assert own == same
    worn = good(garage, IMPORT + "group { zoo.ring(); zoo.ball { } material volumetric { } }")
    assert [leaf.material and leaf.material.name for leaf in worn.nodes[0].children] == ["diffuse", None]  # type: ignore[union-attr]


def test_groups_stand_in_modules_and_chains(garage: Path) -> None:
    module = "module mark() { zoo.logo() { scale(0.5); } }"
    scene = good(garage, f"{IMPORT} {module} chain {{ square {{ }} smooth mark(); }}")
    assert [child.op for child in scene.nodes[0].children] == ["union", "smooth"]  # type: ignore[union-attr]
    scene = good(garage, IMPORT + "chain { zoo.logo(); subtract zoo.tile { scale(0.2); } }")
    assert compile_scene(scene).objects == ("zoo.tile", "zoo.tile", "zoo.tile")


def test_text_json_and_python_hold_the_parts(garage: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(garage)
    scene = good(garage, IMPORT + "zoo.car() { rotate(30deg, axis = Y); }")
    assert nsg.Scene.from_json(scene.to_json(), root=garage) == scene
    (garage / "again.nsg").write_text(scene.to_nsg())
    assert nsg.load(garage / "again.nsg").nodes == scene.nodes
    zoo = nsg.load_elements("zoo.safetensors")
    made = nsg.Scene(elements=zoo, nodes=nsg.Group(zoo.group("car"), nsg.Rotate.degrees(30, axis=(0, 1, 0))))
    assert compile_scene(made).digest() == compile_scene(scene).digest()
    assert (
        nsg.Scene(elements=zoo, nodes=zoo.group("ring")).nodes == good(garage, IMPORT + "zoo.ring();").nodes
    )
    with pytest.raises(KeyError, match="`zoo` has no group `cow`; it has car, logo, ring"):
        zoo.group("cow")


def test_groups_are_counted_and_checked_without_numpy(garage: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scenelang.language.session.MAX_OBJECTS", 8)
    assert load(garage, IMPORT + "for (i in 0..<2) { zoo.car(); }")[0] is not None
    assert [code for code, _ in load(garage, IMPORT + "for (i in 0..<3) { zoo.car(); }")[1]] == ["E0320"]
    good(garage, IMPORT + "zoo.car();")
    assert not loaded_by("check", str(garage / "scene.nsg")) & {"torch", "numpy"}


# ---------------------------------------------------------------- materials


def worn(garage: Path, text: str, **files: str) -> list[nsg.Material | None]:
    scene = good(garage, IMPORT + text, **files)
    again = good(garage, scene.to_nsg())
    assert again.nodes == scene.nodes
    assert nsg.Scene.from_json(scene.to_json(), root=garage) == scene
    assert compile_scene(again).digest() == compile_scene(scene).digest()
    return [node.material for node in scene.nodes]


FLIP, TURN = nsg.Flip(), nsg.Hue.degrees(36)


def test_materials_of_elements(garage: Path) -> None:
    for text, expected in (
        ("square { material zoo.bark; }", nsg.Material("zoo.bark")),
        ("square { material zoo.bark { flip(); hue(0.1turn); } }", nsg.Material("zoo.bark", (FLIP, TURN))),
        ("square { material flat zoo.bark { flip(); } }", nsg.Material("zoo.bark", FLIP, "flat")),
        ("torus { material volumetric zoo.bark; }", nsg.Material("zoo.bark", (), "volumetric")),
        ("zoo.ring { material zoo.hide { hue(0.1turn); } }", nsg.Material("zoo.hide", TURN)),
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
    ):
        assert worn(garage, text) == [expected], text
        assert format_text(format_text(text)) == format_text(text)
    scene = good(garage, IMPORT + "torus { material volumetric zoo.bark; }")
    (node,) = json.loads(scene.to_json())["nodes"]
    assert (node["material"]["name"], node["material"]["shading"]) == ("zoo.bark", "volumetric")
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.validate(json.loads(scene.to_json()), scene_schema())


def test_mistakes(garage: Path) -> None:
    (garage / "text.safetensors").write_text("let size = 1;")
    (garage / "lib.nsg").write_text("let bark = material flat;")
    wrong = []
    for text, code, message, help in (
        ("zoo.rng { }", "E0212", "`zoo` has no `rng`", "did you mean `ring`?"),
        ("zoo.cat();", "E0212", "`zoo` has no `cat`", "did you mean `car`?"),
        ("zoo.car(2);", "E0308", "group `zoo.car` takes no arguments", "scale(0.5)"),
        ("zoo.ball();", "E0212", "`zoo` has no group `ball`", "its geometry is zoo.ball { … }"),
        ("zoo.ball(2);", "E0308", "`zoo.ball` takes no arguments", "scale(0.5)"),
        ("zoo.car { }", "E0212", "`zoo` has no geometry `car`", "its group is zoo.car() { … }"),
        ("zoo.logo() { zoo.tile { } }", "E0330", "object `zoo.tile` inside an object", "group"),
        ("sphere { zoo.car(); }", "E0330", "group `zoo.car` inside an object", "group"),
        ("let a = zoo.car;", "E0213", "`zoo.car` is a geometry, not a value", ""),
        ('import "zoo.safetensors" as if;', "E0110", "`if` is a keyword", ""),
        ('import "zoo.safetensors" as ..;', "E0109", "expected a name", ""),
        ('import "none.safetensors" as a;', "E0214", "no such file", ""),
        ('import "../zoo.safetensors" as a;', "E0215", "outside the import root", ""),
        ('import "text.safetensors" as a; a.ring { }', "E0217", "not a file of elements", ""),
        ("square { material zoo.brak; }", "E0212", "`zoo` has no material `brak`", "did you mean `bark`?"),
        ("square { material zo.bark; }", "E0201", "unknown name `zo`", ""),
        ("let zo = 2; square { material zo.bark; }", "E0213", "`zo` is a value, not an imported file", ""),
        ("zoo.bark { }", "E0213", "`zoo.bark` is the name of a material", "write material zoo.bark"),
        ("square { zoo.bark; }", "E0213", "`zoo.bark` is the name of a material", ""),
        ("let a = zoo.bark;", "E0213", "`zoo.bark` is the name of a material", ""),
        ("square { material zoo.ring; }", "E0213", "`zoo.ring` is a geometry, not a material", ""),
        ("square { material flat square; }", "E0213", "`square` is a geometry, not a material", ""),
        ("square { material mist zoo.bark; }", "E0208", "unknown material `mist`", ""),
        ("torus { material diffuse volumetric; }", "E0213", "`volumetric` is not a texture", ""),
        ("square { material zoo.bark; material zoo.stone; }", "E0332", "a second material in one block", ""),
        (
            'import "lib.nsg" as lib; square { material lib.bark; }',
            "E0213",
            "`lib.bark` is a value, not a material's name",
            "",
        ),
    ):
        (garage / "scene.nsg").write_text(IMPORT + text)
        found = Diagnostics()
        Source(garage / "scene.nsg").scene(found)
        first = found.items[0] if len(found) == 1 else None
        if (
            first is None
            or first.code != code
            or message not in first.message
            or help not in (first.help or "")
        ):
            wrong.append((text, *found))
    assert wrong == []
    (garage / "scene.nsg").write_text(IMPORT + "square { material zoo.brak; }")
    (one,) = check(garage / "scene.nsg")
    assert one.fix is None
    assert one.guess is not None
    assert [edit.replacement for edit in one.guess.edits] == ["bark"]


def test_sizes_are_values_that_early_files_lack(tmp_path: Path) -> None:
    old, new = element(ball, "old", d=2, levels=3), element(square, "tile", d=2, levels=3)
    new = replace(new, about={**new.about, "size": 2.5, "x": 3, "y": -0.5})
    (tmp_path / "zoo.safetensors").write_bytes(element_file_bytes([old, new]))
    text = "module m(k = zoo.tile_size) { zoo.tile { scale(k); } } m(); let a = 2 * zoo.tile_size; m(a);"
    scene = good(tmp_path, IMPORT + text)
    assert [node.transforms for node in scene.nodes] == [(nsg.Scale(2.5),), (nsg.Scale(5),)]
    placed = good(tmp_path, f"{IMPORT} zoo.tile {{ translate(zoo.tile_centre); scale(zoo.tile_centre.x); }}")
    assert placed.nodes[0].transforms == (nsg.Translate(3, -0.5), nsg.Scale(3))
    for fact in ("size", "centre"):
        (tmp_path / "scene.nsg").write_text(f"{IMPORT} zoo.old {{ scale(zoo.old_{fact}); }}")
        (one,) = check(tmp_path / "scene.nsg")
        assert (one.code, "learn it again" in (one.help or "")) == ("E0212", True)
