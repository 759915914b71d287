"""The reference of solid scenes against a slow loop, POV-Ray 3.7, and facts in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lab.bench import povray
from scenelang.compiler.graph import Fold
from scenelang.compiler.spaces import Camera, Ground, Light, Stage
from scenelang.compiler.steps import Displace, Grow, Shell, Twist, Warp
from scenelang.drawing.exact import solid
from scenelang.drawing.exact.solid import ExactBody, solid_image
from scenelang.drawing.image import encoded
from scenelang.drawing.metrics import flip
from tests.drawing import solid_oracle
from tests.drawing.solids import (
    ASIDE,
    FROM_ASIDE,
    GOLD,
    RED,
    SKY,
    USUAL,
    fold,
    leaf,
    moved,
    scaled,
    sheared,
    turned,
)
from tests.pictures import psnr_db

AXES = np.eye(3)[:, :, None]

NEEDS_POVRAY = pytest.mark.skipif(
    povray.povray() is None, reason="POV-Ray is not installed (the package povray)"
)
BENT = Warp(0.8, (0.0, 0.0)), Warp(0.0, (0.5, 0.0)), Twist(0.8)

POVRAY: dict[str, tuple[Fold, Stage, tuple[int, int], float]] = {
    "usual": (USUAL, Stage(), (120, 120), 65),
    "from aside, a wide view, a light close to a surface": (
        ASIDE,
        FROM_ASIDE,
        (150, 100),
        60,
    ),
    "booleans": (
        fold(
            leaf("sphere", "diffuse", GOLD, scaled(0.9)),
            leaf("torus", "diffuse", SKY, turned(0.6, 1, 0, 1)),
            ("subtract", leaf("sphere", "diffuse", RED, scaled(0.6, 0.8, 0.6), moved(-0.3, 0.5, 0.6))),
            ("intersect", leaf("sphere", "diffuse", RED, scaled(1.2, 0.9, 1.0), moved(-0.1, 0, 0))),
            (
                "subtract",
                leaf("torus", "diffuse", RED, scaled(0.8), turned(1.3, 1, 0, 0), moved(0.5, 0, 0.5)),
            ),
            leaf("sphere", "diffuse", RED, scaled(0.2), moved(0.7, -0.6, 0.6)),
        ),
        Stage(Camera((-2, 2, 3.5), (0.1, -0.2, 0), 0.7), (Light((0.2, 2.5, 1.6), 12.0),), Ground(-0.7)),
        (150, 100),
        48,
    ),
    "media": (
        fold(
            leaf("sphere", "volumetric", SKY, scaled(0.9, 0.7, 0.8), moved(-0.3, 0, 0)),
            leaf("torus", "volumetric", RED, scaled(0.9), turned(0.9, 1, 0, 1), moved(0.2, 0.2, 0.1)),
            ("subtract", leaf("sphere", "diffuse", RED, scaled(0.4), moved(-0.5, 0.3, 0.5))),
            leaf("sphere", "diffuse", GOLD, scaled(0.35), moved(0.6, -0.4, -1.2)),
            leaf("torus", "diffuse", GOLD, scaled(0.3), moved(0.9, 1.1, 0.8)),
        ),
        Stage(lights=(Light(position=(1.0, 3.0, 2.0), power=12.0, rgb=(1.0, 0.8, 0.5)),)),
        (60, 40),
        55,
    ),
    "an eye in a medium": (
        fold(
            leaf("sphere", "volumetric", RED, scaled(0.7, 0.5, 0.8), moved(0.2, 0.8, 2.4)),
            leaf("torus", "diffuse", GOLD, turned(0.5, 1, 0, 0)),
        ),
        Stage(Camera((0.1, 0.7, 2.8), fov_rad=1.2)),
        (40, 40),
        55,
    ),
    "warped": (
        fold(
            leaf(
                "torus", "diffuse", GOLD, Displace(0.06, 7), *BENT, scaled(0.9, 0.7, 0.8), turned(1, 1, 0, 0)
            ),
            leaf("sphere", "diffuse", SKY, scaled(0.4), moved(-0.2, 0.6, 0.3)),
        ),
        Stage(),
        (60, 60),
        60,
    ),
    "blended": (
        fold(
            leaf("sphere", "diffuse", GOLD, scaled(0.7), moved(-0.3, 0, 0)),
            ("smooth", leaf("torus", "diffuse", GOLD, turned(1.3, 1, 0, 0), moved(0.6, 0.2, 0)), 0.3),
        ),
        Stage(),
        (40, 40),
        55,
    ),
}  # with the least PSNR in dB

SCENES: dict[str, tuple[Fold, Stage]] = {
    **{
        name: (POVRAY[name][0], POVRAY[name][1])
        for name in ("usual", "booleans", "media", "warped", "blended")
    },
    "folds": (
        fold(
            fold(
                leaf("sphere", "diffuse", GOLD, scaled(0.7)),
                ("smooth", leaf("sphere", "volumetric", SKY, scaled(0.6), moved(0.7, 0.2, 0)), 0.4),
                steps=(sheared("zx", 0.3), moved(-0.3, 0, 0)),
            ),
            ("subtract", fold(leaf("torus", "diffuse", RED), leaf("sphere", "diffuse", RED, scaled(0.3)))),
            (
                "smooth",
                leaf("torus", "volumetric", RED, scaled(0.6), turned(1.5, 1, 0, 0), moved(0.2, 0.6, 0.3)),
            ),
            ("intersect", leaf("sphere", "diffuse", RED, scaled(0.95))),
        ),
        Stage(horizon=(0.2, 0.1, 0.3), zenith=(0.2, 0.1, 0.3), ground=Ground(-0.4, (0.1, 0.6, 0.2))),
    ),
    "skins": (
        fold(
            leaf("sphere", "diffuse", GOLD, Shell(0.3), Displace(0.05, 6), scaled(0.6), moved(-0.7, 0, 0)),
            ("subtract", leaf("sphere", "diffuse", RED, Grow(-0.2), moved(-0.7, 0.7, 0.7))),
            leaf("torus", "volumetric", SKY, Displace(0.05, 6), Shell(0.2), Grow(0.1), scaled(0.6)),
        ),
        Stage(),
    ),
    "alpha": (
        fold(
            leaf("sphere", "volumetric", SKY, scaled(0.8), moved(0.3, 0, 0)),
            leaf("torus", "diffuse", GOLD, turned(0.7, 0, 0, 1), moved(-0.3, 0.2, -0.4)),
        ),
        Stage(transparent=True, ground=None, lights=(Light(position=(0.0, -3.0, 2.0)),)),
    ),
    "inside": (
        fold(
            leaf("sphere", "volumetric", SKY, scaled(1.7)),
            leaf("sphere", "diffuse", GOLD, scaled(0.5), moved(0.4, 0.3, 0)),
        ),
        Stage(camera=Camera(eye=(0.3, 0.5, 1.4)), transparent=True, lights=(Light((-1.0, 1.0, 1.0), 4.0),)),
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_picture_equals_the_slow_loop(name: str) -> None:
    root, stage = SCENES[name]
    canvas = (4, 3)
    slow = np.array(solid_oracle.draw(root, stage, canvas))
    fast = np.asarray(solid_image(root, stage, canvas))
    np.testing.assert_allclose(fast, slow, atol=6e-3)
    assert abs(fast - slow).mean() < 3e-4


def assert_povray_agrees(
    root: Fold, stage: Stage, canvas: tuple[int, int], least_db: float, **brought: Any
) -> None:
    ours = np.asarray(solid_image(root, stage, canvas, **brought))
    theirs = encoded(povray.povray_picture(root, stage, canvas))
    decibels, difference = psnr_db(theirs, ours), flip(theirs, ours)
    print(f"PSNR {decibels:.1f} dB, FLIP {difference:.5f}")
    assert decibels > least_db
    assert difference < 0.002


@pytest.mark.oracle
@NEEDS_POVRAY
@pytest.mark.parametrize("name", POVRAY)
def test_povray_draws_the_same(name: str) -> None:
    assert_povray_agrees(*POVRAY[name])


@pytest.mark.oracle
@NEEDS_POVRAY
def test_povray_draws_meshes_the_same() -> None:
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("igl")
    from scenelang.drawing.exact.mesh import mesh_of

    made = trimesh.creation.torus(0.7, 0.3, major_sections=14, minor_sections=7)
    shape = mesh_of(np.asarray(made.vertices), np.asarray(made.faces, np.int64))
    povray.MESHES["ring"] = povray.mesh(shape.vertices, shape.triangles)
    root = fold(
        leaf("ring", "diffuse", GOLD, scaled(0.9, 0.6, 1.1), turned(0.8, 1, 0.4, 0.2), moved(-0.4, 0, 0)),
        leaf("ring", "volumetric", SKY, scaled(0.7), turned(1.4, 0.2, 1, 0), moved(1.0, 0.3, 0.2)),
        ("subtract", leaf("sphere", "diffuse", RED, scaled(0.5), moved(-0.9, 0.2, 0.5))),
        leaf("sphere", "diffuse", RED, scaled(0.3), moved(0.3, -0.6, 0.7)),
    )
    assert_povray_agrees(root, Stage(), (40, 40), 48, brought={"ring": shape})


def test_an_eye_in_a_solid_sees_nothing() -> None:
    with pytest.raises(ValueError, match="the eye is inside an opaque object"):
        solid_image(fold(leaf("sphere", "diffuse", GOLD, scaled(9.0))), Stage(), (2, 2))


@pytest.mark.parametrize("geometry", ["sphere", "torus"])
def test_gradients_are_differences_and_bounded_within_reach(geometry: str) -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        kinds = [
            Warp(float(rng.uniform(-2, 2)), tuple(rng.uniform(-1, 1, 2).tolist())),
            Twist(float(rng.uniform(-2, 2))),
            scaled(*rng.uniform(0.3, 3.0, 3).tolist()),
            sheared("yz", float(rng.uniform(-1, 1))),
            moved(*rng.uniform(-1, 1, 3).tolist()),
        ]
        steps = [Displace(0.1, 6.0), *(kinds[i] for i in rng.integers(0, 5, 5)), scaled(0.3)]
        body = ExactBody(leaf(geometry, "diffuse", GOLD), tuple(steps), 0.0)
        p = rng.uniform(-1, 1, (3, 1000))
        h = 1e-7
        differences = [(body.distance(p + h * e)[0] - body.distance(p - h * e)[0]) / (2 * h) for e in AXES]
        size = 1 + np.linalg.norm(differences, axis=0)
        np.testing.assert_allclose(body.gradient(p) / size, differences / size, atol=2e-5)
        way = rng.normal(size=p.shape)
        way *= min(body.reach, 0.2) / np.linalg.norm(way, axis=0)
        steepest = np.linalg.norm(body.gradient(p + way), axis=0)
        assert (steepest <= body.distance(p)[1] * body.first.grows + 1e-9).all()


def test_a_bound_holds_where_the_stretch_grows() -> None:
    """About the centre of a twirl; the map outside it makes the reach longer."""
    steps = (moved(0.5, 0.3, 0.2), Warp(12.0, (0.0, 0.0)), scaled(0.3))
    body = ExactBody(leaf("sphere", "diffuse", GOLD), steps, 0.0)
    way = np.random.default_rng(6).normal(size=(3, 1000))
    way *= body.reach / np.linalg.norm(way, axis=0)
    bound = body.distance(np.zeros((3, 1)))[1] * body.first.grows
    assert np.linalg.norm(body.gradient(way), axis=0).max() < bound


def test_no_ray_passes_through_what_is_warped() -> None:
    """Against each ray's least distance over many small steps."""
    ring = leaf("torus", "diffuse", GOLD, Warp(3.0, (1.0, 0.5)), Twist(6.0), scaled(1.4))
    stage = Stage(ground=None, transparent=True)
    alpha = np.asarray(solid_image(fold(ring), stage, (40, 40), per_side=1))[..., 3]
    forward, right, up = np.array(stage.camera.axes())
    x = (np.arange(40) + 0.5) / 20 - 1.0
    d = (3 * forward + x[None, :, None] * right - x[:, None, None] * up).reshape(-1, 3).T
    d /= np.linalg.norm(d, axis=0)
    body = ExactBody(ring, ring.steps, 0.0)
    eye = np.array(stage.camera.eye)[:, None]
    least = np.min([body.distance(eye + t * d)[0] for t in np.arange(4.5, 7.8, 0.004)], axis=0)
    sure = abs(least) > 1e-3
    np.testing.assert_array_equal(alpha.ravel()[sure], (least < 0)[sure])


def test_finer_steps_change_nothing_to_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """By more than 60 dB: what the language asks of light in media."""
    root, stage = SCENES["media"]
    usual = np.asarray(solid_image(root, stage, (10, 8)))
    monkeypatch.setattr(solid, "TOLERANCE", solid.TOLERANCE / 20)
    monkeypatch.setattr(solid, "HALVINGS", solid.HALVINGS + 3)
    monkeypatch.setattr(solid, "STEP", solid.STEP / 2)
    assert psnr_db(usual, np.asarray(solid_image(root, stage, (10, 8)))) > 60


def test_a_light_inside_a_solid_lights_nothing_outside() -> None:
    root = fold(
        leaf("sphere", "diffuse", GOLD, scaled(0.3), moved(0.5, 0.4, 0)),
        leaf("torus", "volumetric", SKY, moved(-0.4, 0, 0)),
    )
    inside, dark = Stage(lights=(Light((0.5, 0.4, 0.1)),)), Stage(lights=(Light(power=0.0),))
    np.testing.assert_allclose(
        solid_image(root, inside, (24, 24)), solid_image(root, dark, (24, 24)), atol=1e-7
    )


def test_the_ground_is_not_drawn_from_below_and_casts_no_shadow() -> None:
    below = Camera(eye=(0.0, -3.0, 4.0))
    root = fold(leaf("sphere", "diffuse", GOLD, scaled(0.6)))
    with_ground, without = (
        Stage(below, (Light((0.0, -3.0, 3.0)),)),
        Stage(below, (Light((0.0, -3.0, 3.0)),), None),
    )
    np.testing.assert_array_equal(
        solid_image(root, with_ground, (24, 24)), solid_image(root, without, (24, 24))
    )
