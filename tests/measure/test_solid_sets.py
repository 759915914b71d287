"""Sets of random solid scenes: the same for the same seed, and what their configs say."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.graph.stage import Stage
from scenelang.graph.steps import Affine
from scenelang.measure.solid_sets import SOLID_SETS, SolidScene, solid_scenes
from scenelang.reference.solid.field import Field


def leaves(scene: SolidScene) -> list:
    return [link.node for link in scene.root.links]


@pytest.mark.parametrize("name", SOLID_SETS)
def test_scenes_are_what_their_set_says(name: str) -> None:
    config, scene = SOLID_SETS[name], solid_scenes(name, 3)
    made = [scene(index) for index in range(5)]
    assert made[2] == scene(2)
    assert made[2] != made[3]
    low, high = config.objects
    assert all(low <= len(leaves(s)) <= high and s.canvas == config.canvas for s in made)
    assert any(link.op != "union" for s in made for link in s.root.links) == (config.unions < 1)
    assert any(leaf.look.material == "volumetric" for s in made for leaf in leaves(s)) == (config.media > 0)
    warped = any(not isinstance(step, Affine) for s in made for leaf in leaves(s) for step in leaf.steps)
    assert warped == (config.warp > 0 or config.shuffled)
    assert all((s.stage != Stage()) == config.staged for s in made)


def test_every_scene_can_be_drawn_and_shows_something() -> None:
    for name in SOLID_SETS:
        scene = solid_scenes(name, 4)(0)
        small = SolidScene(scene.root, scene.stage, (24, 16))
        empty = SolidScene(type(scene.root)("scene", ()), scene.stage, (24, 16))
        assert np.isfinite(small.exact()).all()
        assert abs(small.exact() - empty.exact()).max() > 0.05
        assert Field(scene.root).media == any(leaf.look.material == "volumetric" for leaf in leaves(scene))
