"""The reference of solid scenes against POV-Ray 3.7."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from scenelang.compiler.graph import Fold
from scenelang.compiler.spaces import Camera, Ground, Light, Stage
from scenelang.compiler.steps import Displace, Twist, Warp
from scenelang.drawing.exact.solid import solid_image
from scenelang.drawing.image import encoded
from scenelang.drawing.metrics import flip
from tests.drawing.povray import MESHES, mesh, povray, povray_picture
from tests.drawing.solids import GOLD, RED, SKY, USUAL, fold, leaf, moved, scaled, sheared, turned
from tests.pictures import psnr_db

pytestmark = [
    pytest.mark.oracle,
    pytest.mark.skipif(povray() is None, reason="POV-Ray is not installed (the package povray)"),
]

BENT = Warp(0.8, (0.0, 0.0)), Warp(0.0, (0.5, 0.0)), Twist(0.8)

SCENES: dict[str, tuple[Fold, Stage, tuple[int, int], float]] = {
    "usual": (
        USUAL,
        Stage(),
        (120, 120),
        65,
    ),
    "from aside, a wide view, a light close to a surface": (
        fold(
            leaf("torus", "diffuse", SKY, scaled(1.1, 0.7, 0.9), turned(2.1, 1, 2, 0.5), sheared("yz", 0.4)),
            leaf(
                "sphere", "diffuse", GOLD, scaled(0.6, 0.2, 0.4), turned(0.7, 0, 0, 1), moved(0.9, 0.3, -0.4)
            ),
        ),
        Stage(
            Camera((2.2, 2.6, -1.7), (0.3, -0.2, 0.1), radians(80)),
            Light((0.75, 0.7, -0.4), 0.4, (1.0, 0.7, 0.4)),
            Ground(-1.1, (0.3, 0.5, 0.6)),
            (0.4, 0.1, 0.2),
            (0.4, 0.1, 0.2),
        ),
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
        Stage(Camera((-2, 2, 3.5), (0.1, -0.2, 0), 0.7), Light((0.2, 2.5, 1.6), 12.0), Ground(-0.7)),
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
        Stage(light=Light(position=(1.0, 3.0, 2.0), power=12.0, rgb=(1.0, 0.8, 0.5))),
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


@pytest.mark.parametrize("name", SCENES)
def test_the_reference(name: str) -> None:
    root, stage, canvas, least = SCENES[name]
    ours, theirs = np.asarray(solid_image(root, stage, canvas)), encoded(povray_picture(root, stage, canvas))
    decibels, difference = psnr_db(theirs, ours), flip(theirs, ours)
    print(f"PSNR {decibels:.1f} dB, FLIP {difference:.5f}")
    assert decibels > least
    assert difference < 0.002


def test_meshes() -> None:
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("igl")
    from scenelang.drawing.exact.mesh import mesh_of

    made = trimesh.creation.torus(0.7, 0.3, major_sections=14, minor_sections=7)
    shape = mesh_of(np.asarray(made.vertices), np.asarray(made.faces, np.int64))
    MESHES["ring"] = mesh(shape.vertices, shape.triangles)
    root = fold(
        leaf("ring", "diffuse", GOLD, scaled(0.9, 0.6, 1.1), turned(0.8, 1, 0.4, 0.2), moved(-0.4, 0, 0)),
        leaf("ring", "volumetric", SKY, scaled(0.7), turned(1.4, 0.2, 1, 0), moved(1.0, 0.3, 0.2)),
        ("subtract", leaf("sphere", "diffuse", RED, scaled(0.5), moved(-0.9, 0.2, 0.5))),
        leaf("sphere", "diffuse", RED, scaled(0.3), moved(0.3, -0.6, 0.7)),
    )
    ours = np.asarray(solid_image(root, Stage(), (90, 90), brought={"ring": shape}))
    theirs = encoded(povray_picture(root, Stage(), (90, 90)))
    decibels, difference = psnr_db(theirs, ours), flip(theirs, ours)
    print(f"PSNR {decibels:.1f} dB, FLIP {difference:.5f}")
    assert decibels > 48
    assert difference < 0.002
