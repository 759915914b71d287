"""The path tracer: its field is the exact picture's, and its light is what closed forms say.

Slow where numba has to compile it, which it does once for each change.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba")

from lab.light.families import FAMILIES, scene_text
from lab.light.field import World, asked, world_of
from lab.light.measure import scene_of
from lab.light.paths import fluence, irradiance, light, traced_picture
from scenelang import render
from scenelang.drawing.exact.solid import ExactField
from scenelang.drawing.image import from_light
from tests.lab.conftest import run

UP, HERE = np.array([[0.0, 1.0, 0.0]]), np.zeros((1, 3))
EVEN = "sky(1, #fff, #fff); ground(none);"
AWAY = "sphere { translate(0, -50, 0); }"


def world(text: str) -> World:
    return world_of(scene_of(f"nsg 1; {text}")[1])


@pytest.mark.parametrize("family", ["mixed", "mist", "caves", "glossy"])
def test_field_is_the_exact_one(family: str) -> None:
    rng = np.random.default_rng(1)
    for index in range(5):
        _, graph = scene_of(scene_text(family, 3, index))
        points = rng.uniform(-1.4, 1.4, (500, 3))
        d, who, look = asked(world_of(graph), points)
        exact = ExactField(graph.root).at(points.T)
        near, inside = abs(exact.d) < 0.02, exact.d < 0.0
        assert (np.sign(d) == np.sign(exact.d)).all()
        assert np.allclose(d[near], exact.d[near], rtol=0, atol=1e-9)
        assert (who + 1 == exact.owner)[inside].all()
        assert np.allclose(look[inside, :3], np.broadcast_to(exact.rgb, (3, 500)).T[inside], atol=1e-9)


def test_sky_over_an_open_plane() -> None:
    assert irradiance(world(EVEN + "light(none);" + AWAY), HERE, UP, 1024) == pytest.approx(1.0, abs=1e-9)
    rising = world("sky(1, #000, #fff); ground(none); light(none);" + AWAY)
    # 2 c dc over the cosine c, of clamp(2 c, 0, 1)
    assert irradiance(rising, HERE, UP, 4096) == pytest.approx(1 / 6 + 3 / 4, abs=1e-3)


def test_furnace_neither_gains_nor_loses() -> None:
    seen = light(
        world(EVEN + "light(none); sphere { material diffuse { color(#fff); } }"), HERE + 4 * UP, -UP, 256
    )
    assert seen[0, :3] == pytest.approx(0.98, abs=1e-3)
    hollow = world(
        EVEN + "light(none); sphere { shell(0.2); material diffuse { color(#bcbcbc); glow(#fff); } }"
    )
    albedo = ((188 / 255 + 0.055) / 1.055) ** 2.4
    found = np.mean([light(hollow, HERE, UP, 4096, seed=seed)[0, 0] for seed in range(4)])
    assert found == pytest.approx(1 / (1 - albedo), rel=0.03)


@pytest.mark.parametrize("far", [0.5, 3.0])
def test_what_glows_is_met_by_chance_and_asked_once(far: float) -> None:
    """A ball of radius a and radiance 1 at a distance d sends (a / d)² to a level point below."""
    lit = world(f"""sky(0); light(none); ground(0, #fff); sphere {{ scale(0.3); translate(0, {far}, 0);
        material diffuse {{ color(#000); glow(#fff); }} }} sphere {{ translate(0, -50, 0); }}""")
    seen = light(lit, HERE + 0.1 * UP + [0.0, 0.0, 1e-9], -UP, 8192)[0, 0]
    assert seen == pytest.approx(0.98 * (0.3 / far) ** 2, rel=0.01)


@pytest.mark.parametrize("radius", [0.0, 0.5])
def test_lamps_over_a_plane_and_in_a_point(radius: float) -> None:
    lit = world(f"sky(0); ground(none); light([1, 2, 0.5], 7, #fff, {radius});" + AWAY)
    r2 = 5.25
    assert irradiance(lit, HERE, UP, 256)[0] == pytest.approx(7 * 2 / r2**1.5, rel=2e-4)
    cap = 1 - math.sqrt(1 - radius**2 / r2) if radius else 0.0
    everywhere = 7 * cap / (2 * radius**2) if radius else 7 / (4 * r2)
    assert fluence(lit, HERE, 256)[0] == pytest.approx(everywhere, rel=1e-6)
    assert (irradiance(lit, HERE, UP, 16, lamps=False) == 0.0).all()


def test_mist_lets_through_what_its_depth_says() -> None:
    lit = "light([0, 0, 0], 4, #fff); sky(0); ground(none);"
    mist = world(lit + "sphere { scale(0.5); material volumetric { color(#000); density(4); } }")
    assert fluence(mist, HERE + 2 * UP, 16)[0] == pytest.approx(math.exp(-2) / 4, rel=1e-3)
    through = light(
        world(EVEN + "light(none); sphere { scale(0.5); material volumetric { color(#000); } }"),
        3 * UP,
        -UP,
        8192,
    )
    assert through[0, 0] == pytest.approx(math.exp(-3), rel=0.02)


def test_each_medium_has_its_own_density() -> None:
    """The later one's holds where two overlap."""
    ball = "sphere {{ scale(0.5); translate(0, {}, 0); material volumetric {{ color(#000); density({}); }} }}"
    first, second = ball.format(-0.2, 1), ball.format(0.2, 3)
    through = light(world(EVEN + "light(none);" + first + second), 3 * UP, -UP, 16384)
    assert through[0, 0] == pytest.approx(math.exp(-0.4 - 3), rel=0.03)


def test_lamps_in_mist_by_angle_and_by_chance() -> None:
    """Points by the angle at a lamp change the noise alone."""
    ball = "sphere { scale(0.8); material volumetric { color([0.8, 0.5, 0.9]); density(4); } }"
    _, graph = scene_of(
        f"nsg 1; canvas(8, 8); sky(0.1); ground(none); light([0.1, 0, 0], 2, #fff, 0.2); {ball}"
    )
    assert graph.stage is not None
    means = []
    for near in (1.0, 0.0):
        lit = world_of(graph)
        lit.lamps[:, 7] = near
        means.append(
            traced_picture(lit, graph.stage, (8, 8), per_side=1, paths=2048, batch=512).mean[:3].mean()
        )
    assert means[0] == pytest.approx(means[1], rel=0.02)


@pytest.mark.parametrize("radius", [0.05, 0.165])
def test_mist_around_a_lamp_is_drawn_as_bright_as_it_is(radius: float) -> None:
    lit = f"sky(0.001); ground(none); light([0, 0, 0], 0.5, #fff, {radius}); camera(fov = 20deg);"
    mist = "sphere { scale(0.9); material volumetric { color([0.9, 0.9, 0.9]); density(3.4); } }"
    program, graph = scene_of(f"nsg 1; canvas(12, 12); {lit} {mist}")
    assert graph.stage is not None
    traced = traced_picture(world_of(graph), graph.stage, (12, 12), paths=1024, batch=256)
    exact = np.asarray(from_light(traced.mean, False))
    assert abs(np.asarray(render(program)) - exact).mean() < 0.012


def test_points_that_send_light_change_no_mean() -> None:
    """A lamp within a cut shell, mist that a solid sticks in, and what mirrors, with and without points."""
    look = "material diffuse { color([0.9, 0.8, 0.7]); }"
    _, graph = scene_of(
        f"""nsg 1; light([0, 0.3, 0], 2, #fff, 0.1); sky(0.2);
        subtract {{ sphere {{ shell(0.2); }} box {{ scale(0.6); translate(0.5, 0.3, 0.6); }} {look} }}
        sphere {{ scale(0.6); translate(0.9, 0.5, 0.9); material volumetric {{ density(3); }} }}
        box {{ scale(0.4); translate(1.0, 0.2, 0.9); {look} }}
        sphere {{ scale(0.4); translate(-0.9, -0.4, 0.9); material glossy {{ roughness(0.3); }} }}"""
    )
    assert graph.stage is not None
    for seed in range(1):
        plain, points = (
            traced_picture(
                world_of(graph), graph.stage, (12, 12), paths=4096, batch=512, points=on, seed=seed
            )
            for on in (False, True)
        )
        spread = np.hypot(plain.error, points.error)[:3] + 1e-4
        assert abs((points.mean - plain.mean)[:3] / spread).mean() < 1.2
        assert abs(points.mean[:3].mean() / plain.mean[:3].mean() - 1.0) < 0.01
        assert points.decibels > plain.decibels


def test_every_family_is_drawn_and_measured(tmp_path: Path) -> None:
    how = f"--scenes 1 --size 16 --paths 8 --cache {tmp_path} -o {tmp_path}"
    assert run("light", *FAMILIES, "--trace", *how.split()).exit_code == 0
    assert len(list(tmp_path.glob("*.npz"))) == len(FAMILIES)
    assert run("light", "soft", *how.split()).exit_code == 0
    record = json.loads((tmp_path / "light-soft.json").read_text())
    assert record["scenes"][0]["psnr"] == record["mean_psnr"] == pytest.approx(record["psnr_5"], abs=0.01)
