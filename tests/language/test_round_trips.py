"""Scenes through JSON, text and `repr`, and back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings

import scenelang as nsg
from scenelang.assets.records import deep_stack
from scenelang.compiler.program import program_bytes
from scenelang.language.scene import to_readable_json
from tests.strategies import scenes

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.nsg"))


@settings(max_examples=50)
@given(scenes)
def test_readable_json_reads_back(scene: nsg.Scene) -> None:
    again = nsg.Scene.from_json(to_readable_json(scene))
    assert again == scene
    assert again.to_json() == scene.to_json()


@settings(max_examples=50)
@given(scenes)
def test_repr_of_nodes_is_code(scene: nsg.Scene) -> None:
    names = dict(vars(nsg)) | {name: getattr(nsg, name) for name in nsg.__all__}
    assert eval(repr(scene.nodes), names) == scene.nodes


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_way_gives_the_same_program(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)  # where files of elements are looked for
    scene = nsg.load(path)
    program = program_bytes(nsg.compile(scene))
    ways = (
        nsg.Scene.from_json(scene.to_json(), root="."),
        nsg.Scene.from_json(to_readable_json(scene), root="."),
        nsg.loads(scene.to_nsg(), root="."),
    )
    for way in ways:
        assert way == scene
        assert program_bytes(nsg.compile(way)) == program


def test_deep_scenes_have_a_repr() -> None:
    node: Any = nsg.Object("star")
    for _ in range(399):
        node = nsg.Chain.model_construct(
            kind="chain",
            children=(nsg.Link.model_construct(op="union", node=node),),
            transforms=(),
            material=None,
        )
    scene = nsg.Scene.model_construct(nodes=(node,))
    assert repr(scene) == "Scene(1 object, 256 x 256)"
    with deep_stack():
        assert "…" in repr(scene.nodes) or repr(scene.nodes)


def test_repr_shows_what_was_said() -> None:
    star = nsg.Object("star", transforms=[nsg.Scale.uniform(0.5)], material=nsg.Material("flat"))
    said = "Object(geometry='star', transforms=(Scale(x=0.5, y=0.5, z=0.5),), material=Material(name='flat'))"
    assert repr(star) == said
    assert repr(nsg.Scene()) == "Scene(0 objects, 256 x 256)"
    pair = nsg.Group((star, nsg.Chain((star, nsg.Link("subtract", star)))))
    animation = nsg.Animation(2, 24)
    scene = nsg.Scene(canvas=(64, 48), model="shapes2d", animation=animation, nodes=(star, *[pair] * 500))
    assert f"{scene}" == repr(scene) == "Scene(1,501 objects, 64 x 48, shapes2d, a frame of 48)"
    assert repr(nsg.Flip()) == "Flip()"


def test_colours_by_their_digits() -> None:
    assert nsg.Color.hex("#d33") == nsg.Color.hex("#DD3333") == nsg.Color(rgb=(0xDD / 255, 0.2, 0.2))
    for wrong in ("d33", "#d3", "#dd33333", "#xyz", ""):
        with pytest.raises(ValueError, match="is not a colour"):
            nsg.Color.hex(wrong)


TREE = """nsg 1;
square {}
subtract(k = 0.1) {
  star {}
  intersect(k = 0.05) {
    square {}
    chain { star {} subtract(k = 0.2) square {} }
  }
}
"""


def test_trees_and_widths_are_the_same_in_text_and_json() -> None:
    scene = nsg.loads(TREE)
    assert nsg.loads(nsg.format_text(TREE)) == scene
    for again in (nsg.loads(scene.to_nsg()), nsg.Scene.from_json(scene.to_json())):
        assert again == scene
        assert program_bytes(nsg.compile(again)) == program_bytes(nsg.compile(scene))
