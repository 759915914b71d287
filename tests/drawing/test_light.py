"""The exact picture of solids by lamps of a radius and under a sky, against closed forms and quadrature."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from math import acos, asin, cos, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest

from scenelang.compiler.graph import Fold, Leaf, Look
from scenelang.compiler.spaces import Camera, Ground, Light, Sky, Stage
from scenelang.compiler.steps import Displace, Shell, Step, Twist
from scenelang.drawing.exact import picture, solid
from scenelang.drawing.exact.solid import ExactField, radiance, ways
from scenelang.drawing.image import Image
from tests.drawing.solids import fold, leaf, moved, scaled, turned

NOTHING = Fold("scene", ())
DARK = (0.0, 0.0, 0.0)


def look(geometry: str, material: str, rgb: Any, *steps: Step, **own: Any) -> Leaf:
    """An object that glows, or is dense or glossy."""
    made = leaf(geometry, material, rgb, *steps)
    return made.changed(Look(material, rgb=rgb, **own), made.moves)


def found(root: Fold, stage: Stage, d: np.ndarray, paths: int) -> tuple[np.ndarray, np.ndarray]:
    """Light (3, M) along ways (3, M) under the stage's sky, and its standard errors."""
    random, field, count = np.random.default_rng(3), ExactField(root), d.shape[1]
    many = np.repeat(d, paths, 1)
    even = (random.random((picture._NUMBERS, 1)) + np.arange(many.shape[1]) * picture._EVEN) % 1.0
    out = picture.paths_light(field, stage, many, random, even)[:3].reshape(3, count, paths)
    return out.mean(2), out.std(2) / sqrt(paths)


def straight(stage: Stage, count: int = 1) -> np.ndarray:
    """Ways of a picture of so many pixels a side."""
    return np.asarray(ways(stage, (count, count), range(count), 1))


def test_solids_in_media_lose_no_light() -> None:
    """A ball in a ball of mist, both of which send what they swallow of an even light."""
    root = fold(
        look("sphere", "volumetric", (0.9,) * 3, scaled(0.9), glow=(0.1,) * 3, density=4.0),
        look("sphere", "diffuse", (0.8,) * 3, scaled(0.6), glow=(0.2,) * 3),
    )
    stage = Stage(ground=None, lights=(), sky=Sky(1.0, (1.0,) * 3, (1.0,) * 3))
    light, error = found(root, stage, np.array([[0.0], [-0.2], [-1.0]]) / sqrt(1.04), 2000)
    assert abs(light - 1.0).max() < max(4.0 * float(error.max()), 5e-3)


def test_equilibrium() -> None:
    """Where everything sends what it swallows of an even light, that light is all that there is to see."""
    even = np.array([0.8, 0.5, 0.9])

    def warm(geometry: str, material: str, rgb: tuple[float, ...], *steps: Step, **own: Any) -> Leaf:
        return look(geometry, material, rgb, *steps, glow=tuple((1.0 - np.array(rgb)) * even), **own)

    root = fold(
        warm("sphere", "volumetric", (0.9, 0.2, 0.5), scaled(0.9, 0.7, 0.8), moved(-0.4, 0.1, 0.0)),
        warm("box", "volumetric", (0.5, 0.8, 0.1), turned(0.6), moved(0.3, 0.2, 0.1), density=9.0),
        warm("torus", "diffuse", (0.9, 0.9, 0.3), Displace(0.05, 7.0), scaled(0.8), Twist(0.6), turned(0.7)),
        ("smooth", warm("sphere", "diffuse", (0.1, 0.4, 0.8), scaled(0.4), moved(0.5, 0.5, 0.5)), 0.3),
        ("subtract", warm("sphere", "diffuse", DARK, scaled(0.4), moved(-0.3, 0.0, 0.9)), 0.1),
        warm("sphere", "diffuse", (0.7, 0.7, 0.7), Shell(0.1), scaled(0.3), moved(-0.3, 0.9, 0.2)),
    )
    stage = Stage(ground=None, lights=(), sky=Sky(1.0, tuple(even), tuple(even)))
    mean, error = found(root, replace(stage, horizon=tuple(even), zenith=tuple(even)), straight(stage, 8), 64)
    assert abs(mean - even[:, None]).max() < 1e-9 + 5.0 * error.max()
    assert abs(mean.mean(1) / even - 1.0).max() < 0.01


def test_hollow() -> None:
    """A closed hollow of albedo a that sends e is as bright as e / (1 - a)."""
    root = fold(look("sphere", "diffuse", (0.6, 0.3, 1.0), Shell(0.1), scaled(2.0), glow=(0.2, 0.5, 0.01)))
    stage = Stage(Camera((0.3, 0.2, 0.1)), (), None, sky=Sky())
    mean, error = found(root, stage, straight(stage, 3), 64)
    expected = np.array([0.2 / 0.4, 0.5 / 0.7, 0.01 / 0.02])  # of white 0.98 counts
    assert abs(mean.mean(1) / expected - 1.0).max() < 0.04
    assert error.max() < 0.1


def test_ground_under_sky() -> None:
    """The ground receives horizon + 11/12 (zenith - horizon) of the sky, times its power."""
    sky = Sky(0.4, (0.9, 0.5, 0.1), (0.2, 0.6, 1.0))
    lamp = Light((1.0, 2.0, 1.0), 6.0, (1.0, 0.5, 0.2), 0.7)
    stage = Stage(lights=(lamp,), sky=sky)
    d = straight(stage, 9)[:, 60:]
    mean, error = found(NOTHING, stage, d, 512)
    p = np.reshape(stage.camera.eye, (3, 1)) - d * (2.2 / d[1])
    way = np.reshape(lamp.position, (3, 1)) - p
    direct = lamp.power * way[1] / (way * way).sum(0) ** 1.5
    horizon, zenith = (np.reshape(c, (3, 1)) for c in (sky.horizon, sky.zenith))
    received = sky.power * (horizon + 11.0 / 12.0 * (zenith - horizon))
    received = received + np.reshape(lamp.rgb, (3, 1)) * direct
    clear = np.exp(-(p[0] ** 2 + p[2] ** 2) / 64.0)
    seen = clear * np.array([[0.5], [0.48], [0.45]]) * received
    seen += (1.0 - clear) * np.reshape(stage.horizon, (3, 1))
    assert (abs(mean - seen) < 1e-4 + 5.0 * error).all()
    assert abs((mean / seen).mean() - 1.0) < 0.003


@pytest.mark.parametrize(("away", "angle"), [(3.0, 0.4), (1.2, 0.0), (2.0, 1.4), (1.5, 1.9), (1.1, 2.3)])
def test_ball_of_light(away: float, angle: float) -> None:
    """A sphere over, through and below a surface's horizon; Naraghi, Diffuse View Factors, 1988."""
    far = away * cos(angle)
    if angle <= pi / 2 - asin(1 / away):
        factor = cos(angle) / away**2
    elif angle >= pi / 2 + asin(1 / away):
        factor = 0.0
    else:
        root = sqrt(away**2 - 1.0)
        factor = 0.5 - asin(root / (away * sin(angle))) / pi
        factor += cos(angle) / (pi * away**2) * acos(-root / (sin(angle) / cos(angle)))
        factor -= root * sqrt(1.0 - far**2) / (pi * away**2)
    radius = 0.7
    lamp = Light((radius * away * sin(angle), radius * far, 0.0), 5.0, (1.0, 1.0, 1.0), radius)
    p, up = np.zeros((3, 64)), np.repeat([[0.0], [1.0], [0.0]], 64, 1)
    received = solid._received(ExactField(NOTHING), Stage(lights=(lamp,)), p, up)[0].mean() - 0.18
    assert received == pytest.approx(factor * lamp.power / radius**2, rel=5e-3, abs=1e-3)


def test_soft_shadow() -> None:
    """A disc hides a part of a lamp as two spheres' discs overlap, seen from the middle of its shadow."""
    lamp = Light((0.0, 8.0, 0.0), 40.0, (1.0, 1.0, 1.0), 1.0)
    ball = 0.25
    root = fold(leaf("sphere", "diffuse", DARK, scaled(ball), moved(0.0, 1.0, 0.0)))
    p, up = np.zeros((3, 1)), np.array([[0.0], [1.0], [0.0]])
    # Both are round about y: the sphere hides all that is within its own angle, sin = ball / 1.
    hidden = Light((0.0, 8.0, 0.0), 40.0, (1.0, 1.0, 1.0), 4.0)
    field = ExactField(root)
    assert solid._received(field, Stage(lights=(lamp,)), p, up)[0, 0] == pytest.approx(0.18, abs=1e-9)
    rest = 40.0 / 16.0 * ((4.0 / 8.0) ** 2 - ball**2)  # of sin² of the cones
    received = solid._received(field, Stage(lights=(hidden,)), p, up)[0, 0] - 0.18
    assert received == pytest.approx(rest, rel=0.02)


def test_slab(monkeypatch: pytest.MonkeyPatch) -> None:
    """Light through a slab of mist: what is behind it, what it sends, and what it scatters once."""
    monkeypatch.setattr(solid, "AMBIENT", (0.0, 0.0))
    side, sigma = 2.0 / sqrt(3.0), 8.0
    slab = look("box", "volumetric", (0.5, 0.2, 0.8), scaled(2.0), density=sigma, glow=(0.1, 0.3, 0.2))
    lamp = Light((0.3, 0.2, 5.0), 7.0, (1.0, 0.6, 0.9), 0.5)
    d = np.array([[0.0], [0.0], [-1.0]])
    stage = Stage(Camera((0.0, 0.0, 4.0)), (lamp,), None, (0.9, 0.7, 0.2), (0.9, 0.7, 0.2))
    drawn = radiance(ExactField(fold(slab)), stage, d)[:3, 0]
    through = np.exp(-2.0 * side * sigma)
    expected = through * np.array(stage.horizon) + (1.0 - through) * np.array([0.1, 0.3, 0.2])
    z, weights = np.polynomial.legendre.leggauss(200)
    z = side * z
    # over the lamp's solid angle: the mean over its disc of ways, by a fine grid
    u, v = np.meshgrid((np.arange(40) + 0.5) / 40, 2.0 * pi * (np.arange(40) + 0.5) / 40)
    for depth, share in zip(z, weights * side, strict=True):
        middle = np.array(lamp.position) - (0.0, 0.0, depth)
        r = np.linalg.norm(middle)
        most = sqrt(1.0 - (lamp.radius / r) ** 2)
        c = 1.0 - u * (1.0 - most)
        s = np.sqrt(1.0 - c * c)
        axis = middle / r
        one = np.cross(axis, (0.0, 1.0, 0.0))
        one /= np.linalg.norm(one)
        other = np.cross(axis, one)
        up = c * axis[2] + s * (np.cos(v) * one[2] + np.sin(v) * other[2])
        arrives = np.exp(-sigma * (side - depth) / up).mean() * 2.0 * pi * (1.0 - most)
        light_there = arrives * lamp.power / lamp.radius**2 / (4.0 * pi) * np.array(lamp.rgb)
        colour = np.array([0.5, 0.2, 0.8])
        expected += share * sigma * np.exp(-sigma * (side - depth)) * colour * light_there
    assert drawn == pytest.approx(expected, rel=1e-3)


def test_paths_and_quadrature(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where little light goes on, paths find what is found without a sky."""
    monkeypatch.setattr(solid, "AMBIENT", (0.0, 0.0))
    faint = (1e-3, 5e-4, 8e-4)
    root = fold(
        look("sphere", "volumetric", faint, scaled(0.8), moved(-0.5, 0.0, 0.0), density=2.0),
        look("box", "volumetric", faint, scaled(0.8), moved(0.3, 0.2, 0.3), glow=(1e-3, 0.0, 2e-3)),
        leaf("torus", "diffuse", faint, scaled(0.9), turned(0.9), moved(0.2, 0.4, -0.4)),
    )
    lamps = (Light((2.0, 3.0, 2.0), 9.0, (1.0, 0.7, 0.4), 0.8), Light((-2.0, 1.0, 2.0), 4.0))
    ground = Ground(-1.0, faint)
    stage = Stage(lights=lamps, ground=ground, horizon=DARK, zenith=DARK)
    d = straight(stage, 8)
    expected = radiance(ExactField(root), stage, d)[:3]
    mean, error = found(root, replace(stage, sky=Sky(0.0, DARK, DARK)), d, 128)
    assert mean.mean(1) == pytest.approx(expected.mean(1), rel=0.01)
    assert (abs(mean - expected) < 0.02 * expected + 5.0 * error + 1e-6).mean() > 0.98


def reflected(rough: float, rgb: np.ndarray, n: Any, v: Any, w: np.ndarray) -> np.ndarray:
    """f cos of the contract's lobes, written down from it; ways w (M, 3), colours (3,)."""
    alpha = rough**2
    h = (v + w) / np.linalg.norm(v + w, axis=1)[:, None]
    nv, nl, nh, hv = v @ n, np.maximum(w @ n, 0.0), h @ n, h @ v

    def masked(c: Any) -> Any:
        return 2.0 / (1.0 + np.sqrt(1.0 + alpha**2 * (1.0 - c * c) / np.maximum(c * c, 1e-12)))

    spread = alpha**2 / (pi * (nh**2 * (alpha**2 - 1.0) + 1.0) ** 2)
    zero = rgb if rough < 0.0 else np.full(3, 0.04)
    shine = zero + (1.0 - zero) * (1.0 - hv[:, None]) ** 5
    lobe = (spread * masked(nv) * masked(nl) / (4.0 * nv))[:, None] * shine * (nl > 0.0)[:, None]
    under = 0.0 if rough < 0.0 else rgb * (1.0 - (0.04 + 0.96 * (1.0 - nv) ** 5)) / pi
    return np.asarray(lobe + under * nl[:, None])


@pytest.mark.parametrize("rough", [0.1, 0.4, 1.0, -0.1, -0.4, -1.0])
def test_lobes(rough: float) -> None:
    """A ball under an even sky, and by two lamps, against a quadrature of the formulas."""
    rgb, even = np.array([0.9, 0.5, 0.2]), np.array([0.7, 0.4, 0.9])
    root = fold(look("sphere", "diffuse", tuple(rgb), roughness=rough))
    eye, n = np.array([1.2, 0.0, 6.0]), np.array([0.0, 0.0, 1.0])
    v = (eye - n) / np.linalg.norm(eye - n)
    c, a = np.meshgrid((np.arange(750) + 0.5) / 750, 2 * pi * (np.arange(300) + 0.5) / 300, indexing="ij")
    s = np.sqrt(1.0 - c * c)
    w = np.stack([s * np.cos(a), s * np.sin(a), c], -1).reshape(-1, 3)
    answers = reflected(rough, rgb, n, v, w) * (2.0 * pi / len(w))
    stage = Stage(Camera(tuple(eye)), (), None, sky=Sky(1.0, tuple(even), tuple(even)))
    mean, _ = found(root, stage, -v[:, None], 20_000)
    assert mean[:, 0] == pytest.approx(answers.sum(0) * even, rel=5e-3)
    dark = replace(stage, sky=Sky(0.0, DARK, DARK))
    mirror = np.array([-v[0], 0.0, v[2]])
    at = mirror + np.array([0.1, 0.05, 0.0])
    at /= np.linalg.norm(at)
    point = replace(dark, lights=(Light(tuple(n + 3.0 * at), 5.0),))
    mean, _ = found(root, point, -v[:, None], 4)
    assert mean[:, 0] == pytest.approx(reflected(rough, rgb, n, v, at[None])[0] * pi * 5.0 / 9.0, rel=2e-3)
    ball = replace(dark, lights=(Light(tuple(n + 3.0 * at), 5.0, (1.0, 1.0, 1.0), 0.8),))
    mean, _ = found(root, ball, -v[:, None], 20_000)
    seen = (w @ at) > sqrt(1.0 - (0.8 / 3.0) ** 2)
    assert mean[:, 0] == pytest.approx(answers[seen].sum(0) * 5.0 / 0.8**2, rel=0.015)


def test_same_again() -> None:
    """The same picture each time, its noise about what is left, and alpha of what hides nothing."""
    root = fold(
        leaf("sphere", "diffuse", (0.8, 0.5, 0.2), scaled(0.6)),
        look("sphere", "volumetric", (0.5, 0.5, 0.9), scaled(0.6), moved(0.7, 0.3, 0.0), density=5.0),
    )
    stage = Stage(lights=(Light((2.5, 4.0, 3.0), 20.0, (1.0, 1.0, 1.0), 0.5),), sky=Sky(0.5))

    def drawn(stage: Stage, paths: int) -> Image:
        return solid.solid_image(root, stage, (6, 4), light=partial(picture.sky_light, paths=paths))

    one, other = (drawn(stage, 4) for _ in range(2))
    assert (one == other).all()
    fine = drawn(stage, 16)
    left = float(np.sqrt(np.mean((np.asarray(one, float) - fine) ** 2)))
    assert 0.5 * left < one.noise < 2.0 * left
    clear = drawn(replace(stage, transparent=True, ground=None), 2)
    plain = solid.solid_image(root, replace(stage, transparent=True, ground=None, sky=None), (6, 4))
    assert clear[..., 3] == pytest.approx(plain[..., 3], abs=1e-6)
    with pytest.raises(ValueError, match="inside an opaque object"):
        drawn(replace(stage, camera=Camera((0.0, 0.0, 0.1))), 2)
