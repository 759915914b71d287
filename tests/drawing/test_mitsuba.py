"""The reference of solid scenes against Mitsuba 3 (the extra ``oracles``)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenelang.compiler.graph import Fold
from scenelang.compiler.spaces import Camera, Ground, Light, Stage
from scenelang.drawing.exact import solid as exact
from scenelang.drawing.image import encoded
from scenelang.drawing.metrics import flip
from tests.drawing.solids import fold, leaf, moved, scaled, turned
from tests.drawing.test_povray import SCENES
from tests.pictures import psnr_db

pytest.importorskip("mitsuba", reason="Mitsuba is not installed (the extra oracles)")
from tests.drawing import mitsuba_scenes

pytestmark = pytest.mark.oracle

GOLD, BLUE = (0.8, 0.53, 0.12), (0.2, 0.4, 0.9)
BLACK = (0.0, 0.0, 0.0)
STAGE = Stage(
    camera=Camera(eye=(-1.5, 1.6, 4.5), target=(0.1, -0.1, 0.0), fov_rad=0.7),
    light=Light((1.5, 3.0, 2.0), 16.0),
    ground=Ground(-0.8, (0.5, 0.6, 0.4)),
    horizon=BLACK,
    zenith=BLACK,
)
ASIDE = SCENES["from aside, a wide view, a light close to a surface"]
UNIONS: dict[str, tuple[Fold, Stage, tuple[int, int], int]] = {
    "shadows": (
        fold(
            leaf("sphere", "diffuse", GOLD, scaled(0.5), moved(0.4, 0.2, 0.1)),
            leaf(
                "torus", "diffuse", BLUE, scaled(0.9, 0.9, 0.5), turned(1.1, 1, 0, 0), moved(-0.2, -0.1, 0.2)
            ),
        ),
        STAGE,
        (48, 48),
        144,
    ),
    "from aside": (ASIDE[0], replace(ASIDE[1], horizon=BLACK, zenith=BLACK), (60, 40), 144),
    "single scattering": (
        fold(
            leaf("sphere", "volumetric", BLUE, scaled(0.7, 0.6, 0.7), moved(-0.2, 0.0, 0.0)),
            leaf("torus", "volumetric", GOLD, scaled(0.5), turned(0.9, 1, 0, 0), moved(1.0, 0.0, -0.3)),
            leaf("sphere", "diffuse", GOLD, scaled(0.3), moved(0.5, 0.7, 0.5)),
        ),
        STAGE,
        (40, 40),
        576,
    ),
}


@pytest.mark.parametrize("name", UNIONS)
def test_unions(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without what Mitsuba does not know; POV-Ray draws booleans, too."""
    root, stage, canvas, samples = UNIONS[name]
    scene = mitsuba_scenes.exported(mitsuba_scenes.solids(root), stage, canvas, samples)
    drawn = mitsuba_scenes.picture(scene)
    monkeypatch.setattr(exact, "AMBIENT", (0.0, 0.0))
    monkeypatch.setattr(exact, "FADE", 1e30)
    ours = np.asarray(exact.solid_image(root, stage, (drawn.shape[1], drawn.shape[0]), per_side=8))
    theirs = encoded(drawn)
    decibels, difference = psnr_db(theirs, ours), flip(theirs, ours)
    print(f"PSNR {decibels:.1f} dB, FLIP {difference:.4f}")
    assert decibels > 45
    assert difference < 0.005
