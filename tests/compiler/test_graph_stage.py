"""The stage's values: the camera's axes, what has no picture, and colours read as linear."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from scenelang.compiler import spaces
from scenelang.compiler.spaces import Camera, Ground, Light, Stage, decoded


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


def test_constants_are_those_of_the_language() -> None:
    """Other tests draw with whatever they are."""
    camera, light = Camera((0, 1.2, 6), (0, 0, 0), math.radians(36.8699)), Light((2.5, 4, 3), 28, (1, 1, 1))
    written = Stage(camera, light, Ground(-1, (0.50, 0.48, 0.45)), (0.80, 0.86, 0.92), (0.30, 0.50, 0.85))
    assert Stage() == replace(written, camera=replace(camera, fov_rad=Camera().fov_rad))
    assert Camera().fov_rad == pytest.approx(camera.fov_rad, abs=1e-6)
    assert (spaces.AMBIENT, spaces.EXTINCTION, spaces.FADE) == ((0.12, 0.06), 3, 64)
    assert (spaces.NEAREST, spaces.LIFT) == (1e-3, 1e-4)
