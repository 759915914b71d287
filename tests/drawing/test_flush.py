"""Faces of several operands in one plane, against the exact reference."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.compile import compile_scene
from scenelang.drawing.render import draw

SIDE = 96
RED, GREEN = (f"material diffuse {{ color({colour}); }}" for colour in ("#f00", "#0f0"))
MIST = "material volumetric;"
CUT = "subtract { s.block(2, 1, 1); s.block(1, 1, 1); }"
TWO = f"s.block(1.6, 1, 1) {{ {RED} }} s.block(1, 1, 1) {{ translate(0.3, 0, 0); {GREEN} }}"
SCENES = {
    "cut": CUT,
    "turned": f"group {{ {CUT} rotate(35deg, axis = [1, 2, 3]); }}",
    "moved": "subtract { s.block(2, 1, 1) { translate(0.1, 0.1, 0.1); }"
    " s.block(1, 0.6, 1) { translate(0.1, 0.3, 0.1); } }",
    "itself": "subtract { s.block(2, 1, 1); s.block(2, 1, 1); }",
    "round": "subtract { s.column(0.7, 1); s.column(0.7, 1); } sphere { scale(0.1); }",
    "grooves": "subtract { s.block(2, 0.4, 1.4);"
    " for (i in -2..2) { s.block(0.2, 0.4, 1.4) { translate(0.4 * i, 0.2, 0); } } }",
    "groups": "sphere { scale(0.1); }"
    f" group {{ subtract {{ group {{ {TWO} }} s.block(0.6, 1, 1); }} translate(0.1, 0.1, 0); }}",
    "intersected": f"intersect {{ s.block(2, 1, 1) {{ {RED} }}"
    f" s.block(1, 1, 1) {{ translate(0.5, 0, 0); {GREEN} }} }}",
    "two": TWO,
    "turned two": f"group {{ {TWO} rotate(35deg, axis = [1, 2, 3]); }}",
    "on mist": f"s.block(1, 0.5, 1) {{ translate(0, -0.5, 0); {RED} }} s.block(1, 0.5, 1) {{ {MIST} }}",
    "mist": f"subtract {{ s.block(2, 1, 1) {{ {MIST} }} s.block(1, 1, 1); }}"
    " s.block(2, 0.5, 1) { translate(0, -0.75, 0); }",
}


def scene(text: str) -> nsg.Scene:
    return nsg.loads(f'nsg 1; import "std/solids" as s; canvas({SIDE}, {SIDE}); {text}')


def wrong(found: Any, exact: Any) -> int:
    """Pixels that differ by more than 24 of 255, as at an edge those may of which a sample is another."""
    return int((abs(np.asarray(found) - np.asarray(exact)).max(2) > 24 / 255).sum())


@pytest.mark.parametrize("name", SCENES)
def test_faces_in_one_plane_are_as_the_formulas_say(name: str) -> None:
    text = scene(SCENES[name])
    exact = nsg.render(text, backend="reference")
    for backend in ("neural", "exact"):
        assert wrong(nsg.render(text, backend=backend), exact) < 8


@pytest.mark.parametrize("name", ["itself", "two"])
def test_the_network_as_written_agrees(name: str) -> None:
    text = scene(SCENES[name])
    exact = nsg.render(text, backend="reference")
    assert wrong(draw(compile_scene(text), place="cpu").image, exact) < 8


@pytest.mark.parametrize("backend", ["neural", "exact", "reference"])
def test_the_earlier_colour_shows_in_a_plane(backend: str) -> None:
    """On the front and on top, which the eye sees from the side."""
    image = np.asarray(nsg.render(scene(TWO), backend=backend))
    assert (image[..., 0] > 0.5).any()
    assert not (image[..., 1] > image[..., 0] + 0.1).any()
    opposite = np.asarray(nsg.render(scene(TWO.replace("#f00", "#00f")), backend=backend))
    assert not (opposite[..., 1] > opposite[..., 2] + 0.1).any()


def test_seams_are_found_behind_slow_distances() -> None:
    """Next to a rod a flat block's distance hardly changes along rays, which end before the surface."""
    text = """nsg 1; import "std/solids" as s; canvas(128, 128); ground(none);
    camera(eye = [90, 80, 120], target = [15, 5, 10], fov = 16deg);
    light(position = [60, 160, 140], power = 36000); s.rounded(60, 6, 40, 2) { translate(0, 3, 0); }"""
    network, formulas = (np.asarray(nsg.render(nsg.loads(text), backend=way)) for way in ("neural", "exact"))
    assert (abs(network - formulas).max(2) > 3 / 255).sum() <= 3
