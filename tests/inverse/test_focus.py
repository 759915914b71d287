"""Targets out of focus, whose blur is found with the values."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

import scenelang
from scenelang.drawing.image import decoded, encoded
from scenelang.inverse.search import Blur, blurred
from scenelang.language.diagnostics import SourceFile

TEXT = """
canvas(64, 64); background(#ffffff); param size = 0.3 in 0.2..0.8;
square { scale(size); rotate(20deg); translate(0.1, -0.1); material flat { color(#202080); } }
"""


@pytest.mark.parametrize(("sigma", "finer"), [(0.7, 1), (2.3, 1), (1.1, 2), (0.0, 2)])
@pytest.mark.parametrize("light", [True, False])
def test_a_picture_goes_through_a_gaussian_and_to_larger_pixels(
    sigma: float, finer: int, light: bool
) -> None:
    """As scipy has it."""
    picture = np.random.default_rng(1).random((12, 16, 3))
    found = decoded(picture) if light else picture
    if sigma:
        radius = int(np.ceil(3 * sigma * finer))
        found = ndimage.gaussian_filter(found, sigma * finer, mode="nearest", axes=(0, 1), radius=radius)
    means = ndimage.uniform_filter(found, (finer, finer, 1), origin=(-(finer > 1), -(finer > 1), 0))
    expected = means[::finer, ::finer]
    np.testing.assert_allclose(
        blurred(picture, Blur(sigma, light), finer), encoded(expected) if light else expected, atol=1e-9
    )


def test_a_blur_is_found_with_the_size_that_would_make_up_for_it() -> None:
    """The target is of eight times as many pixels along each side, blurred in light or not, and averaged."""
    for light in (True, False):
        sharp = scenelang.loads(TEXT.replace("64, 64", "512, 512"), params={"size": 0.5})
        seen = np.asarray(scenelang.render(sharp), float)
        soft = ndimage.gaussian_filter(decoded(seen) if light else seen, (9.6, 9.6, 0))
        mean = soft.reshape(64, 8, 64, 8, 3).mean((1, 3))
        found = scenelang.fit(SourceFile("a.nsg", TEXT), encoded(mean) if light else mean)
        assert found.blur.sigma == pytest.approx(1.2, abs=0.05)
        assert found.blur.light == light
        assert found.blurred_psnr > 45 > found.psnr
        assert float(found.values["size"]) == pytest.approx(0.5, abs=0.003)
        assert any("after a blur of 1.2" in line for line in found.told())


def test_a_target_in_focus_has_no_blur() -> None:
    target = scenelang.render(scenelang.loads(TEXT, params={"size": 0.6}))
    found = scenelang.fit(SourceFile("a.nsg", TEXT), target)
    assert (found.blur.sigma, found.blurred_psnr) == (0.0, found.psnr)
