"""The stage of 3D scenes and the width of a blend: what is stated, what hides it, and who refuses it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import scenelang as nsg
from scenelang.compiler.compile import scene_dimension
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.spaces import (
    HORIZON,
    Camera,
    Ground,
    Light,
    Sky,
    Stage,
    decoded,
    read_stage,
    stage_data,
    stage_of,
)
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import same_nodes
from tests.language.cases import run_text

WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
SOLIDS = load_manifest("solids3d")


def test_what_is_stated_stands_over_the_defaults() -> None:
    for text, stage in (
        ("", Stage()),
        ("camera(); light(); ground();", Stage()),
        (
            "camera(fov = 0.25turn, eye = 2 * X);",
            Stage(Camera(eye=(2.0, 0.0, 0.0), fov_rad=math.pi / 2)),
        ),
        ("light([1, 2, 3], 4, rgb(0, 0.5, 1));", Stage(lights=(Light((1, 2, 3), 4, decoded((0, 0.5, 1))),))),
        ("light(color = #fff);", Stage()),
        ("ground(-2);", Stage(ground=Ground(-2.0))),
        ("ground(color = #fff);", Stage(ground=Ground(rgb=(1.0, 1.0, 1.0)))),
        ("ground(none);", Stage(ground=None)),
        ("background(none);", Stage(transparent=True)),
        ("background(#fff);", Stage(horizon=WHITE, zenith=WHITE)),
        ("light(none);", Stage(lights=())),
        ("light([0, 9, 0], radius = 0.5);", Stage(lights=(Light((0, 9, 0), radius=0.5),))),
        (
            "light(); light(power = 2); light(radius = 1);",
            Stage(lights=(Light(), Light(power=2), Light(radius=1))),
        ),
        ("sky();", Stage(sky=Sky())),
        ("sky(2, zenith = #fff);", Stage(zenith=WHITE, sky=Sky(2, HORIZON, WHITE))),
        ("sky(); background(#fff);", Stage(horizon=WHITE, zenith=WHITE, sky=Sky(1, WHITE, WHITE))),
        (
            "background(#fff); sky(horizon = #000);",
            Stage(horizon=WHITE, zenith=WHITE, sky=Sky(1, BLACK, WHITE)),
        ),
        ("background(none); sky(0);", Stage(transparent=True, sky=Sky(0))),
    ):
        scene = run_text(text + "sphere;").good()
        for way in (scene, run_text(scene.to_nsg()).good(), nsg.Scene.from_json(scene.to_json())):
            assert stage_of(way) == stage, text
        assert read_stage(json.loads(json.dumps(stage_data(stage)))) == stage


def test_the_stage_moves() -> None:
    text = (
        "animate(1, 4); camera(eye = [4 * sin(TAU * u * 1rad), 1, 4]); smooth(k = 0.1 + u) { sphere; torus; }"
    )
    scenes = [run_text(text, frame=frame).good() for frame in (0, 1)]
    assert [scene.camera.eye[0] for scene in scenes] == pytest.approx([0, 4])
    assert [scene.nodes[0].k for scene in scenes] == pytest.approx([0.1, 0.35])
    moved = scenes[0].model_copy(update={"camera": scenes[1].camera})
    assert same_nodes(scenes[0], scenes[0])
    assert not same_nodes(scenes[0], moved)
    found = run_text("animate(1, 4); camera(fov = 60deg * u); sphere;").only()
    assert (found.code, found.span.text) == ("E0338", "60deg * u")


def test_own_names_hide_the_words() -> None:
    for text in (
        "module light(p) { sphere; } light(3);",
        "module sky() { sphere; } sky();",
        "module glow(p) { sphere; } glow(3);",
        "module density() { sphere; } group { density(); }",
        "module ground() { sphere; } ground;",
        "module camera() { sphere; } group { camera(); }",
        "let light = material diffuse; sphere { light; }",
    ):
        scene = run_text(text).good()
        assert (scene.camera, scene.light, scene.ground, scene.sky) == ("default",) * 4, text
        assert len(scene.nodes) == 1
    assert run_text("let light = 3; light(power = light); sphere;").good().light == nsg.Light(power=3)


def test_imported_files_have_no_stage(tmp_path: Path) -> None:
    lib = tmp_path / "lib.nsg"
    text = 'import "lib.nsg" as lib; lib.ball();'
    lib.write_text("module ball() { sphere; }\nlight(power = 3);\nbackground(#000);\n", "utf-8")
    found = run_text(text, path=tmp_path / "main.nsg").only()
    assert (found.code, found.message, found.span.text) == ("E0330", "`light` in an imported file", "light")
    lib.write_text("module ball() { light(); }\nmodule light() { sphere; }\nlight();\n", "utf-8")
    assert run_text(text, path=tmp_path / "main.nsg").good().light == "default"


def test_the_first_geometry_and_then_the_stage_say_the_dimension() -> None:
    for text, dimension in (
        ("", 2),
        ("camera();", 3),
        ("ground(none);", 3),
        ("background(#000);", 2),
        ("light(); square;", 2),
        ("sky();", 3),
        ("smooth(k = 0.3) { sphere; torus; }", 3),
        ("group { group {} chain { square; smooth(k = 0.3) star; } } torus;", 2),
        ("torus; square;", 3),
    ):
        assert scene_dimension(run_text(text).good()) == dimension, text


def test_the_width_of_each_blend_reaches_the_graph() -> None:
    text = (
        "chain { sphere; smooth(k = 0.3) torus; smooth sphere; smooth(0.2) smooth(k = 1) { torus; sphere; } }"
    )
    graph = lower(run_text(text).good(), SOLIDS, None, Diagnostics())
    (chain,) = [link.node for link in graph.root.links]
    assert [link.k for link in chain.links] == [0.0, 0.3, 0.0, 0.2]
    assert [link.k for link in chain.links[3].node.links] == [0.0, 1.0]
