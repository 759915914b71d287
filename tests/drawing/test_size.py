"""Scenes in any unit: all lengths times k, lamps' powers times k², densities over k, are the same picture."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.spaces import Ground, Stage, read_stage, stage_data

SCENE = """
canvas(32, 24); camera(eye = k * [1.5, 1.8, 5]); ground(-0.7 * k, fade = 8 * k);
light(position = k * [1, 3, 2.5], power = 14 * k * k); light(k * [-2, 2, 1], 6 * k * k, radius = 0.3 * k);
smooth(k = 0.2 * k) { box { scale(k / 2); } sphere { scale(k / 2); translate(k / 2, 0.3 * k, 0.3 * k); } }
subtract(k = 0.1 * k) {
  sphere { scale(0.4 * k); translate(-k, 0, 0); }
  box { scale(0.3 * k); translate(-k, 0.3 * k, 0); }
}
cylinder { scale(0.2 * k, 0.4 * k, 0.2 * k); translate(1.2 * k, 0, 0); twist(0.4 / k); }
torus { scale(0.4 * k); translate(0, 0.9 * k, 0); material volumetric { density(5 / k); } }
"""
SOFT = """
camera(eye = k * [0, 1, 4]); ground(-0.7 * k, fade = 8 * k);
light(k * [-2, 2, 1], 16 * k * k, radius = 0.3 * k); sphere { scale(0.6 * k); }
"""


def scene(k: float, more: str = "") -> nsg.Scene:
    return nsg.loads(f"nsg 1; let k = {k!r}; {more} {SCENE}")


def hold(draw: Callable[[float], nsg.Image], scales: tuple[float, ...]) -> None:
    usual = np.asarray(draw(1.0))
    assert usual.std() > 0.1
    for k in scales:
        assert abs(np.asarray(draw(k)) - usual).max() < 2 / 255


@pytest.mark.parametrize("backend", ["neural", "exact"])
def test_pictures_do_not_depend_on_the_unit(backend: str) -> None:
    hold(lambda k: nsg.render(scene(k), backend=backend), (1e-4, 0.03, 1e4))


def test_the_reference_does_not_depend_on_the_unit() -> None:
    """All but soft lamps, and a ball by such a lamp, to which each point takes 144 ways."""
    hard = SCENE.replace(", radius = 0.3 * k", "")
    for text in (hard, SOFT):

        def draw(k: float, text: str = text) -> nsg.Image:
            return nsg.render(nsg.loads(f"let k = {k!r}; {text}"), backend="reference", size=(8, 6))

        hold(draw, (1e-4 if text is hard else 1e4,))


def test_light_from_everywhere_does_not_depend_on_the_unit() -> None:
    usual = np.asarray(nsg.render(scene(1.0, "sky();")))
    for k in (1e-3, 300.0):
        assert abs(np.asarray(nsg.render(scene(k, "sky();"))) - usual).max() < 2 / 255


@pytest.mark.parametrize("exact", [False, True])
def test_depths_are_in_the_unit_of_the_scene(exact: bool) -> None:
    backend = "reference" if exact else "neural"
    one, other = (nsg.render_outputs(scene(k), ["depth"], backend=backend) for k in (1.0, 50.0))
    assert one.depth is not None
    assert other.depth is not None
    assert np.isfinite(one.depth).mean() > 0.5
    assert np.allclose(other.depth, 50 * one.depth, rtol=1e-4)


def test_a_ground_that_does_not_say_how_it_fades_is_written_as_before() -> None:
    assert stage_data(Stage())["ground"] == {"y": -1.0, "rgb": (0.5, 0.48, 0.45)}
    faded = Stage(ground=Ground(fade=3.0))
    assert stage_data(faded)["ground"]["fade"] == 3.0
    for stage in (Stage(), faded):
        assert read_stage(json.loads(json.dumps(stage_data(stage)))) == stage
