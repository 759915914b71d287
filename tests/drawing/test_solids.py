"""Scenes of solids from text to picture, by the network and exactly."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import scenelang as nsg
from scenelang.cli.main import cli
from scenelang.compiler.program import Program
from scenelang.drawing.how import RenderError
from scenelang.drawing.image import enlarged
from scenelang.drawing.small import choose_drawer, draw_small
from scenelang.drawing.torch_backend import draw_program, open_model
from scenelang.output.plan import plan_of

TEXT = """nsg 1;
canvas(72, 48);
animate(seconds = 1, fps = 3);
let mist = material volumetric { color([0.3, 0.5, 1.0]); };
module ball(at, c = #e8c060) {
  sphere { scale(0.6); translate(at); material diffuse { color(c); } }
}
chain {
  ball(at = [0, 0.5 - u, 0]);
  smooth torus { displace(0.04, 6); twist(0.7); twirl(0.4); scale(0.8); rotate(40deg, axis = [1, 2, 0]); }
  subtract sphere { scale(0.4); translate(0.3, 0.6, 0.6); }
  torus  { scale(1.2, 1.2, 0.4); bend(0.3); rotate(70deg, axis = X); mist { hue(0.1turn); } }
}
"""


def psnr(a: nsg.Image, b: nsg.Image) -> float:
    return float(-10 * np.log10(np.square(np.asarray(a, float) - np.asarray(b, float)).mean() + 1e-12))


@pytest.fixture(scope="module")
def scene() -> nsg.Scene:
    return nsg.loads(TEXT)


@pytest.fixture(scope="module")
def program(scene: nsg.Scene) -> Program:
    return nsg.compile(scene)


@pytest.fixture(scope="module")
def exact(scene: nsg.Scene) -> nsg.Image:
    return nsg.render(scene, backend="reference")


def test_the_network_draws_what_the_reference_does(
    scene: nsg.Scene, program: Program, exact: nsg.Image, tmp_path: Path
) -> None:
    picture = nsg.render(scene)
    assert picture.shape == (48, 72, 3)
    assert psnr(picture, exact) > 42
    assert np.array_equal(nsg.render(program), picture)
    program.save(tmp_path / "p.safetensors")
    assert np.array_equal(nsg.render(nsg.load_program(tmp_path / "p.safetensors")), picture)
    assert np.allclose(nsg.render(scene, threads=1), nsg.render(scene, threads=3), atol=1 / 255)


def test_torch_draws_the_same(program: Program, exact: nsg.Image) -> None:
    assert choose_drawer(program).library == "numpy"
    assert choose_drawer(program, "cpu").library == "torch"
    drawn = nsg.render(program, device="cpu")
    assert psnr(drawn, nsg.render(program)) > 48
    assert psnr(drawn, exact) > 42


def test_samples_and_backgrounds(scene: nsg.Scene, exact: nsg.Image) -> None:
    program = nsg.compile(scene)
    four, few, one = (draw_small(program, samples=samples) for samples in ("four", "adaptive", "one"))
    assert psnr(four.image, exact) > 42
    assert 20 < psnr(one.image, exact) < psnr(four.image, exact)
    assert one.pairs < few.pairs
    assert [one.refined, four.refined] == [0, 72 * 48]
    assert 0 < few.refined < four.refined
    quick = draw_small(program, samples="quick")
    assert psnr(one.image, exact) < psnr(quick.image, exact)
    assert one.pairs < quick.pairs < 0.8 * few.pairs
    assert quick.refined < few.refined
    clear = scene.model_copy(update={"background": None})
    draft, half = nsg.render(clear, samples="draft"), nsg.render(clear, samples="one", size=(36, 24))
    assert np.array_equal(draft, enlarged(half, (72, 48)))
    ours, theirs = nsg.render(clear), nsg.render(clear, backend="reference")
    assert ours.shape == theirs.shape == (48, 72, 4)
    assert abs(np.asarray(ours)[..., 3] - np.asarray(theirs)[..., 3]).mean() < 2e-3


def test_a_model_draws_its_own_dimension(scene: nsg.Scene, program: Program) -> None:
    flat = nsg.compile(nsg.loads("square { }"))
    with pytest.raises(RenderError):
        draw_program(program, open_model("shapes2d"))
    with pytest.raises(RenderError):
        draw_program(flat, open_model("solids3d"))
    assert flat.model == "shapes2d"
    assert nsg.compile(nsg.loads("canvas(8, 8);")).model == "shapes2d"
    assert program.model == "solids3d"


def test_plans_of_solids(scene: nsg.Scene, program: Program) -> None:
    found = plan_of(scene, program, {}, open_model("solids3d"))
    assert found["model"] == "solids3d"
    assert found["rows"] == 4
    cost, drawing = found["drawing"], draw_small(program, threads=1)
    assert cost["psnr"] > 40
    assert cost["rays"] == 72 * 48 + 4 * cost["refined"]
    assert cost["light_rays"] > 0
    assert cost["near"] < cost["steps"] < cost["evaluations"] == drawing.pairs
    assert "meetings" not in cost


def test_the_plan_speaks_of_rays(tmp_path: Path) -> None:
    file = tmp_path / "scene.nsg"
    file.write_text(TEXT)
    said = CliRunner().invoke(cli, ["dump", "--costs", str(file), "--threads", "1"]).output
    assert re.search(r"rays +[\d,]+ from the eye and [\d,]+ to the light, \d+\.\d % near an object", said)
    assert re.search(r"steps +[\d,]+, \d+\.\d on a ray near an object", said)
    assert re.search(r"network +[\d,]+ evaluations of an object, \d\.\d\d of 4 a step", said)
    assert "meetings" not in said


def test_nothing_is_seen_from_inside() -> None:
    inside = nsg.loads("sphere { translate(0, 1.2, 6); }")
    with pytest.raises(RenderError, match="inside"):
        nsg.render(inside, backend="reference")
