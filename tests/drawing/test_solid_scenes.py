"""Scenes that strangers write: the network's picture beside the exact one."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg

SCENES = {
    "a light inside a medium": """
        light(position = [0, 0.3, 0], power = 2);
        sphere { material volumetric { color(#fa6); } }
        torus { translate(1.4, 0, 0); }
    """,
    "a solid that is half in a medium": """
        sphere { material volumetric { color(#49f); } }
        torus { rotate(60deg, axis = X); translate(0.7, 0, 0.2); material diffuse { color(#f40); } }
    """,
}


@pytest.mark.parametrize("name", SCENES)
def test_the_network_draws_what_the_reference_does(name: str) -> None:
    scene = nsg.loads("canvas(48, 48);" + SCENES[name])
    ours, exact = (np.asarray(nsg.render(scene, backend=by), float) for by in ("neural", "reference"))
    assert -10 * np.log10(np.square(ours - exact).mean()) > 46


@pytest.mark.parametrize(
    "text",
    [
        "camera([0, 0, 1e12]); light([1e12, 1e12, 0], 1e12); ground(-1e12);",
        "camera([0, 1, 0], [0, 1, 1e-12]); light([0, 1, 0], 1e12);",
        "camera([0, 5, 1e-12], fov = 179.9999999deg); light([0, 0.5, 0]);",
        "camera(fov = 1e-10deg); ground(1.2); light([0, -1, 0]); background(none);",
    ],
)
@pytest.mark.parametrize("backend", ["neural", "reference"])
def test_the_stages_farthest_numbers_are_drawn_without_a_warning(text: str, backend: str) -> None:
    solids = "sphere { scale(0.5); } torus { translate(1, 0, 0); material volumetric; }"
    assert np.isfinite(nsg.render(nsg.loads(f"canvas(9, 6); {text} {solids}"), backend=backend)).all()


@pytest.mark.parametrize("canvas", ["1, 1", "1, 300", "300, 1"])
def test_thin_canvases_have_the_view_of_their_shorter_side(canvas: str) -> None:
    text = f"canvas({canvas}); sphere {{ scale(0.5); }} torus {{ material volumetric; }}"
    ours, exact = (np.asarray(nsg.render(nsg.loads(text), backend=by)) for by in ("neural", "reference"))
    assert abs(ours - exact).mean() < 3e-3


def test_an_animation_names_the_object_that_its_camera_enters() -> None:
    text = "animate(1, 10); camera([0, 0, 3 - 0.4 * frame], [0, 0, -9]); sphere { scale(0.5); }"
    for frame in (6, 9):
        assert nsg.compile(nsg.loads(text, frame=frame)).tokens.tolist() in ([0], [])
    with pytest.raises(nsg.SceneError) as caught:
        nsg.compile(nsg.loads(text, frame=7))
    (found,) = caught.value.diagnostics
    assert (found.code, "`sphere`" in found.message) == ("E0408", True)
