"""The mask of a shadow is where the light's rays pass the medium, by the geometry of balls."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from lab.cli import command
from lab.shadows import shadow_mask
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.spaces import Camera, Light
from scenelang.language.scene import Material, Object, Scale, Scene, Translate

SIDE = 48


def test_the_mask_is_what_the_ball_of_mist_darkens() -> None:
    mist, radius = np.array([0.9, 1.5, 1.1]), 0.35
    moved = (Scale(radius), Translate(*mist.tolist()))
    nodes = (Object("sphere", Scale(0.8)), Object("sphere", moved, Material("volumetric")))
    scene = Scene(nodes=nodes, canvas=(SIDE, SIDE), model="solids3d")
    mask, _, _ = shadow_mask(scene, load_manifest("solids3d"))

    eye, lamp = np.array(Camera().eye), np.array(Light().position)
    forward, right, up = (np.array(axis) for axis in Camera().axes())
    at = (np.arange(SIDE) + 0.5) / SIDE * 2 - 1
    x, y = np.meshgrid(at, -at)
    way = 3 * forward + x[..., None] * right + y[..., None] * up
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    b = way @ eye
    inside = b * b - (eye @ eye - 0.64)
    p = eye + way * (-b - np.sqrt(np.maximum(inside, 0)))[..., None]
    to = lamp - p
    r = np.linalg.norm(to, axis=2, keepdims=True)
    to /= r
    gap = mist - p
    along = np.clip((gap * to).sum(2), 0, r[..., 0])
    missed = np.linalg.norm(gap - along[..., None] * to, axis=2)
    facing = (p * to).sum(2)
    seen = np.linalg.norm(np.cross(mist - eye, way), axis=2) > radius
    surely = (inside > 0.05) & seen & (facing > 0.1)
    assert mask[surely & (missed < 0.9 * radius)].all()
    assert not mask[surely & (missed > 1.05 * radius)].any()
    assert mask.sum() > 20


def test_the_command_measures_inside_shadows(tmp_path: Path) -> None:
    asked = ["shadows", "--scenes", "2", "--side", "32", "-o", str(tmp_path)]
    done = CliRunner().invoke(command, asked)
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "shadows.json").read_text("utf-8"))
    assert found["scenes"] == 2
    assert found["wrong_percent"]["mean"] < 2  # of a picture without shadows it is 100
    assert found["psnr_uncapped"]["worst"] > found["without"]["worst"] + 10
    assert (tmp_path / "shadows.png").exists()
