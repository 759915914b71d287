"""Light in media, against closed forms and the reference."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from scenelang.compiler.spaces import Camera, Light, Stage
from scenelang.drawing.exact.solid import solid_image
from scenelang.drawing.solid.draw import draw_solids
from scenelang.drawing.solid.march import march
from tests.drawing.solids import Object, field, graph, moved, psnr, scaled, turned


def test_a_medium_lets_through_what_its_length_says() -> None:
    """Straight through the middle, lit by nothing: what is behind times the transmittance, plus ambient."""
    stage = Stage(light=Light(power=0.0), ground=None, horizon=(0.5, 0.5, 0.5), zenith=(0.5, 0.5, 0.5))
    solids = field([Object("sphere", (scaled(0.5, 0.5, 0.5),), "volumetric", (1.0, 1.0, 1.0))])
    image, *_ = draw_solids(solids, stage, (65, 65), samples="four")
    clear = np.exp(-3 * 1.0)
    linear = 0.5 * clear + 0.12 * (1 - clear)
    assert image[32, 32] == pytest.approx(1.055 * linear ** (1 / 2.4) - 0.055, abs=2e-3)
    alpha, *_ = draw_solids(solids, Stage(light=Light(power=0.0), ground=None, transparent=True), (65, 65))
    assert alpha[32, 32, 3] == pytest.approx(1 - clear, abs=1e-3)
    assert alpha[0, 0, 3] == 0


@pytest.mark.parametrize(
    ("radius", "away", "power"), [(0.5, 3.0, 40.0), (1.0, 2.0, 300.0), (1.4, 3.0, 1500.0)]
)
def test_a_medium_glows_where_the_light_is_behind_it(radius: float, away: float, power: float) -> None:
    """Along the axis: the deeper a point lies, the more light arrives and the less of it gets out."""
    camera, dark = Camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0)), (0.0, 0.0, 0.0)
    light = Light((0.0, 0.0, -away), power)
    stage = Stage(camera=camera, light=light, ground=None, horizon=dark, zenith=dark)
    step = scaled(radius, radius, radius)
    image, *_ = draw_solids(
        field([Object("sphere", (step,), "volumetric", (1.0, 1.0, 1.0))]), stage, (65, 65)
    )
    z = np.linspace(-radius, radius, 20_001)
    arrived, left = np.exp(-3 * (z + radius)), np.exp(-3 * (radius - z))
    sent = 2 * radius * np.mean(3 * left * (power / (4 * (z + away) ** 2) * arrived + 0.12))
    linear = ((image[32, 32] + 0.055) / 1.055) ** 2.4
    assert linear == pytest.approx(sent, rel=0.02)


@pytest.mark.parametrize(
    ("other", "least"),
    [
        (Object("torus", (scaled(0.9, 0.9, 0.9), moved(0, 0, -0.4)), "volumetric", (0, 0.1, 0.9)), 57),
        (Object("sphere", (scaled(0.5, 0.9, 0.5), moved(0.5, 0.2, 0)), "volumetric", (0, 0.1, 0.9)), 57),
        (Object("torus", (scaled(0.6, 0.6, 0.6), turned(0.7), moved(0.9, 1.2, 0.9))), 52.5),
    ],
)  # fmt: skip
def test_colours_and_shadows_change_within_media(other: Object, least: float) -> None:
    """A later medium in another, and a shadow that falls into one: three nodes a ray do not tell where."""
    objects = [Object("sphere", (scaled(0.9, 0.9, 0.9),), "volumetric", (0.9, 0.5, 0.1)), other]
    exact = solid_image(graph(objects), Stage(), (40, 40))
    assert psnr(draw_solids(field(objects), Stage(), (40, 40))[0], exact) > least


def test_what_is_cut_out_of_a_medium_is_not_in_it() -> None:
    """Ways in a ball that two others cut, from outside and from inside it, against intervals."""
    cuts = [((-0.2, 0.0, 0.3), 0.6), ((0.3, 0.0, -0.2), 0.5)]
    ball = Object("sphere", (scaled(1, 1, 1),), "volumetric")
    holes = [Object("sphere", (scaled(r, r, r), moved(*c)), token="subtract") for c, r in cuts]
    solids = field([ball, *holes])
    for eye in ([0.0, 0.5, 5.0], [0.0, 0.95, 0.0]):
        origin = np.array(eye, np.float32)
        way = np.random.default_rng(1).normal(0, 0.4, (3, 400)).astype(np.float32) - origin[:, None]
        way /= np.linalg.norm(way, axis=0)
        trail = march(solids, origin, way, np.full(400, 9.0, np.float32))
        t = np.linspace(0, 7, 7001)
        inside = _within(origin, way, (0, 0, 0), 1.0, t)
        for centre, radius in cuts:
            inside &= ~_within(origin, way, centre, radius, t)
        assert trail.length == pytest.approx(inside.sum(1) * 1e-3, abs=0.02)  # ends to within 0.009


def _within(
    origin: np.ndarray, way: np.ndarray, centre: Sequence[float], radius: float, t: np.ndarray
) -> np.ndarray:
    """Whether points of rays are in a ball, (M, len(t))."""
    to = np.array(centre) - origin
    along = to @ way
    half = np.sqrt(np.maximum(radius**2 - (to @ to - along**2), 0))
    return abs(t - along[:, None]) < half[:, None]
