"""Metrics against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scenelang.drawing.metrics import GAP, TEXT, compare, flip, flip_map, psnr, side_by_side, ssim

GREY = np.full((32, 48, 3), 0.5, np.float32)


def test_a_constant_error_and_none() -> None:
    assert psnr(GREY + 0.1, GREY) == pytest.approx(20.0, abs=1e-4)
    assert psnr(GREY + 0.01, GREY) == pytest.approx(40.0, abs=1e-3)
    assert (psnr(GREY, GREY), flip(GREY, GREY)) == (50.0, 0.0)
    assert ssim(GREY, GREY) == pytest.approx(1.0)
    assert math.isfinite(ssim(GREY[:5, :7], GREY[:5, :7]))


def test_alpha_is_put_over_white_and_sizes_are_compared() -> None:
    clear = np.concatenate([GREY, np.full((32, 48, 1), 0.5, np.float32)], axis=2)
    assert compare(clear, GREY * 0.5 + 0.5) == pytest.approx({"psnr": 50.0, "ssim": 1.0, "flip": 0.0})
    with pytest.raises(ValueError, match="48 × 32 and 32 × 48 pixels"):
        compare(GREY, GREY.swapaxes(0, 1))


def test_ssim_of_two_constants_is_the_luminance_term() -> None:
    a, b, c1 = 0.5, 0.6, 0.01**2
    want = (2 * a * b + c1) / (a * a + b * b + c1)
    assert ssim(GREY + 0.1, GREY) == pytest.approx(want, abs=1e-4)


def test_flip_map_is_where_the_error_is() -> None:
    spoilt = GREY.copy()
    spoilt[:, 40:] = 1.0
    error = flip_map(spoilt, GREY)
    assert error.shape == (32, 48)
    assert error[:, 44:].mean() > 0.1 > 10 * error[:, :20].mean()


@pytest.mark.parametrize("side", [64, 128])
def test_names_stand_above_their_own_pictures(side: int) -> None:
    grey = np.full((side, side, 3), 0.5, np.float32)
    small = np.full((8, 8, 3), 0.5)
    sheet = (np.asarray(side_by_side(small, small, "PSNR 50.00 dB  SSIM 1.0000")) < 0.3).any(-1)
    inked = sheet[TEXT : 2 * TEXT].any(0)  # gaps of three columns at least are between captions alone
    assert len("".join("#" if ink else " " for ink in inked).strip().split("   ")) >= 3
    assert not sheet[:TEXT, -3:].any()  # nor is the label cut
    row = side_by_side(grey, grey, "#12 34.5 dB")
    names = row[-side - TEXT : -side].min(axis=(0, 2))
    for column in (1, 2):
        assert names[column * (side + GAP) - GAP :][:GAP].min() == 1.0
