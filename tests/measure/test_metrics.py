"""Metrics against closed forms, and the sets against what they say of themselves."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from lab.sets.plane import GEOMETRIES, SETS, random_scene
from lab.sets.scenes import interval, sets_of, spread
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.metrics import compare, flip, flip_map, psnr, ssim
from scenelang.language.words import OPERATIONS, TEXTURES

GREY = np.full((32, 48, 3), 0.5, np.float32)


def test_psnr_of_a_constant_error() -> None:
    assert psnr(GREY + 0.1, GREY) == pytest.approx(20.0, abs=1e-4)
    assert psnr(GREY + 0.01, GREY) == pytest.approx(40.0, abs=1e-3)


def test_psnr_of_equal_pictures_is_the_cap() -> None:
    assert psnr(GREY, GREY) == 50.0


def test_ssim_and_flip_of_equal_pictures() -> None:
    assert ssim(GREY, GREY) == pytest.approx(1.0)
    assert flip(GREY, GREY) == 0.0


def test_intervals_hold_the_mean_19_times_in_20() -> None:
    rng = np.random.default_rng(3)
    drawn = [rng.normal(7.0, 2.0, 40).tolist() for _ in range(1000)]
    held = sum(abs(np.mean(values) - 7.0) < interval(values) for values in drawn)
    assert 920 < held < 970
    assert spread([40.0, 42.0], 5) == {"mean": 41.0, "interval": 1.96, "p5": 40.1, "worst": 40.0}
    assert interval([50.0]) == 0.0


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


def test_small_pictures_have_an_ssim() -> None:
    assert math.isfinite(ssim(GREY[:5, :7], GREY[:5, :7]))


def test_every_scene_of_a_set_compiles() -> None:
    for name in SETS:
        rng = np.random.default_rng(0)
        for _ in range(20):
            program = compile_scene(random_scene(rng, SETS[name]))
            assert len(program) <= SETS[name].objects[1] or SETS[name].nest in ("any", "leaves")


def test_sets_of_textures_are_of_models_that_have_some() -> None:
    """One has squares that move and grow, with flips, turns and hues; the other has everything."""
    plain, textured = (sets_of(load_manifest(name)) for name in ("shapes2d-streaming", "shapes2d"))
    assert set(textured) - set(plain) == {"textures2d", "textures2d-mixed"}
    for name, shapes, ops in (
        ("textures2d", {"square"}, {"flip", "rotate", "hue"}),
        ("textures2d-mixed", {*GEOMETRIES}, {*OPERATIONS}),
    ):
        made = [textured[name](np.random.default_rng(index)) for index in range(60)]
        words = {*re.findall(r'"(?:geometry|name|kind)": ?"(\w+)"', "".join(s.to_json() for s in made))}
        assert words & {*GEOMETRIES} == shapes
        assert words & {*OPERATIONS} >= ops
        assert words >= {*TEXTURES}


def test_a_set_is_the_same_every_time() -> None:
    a, b = (random_scene(np.random.default_rng([3, 1]), SETS["tree"]) for _ in range(2))
    assert a == b
