"""Scenes of solids from text to picture, by the network and exactly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.program import Program
from scenelang.drawing.how import RenderError
from scenelang.drawing.image import enlarged
from scenelang.drawing.small import draw_small
from scenelang.drawing.torch_backend import draw_program, open_model
from scenelang.output.frontier import plan_of
from tests.pictures import psnr_db

TEXT = """nsg 1;
canvas(48, 32);
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
    assert picture.shape == (32, 48, 3)
    assert psnr_db(picture, exact) > 42
    assert np.array_equal(nsg.render(program), picture)
    program.save(tmp_path / "p.safetensors")
    assert np.array_equal(nsg.render(nsg.load_program(tmp_path / "p.safetensors")), picture)
    assert np.allclose(nsg.render(scene, threads=1), nsg.render(scene, threads=3), atol=1 / 255)


def test_samples_and_backgrounds(scene: nsg.Scene, exact: nsg.Image) -> None:
    program = nsg.compile(scene)
    four, few, one = (draw_small(program, samples=samples) for samples in ("four", "adaptive", "one"))
    assert psnr_db(four.image, exact) > 42
    assert 20 < psnr_db(one.image, exact) < psnr_db(four.image, exact)
    assert one.pairs < few.pairs
    assert [one.refined, four.refined] == [0, 48 * 32]
    assert 0 < few.refined < four.refined
    quick = draw_small(program, samples="quick")
    assert psnr_db(one.image, exact) < psnr_db(quick.image, exact)
    assert one.pairs < quick.pairs < 0.8 * few.pairs
    assert quick.refined < few.refined
    clear = scene.model_copy(update={"background": None})
    draft, half = nsg.render(clear, samples="draft"), nsg.render(clear, samples="one", size=(24, 16))
    assert np.array_equal(draft, enlarged(half, (48, 32)))
    ours, theirs = nsg.render(clear), nsg.render(clear, backend="reference")
    assert ours.shape == theirs.shape == (32, 48, 4)
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
    assert cost["rays"] == 48 * 32 + 4 * cost["refined"]
    assert cost["light_rays"] > 0
    assert cost["near"] < cost["steps"] < cost["evaluations"] == drawing.pairs
    assert "meetings" not in cost


def test_nothing_is_seen_from_inside() -> None:
    inside = nsg.loads("sphere { translate(0, 1.2, 6); }")
    with pytest.raises(RenderError, match="inside"):
        nsg.render(inside, backend="reference")


def test_the_stages_farthest_numbers_are_drawn_without_a_warning() -> None:
    solids = "sphere { scale(0.5); } torus { translate(1, 0, 0); material volumetric; }"
    for text in (
        "camera([0, 0, 1e12]); light([1e12, 1e12, 0], 1e12); ground(-1e12);",
        "camera([0, 1, 0], [0, 1, 1e-12]); light([0, 1, 0], 1e12);",
        "camera([0, 5, 1e-12], fov = 179.9999999deg); light([0, 0.5, 0]);",
        "camera(fov = 1e-10deg); ground(1.2); light([0, -1, 0]); background(none);",
    ):
        scene = nsg.loads(f"canvas(9, 6); {text} {solids}")
        for backend in ("neural", "reference"):
            assert np.isfinite(nsg.render(scene, backend=backend)).all(), (text, backend)


def test_thin_canvases_have_the_view_of_their_shorter_side() -> None:
    for canvas in ("1, 1", "1, 300", "300, 1"):
        text = f"canvas({canvas}); sphere {{ scale(0.5); }} torus {{ material volumetric; }}"
        ours, exact = (np.asarray(nsg.render(nsg.loads(text), backend=by)) for by in ("neural", "reference"))
        assert abs(ours - exact).mean() < 3e-3, canvas


def test_an_animation_names_the_object_that_its_camera_enters() -> None:
    text = "animate(1, 10); camera([0, 0, 3 - 0.4 * frame], [0, 0, -9]); sphere { scale(0.5); }"
    for frame in (6, 9):
        assert nsg.compile(nsg.loads(text, frame=frame)).tokens.tolist() in ([0], [])
    with pytest.raises(nsg.SceneError) as caught:
        nsg.compile(nsg.loads(text, frame=7))
    (found,) = caught.value.diagnostics
    assert (found.code, "`sphere`" in found.message) == ("E0408", True)
