"""Textures in the plane against a slow loop: any moves, steps, warps and operators, by either library."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from scenelang.compiler.program import Paint, Program, ProgramError
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.neural.draw import draw
from tests.assets.shapes import noise
from tests.drawing.slow import Slow
from tests.drawing.test_field import BLENDED, EQUAL, NETWORKS, SCENES, drawn, program

SLOW = Slow()
COARSE, FINE = noise(7, 5), noise(64, 48, seed=1)
STEPS = (
    (),
    (("hue", 0.3),),
    (("color", 0.9, 0.5, 0.2), ("hue", -1.7), ("grayscale", 0.4)),
    (("grayscale", 1.0), ("hue", 0.5), ("color", 0.2, 1.0, 0.6)),
)


@pytest.fixture(params=NETWORKS)
def network(request: pytest.FixtureRequest):
    return NETWORKS[request.param]


def dressed(p: Program, paints: list[Paint | None], frames: np.ndarray | None = None) -> Program:
    """The same Program with paints, and with texture frames (N, 6)."""
    vectors = p.vectors.copy()
    if frames is not None:
        vectors[:, 32:38] = frames
    palette = tuple(dict.fromkeys(paint for paint in paints if paint))
    return dataclasses.replace(
        p,
        vectors=vectors,
        elements=tuple(dict.fromkeys(paint.element for paint in palette)),
        palette=palette,
        worn=np.array([palette.index(paint) if paint else -1 for paint in paints], np.int32),
    )


def at_random(p: Program, seed: int, element=COARSE) -> Program:
    """Three rows of four in a texture, moved anyhow."""
    rng = np.random.default_rng(seed)
    paints = [Paint(element, STEPS[rng.integers(4)]) if rng.random() < 0.75 else None for _ in p.tokens]
    frames = rng.normal(0, 1, (len(p), 6))
    return dressed(p, [Paint(element, STEPS[seed % 4]), *paints[1:]], frames)


@pytest.mark.parametrize("name", [name for name in SCENES if "small" not in name])
def test_the_loop_draws_the_same(name: str) -> None:
    p = at_random(program(SCENES[name], (23, 18)), [*SCENES].index(name))
    exact = SLOW.picture(p.vectors, p.tokens, p.canvas, p.paints())
    plain = SLOW.picture(p.vectors, p.tokens, p.canvas)
    assert abs(exact - plain).max() > 0.1
    for network in NETWORKS.values():
        everywhere, _ = drawn(network, p, samples="four")
        np.testing.assert_allclose(everywhere, exact, rtol=0, atol=EQUAL)
        some, _ = drawn(network, p)
        np.testing.assert_allclose(some, exact, rtol=0, atol=BLENDED if 1 in p.tokens else EQUAL)


def test_inside_an_object_too_a_pixel_is_the_mean_of_four_lookups(network) -> None:
    p = at_random(program("square { scale(3); twirl(0.3); }", (40, 40)), 3, FINE)
    exact = SLOW.picture(p.vectors, p.tokens, p.canvas, p.paints())
    found, drawing = drawn(network, p)
    np.testing.assert_allclose(found, exact, rtol=0, atol=EQUAL)
    assert network.xp is not NUMPY or drawing.refined == 0  # the kernel asked once a pixel
    assert abs(drawn(network, p, samples="one")[0] - exact).max() > 0.1


def test_a_narrow_blend_of_textures_is_sampled_four_times(network) -> None:
    """Where what is mixed changes across a pixel as the textures do, means of either would not do."""
    text = "smooth { square { scale(3); translate(1, 0); } square { scale(3); translate(-1, 0); } }"
    p = at_random(program(text, (16, 16)), 1, FINE)
    exact = SLOW.picture(p.vectors, p.tokens, p.canvas, p.paints())
    np.testing.assert_allclose(drawn(network, p)[0], exact, rtol=0, atol=EQUAL)


def test_rows_without_paint_stay_as_they_are(network) -> None:
    p = program(SCENES["unions"])
    some = dressed(p, [None, Paint(COARSE), None, None])
    assert (drawn(network, some)[0] != drawn(network, p)[0]).any()
    cut = program("subtract { square { scale(0.6); } star { scale(0.3); } }")
    np.testing.assert_array_equal(
        drawn(network, dressed(cut, [None, Paint(COARSE)]))[0], drawn(network, cut)[0]
    )


@pytest.mark.parametrize("number", [1e25, -1e25])
def test_frames_of_textures_that_nobody_can_draw(network, number: float) -> None:
    p = program(SCENES["unions"])
    for at in range(6):
        frames = np.tile([1.0, 0, 0, 0, 1, 0], (4, 1))
        frames[2, at] = number
        with pytest.raises(ProgramError):
            draw(network, dressed(p, [Paint(COARSE)] * 4, frames))
        frames[2, at] = number / 1e8  # beyond what can be seen, and drawn
        assert np.isfinite(drawn(network, dressed(p, [Paint(COARSE)] * 4, frames))[0]).all()
