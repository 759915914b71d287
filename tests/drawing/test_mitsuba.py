"""The reference of solid scenes against Mitsuba 3 (the extra ``oracles``)."""

from __future__ import annotations

from dataclasses import replace
from math import acos
from typing import Any

import numpy as np
import pytest

from scenelang.compiler.graph import Fold
from scenelang.compiler.spaces import Camera, Ground, Light, Stage
from scenelang.drawing.exact import solid as exact
from scenelang.drawing.image import encoded
from scenelang.drawing.metrics import flip
from tests.drawing.solids import ASIDE, FROM_ASIDE, fold, leaf, moved, scaled, turned
from tests.pictures import psnr_db

pytest.importorskip("mitsuba", reason="Mitsuba is not installed (the extra oracles)")
from lab.bench import mitsuba_scenes

pytestmark = pytest.mark.oracle

GOLD, BLUE = (0.8, 0.53, 0.12), (0.2, 0.4, 0.9)
BLACK = (0.0, 0.0, 0.0)
STAGE = Stage(
    camera=Camera(eye=(-1.5, 1.6, 4.5), target=(0.1, -0.1, 0.0), fov_rad=0.7),
    lights=(Light((1.5, 3.0, 2.0), 16.0),),
    ground=Ground(-0.8, (0.5, 0.6, 0.4)),
    horizon=BLACK,
    zenith=BLACK,
)
BALL = leaf("sphere", "diffuse", GOLD, scaled(0.5), moved(0.4, 0.2, 0.1))
UNIONS: dict[str, tuple[Fold, Stage, tuple[int, int], int]] = {
    "shadows": (
        fold(
            BALL,
            leaf(
                "torus", "diffuse", BLUE, scaled(0.9, 0.9, 0.5), turned(1.1, 1, 0, 0), moved(-0.2, -0.1, 0.2)
            ),
        ),
        STAGE,
        (48, 48),
        144,
    ),
    "from aside, a wide view, a light close to a surface": (
        ASIDE,
        replace(FROM_ASIDE, horizon=BLACK, zenith=BLACK),
        (60, 40),
        144,
    ),
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


def compared(drawn: np.ndarray, root: Fold, stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hold the reference, without what Mitsuba does not know, to a picture of linear light."""
    monkeypatch.setattr(exact, "AMBIENT", (0.0, 0.0))
    stage = replace(stage, ground=stage.ground and replace(stage.ground, fade=1e15))
    ours = np.asarray(exact.solid_image(root, stage, (drawn.shape[1], drawn.shape[0]), per_side=8))
    theirs = encoded(drawn)
    decibels, difference = psnr_db(theirs, ours), flip(theirs, ours)
    print(f"PSNR {decibels:.1f} dB, FLIP {difference:.4f}")
    assert decibels > 45
    assert difference < 0.005


@pytest.mark.parametrize("name", UNIONS)
def test_unions(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    root, stage, canvas, samples = UNIONS[name]
    scene = mitsuba_scenes.exported(mitsuba_scenes.solids(root), stage, canvas, samples)
    compared(mitsuba_scenes.picture(scene), root, stage, monkeypatch)


def cap(radius: float, height: float, whole: float, side: float) -> mitsuba_scenes.Surface:
    """The part of a sphere about (0, height, 0) up to an angle from ``side`` times the axis y."""

    def surface(u: np.ndarray, v: np.ndarray) -> Any:
        n, _ = mitsuba_scenes.ball(u, v * whole / np.pi)
        n = n * [[1], [side], [1]]
        return radius * n + [[0], [height], [0]], n

    return surface


@pytest.mark.parametrize(("op", "side"), [("subtract", -1.0), ("intersect", 1.0)])
def test_booleans(op: str, side: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """A unit ball and one of radius 0.8, 0.9 above it: what is left of both is caps."""
    ball = leaf("sphere", "diffuse", GOLD)
    root = fold(
        fold(ball, (op, leaf("sphere", "diffuse", GOLD, scaled(0.8), moved(0, 0.9, 0)))),
        steps=(scaled(0.7), turned(0.8, 1, 0, 0.3), moved(-0.1, 0.1, 0)),
    )
    matrix = np.eye(4)
    for step in (move.step for move in root.moves):
        matrix = np.vstack([np.reshape(step.rows, (3, 4)), (0, 0, 0, 1)]) @ matrix
    meet = (1 + 0.9**2 - 0.8**2) / (2 * 0.9)  # the height at which their surfaces do
    below, inner = cap(0.8, 0.9, acos((0.9 - meet) / 0.8), -1.0), acos(meet)
    outer = cap(1.0, 0.0, inner if side > 0 else np.pi - inner, side)
    objects = {
        "outer": mitsuba_scenes.mesh(outer, matrix, ball),
        "cut": mitsuba_scenes.mesh(below, matrix, ball),
    }
    compared(
        mitsuba_scenes.picture(mitsuba_scenes.exported(objects, STAGE, (48, 48), 144)),
        root,
        STAGE,
        monkeypatch,
    )
