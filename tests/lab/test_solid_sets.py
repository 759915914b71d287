"""Sets of random solid scenes: the same for the same seed, what their configs say, what is drawn again."""

from __future__ import annotations

import numpy as np
import pytest

from lab.sets.scenes import coverage, scenes_of
from lab.sets.solids import SOLID_SETS
from scenelang.compiler.compile import compile_scene
from scenelang.drawing.neural.load import Model, load_model
from scenelang.language.scene import Camera, Object, Scale, Scene, Translate

STAGE = ("camera", "light", "ground", "background")


@pytest.fixture(scope="module")
def model() -> Model:
    return load_model("solids3d")


@pytest.mark.parametrize("name", [name for name, config in SOLID_SETS.items() if not config.trees])
def test_scenes_are_what_their_set_says(name: str, model: Model) -> None:
    config, scene = SOLID_SETS[name], scenes_of(model, name, 3)
    made = [scene(index) for index in range(6)]
    assert made[2] == scene(2)
    assert made[2] != made[3]
    chains = [s.nodes[0].children for s in made]
    solids = [link.node for chain in chains for link in chain]
    low, high = config.objects
    assert all(low <= len(chain) <= high for chain in chains)
    assert all(s.canvas == config.canvas for s in made)
    assert any(link.op != "union" for chain in chains for link in chain) == (config.unions < 1)
    media = [solid.material.name == "volumetric" for solid in solids]
    assert (any(media), all(media)) == (config.media > 0, config.media == 1)
    warped = any(
        t.kind in ("twirl", "bend", "twist", "displace") for solid in solids for t in solid.transforms
    )
    assert warped == (config.warp > 0 or config.shuffled)
    assert any(getattr(s, word) != "default" for s in made for word in STAGE) == config.staged
    drawn = {"sphere", "torus"} if not config.meshes else {"zoo.bunny", "zoo.monkey", "zoo.teapot"}
    assert {solid.geometry for solid in solids} == drawn
    for s in made:
        compile_scene(s)  # raises where it is refused


def test_a_scene_covers_what_its_objects_do(model: Model) -> None:
    """A sphere of a tenth of the view's height, in the middle or out of view, and one around the eye."""
    ball = Object("sphere", Scale.uniform(0.2))
    clear = Camera((0, 0, 6), (0, 0, 0), fov=2 * np.arctan(1 / 3))
    far = Object("sphere", (Scale.uniform(0.2), Translate(0, 9, 0)))
    scenes = [
        Scene(model="solids3d", camera=clear, nodes=node)
        for node in (ball, far, Object("sphere", Scale.uniform(7)))
    ]
    assert [coverage(scene, model.manifest) for scene in scenes] == [
        pytest.approx(np.pi / 400, abs=0.002),
        0.0,
        0.0,
    ]
