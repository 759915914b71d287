"""The mask of a shadow is where the light's rays pass the medium, by the geometry of balls."""

from __future__ import annotations

import numpy as np

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
