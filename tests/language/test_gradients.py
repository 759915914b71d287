"""Gradients as text, JSON and Python; names that scenes have of their own."""

from __future__ import annotations

from pathlib import Path

import pytest

import scenelang as nsg
from scenelang.language.words import TEXTURES

TEXT = """
param c = #d33;
let g = material radial { stop(0, c); stop(0.5, #fff); stop(0.5, [0, 0, 0.3]); };
square { g { rotate(90deg); hue(0.1turn); } }
group { star { material flat linear { for (i in 0..7) { stop(i / 7, hsv(i / 8, 1, 1)); } } } g; pentagon; }
"""


def test_text_json_and_python_say_the_same(tmp_path: Path) -> None:
    scene = nsg.loads(TEXT)
    assert nsg.loads(scene.to_nsg()) == scene
    assert nsg.Scene.model_validate_json(scene.model_dump_json()) == scene
    stops = nsg.Stop(0, "#d33"), nsg.Stop(0.5, "#fff"), nsg.Stop(0.5, (0, 0, 0.3))
    material = nsg.Material("radial", (*stops, nsg.Rotate.degrees(90), nsg.Hue.degrees(36)))
    assert scene.nodes[0] == nsg.Object("square", (), material)
    program = nsg.compile(scene)
    program.save(tmp_path / "g.safetensors")
    again = nsg.load_program(tmp_path / "g.safetensors")
    assert again.digest() == program.digest()
    assert len(program.palette) == 3
    assert nsg.format_text(nsg.format_text(TEXT)) == nsg.format_text(TEXT)


@pytest.mark.parametrize(("name", "stops", "words"), [
    ("linear", [], "no stop"),
    ("radial", [0.5], "one stop"),
    ("linear", [0.5, 0.4], "0.4 after one at 0.5"),
    ("linear", [0.1 * at for at in range(9)], "more than 8"),
    ("flat", [0, 1], "not a gradient"),
])  # fmt: skip
def test_stops_in_python(name: str, stops: list[float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        nsg.Material(name, [nsg.Stop(offset, "#fff") for offset in stops])


def test_own_names_hide_the_words() -> None:
    own = nsg.loads("""
        module stop(k) { star { scale(k); } }
        module linear(k) { stop(k) { translate(0.5, 0); } }
        fn radial(x) = x / 2;
        stop(0.5); linear(radial(1));
        square { material linear { stop(0, #f00); stop(1, #fff); } }
    """)
    as_before = nsg.loads("""
        module a(k) { star { scale(k); } }
        module b(k) { a(k) { translate(0.5, 0); } }
        a(0.5); b(0.5);
        square { material linear { stop(0, #f00); stop(1, #fff); } }
    """)
    assert own == as_before
    assert nsg.loads("let stop = material flat; square { stop; }") == nsg.loads("square { material flat; }")


@pytest.mark.parametrize("name", TEXTURES)
def test_the_sixteen_textures_are_materials_everywhere(name: str) -> None:
    for text in (
        f"square {{ material {name}; }}",
        f'model "textures2d"; square {{ material flat {name}; }}',
        f"sphere {{ material {name}; }}",
        f"torus {{ material volumetric {name} {{ hue(0.1turn); }} }}",
    ):
        program = nsg.compile(nsg.loads(text))
        assert [paint.element.name for paint in program.palette] == [name]
