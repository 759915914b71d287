"""Numbers of samples: pixels against pictures whose pixels are single samples, by every way to draw."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import scenelang as nsg
from scenelang.cli.main import cli
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.program import ProgramError, parse_program, program_bytes
from scenelang.drawing.exact.picture import reference_image
from scenelang.drawing.how import How
from scenelang.drawing.image import decoded, encoded
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import Scene
from tests.pictures import Array, psnr_db

SIDE = 40
SCENES = {
    "plane": """
        canvas(40, 40); background(#246);
        star { scale(0.9); rotate(7deg); material flat { color(#fc3); } }
        smooth { pentagon { scale(0.4); translate(0.4, 0.2); } square { scale(0.3); material checker; } }
        """,
    "glass": """
        canvas(40, 40);
        square { scale(0.7); rotate(20deg); material bricks { opacity(0.6); } }
        star { scale(0.8); material flat { color(#36c); opacity(0.5); } }
        """,
    "space": """
        canvas(40, 40); light(power = 9); background(#345);
        sphere { scale(0.8); material diffuse { color(#753); } }
        torus { rotate(60deg, axis = X); translate(0.3, 0.3, 0.6); material diffuse { color(#357); } }
        sphere { scale(0.5); translate(-0.8, 0, 0.8); material volumetric { color(#9cf); } }
        """,
}


def mean_of(fine: Any, side: int, solid: bool) -> Array:
    """Pixels as means of side x side pixels, in space of linear light."""
    values = np.asarray(fine, np.float64)
    values = decoded(values) if solid else values
    high, wide = values.shape[0] // side, values.shape[1] // side
    result = values.reshape(high, side, wide, side, 3).mean((1, 3))
    return np.asarray(encoded(result) if solid else result)


def of(name: str, samples: int) -> Scene:
    return nsg.loads(SCENES[name]).model_copy(update={"samples": samples})


@pytest.mark.parametrize("name", SCENES)
def test_the_reference_takes_a_regular_grid(name: str) -> None:
    for samples, side in ((4, 2), (16, 4)):
        scene = of(name, samples)
        model = load_manifest("solids3d" if name == "space" else "shapes2d")
        fine = lower(scene.sized((side * SIDE, side * SIDE)), model, None, Diagnostics())
        wanted = mean_of(reference_image(fine, per_side=1), side, name == "space")
        np.testing.assert_allclose(nsg.render(scene, backend="reference"), wanted, atol=1e-5)


@pytest.mark.parametrize("name", SCENES)
def test_networks_take_the_same(name: str) -> None:
    """All samples exactly, and those near outlines nearly; torch as numpy, and formulas too."""
    for samples, side in ((4, 2), (16, 4)):
        scene, solid = of(name, samples), name == "space"
        fine = nsg.render(scene.sized((side * SIDE, side * SIDE)), samples="one")
        wanted = mean_of(fine, side, solid)
        assert psnr_db(np.asarray(nsg.render(scene, samples="four")), wanted) > (48 if solid else 70)
        assert psnr_db(np.asarray(nsg.render(scene)), wanted) > (40 if solid else 50)
        assert psnr_db(np.asarray(nsg.render(scene, backend="exact")), wanted) > 35
        other = nsg.render(scene, device="cpu", samples="four")
        assert psnr_db(np.asarray(other), wanted) > (48 if solid else 70)


def test_sixteen_are_nearer_than_four() -> None:
    """Of a picture of very many samples, and by the option as by the statement."""
    for name in ("plane", "space"):
        solid = name == "space"
        many = nsg.render(of(name, 16).sized((4 * SIDE, 4 * SIDE)))
        best = mean_of(many, 4, solid)
        four, sixteen = (np.asarray(nsg.render(of(name, n))) for n in (4, 16))
        assert psnr_db(sixteen, best) > psnr_db(four, best) + 3
        for given in (16, "16"):
            assert np.array_equal(nsg.render(of(name, 4), samples=given), sixteen)
        assert np.array_equal(nsg.render(of(name, 16), samples=4), four)
        assert np.array_equal(nsg.render(nsg.compile(of(name, 4)), samples=16), sixteen)


def test_the_command_line_overrides(tmp_path: Path) -> None:
    (tmp_path / "a.nsg").write_text(SCENES["plane"])
    (tmp_path / "b.nsg").write_text("samples(16);" + SCENES["plane"])
    runner, out = CliRunner(), {}
    for file, more in (("a", []), ("a", ["--samples", "16"]), ("b", []), ("b", ["--samples", "4"])):
        path = tmp_path / f"{file}{len(more)}.png"
        shown = runner.invoke(cli, ["render", str(tmp_path / f"{file}.nsg"), "-o", str(path), *more])
        assert shown.exit_code == 0, shown.output
        out[path.stem] = path.read_bytes()
    assert out["a0"] == out["b2"] != out["a2"] == out["b0"]
    shown = runner.invoke(cli, ["render", str(tmp_path / "a.nsg"), "-o", "c.png", "--samples", "9"])
    assert shown.exit_code == 2
    reference = ["--backend", "reference", "--samples", "16"]
    for name in "ab":
        path = tmp_path / f"{name}-exact.png"
        shown = runner.invoke(cli, ["render", str(tmp_path / f"{name}.nsg"), "-o", str(path), *reference])
        assert shown.exit_code == 0, shown.output
        out[name] = path.read_bytes()
    assert out["a"] == out["b"]


def test_a_program_with_sixteen_is_format_5_and_comes_back() -> None:
    program = nsg.compile(of("plane", 16))
    data = program_bytes(program)
    assert rb"\"format\":5," in data
    assert parse_program(data).samples == 16
    assert parse_program(data).digest() == program.digest() != nsg.compile(of("plane", 4)).digest()
    for wrong in (8, 0, 16.0, True, "16"):
        with pytest.raises(ProgramError, match="samples"):
            replace(program, samples=wrong)  # type: ignore[arg-type]
    with pytest.raises(ProgramError):
        parse_program(data.replace(rb"\"samples\":16", rb"\"samples\":17"))
    with pytest.raises(ProgramError):
        parse_program(data.replace(rb"\"format\":5", rb"\"format\":4"))


def test_what_excludes_it_says_so() -> None:
    with pytest.raises(ValueError, match="samples"):
        How(samples=9).checked()  # type: ignore[arg-type]
    with pytest.raises(nsg.SceneError) as caught:
        nsg.compile(of("plane", 16), model="shapes2d-reading")
    assert "E0381" in {d.code for d in caught.value.diagnostics}
    with pytest.raises(nsg.RenderError, match="one way"):
        nsg.render(nsg.loads('model "shapes2d-reading"; square { scale(0.5); }'), samples=16)
