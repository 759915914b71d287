"""Elements in scenes: imported by text and JSON, compiled, drawn."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.assets.zoo import zoo_bytes
from scenelang.compiler.check import check_compiles
from scenelang.compiler.compile import compile_scene, find_model
from scenelang.compiler.program import parse_program, program_bytes
from scenelang.drawing.metrics import psnr
from scenelang.language.diagnostics import Diagnostics
from tests.assets.scenes import IMPORT, good, load
from tests.assets.shapes import ball, element, square, torus

RING = "zoo.ring { scale(0.9); rotate(40deg, axis = X); translate(0.2, 0, 0); }"
PURE = RING.replace("zoo.ring", "torus")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    flat = [element(ball, "ball", d=2, levels=3), element(square, "tile", d=2, levels=7)]
    zoo = zoo_bytes([element(torus, "ring", levels=5), *flat])
    (tmp_path / "zoo.safetensors").write_bytes(zoo)
    return tmp_path


def test_an_element_is_drawn_as_the_shape_it_is(folder: Path) -> None:
    scene = good(folder, f"{IMPORT}{RING} sphere {{ scale(0.4); translate(-1, 0, 0.5); }}")
    pure = good(folder, f"{PURE} sphere {{ scale(0.4); translate(-1, 0, 0.5); }}")
    own, exact = nsg.render(scene), nsg.render(pure, backend="reference")
    assert psnr(own, exact) > 45
    ours = np.asarray(nsg.render(scene.sized((64, 64)), device="cpu"))  # torch's
    assert abs(ours - np.asarray(nsg.render(scene.sized((64, 64))))).max() < 1.5 / 255


@pytest.mark.parametrize(
    "body",
    [
        "chain { sphere { scale(0.8); } subtract @ }",
        "chain { sphere { scale(0.8); } smooth(k = 0.3) @ }",
        "chain { sphere { scale(0.8); } intersect @ }",
        "@ sphere { scale(0.5); material volumetric { color(#48c); } }",
        "group { @ twist(0.6); bend(0.3); twirl(0.4); }",
    ],
)
def test_elements_obey_booleans_warps_and_media(folder: Path, body: str) -> None:
    pictures = [
        nsg.render(good(folder, "canvas(96, 96);" + IMPORT + body.replace("@", text)))
        for text in (RING, PURE)
    ]
    assert psnr(*pictures) > 42


TILE = "zoo.tile { scale(0.8, 0.5); rotate(20deg); material flat { color(#c36); } }"


@pytest.mark.parametrize(
    "body",
    [
        "@ star { scale(0.4); translate(0.5, 0.3); }",
        "chain { pentagon { material flat { color(#36c); } } subtract @ }",
        "chain { pentagon { scale(0.6); translate(0.5, 0); } smooth @ }",
        "chain { pentagon { } intersect @ }",
        "group { @ bend(0.6); twirl(0.8); scale(0.7); }",
    ],
)
@pytest.mark.parametrize("device", ["auto", "cpu"])
def test_flat_elements_obey_booleans_and_warps(folder: Path, body: str, device: Any) -> None:
    head = f'model "shapes2d"; canvas(128, 128); {IMPORT} background(#9c9);'
    pictures = [
        nsg.render(good(folder, head + body.replace("@", text)), device=device)
        for text in (TILE, TILE.replace("zoo.tile", "square"))
    ]
    assert psnr(*pictures) > 45


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
    (folder / "more/zoo.safetensors").write_bytes(zoo_bytes([element(ball, "ring", levels=2)]))
    library = 'import "more/zoo.safetensors" as zoo; module small() { zoo.ring { scale(0.5); } }'
    scene = good(folder, f'{IMPORT} import "lib.nsg" as lib; {RING} lib.small();', lib=library)
    assert [(file.name, file.path) for file in scene.elements] == [
        ("zoo", "zoo.safetensors"),
        ("zoo_2", "more/zoo.safetensors"),
    ]
    assert [node.geometry for node in scene.nodes] == ["zoo.ring", "zoo_2.ring"]  # type: ignore[union-attr]
    again = good(folder, scene.to_nsg())
    assert (again.nodes, again.elements) == (scene.nodes, scene.elements)


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        (f"{IMPORT} zoo.rng {{ }}", "E0212", "`zoo` has no `rng`"),
        (f"{IMPORT} let a = zoo.ring;", "E0213", "is a geometry, not a value"),
        (f"{IMPORT} zoo.ring(2);", "E0308", "takes no arguments"),
        ('import "zoo.safetensors" as if;', "E0110", "`if` is a keyword"),
        ('import "zoo.safetensors" as ..;', "E0109", "expected a name"),
        ('import "none.safetensors" as zoo;', "E0214", "no such file"),
        ('import "../zoo.safetensors" as zoo;', "E0215", "outside the import root"),
        ('import "text.safetensors" as zoo; zoo.ring { }', "E0217", "not a file of elements"),
    ],
)
def test_mistakes(folder: Path, text: str, code: str, words: str) -> None:
    (folder / "text.safetensors").write_text("let size = 1;")
    _, found = load(folder, text)
    assert [d[0] for d in found] == [code]
    assert words in found[0][1]


def test_the_smallest_model_that_draws_elements_is_chosen(folder: Path) -> None:
    scene = good(folder, IMPORT + RING)
    model = find_model(scene, Diagnostics())
    assert model is not None
    assert model.name == "solids3d"
    found = Diagnostics()
    with pytest.raises(nsg.SceneError, match=r"does not draw `zoo\.ring`, an element of space"):
        compile_scene(scene, model="shapes2d", diagnostics=found)
    flat = good(folder, f'model "solids3d"; {IMPORT} zoo.ball {{ }}')
    with pytest.raises(nsg.SceneError, match=r"does not draw `zoo\.ball`, an element of the plane"):
        compile_scene(flat)


def test_the_exact_picture_is_not_known(folder: Path) -> None:
    with pytest.raises(nsg.RenderError, match=r"the exact shape of `zoo\.ring` is not known"):
        nsg.render(good(folder, IMPORT + RING), backend="reference")


@pytest.mark.parametrize(("op", "inside"), [("subtract", False), ("intersect", False), ("union", True)])
def test_an_eye_in_what_an_element_cuts_is_not_said_to_be_inside(folder: Path, op: str, inside: bool) -> None:
    scene = good(folder, f"{IMPORT} chain {{ sphere {{ scale(9); }} {op} zoo.ring {{ }} }}")
    found = Diagnostics()
    check_compiles(scene, None, found)
    assert [d.code for d in found.errors] == ["E0408"] * inside


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


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"path": "../zoo.safetensors"}, "outside the import root"),
        ({"path": "/etc/passwd"}, "outside the import root"),
        ({"path": "none"}, "no such file"),
        ({"path": "loop"}, "loop|too many levels"),
        ({"path": 'a"; sphere { } //'}, "not a possible name"),
        ({"digest": "0" * 64}, "not the file that the scene was made with"),
    ],
)
def test_json_of_other_files(folder: Path, change: dict[str, Any], words: str) -> None:
    data = json.loads(good(folder, IMPORT + RING).to_json())
    (folder / "loop").symlink_to("loop")
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


def test_a_program_without_elements_is_of_the_old_format(folder: Path) -> None:
    data = program_bytes(compile_scene(good(folder, f"{IMPORT} torus {{ }}")))
    assert b'\\"format\\":1' in data
    assert b"forms" not in data


def test_data_of_an_earlier_version_takes_the_meshes_that_ship_now() -> None:
    data = json.loads(nsg.loads('import "std/meshes" as m; m.teapot { }').to_json())
    data["elements"][0]["digest"] = "0" * 64
    assert len(compile_scene(nsg.Scene.from_json(json.dumps(data), root="."))) == 1
