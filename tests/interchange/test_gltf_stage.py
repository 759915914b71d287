"""Cameras and lights of glTF files, by hand and by pygltflib, against the matrices of its specification."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
import pytest

import scenelang as nsg
from scenelang.graph.stage import stage_of
from scenelang.interchange.gltf import load_gltf
from scenelang.interchange.gltf_file import GltfError
from tests.interchange.documents import Json, document, read

BALL = {"name": "Sphere"}
LENS = {"type": "perspective", "perspective": {"yfov": 0.8, "aspectRatio": 1.5}}
LAMP = {"type": "point", "color": [1.0, 0.5, 0.0], "intensity": 88.0}


def staged(node: Json, lens: Json = LENS, lamp: Json = LAMP, **further: Any) -> Json:
    """A ball and a node, whose camera or light is the given one."""
    lights = {"extensions": {"KHR_lights_punctual": {"lights": [lamp]}}}
    return document([{"children": [1, 2]}, BALL, node], cameras=[lens], **lights, **further)


def with_light(**node: Any) -> Json:
    return {"name": "Lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}, **node}


def seen_at(scene: nsg.Scene, p: np.ndarray) -> np.ndarray:
    """Where a world point stands in the scene's picture, in shares of its half height and half width."""
    camera, (width, height) = stage_of(scene).camera, scene.canvas
    forward, right, up = np.array(camera.axes())
    to = p - np.array(camera.eye)
    x, y = (to @ axis / (to @ forward) / math.tan(camera.fov_rad / 2) for axis in (right, up))
    return np.array([x * min(width, height) / width, y * min(width, height) / height])


def turned(yaw: float, pitch: float) -> tuple[list[float], np.ndarray]:
    """A quaternion about x, then y, and its matrix."""
    (sy, cy), (sx, cx) = ((math.sin(a / 2), math.cos(a / 2)) for a in (yaw, pitch))
    about_y = [[math.cos(yaw), 0, math.sin(yaw)], [0, 1, 0], [-math.sin(yaw), 0, math.cos(yaw)]]
    about_x = [[1, 0, 0], [0, math.cos(pitch), -math.sin(pitch)], [0, math.sin(pitch), math.cos(pitch)]]
    return [cy * sx, sy * cx, -sy * sx, cy * cx], np.array(about_y) @ about_x


@pytest.mark.parametrize("aspect", [0.6, 1.0, 1.5])
@pytest.mark.parametrize("seed", range(4))
def test_the_picture_shows_what_the_camera_of_the_file_sees(aspect: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    quaternion, turn = turned(rng.uniform(-3, 3), rng.uniform(-1.2, 1.2))
    place, scale = rng.normal(0, 3, 3), rng.uniform(0.5, 2)
    node = {"camera": 0, "translation": place.tolist(), "rotation": quaternion, "scale": [scale] * 3}
    found = read(staged(node, {"type": "perspective", "perspective": {"yfov": 0.8, "aspectRatio": aspect}}))
    assert found.left_out == []
    width, height = found.scene.canvas
    assert (width / height, min(width, height)) == (pytest.approx(aspect, abs=0.005), 256)
    for p in rng.uniform((-1, -1, -9), (1, 1, -2), (5, 3)):
        clip = np.array([p[0] / aspect, p[1]]) / (-p[2] * math.tan(0.4))
        assert seen_at(found.scene, place + turn @ p) == pytest.approx(
            clip, abs=4e-3
        )  # canvases are whole pixels


def test_a_camera_below_turned_nodes_is_where_they_carry_it() -> None:
    nodes = [
        {"children": [1, 2], "rotation": [0, math.sin(0.5), 0, math.cos(0.5)], "translation": [1, 0, 0]},
        BALL,
        {"camera": 0, "translation": [0, 0, 4], "scale": [1, 1, 3]},
    ]
    camera = read(document(nodes, cameras=[LENS])).scene.camera
    assert camera.eye == pytest.approx((1 + 4 * math.sin(1), 0, 4 * math.cos(1)), abs=1e-4)
    ahead = np.subtract(camera.target, camera.eye)
    assert ahead / np.linalg.norm(ahead) == pytest.approx((-math.sin(1), 0, -math.cos(1)), abs=1e-5)


def test_a_light_gives_a_white_surface_its_candela_over_pi() -> None:
    found = read(staged(with_light(translation=[1, 2, 3])))
    light = found.scene.light
    assert (light.position, light.power) == ((1, 2, 3), pytest.approx(88 / math.pi, rel=1e-5))
    assert light.color == (1.0, pytest.approx(0.7354, abs=1e-4), 0.0)
    assert found.left_out == []
    assert found.scene.camera == "default"


def test_a_file_of_another_library(tmp_path: Path) -> None:
    lens = pygltflib.Perspective(yfov=0.7, znear=0.1, zfar=100)
    gltf = pygltflib.GLTF2(
        scene=0,
        scenes=[pygltflib.Scene(nodes=[0, 1, 2])],
        nodes=[
            pygltflib.Node(name="Torus.001", scale=[0.5, 0.5, 0.5]),
            pygltflib.Node(name="Camera", camera=0, translation=[0, 0, 5]),
            pygltflib.Node(
                name="Light", translation=[2, 3, 4], extensions={"KHR_lights_punctual": {"light": 0}}
            ),
        ],
        cameras=[pygltflib.Camera(type="perspective", perspective=lens)],
        extensionsUsed=["KHR_lights_punctual"],
        extensions={"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": math.pi}]}},
    )
    gltf.save(str(tmp_path / "a.gltf"))
    gltf.save(str(tmp_path / "a.glb"))
    text, binary = (load_gltf(tmp_path / name) for name in ("a.gltf", "a.glb"))
    assert text.scene == binary.scene
    assert text.left_out == []
    assert (text.scene.camera.eye, text.scene.camera.target) == ((0, 0, 5), (0, 0, 0))
    assert text.scene.camera.fov == pytest.approx(0.7, rel=1e-5)
    assert (text.scene.light.position, text.scene.light.power) == ((2, 3, 4), 1.0)
    again = nsg.loads(text.scene.to_nsg())
    assert (again.camera.eye, again.light, len(again.nodes)) == (text.scene.camera.eye, text.scene.light, 1)
    assert nsg.render(again, size=(48, 48)).std() > 0.05


def lens(**perspective: Any) -> Json:
    return {"cameras": [{"type": "perspective", "perspective": perspective}]}


def lamp(**values: Any) -> Json:
    return {"extensions": {"KHR_lights_punctual": {"lights": [{**LAMP, **values}]}}}


def test_nested_scales_beyond_all_numbers_place_nothing() -> None:
    above = [{"scale": [1e5] * 3, "children": [at + 1]} for at in range(70)]
    nodes = [*above, {"children": [71, 72, 73]}, BALL, {"camera": 0, "translation": [1, 2, 3]}]
    nodes.append(with_light(translation=[1, 2, 3]))
    found = read(document(nodes, cameras=[LENS], **lamp()))
    assert [line.rpartition(": ")[2] for line in found.left_out] == [
        "a camera whose numbers are too small or too large",
        "a light whose numbers are too large",
    ]


ROLLED = [0, 0, math.sin(0.1), math.cos(0.1)]


@pytest.mark.parametrize(
    ("node", "further", "said"),
    [
        ({"camera": 0, "rotation": ROLLED}, {}, "/node 0/node 2: its roll of -11.5°"),
        ({"camera": 0}, {"lens": {"type": "orthographic"}}, "/node 0/node 2: a camera without perspective"),
        ({"camera": 0, "translation": [1e300, 0, 0]}, {}, "float32 cannot undo"),
        ({"camera": 0, "scale": [0, 1, 1]}, {}, "a scale of 0"),
        (with_light(), {"lamp": {"type": "spot"}}, "/node 0/Lamp: a spot light"),
        (with_light(), {"lamp": {**LAMP, "range": 9}}, "/node 0/Lamp: its range of 9"),
        (with_light(children=[3]), {"more": with_light()}, "/node 0/Lamp/Lamp: a further light"),
        ({"camera": 0, "children": [3]}, {"more": {"camera": 0}}, "node 3: a further camera"),
    ],
)
def test_what_is_left_out_is_said(node: Json, further: Json, said: str) -> None:
    more = further.pop("more", None)
    data = staged(node, **further)
    data["nodes"] += [more] if more else []
    (line,) = read(data).left_out
    assert said in line


@pytest.mark.parametrize(
    ("node", "further", "said"),
    [
        ({"camera": 1}, {}, "node 2 names camera 1, and there are 1"),
        (with_light(), {"extensions": {}}, "node 2 names light 0, and there are 0"),
        ({"camera": 0}, lens(yfov=0), "yfov"),
        ({"camera": 0}, lens(yfov=3.15), "yfov"),
        ({"camera": 0}, lens(yfov=1, aspectRatio=0), "aspect"),
        (with_light(), lamp(intensity=-1), "intensity"),
        (with_light(), lamp(intensity=math.nan), "NaN"),
        (with_light(), lamp(color=[2, 0, 0]), "color"),
        (with_light(), {"extensions": {"KHR_lights_punctual": {"lights": {}}}}, "lights"),
    ],
)
def test_hostile_values(node: Json, further: Json, said: str) -> None:
    with pytest.raises(GltfError, match=said):
        read({**staged(node), **further})
