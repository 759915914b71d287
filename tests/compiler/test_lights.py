"""Lamps, skies, glow, density and reflection, from text to Programs and their files."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.lifting import SOLID_LAYOUT
from scenelang.compiler.program import Program, ProgramError, parse_program, program_bytes
from scenelang.compiler.spaces import Light, Sky, Stage, decoded
from scenelang.editors.dumps import stage_text

HALF = (0.5, 0.5, 0.5)


def of(material: str) -> list[Any]:
    """Density, roughness and glow in the vector of a ball of a material under a sky."""
    vector = nsg.compile(nsg.loads(f"sky(); sphere {{ {material} }}")).vectors[0]
    parts = SOLID_LAYOUT.unpack(vector.astype(np.float64))
    return [float(parts.density), float(parts.roughness), *parts.glow.tolist()]


@pytest.mark.parametrize(
    ("material", "wanted"),
    [
        ("", (0, 0, 0, 0, 0)),
        ("material volumetric;", (0, 0, 0, 0, 0)),
        ("material volumetric { density(8); }", (8, 0, 0, 0, 0)),
        ("material volumetric linear { density(8); stop(0, #fff); stop(1, #000); }", (8, 0, 0, 0, 0)),
        ("material glossy;", (0, 0.3, 0, 0, 0)),
        ("material metal { color(#d33); roughness(0.05); hue(90deg); }", (0, -0.05, 0, 0, 0)),
        ("material glossy bricks { roughness(1); scale(0.5); }", (0, 1, 0, 0, 0)),
        ("material diffuse { glow([0, 1, 0.5], 3); color(#000); }", (0, 0, 0, 3, 3 * decoded(HALF)[0])),
        ("material glossy { glow(#fff); grayscale(1); }", (0, 0.3, 1, 1, 1)),
        ("let m = material metal { glow(#fff); roughness(0.5); }; m { roughness(0.2); }", (0, -0.2, 1, 1, 1)),
    ],
)
def test_properties_reach_the_vectors(material: str, wanted: tuple[float, ...]) -> None:
    assert of(material) == pytest.approx(wanted, abs=1e-6)


def test_what_reflects_is_diffuse_to_the_network() -> None:
    scene = nsg.loads(
        "sky(); sphere { material metal; } box { material glossy; } torus { material diffuse; }"
    )
    codes = SOLID_LAYOUT.unpack(nsg.compile(scene).vectors).material
    assert (codes == codes[0]).all()


@pytest.mark.parametrize(
    ("text", "code", "place"),
    [
        ("sphere { material metal; }", "E0392", "metal"),
        ("background(#fff); sphere { material glossy bricks; }", "E0392", "bricks"),
        ("sphere { material diffuse { density(2); } }", "E0393", "diffuse"),
        ("sky(); sphere { material metal { density(2); } }", "E0393", "metal"),
        ("sphere { material volumetric { roughness(0.2); } }", "E0393", "volumetric"),
        ("let m = material flat { glow(#fff); }; square { m; }", "E0380", "flat"),
        ("square { material bricks { density(2); } }", "E0380", "bricks"),
        ("square { material metal; }", "E0502", "metal"),
        ("sky(); square;", "E0511", "sky"),
        ("light(); light(radius = 1); square;", "E0511", "light"),
        ('model "shapes2d-reading"; square { material flat { roughness(0.2); } }', "E0380", "flat"),
    ],
)
def test_what_does_not_fit_is_refused(text: str, code: str, place: str) -> None:
    (found,) = nsg.check_text(text).errors
    assert (found.code, found.span and found.span.text) == (code, place)
    with pytest.raises(nsg.SceneError, match=code):  # the same without places
        nsg.compile(nsg.Scene.from_json(nsg.loads(text).to_json()))


@pytest.mark.parametrize("end", ["", "\n", " // the end"])
def test_the_fix_adds_a_sky(end: str) -> None:
    fixed, left = nsg.fix_text("nsg 1;\nsphere { material metal; }" + end)
    assert "\nsky();\n" in fixed
    assert not left.errors
    hidden = "module sky() { sphere; } sky() { material metal; }"
    assert nsg.fix_text(hidden)[0] == hidden


def test_json_and_python_say_what_text_says() -> None:
    text = (
        "light(none); sky(0.5, #ff0000); sphere { material glossy { glow(#00ff00, 2); roughness(0.25); } }"
        "torus { material volumetric { density(9); } }"
    )
    scene = nsg.loads(text)
    glossy = nsg.Material("glossy", glow=nsg.Glow("#0f0", 2.0), roughness=0.25)
    made = nsg.Scene(
        light=(),
        sky=nsg.Sky(0.5, "#f00"),
        nodes=(
            nsg.Object("sphere", (), glossy),
            nsg.Object("torus", (), nsg.Material("volumetric", density=9)),
        ),
    )
    assert made == scene == nsg.Scene.from_json(scene.to_json()) == nsg.loads(scene.to_nsg())
    lamps = nsg.Scene(light=[nsg.Light(), nsg.Light(radius=2)])
    assert nsg.Scene.from_json(lamps.to_json()) == lamps == nsg.loads(lamps.to_nsg())
    assert nsg.Scene(light=[nsg.Light()]) == nsg.Scene(light=nsg.Light())
    assert nsg.Material("diffuse", glow="#fff") == nsg.Material("diffuse", glow=nsg.Glow((1, 1, 1)))


def test_scenes_without_any_are_written_as_before() -> None:
    scene = nsg.loads("light(power = 3); sphere { material diffuse { color(#d33); } }")
    data = json.loads(scene.to_json())
    assert data["light"] == {"position": [2.5, 4.0, 3.0], "power": 3.0, "color": [1.0, 1.0, 1.0]}
    assert "sky" not in data
    assert data["nodes"][0]["material"].keys() == {"name", "ops", "shading"}
    assert rb"\"format\":1" in program_bytes(nsg.compile(scene))


@pytest.mark.parametrize(
    "wrong",
    [
        {"light": [{"power": -1}]},
        {"light": {"radius": -1}},
        {"light": [{}] * 9},
        {"light": [None]},
        {"sky": None},
        {"sky": {"power": -1}},
        {"sky": {"horizon": [2, 0, 0]}},
        *(
            {"nodes": [{"kind": "object", "geometry": "sphere", "material": {"name": "metal", name: value}}]}
            for name, value in (("density", 0), ("density", 2e6), ("roughness", 0.01), ("glow", {"power": 1}))
        ),
    ],
)
def test_json_with_wrong_values_is_refused_at_its_place(wrong: dict[str, Any]) -> None:
    with pytest.raises(nsg.SceneError, match="E0313") as found:
        nsg.Scene.from_json(json.dumps(wrong))
    assert all(d.span is not None for d in found.value.diagnostics)
    nsg.Scene.from_json(json.dumps({"light": [{}] * 8}))


EVERYTHING = """
sky(0.5); light([2, 4, 3], 20, #fff, 0.4); light([-2, 4, 3]);
sphere { material volumetric { density(8); glow(#f80, 2); } }
torus { material metal { roughness(0.2); } }
"""


def test_files_of_format_5_keep_everything(tmp_path: Path) -> None:
    made = nsg.compile(nsg.loads(EVERYTHING))
    assert made.lit
    made.save(tmp_path / "all.safetensors")
    again = nsg.load_program(tmp_path / "all.safetensors")
    assert (again.digest(), again.stage) == (made.digest(), made.stage)
    assert program_bytes(again) == program_bytes(made)
    for text in (
        "light(none); sphere;",
        "sky(); sphere;",
        "light(radius = 1); sphere;",
        "light(); light(); sphere;",
        "sphere { material diffuse { glow(#fff); } }",
        "sphere { material volumetric { density(2); } }",
    ):
        assert rb"\"format\":5" in program_bytes(nsg.compile(nsg.loads(text))), text


def forged(program: Program, **parts: float) -> Program:
    vectors = program.vectors.copy()
    for name, value in parts.items():
        vectors[0, getattr(SOLID_LAYOUT.places, name)] = value
    return replace(program, vectors=vectors)


def test_forged_programs_are_refused() -> None:
    made = nsg.compile(nsg.loads(EVERYTHING))
    assert made.stage is not None
    for name, values in (
        ("density", (-1.0, 1.1e6, np.nan, np.inf)),
        ("roughness", (0.04, -0.04, 1.01, -1.01, np.nan)),
        ("glow", (-1.0, 1e13, np.nan)),
    ):
        for value in values:
            with pytest.raises(ProgramError):
                forged(made, **{name: value})
    lamp = made.stage.lights[0]
    for stage in (
        replace(made.stage, lights=(lamp,) * 9),
        replace(made.stage, lights=(replace(lamp, radius=-1.0),)),
        replace(made.stage, lights=(lamp, replace(lamp, power=-1.0))),
        replace(made.stage, sky=Sky(power=-1.0)),
        replace(made.stage, sky=None),  # with a metal
    ):
        with pytest.raises(ProgramError):
            replace(made, stage=stage)


def test_files_with_forged_headers_are_refused() -> None:
    data = program_bytes(nsg.compile(nsg.loads("sky(); light(radius = 1); sphere;")))
    (size,) = struct.unpack("<Q", data[:8])

    def changed(old: bytes, new: bytes) -> bytes:
        head = data[8 : 8 + size]
        assert old in head
        head = head.replace(old, new)
        return struct.pack("<Q", len(head)) + head + data[8 + size :]

    parse_program(changed(rb"\"radius\":1.0", rb"\"radius\":2.0"))
    for old, new in (
        (rb"\"format\":5", rb"\"format\":1"),
        (rb"\"radius\":1.0", rb"\"radius\":-1.0"),
        (rb"\"radius\":1.0", rb"\"radius\":NaN"),
        (rb"\"radius\":1.0", rb"\"radius\":1e99"),
        (rb"\"lights\":[", rb"\"lights\":[1,"),
        (rb"\"sky\":{", rb"\"sky\":{\"more\":1,"),
    ):
        with pytest.raises(ProgramError):
            parse_program(changed(old, new))


def test_numbers_of_lights_are_swept_and_move() -> None:
    text = "param k = 1 in 0..9; animate(1, 2); sky(k); light(radius = k); light(power = u);"
    text += "sphere { material volumetric { density(1 + k); glow(#fff, k); } }"
    for k in (0, 3):
        made = nsg.compile(nsg.loads(text, k=k, frame=1))
        parts = SOLID_LAYOUT.unpack(made.vectors)
        assert (float(parts.density[0]), parts.glow[0].tolist()) == (1 + k, [k] * 3)
        assert made.stage == Stage(lights=(Light(radius=k), Light(power=0.5)), sky=Sky(k))


def test_dumps_show_all_lights() -> None:
    made = nsg.compile(nsg.loads(EVERYTHING))
    shown = [line for line in stage_text(made.stage) if line.startswith(("light", "sky"))]
    assert shown[0] == "light([2, 4, 3], 20, #ffffff, 0.4)"
    again = nsg.compile(nsg.loads(" ".join(f"{line};" for line in shown) + "sphere;")).stage
    assert again is not None
    assert again.lights == made.stage.lights if made.stage else None
    assert stage_text(Stage(lights=()))[1] == "light(none)"


def test_mist_around_the_eye_hides_by_its_density() -> None:
    text = "camera([0, 0, 0.5], [0, 0, -5]); sphere { material volumetric { density(%g); } }"
    assert [d.code for d in nsg.check_text(text % 0.1)] == []
    assert [d.code for d in nsg.check_text(text % 90)] == ["W0403"]
