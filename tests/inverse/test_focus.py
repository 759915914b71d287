"""Targets out of focus, whose blur is found with the values."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

import scenelang
from scenelang.diagnostics.span import SourceFile
from scenelang.image import decoded, encoded
from scenelang.inverse.target import blurred

TEXT = """
canvas(64, 64); background(#ffffff); param size = 0.3 in 0.2..0.8;
square { scale(size); rotate(20deg); translate(0.1, -0.1); material flat { color(#202080); } }
"""


@pytest.mark.parametrize(("sigma", "finer"), [(0.7, 1), (2.3, 1), (1.1, 2), (0.0, 2)])
def test_light_goes_through_a_gaussian_and_to_larger_pixels(sigma: float, finer: int) -> None:
    """As scipy has it."""
    picture = np.random.default_rng(1).random((12, 16, 3))
    light = decoded(picture)
    if sigma:
        radius = int(np.ceil(3 * sigma * finer))
        light = ndimage.gaussian_filter(light, sigma * finer, mode="nearest", axes=(0, 1), radius=radius)
    means = ndimage.uniform_filter(light, (finer, finer, 1), origin=(-(finer > 1), -(finer > 1), 0))
    expected = encoded(means[::finer, ::finer])
    np.testing.assert_allclose(blurred(picture, sigma, finer), expected, atol=1e-9)


def test_a_blur_is_found_with_the_size_that_would_make_up_for_it() -> None:
    """The target is of eight times as many pixels along each side, blurred in light and averaged."""
    sharp = scenelang.loads(TEXT.replace("64, 64", "512, 512"), params={"size": 0.5})
    light = ndimage.gaussian_filter(decoded(np.asarray(scenelang.render(sharp), float)), (9.6, 9.6, 0))
    target = encoded(light.reshape(64, 8, 64, 8, 3).mean((1, 3)))
    found = scenelang.fit(SourceFile("a.nsg", TEXT), target)
    assert found.blur == pytest.approx(1.2, abs=0.05)
    assert found.blurred_psnr > 45 > found.psnr
    assert float(found.values["size"]) == pytest.approx(0.5, abs=0.003)
    assert any("out of focus: blurred by 1.2" in line for line in found.told())


def test_a_target_in_focus_has_no_blur() -> None:
    found = scenelang.fit(
        SourceFile("a.nsg", TEXT), scenelang.render(scenelang.loads(TEXT, params={"size": 0.6}))
    )
    assert (found.blur, found.blurred_psnr) == (0.0, found.psnr)
