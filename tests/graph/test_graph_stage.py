"""The stage's values: the camera's axes, what has no picture, and colours read as linear."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scenelang.graph.stage import Camera, Light, decoded


@pytest.mark.parametrize(
    ("eye", "right", "up"),
    [
        ((0, 0, 6), (1, 0, 0), (0, 1, 0)),
        ((6, 0, 0), (0, 0, -1), (0, 1, 0)),
        ((0, 5, 0), (1, 0, 0), (0, 0, -1)),
        ((0, -5, 0), (-1, 0, 0), (0, 0, -1)),
        ((3e-16, 5, 0), (1, 0, 0), (0, 0, -1)),
    ],
)
def test_axes_of_the_camera(eye, right, up) -> None:
    forward, *found = Camera(eye=eye).axes()
    np.testing.assert_allclose(found, (right, up), atol=1e-12)
    np.testing.assert_allclose(np.cross(found[0], forward), found[1], atol=1e-12)


def test_axes_are_orthonormal_wherever_the_camera_stands() -> None:
    for eye in np.random.default_rng(1).normal(size=(50, 3)).tolist():
        axes = np.array(Camera(eye=tuple(eye), target=(0.1, -0.2, 0.3)).axes())
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert axes[2, 1] > 0  # up is up


@pytest.mark.parametrize(
    ("value", "fault"),
    [
        (Camera(), None),
        (Camera(eye=(1, 2, 3), target=(1, 2, 3)), "the eye is the target"),
        (Camera(fov_rad=0.0), "a field of view of 0° is not between 0° and 180°"),
        (Camera(fov_rad=math.radians(180)), "a field of view of 180° is not between 0° and 180°"),
        (Camera(fov_rad=math.nan), "a field of view of nan° is not between 0° and 180°"),
        (Light(power=0.0), None),
        (Light(power=-2.0), "a power of -2 is negative"),
    ],
)
def test_faults(value, fault) -> None:
    assert value.fault() == fault


def test_colours_are_decoded_from_srgb() -> None:
    # 188/255 is the 8-bit value nearest to half of the light.
    assert decoded((0.0, 188 / 255, 1.0)) == pytest.approx((0.0, 0.5029, 1.0), abs=1e-4)
    assert decoded((0.04, 0.0404, 0.0405))[0] == pytest.approx(0.04 / 12.92)
