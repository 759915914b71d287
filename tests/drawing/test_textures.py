"""Exact colours of textures, against a loop over points written after the language's definition."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.assets.picture import painted as of_texels
from scenelang.compiler.graph import ColourStep, Look
from scenelang.compiler.program import Paint
from scenelang.compiler.steps import Affine, composed
from scenelang.drawing.exact.field import carry_back, colour_at
from tests.assets.shapes import noise
from tests.drawing.slow import painted

STEPS: list[tuple[ColourStep, ...]] = [
    (),
    (("color", 0.5, 2.0, 0.9), ("hue", 0.3)),
    (("hue", -1.7), ("grayscale", 0.4), ("color", 0.2, 1.0, 1.0), ("hue", 0.05)),
    (("grayscale", 1.0), ("hue", 0.5)),
]


@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize("light", [False, True])
@pytest.mark.parametrize("sides", [(5, 7), (1, 3), (4, 4, 4)])
def test_colours_are_those_of_a_loop(
    sides: tuple[int, ...], light: bool, steps: tuple[ColourStep, ...]
) -> None:
    rng = np.random.default_rng(3)
    flat = len(sides) == 2
    matrix = np.eye(4)
    matrix[:2, [0, 1, 3]] = rng.normal(size=(2, 3))
    moves = (Affine((2.0, 0, 0, 0.3, 0, -0.5, 0, 0, 0, 0, 1, 0)), Affine(tuple(matrix[:3].reshape(-1))))
    element = noise(*sides)
    look = Look("flat", steps, element=element, texture=moves if flat else ())
    points = rng.uniform(-3, 3, (60, 2 if flat else 3))
    found = colour_at(look, carry_back(look.texture, points.T), light)
    back = np.linalg.inv(np.vstack([np.reshape(composed(look.texture), (3, 4)), (0, 0, 0, 1)]))
    frame = back[:2, [0, 1, 3]].reshape(-1)
    expected = painted(Paint(element, steps), frame, points, light=light)
    np.testing.assert_allclose(found, expected, atol=2e-7)


def test_hues_of_grey_and_of_pure_colours() -> None:
    """A third of a turn makes red green and yellow cyan; grey has no hue."""
    colours = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [128] * 3, [255] * 3, [0] * 3, [255, 255, 0]])
    expected = np.array([[0, 255, 0], [0, 0, 255], [255, 0, 0], [128] * 3, [255] * 3, [0] * 3, [0, 255, 255]])
    row = of_texels("row", colours[None].astype(np.uint8))
    look = Look("flat", (("hue", 1 / 3),), element=row)
    middles = (np.arange(7) + 0.5) / 7 * 2 - 1
    np.testing.assert_allclose(colour_at(look, (middles, 0 * middles)), expected / 255, atol=1e-12)
