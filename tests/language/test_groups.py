"""Ready groups in scenes: called as modules, in text, JSON and Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.assets.element import Part
from scenelang.assets.zoo import zoo_bytes
from scenelang.compiler.compile import compile_scene
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.evaluation import Source
from tests.assets.shapes import ball, element, noise, square, torus
from tests.test_architecture import loaded_by

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
IMPORT = 'import "zoo.safetensors" as zoo;\n'
CAR = """
group {
  zoo.ring { scale(0.5); translate(0, 0.5, 0); material zoo.hide; }
  zoo.ring { rotate(90deg); scale(0.25); translate(0.5, -0.5, 0); material diffuse { color(#ff8000); } }
  zoo.ball { }
  @
}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    held = [
        element(torus, "ring", levels=2),
        element(ball, "ball", levels=2),
        element(square, "tile", levels=3, d=2),
        noise(3, 3, 3, name="hide"),
    ]
    (tmp_path / "zoo.safetensors").write_bytes(zoo_bytes(held, GROUPS))
    return tmp_path


def load(folder: Path, text: str) -> tuple[nsg.Scene | None, Diagnostics]:
    (folder / "scene.nsg").write_text(IMPORT + text)
    found = Diagnostics()
    return Source(folder / "scene.nsg").scene(found)[0], found


def good(folder: Path, text: str) -> nsg.Scene:
    scene, found = load(folder, text)
    assert scene is not None, [d.message for d in found]
    return scene


def rows(scene: nsg.Scene) -> np.ndarray:
    return np.asarray(compile_scene(scene).vectors)


@pytest.mark.parametrize(
    ("call", "block"),
    [("zoo.car();", ""), ("zoo.car() { rotate(30deg, axis = Y); }", "rotate(30deg, axis = Y);")],
)
def test_a_call_is_the_parts_in_their_places_and_looks(folder: Path, call: str, block: str) -> None:
    made, written = good(folder, call), good(folder, CAR.replace("@", block))
    np.testing.assert_allclose(rows(made), rows(written), atol=3e-3)  # colours in 8 bits there
    ours, theirs = compile_scene(made), compile_scene(written)
    assert ours.brought() == theirs.brought()
    assert [p and p.element.name for p in ours.paints()] == ["hide", None, None]


def test_a_group_of_one_part_is_that_object(folder: Path) -> None:
    own = good(folder, "zoo.ring() { scale(0.5); }")
    same = good(folder, "zoo.ring { scale(0.5); material diffuse { color(#00f); } }")
    assert own == same
    worn = good(folder, "group { zoo.ring(); zoo.ball { } material volumetric { } }")
    assert [leaf.material and leaf.material.name for leaf in worn.nodes[0].children] == ["diffuse", None]  # type: ignore[union-attr]


def test_groups_stand_in_modules_and_chains(folder: Path) -> None:
    scene = good(folder, "module mark() { zoo.logo() { scale(0.5); } } chain { square { } smooth mark(); } ")
    assert [child.op for child in scene.nodes[0].children] == ["union", "smooth"]  # type: ignore[union-attr]
    scene = good(folder, "chain { zoo.logo(); subtract zoo.tile { scale(0.2); } }")
    assert compile_scene(scene).objects == ("zoo.tile", "zoo.tile", "zoo.tile")


def test_text_json_and_python_hold_the_parts(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    scene = good(folder, "zoo.car() { rotate(30deg, axis = Y); }")
    assert nsg.Scene.from_json(scene.to_json(), root=folder) == scene
    (folder / "again.nsg").write_text(scene.to_nsg())
    assert nsg.load(folder / "again.nsg").nodes == scene.nodes
    zoo = nsg.load_elements("zoo.safetensors")
    made = nsg.Scene(elements=zoo, nodes=nsg.Group(zoo.group("car"), nsg.Rotate.degrees(30, axis=(0, 1, 0))))
    assert compile_scene(made).digest() == compile_scene(scene).digest()
    assert nsg.Scene(elements=zoo, nodes=zoo.group("ring")).nodes == good(folder, "zoo.ring();").nodes
    with pytest.raises(KeyError, match="`zoo` has no group `cow`; it has car, logo, ring"):
        zoo.group("cow")


@pytest.mark.parametrize(
    ("text", "code", "message", "help"),
    [
        ("zoo.cat();", "E0212", "`zoo` has no `cat`", "did you mean `car`?"),
        ("zoo.car(2);", "E0308", "group `zoo.car` takes no arguments", "scale(0.5)"),
        ("zoo.ball();", "E0212", "`zoo` has no group `ball`", "its geometry is zoo.ball { … }"),
        ("zoo.ball(2);", "E0308", "`zoo.ball` takes no arguments", "scale(0.5)"),
        ("zoo.car { }", "E0212", "`zoo` has no geometry `car`", "its group is zoo.car() { … }"),
        ("zoo.logo() { zoo.tile { } }", "E0330", "object `zoo.tile` inside an object", "group"),
        ("sphere { zoo.car(); }", "E0330", "group `zoo.car` inside an object", "group"),
        ("let a = zoo.car;", "E0213", "`zoo.car` is a geometry, not a value", None),
    ],
)
def test_mistakes(folder: Path, text: str, code: str, message: str, help: str | None) -> None:
    _, found = load(folder, text)
    assert [d.code for d in found] == [code]
    (d,) = found
    assert message in d.message
    assert help is None or help in (d.help or "")


def test_objects_of_groups_are_counted(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scenelang.language.session.MAX_OBJECTS", 8)
    assert load(folder, "for (i in 0..<2) { zoo.car(); }")[0] is not None
    assert [d.code for d in load(folder, "for (i in 0..<3) { zoo.car(); }")[1]] == ["E0320"]


def test_checking_groups_needs_no_numpy(folder: Path) -> None:
    good(folder, "zoo.car();")
    assert not loaded_by("check", str(folder / "scene.nsg")) & {"torch", "numpy"}
