"""Surfaces that mirror, against quadratures of the formulas and the scene that is mirrored."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest

from scenelang.compiler.lifting import SOLID_LAYOUT
from scenelang.compiler.spaces import Camera, Light, Sky, Stage
from scenelang.drawing.closed import closed_forms
from scenelang.drawing.solid.around import Around
from scenelang.drawing.solid.draw import Lighting
from scenelang.drawing.solid.field import SolidField
from tests.drawing.solids import Object, moved, network, scaled, vector
from tests.drawing.test_light import reflected

DARK = Sky(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
RGB, EVEN = (0.9, 0.5, 0.2), (0.7, 0.4, 0.9)


def seen(
    objects: list[Object], rough: list[float], stage: Stage, d: Any, net: Any = None, glow: Any = 0.0
) -> np.ndarray:
    """Light (3, M) along unit directions (3, M) from the eye."""
    net = net or closed_forms("solids3d")
    vectors = np.array([vector(o, net) for o in objects], np.float32)
    vectors[:, SOLID_LAYOUT.places.roughness] = rough
    vectors[:, SOLID_LAYOUT.places.glow] = glow
    field = SolidField(net, vectors, np.zeros(len(objects), np.int8))
    lighting = Lighting(field, stage)
    lighting.around = Around(field, stage, lighting.received)
    with field.xp.inference():
        way = field.xp.array(np.asarray(d, np.float32), field.network.codes)
        return np.asarray(field.xp.to_numpy(lighting.shade(way).radiance))


@pytest.mark.parametrize("library", ["closed", "numpy"])
@pytest.mark.parametrize("rough", [0.1, 0.4, 1.0, -0.05, -0.4, -1.0])
def test_lobes(rough: float, library: str) -> None:
    """A ball under an even sky, and by two lamps, each beside and before what it mirrors."""
    net = {"closed": None, "numpy": network()}[library]
    ball, rgb = [Object("sphere", rgb=RGB)], np.array(RGB)
    eye, n = np.array([1.2, 0.0, 6.0]), np.array([0.0, 0.0, 1.0])
    v = (eye - n) / np.linalg.norm(eye - n)
    mirror = np.array([-v[0], 0.0, v[2]])

    def arriving(stage: Stage) -> np.ndarray:
        return seen(ball, [rough], stage, -v[:, None], net)[:, 0]

    def answer(axis: np.ndarray, widest: float) -> np.ndarray:
        """The integral of f cos over a cap of the sphere about an axis, finer about the axis."""
        t = ((np.arange(1000) + 0.5) / 1000)[:, None]
        c, a = 1 - (1 - widest) * t**3, 2 * pi * (np.arange(200) + 0.5) / 200
        x = np.array([axis[2], 0.0, -axis[0]]) / np.hypot(axis[0], axis[2])
        s, y = np.sqrt(1 - c * c), np.cross(axis, x)
        w = (s * np.cos(a))[..., None] * x + (s * np.sin(a))[..., None] * y + (c + 0 * a)[..., None] * axis
        part = ((1 - widest) * 3 * t**2 * 2 * pi / 1000 / 200 + 0 * a).reshape(-1, 1)
        return np.asarray((reflected(rough, rgb, n, v, w.reshape(-1, 3)) * part).sum(0))

    sky = Stage(Camera(tuple(eye)), (), None, sky=Sky(1.0, EVEN, EVEN))
    assert arriving(sky) == pytest.approx(answer(mirror, -1.0) * EVEN, rel=0.03)
    for off in (np.zeros(3), np.array([0.1, 0.05, 0.0]), np.array([0.5, 0.3, 0.0])):
        at = (mirror + off) / np.linalg.norm(mirror + off)
        point = replace(sky, lights=(Light(tuple(n + 3 * at), 5.0),), sky=DARK)
        expected = reflected(rough, rgb, n, v, at[None])[0] * pi * 5 / 9
        assert arriving(point) == pytest.approx(expected, rel=0.1, abs=1e-3)
        soft = replace(point, lights=(Light(tuple(n + 3 * at), 5.0, (1.0, 1.0, 1.0), 0.8),))
        expected = answer(at, sqrt(1 - (0.8 / 3) ** 2)) * 5 / 0.8**2
        assert arriving(soft) == pytest.approx(expected, rel=0.05, abs=2e-3)


def test_mirrors_show_what_is_there() -> None:
    """A smooth wall shows a ball that glows where it is mirrored, not beside it, also by a second wall."""
    wall = Object("box", (scaled(3.0, 3.0, 0.5), moved(0.0, 0.0, -0.5)), rgb=(1.0, 1.0, 1.0))
    other = Object("box", (scaled(3.0, 3.0, 0.5), moved(0.0, 0.0, 4.5)), rgb=(1.0, 1.0, 1.0))
    ball = Object("sphere", (scaled(0.3), moved(0.6, 0.0, 1.5)), rgb=(0.0, 0.0, 0.0))
    eye, glow = np.array([-0.6, 0.4, 3.0]), (2.0, 1.0, 0.5)
    stage = Stage(Camera(tuple(eye)), (), None, sky=DARK)
    # behind the wall, beside that, and behind the wall and its image of the other one
    to = np.array([(0.6, 0.0, -1.5), (1.5, 0.0, -1.5), (0.6, 0.0, -6.5)]) - eye
    d = (to / np.linalg.norm(to, axis=1)[:, None]).T
    light = seen(
        [wall, ball, other], [-0.05, 0.0, -0.05], stage, d, network(), [(0.0,) * 3, glow, (0.0,) * 3]
    )
    assert light[:, 0] == pytest.approx(glow, rel=0.03)
    assert light[:, 1].max() < 0.03
    assert light[:, 2] == pytest.approx(glow, rel=0.05)
