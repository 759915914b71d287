"""Light that media scatter, against an integral equation in float64 and states of balance."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.special import exp1

import scenelang as nsg
from scenelang.compiler.spaces import Ground, Light, Sky, Stage
from scenelang.drawing.small import draw_small
from scenelang.drawing.solid import draw
from scenelang.drawing.solid.draw import Lighting
from scenelang.drawing.solid.march import Pieces
from scenelang.drawing.solid.mist import Mist, _aside
from tests.drawing.solids import Object, everywhere, moved, scaled
from tests.drawing.test_lamps import field_of

WHITE = (1.0, 1.0, 1.0)
EVEN = Stage(lights=(), ground=None, sky=Sky(1.0, WHITE, WHITE))  # the same from everywhere
GREY = (0.9, 0.7, 0.4)


@pytest.mark.parametrize(("r", "radius", "sigma"), [(0.5, 0.25, 4.8), (0.3, 0.25, 2.0), (2.0, 0.1, 1.0)])
def test_a_soft_lamp_in_a_medium_arrives_by_all_of_its_disc(r: float, radius: float, sigma: float) -> None:
    """Along its rim the way is longer; by a million directions."""
    cos = np.linspace((1 - (radius / r) ** 2) ** 0.5, 1, 1_000_001)
    way = r * cos - np.sqrt((radius**2 - r * r * (1 - cos * cos)).clip(0))
    nearest = np.exp(-sigma * (r - radius))
    found = nearest * _aside(np.array([r]), radius, np.array([nearest]))[0]
    assert found == pytest.approx(np.exp(-sigma * way).mean(), rel=0.01)


def in_a_ball(sigma: float, albedo: float, r: np.ndarray, cells: int = 400) -> np.ndarray:
    """J at distances r from the centre of a ball of radius 1 under an even sky of 1.

    r J(r) = U(r) r + (albedo sigma / 2) ∫ E1(sigma |r - s|) s J(s) ds over [-1, 1], the equation of a slab.
    """
    edges = np.linspace(-1, 1, cells + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    mu, weight = np.polynomial.legendre.leggauss(64)

    def alone(r: np.ndarray) -> np.ndarray:
        to_rim = -r[:, None] * mu + np.sqrt(1 - r[:, None] ** 2 * (1 - mu * mu))
        return np.exp(-sigma * to_rim) @ weight / 2

    def integral(x: np.ndarray) -> np.ndarray:  # of E1 from 0
        x = np.maximum(x, 1e-300)
        return 1 - np.exp(-x) + x * exp1(x)

    def kernel(r: np.ndarray) -> np.ndarray:  # integrals of E1 over cells
        ends = np.sign(edges - r[:, None]) * integral(sigma * abs(edges - r[:, None]))
        return np.diff(ends, axis=1) * albedo / 2

    known = np.linalg.solve(np.eye(cells) - kernel(middle), alone(abs(middle)) * middle)
    return (alone(r) * r + kernel(r) @ known) / r


@pytest.mark.parametrize(("sigma", "most"), [(0.5, 0.02), (3.0, 0.05), (12.0, 0.25)])
def test_balls_under_an_even_sky_solve_the_integral_equation(sigma, most):
    mist = Mist(field_of([Object("sphere", (), "volumetric", GREY)], density=(sigma,)), EVEN)
    r = np.linspace(0.1, 0.99, 30)
    p = np.outer(np.array([0.36, 0.48, 0.8]), r).astype(np.float32)
    exact = np.array([in_a_ball(sigma, a, r) for a in GREY])
    seen = np.exp(-sigma * (1 - r))  # what is deep inside tells little
    off = abs(mist.medium(p) / exact - 1) * seen
    assert off.max() < most


def test_a_lamp_in_the_middle_of_a_ball_of_mist_is_no_star():
    """Scattered light is the same in all directions."""
    lit = Stage(lights=(Light((0.0, 0.0, 0.0), 1.0, radius=0.1),), ground=None, sky=Sky(0.0, WHITE, WHITE))
    mist = Mist(field_of([Object("sphere", (), "volumetric", (0.9, 0.9, 0.9))], density=(3.0,)), lit)
    mist.relight()
    way = np.random.default_rng(2).normal(size=(3, 500))
    for r, most in ((0.5, 0.03), (0.7, 0.06)):  # along 14 ways 0.06 and 0.11
        light = mist.medium((r * way / np.linalg.norm(way, axis=0)).astype(np.float32))[0]
        assert light.std() < most * light.mean()


def test_what_glows_in_the_middle_of_a_ball_of_mist_is_less_of_a_star():
    """Its light goes along as many ways as that of a lamp."""
    core = Object("sphere", (scaled(0.25),), rgb=(0.0, 0.0, 0.0))
    mist = Object("sphere", (), "volumetric", (0.9, 0.9, 0.9))
    solids = field_of([mist, core], density=(3.0, 3.0), glow=((0.0, 0.0, 0.0), (5.0, 5.0, 5.0)))
    found = Mist(solids, Stage(lights=(), ground=None, sky=Sky(0.0, WHITE, WHITE)))
    found.relight()
    way = np.random.default_rng(2).normal(size=(3, 500))
    light = found.medium((0.6 * way / np.linalg.norm(way, axis=0)).astype(np.float32))[0]
    assert light.std() < 0.07 * light.mean()  # along 14 ways 0.12


def test_a_ball_within_mist_sends_a_lamps_light_back():
    """Light on it is power cos / r², less what mist takes on the way."""
    lit = Stage(lights=(Light((0.0, 0.0, 0.8), 2.0, radius=0.05),), ground=None, sky=Sky(0.0, WHITE, WHITE))
    solid = Object("sphere", (scaled(0.4),), rgb=GREY)
    mist = Mist(field_of([Object("sphere", (), "volumetric", GREY), solid], density=(2.0, 2.0)), lit)
    out = np.linalg.norm(mist.p, axis=0)
    way = np.array([0.0, 0.0, 0.8]).reshape(3, 1, 1, 1) - mist.p
    r = np.linalg.norm(way, axis=0)
    cos = (way * mist.p).sum(0) / r / out
    near = ~mist.opaque & (out < 0.4 + mist.h) & (cos > 0.3)
    exact = 2 * cos / r**2 * np.exp(-2 * (r - 0.05))
    assert near.sum() > 15
    assert mist.received[0, near].sum() == pytest.approx(exact[near].sum(), rel=0.1)


def test_what_gives_off_as_much_as_it_takes_is_in_balance():
    objects = [
        Object("box", (scaled(1.1, 0.6, 0.8),), "volumetric", GREY),
        Object("sphere", (scaled(0.6), moved(0.7, 0.2, 0.2)), "volumetric", (0.3, 0.6, 0.95)),
        Object("torus", (scaled(0.5), moved(-0.5, 0.3, 0.0)), "diffuse", (0.2, 0.5, 0.8)),
    ]
    glow = [tuple(1 - c for c in o.rgb) for o in objects]
    field = field_of(objects, density=(2.0, 15.0, 3.0), glow=glow)
    mist = Mist(field, EVEN)
    mist.relight(np.ones_like)
    p = np.random.default_rng(0).uniform(-0.5, 0.5, (3, 200)).astype(np.float32)
    p = p[:, everywhere(field, p).register[-1] > 0.5]
    assert abs(mist.medium(p) - 1).max() < 0.02
    way = p / np.linalg.norm(p, axis=0)
    light, clear = mist.along(3 * way, -way, np.full(len(way.T), 3.0, np.float32))
    assert abs(light + clear - 1).max() < 0.02


def test_light_follows_objects_without_a_jump():
    stage = Stage(lights=(Light(), Light((0.1, 0.2, 0.1), 0.5)), ground=Ground(), sky=Sky())
    p = np.random.default_rng(0).uniform(-0.4, 0.4, (3, 500)).astype(np.float32)
    seen = []
    for x in np.array([0.3, 0.3001, 0.3002, 0.3003]):
        objects = [
            Object("sphere", (scaled(0.8),), "volumetric", GREY),
            Object("cone", (scaled(0.5), moved(float(x), 0.4, 0.0)), "volumetric", (0.5, 0.9, 0.9)),
            Object("box", (scaled(0.3), moved(float(x), -0.4, 0.5)), "diffuse", (0.5, 0.5, 0.9)),
        ]
        seen.append(Mist(field_of(objects, density=(2.0, 10.0, 3.0)), stage).medium(p))
    assert max(abs(a - b).mean() for a, b in pairwise(seen)) < 5e-4


def test_media_let_through_what_their_depth_says():
    mist = Mist(field_of([Object("sphere", (), "volumetric", GREY)], density=(1.5,)), EVEN)
    p = np.array([[0.0], [0.1], [3.0]], np.float32)
    way = np.array([[0.0], [0.0], [-1.0]], np.float32)
    for reach, inside in ((10.0, 2.0), (3.0, 1.0), (1.5, 0.0)):
        _, clear = mist.along(p, way, np.array([reach], np.float32))
        assert clear[0] == pytest.approx(np.exp(-1.5 * inside * 0.995), rel=0.05)


def test_media_are_lit_few_pieces_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """All pieces of a band at once took 1.1 GB for thirty shells at 512 x 512; parts look the same."""
    shells = "for (i in 0..<9) { torus { shell(0.02); scale(1 + i / 20); material volumetric; } }"
    drawn = nsg.compile(nsg.loads(f"canvas(64, 64); sky(); light([1, 3, 2], 9, #fff, 0.2); {shells}"))
    whole, scattering, most = draw_small(drawn).image, Lighting._scattering, 0

    def scattered(self: Lighting, way: Any, pieces: Pieces, px: float) -> Any:
        nonlocal most
        most = max(most, len(pieces.ray))
        return scattering(self, way, pieces, px)

    monkeypatch.setattr(Lighting, "_scattering", scattered)
    for bound, expected in ((1 << 30, False), (100, True)):
        most = 0
        monkeypatch.setattr(draw, "PIECES", bound)
        assert np.array_equal(draw_small(drawn).image, whole)
        assert (most < 1000) == expected
