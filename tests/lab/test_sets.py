"""Sets of scenes, decoders with symmetry, masks of shadows."""

from __future__ import annotations

import re

import numpy as np
import pytest

from lab.sets.plane import GEOMETRIES, SETS, random_scene
from lab.sets.scenes import coverage, interval, scenes_of, sets_of, spread
from lab.sets.solids import SOLID_SETS
from lab.shadows import shadow_mask
from scenelang.compiler import spaces
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.neural.load import load_model
from scenelang.language.scene import Camera, Material, Object, Scale, Scene, Translate
from scenelang.language.words import OPERATIONS, TEXTURES

STAGE = ("camera", "light", "ground", "background")


@pytest.mark.parametrize("name", [name for name, config in SOLID_SETS.items() if not config.trees])
def test_scenes_are_what_their_set_says(name: str) -> None:
    config, scene = SOLID_SETS[name], scenes_of(load_model("solids3d"), name, 3)
    made = [scene(index) for index in range(9)]
    assert made[2] == scene(2)
    assert made[2] != made[3]
    chains = [s.nodes[0].children for s in made]
    solids = [link.node for chain in chains for link in chain]
    low, high = config.objects
    assert all(low <= len(chain) <= high for chain in chains)
    assert all(s.canvas == config.canvas for s in made)
    assert any(link.op != "union" for chain in chains for link in chain) == (config.unions < 1)
    media = ["volumetric" in (solid.material.name, solid.material.shading) for solid in solids]
    assert (any(media), all(media)) == (config.media > 0, config.media == 1)
    warped = any(
        t.kind in ("twirl", "bend", "twist", "displace") for solid in solids for t in solid.transforms
    )
    assert warped == (config.warp > 0 or config.shuffled)
    assert any(getattr(s, word) != "default" for s in made for word in STAGE) == config.staged
    drawn = {*config.leaves} if not config.meshes else {"zoo.bunny", "zoo.monkey", "zoo.teapot"}
    assert {solid.geometry for solid in solids} == drawn
    for s in made:
        compile_scene(s)  # raises where it is refused


def test_a_scene_covers_what_its_objects_do() -> None:
    """A sphere of a tenth of the view's height, in the middle or out of view, and one around the eye."""
    ball = Object("sphere", Scale.uniform(0.2))
    clear = Camera((0, 0, 6), (0, 0, 0), fov=2 * np.arctan(1 / 3))
    far = Object("sphere", (Scale.uniform(0.2), Translate(0, 9, 0)))
    scenes = [
        Scene(model="solids3d", camera=clear, nodes=node)
        for node in (ball, far, Object("sphere", Scale.uniform(7)))
    ]
    assert [coverage(scene, load_model("solids3d").manifest) for scene in scenes] == [
        pytest.approx(np.pi / 400, abs=0.002),
        0.0,
        0.0,
    ]


def test_the_mask_is_what_the_ball_of_mist_darkens() -> None:
    mist, radius = np.array([0.9, 1.5, 1.1]), 0.35
    moved = (Scale(radius), Translate(*mist.tolist()))
    nodes = (Object("sphere", Scale(0.8)), Object("sphere", moved, Material("volumetric")))
    scene = Scene(nodes=nodes, canvas=(48, 48), model="solids3d")
    mask, _, _ = shadow_mask(scene, load_manifest("solids3d"))

    eye, lamp = np.array(spaces.Camera().eye), np.array(spaces.Light().position)
    forward, right, up = (np.array(axis) for axis in spaces.Camera().axes())
    at = (np.arange(48) + 0.5) / 24 - 1
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


def test_intervals_hold_the_mean_19_times_in_20() -> None:
    rng = np.random.default_rng(3)
    drawn = [rng.normal(7.0, 2.0, 40).tolist() for _ in range(1000)]
    held = sum(abs(np.mean(values) - 7.0) < interval(values) for values in drawn)
    assert 920 < held < 970
    assert spread([40.0, 42.0], 5) == {"mean": 41.0, "interval": 1.96, "p5": 40.1, "worst": 40.0}
    assert interval([50.0]) == 0.0


def test_every_scene_of_a_set_compiles() -> None:
    for name in SETS:
        rng = np.random.default_rng(0)
        assert random_scene(rng, SETS[name]) == random_scene(np.random.default_rng(0), SETS[name])
        for _ in range(10):
            program = compile_scene(random_scene(rng, SETS[name]))
            config = SETS[name]
            assert len(program) <= config.objects[1] or config.words or config.nest in ("any", "leaves")


def test_sets_of_textures_are_of_models_that_have_some() -> None:
    """One has squares that move and grow, with flips, turns and hues; the other has everything."""
    plain, textured = (sets_of(load_manifest(name)) for name in ("shapes2d-streaming", "shapes2d"))
    assert set(textured) - set(plain) == {
        *("textures2d", "textures2d-mixed", "gradients", "opacity", "letters"),
        *("skins", "leaves2d", "trees2d"),
    }
    for name, shapes, ops in (
        ("textures2d", {"square"}, {"flip", "rotate", "hue"}),
        (
            "textures2d-mixed",
            {*GEOMETRIES},
            {*OPERATIONS} - {"stop", "opacity", "glow", "density", "roughness"},
        ),
    ):
        made = [textured[name](np.random.default_rng(index)) for index in range(60)]
        words = {*re.findall(r'"(?:geometry|name|kind)": ?"(\w+)"', "".join(s.to_json() for s in made))}
        assert words & {*GEOMETRIES} == shapes
        assert words & {*OPERATIONS} >= ops
        assert words >= {*TEXTURES}
