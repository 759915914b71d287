"""Solids in a browser: the shader's field and pictures are the network's, as numpy has them."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from lab.sets.solids import SOLID_SETS, random_solid
from scenelang.assets.zoo import zoo_bytes
from scenelang.compiler.groups import read_groups
from scenelang.compiler.program import Program
from scenelang.drawing.neural.draw import draw_objects
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.network import EMPTY, SolidArrays, Wanted
from scenelang.web.arrays import script
from scenelang.web.export import view_of
from tests.assets.shapes import element, noise, torus
from tests.browser import watched
from tests.drawing.test_trees import LEFT, scene_of

pytestmark = pytest.mark.browser

EXAMPLES = Path(__file__).parents[2] / "examples"
SOLID = re.compile(r"\b(sphere|torus|diffuse|volumetric)\b")
SCENES = [path.stem for path in sorted(EXAMPLES.glob("*.nsg")) if SOLID.search(path.read_text("utf-8"))]
CORNERS = {
    "colours": """
        model "solids3d"; import "zoo.safetensors" as zoo; canvas(64, 64); background(none);
        zoo.ring { rotate(60deg, axis = X); translate(0, 0.2, 0);
            material diffuse zoo.space { color(#ffc); grayscale(0.3); hue(40deg); } }
        sphere { scale(0.5); translate(-0.7, -0.4, 0.6);
            material diffuse zoo.bark { scale(0.7); hue(90deg); } }
        """,
    "mists": """
        import "zoo.safetensors" as zoo; canvas(64, 48); camera(eye = [0, 0.6, 3.2]);
        light(position = [0.4, 1.1, 0.9], power = 6);
        sphere { scale(0.9); material volumetric { color(#fa6); } }
        sphere { scale(0.6); translate(0.5, 0.2, 0.3); material volumetric { color(#59f); } }
        sphere { scale(0.25); translate(0.4, 0.2, 0.3); material diffuse { color(#4d4); } }
        sphere { scale(0.5); translate(-0.9, -0.5, 0.5); material volumetric zoo.bark; }
        """,
    "cut": """
        canvas(64, 48);
        chain {
            sphere { material volumetric { color(#6a8); } }
            subtract sphere { scale(1.2, 0.9, 0.6); translate(-0.2, 0.3, 0.5); }
            subtract sphere { scale(0.7, 0.8, 1.05); translate(0.8, 0.3, -0.6); }
        }
        """,
    "inside": """
        canvas(48, 48); camera(eye = [0.1, 0.2, 0.6], target = [0, 0, -1], fov = 70deg);
        light(position = [0.3, 0.5, 0.2], power = 2);
        sphere { scale(1.2); material volumetric { color(#acf); } }
        torus { scale(0.4); rotate(50deg, axis = X); translate(0, 0, -0.6); }
        """,
    "crowd": """
        canvas(48, 48);
        smooth(0.1) {
            for (i in 0..70) {
                sphere { scale(0.5); translate(0.5 * sin(i * 1rad), 0.3 * cos(i * 2.3rad), 0); }
            }
        }
        """,
    "deep": """
        canvas(64, 48);
        chain {
            sphere { displace(0.06, 9); twist(1.2); bend(0.5); scale(0.8, 1.1, 0.8); rotate(20deg); }
            smooth(0.3) sphere { scale(0.5); translate(0.7, 0.3, 0); }
            subtract torus { twirl(1.3); scale(0.7); translate(0.1, 0.2, 0.5); }
            intersect sphere { scale(1.1); translate(0.1, 0, 0); }
        }
        """,
}
SETUP = """
globalThis.opened = async (message, width, height) => {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [width, height];
  const gl = canvas.getContext("webgl2", { antialias: false });
  const view = await readView(message), drawer = solidDrawer(gl, view);
  const close = (array) => {
    drawer.dispose();
    gl.getExtension("WEBGL_lose_context").loseContext();
    let text = "";
    for (const byte of new Uint8Array(array.buffer)) text += String.fromCharCode(byte);
    return btoa(text);
  };
  return { gl, view, drawer, close };
};
globalThis.pictured = async (message, width, height) => {
  const { gl, view, drawer, close } = await opened(message, width, height);
  const pixels = new Uint8Array(4 * width * height);
  drawer.draw(view.program, { width, height, scale: 1 });
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  if (gl.getError()) throw new Error("an error of GL");
  return close(pixels);
};
globalThis.counted = async (message, width, height) => {
  const { view, drawer, close } = await opened(message, 1, 1);
  const products = drawer.operations(view.program, { width, height });
  return close(new Float64Array([products / view.network.products]));
};
globalThis.answered = async (message, points) => {
  const { view, drawer, close } = await opened(message, 1, 1);
  return close(drawer.points(view.program, new Float32Array(points)));
};
"""


@pytest.fixture(scope="module")
def page(chromium: Any) -> Iterator[Any]:
    with watched(chromium) as page:
        page.add_script_tag(content=script() + SETUP)
        yield page


def network() -> SolidArrays:
    found = load_arrays("solids3d")[0]
    assert isinstance(found, SolidArrays)
    return found


def called(page: Any, name: str, program: Program, *arguments: Any) -> bytes:
    message = json.loads(view_of(program).message())
    return base64.b64decode(page.evaluate(f"(given) => {name}(...given)", [message, *arguments]))


def pictured(page: Any, program: Program) -> np.ndarray:
    """The shader's picture (H, W, 4), premultiplied."""
    w, h = program.canvas
    found = np.frombuffer(called(page, "pictured", program, w, h), np.uint8).reshape(h, w, 4)
    return found[::-1] / 255.0


def network_picture(program: Program) -> np.ndarray:
    """The network's picture, likewise."""
    image = np.asarray(draw_objects(network(), program, threads=1, split=1).image, np.float64)
    alpha = image[..., 3:] if image.shape[2] == 4 else np.ones_like(image[..., :1])
    return np.concatenate([image[..., :3] * alpha, alpha], 2)


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    return float(-10 * np.log10(max(1e-10, np.mean((a - b) ** 2))))


def field_at(program: Program, points: np.ndarray) -> np.ndarray:
    """Distance, colour and medium (M, 5) at points (M, 3), as numpy has them."""
    solids = SolidField(network(), program.vectors, program.tokens, program.brought(), program.paints())
    eye = np.array([0.3, 9.1, 7.7], np.float32)  # rays to the points come from anywhere
    way = (points - eye).T
    t = np.sqrt((way**2).sum(0))
    way = (way / t).astype(np.float32)
    found = np.tile(np.array([100.0, 0, 0, 0, 0]), (len(points), 1))
    some, passes = solids.passes(eye, way, t + 1, tight=False)
    meeting = solids.meet(
        passes, t[some].astype(np.float32), Wanted.ALL, p=np.ascontiguousarray(points.T[:, some])
    )
    found[some, 0] = meeting.distance
    found[some, 1:4], found[some, 4] = meeting.register[:3].T, meeting.register[-1]
    return found


def corner(name: str, folder: Path) -> Program:
    brought = [element(torus, "ring"), noise(9, 9, 9, name="space"), noise(24, 16)]
    (folder / "zoo.safetensors").write_bytes(zoo_bytes(brought))
    return nsg.compile(nsg.loads(CORNERS[name], root=folder))


@pytest.mark.parametrize("name", SCENES)
def test_pictures_are_the_networks(page: Any, name: str) -> None:
    program = nsg.compile(nsg.load(EXAMPLES / f"{name}.nsg"))
    by = 128 / min(program.canvas)
    w, h = program.canvas
    program = dataclasses.replace(program, canvas=(round(w * by), round(h * by)))
    assert psnr(pictured(page, program), network_picture(program)) > 40


@pytest.mark.parametrize("name", CORNERS)
def test_corners_are_the_networks(page: Any, tmp_path: Path, name: str) -> None:
    program = corner(name, tmp_path)
    check_points(page, program)
    assert psnr(pictured(page, program), network_picture(program)) > 40


@pytest.mark.parametrize("seed", [0, 2, 6, 8, 10])
def test_trees_are_the_networks(page: Any, seed: int) -> None:
    """Groups in groups and rounded cuts, of solids and of media."""
    scene = random_solid(np.random.default_rng(seed), SOLID_SETS["trees"]).sized((64, 48))
    program = nsg.compile(scene)
    assert read_groups(program.tokens).deepest > 0
    check_points(page, program, inside=200, near=0.05)
    assert psnr(pictured(page, program), network_picture(program)) > 40


@pytest.mark.parametrize("name", LEFT)
def test_rays_meet_what_groups_leave(page: Any, name: str) -> None:
    scene = scene_of(name)
    picture = pictured(page, nsg.compile(scene))[..., :3]
    assert psnr(picture, np.asarray(nsg.render(scene, backend="reference"))) > 45


@pytest.mark.parametrize("name", SCENES)
def test_points_are_the_fields(page: Any, name: str) -> None:
    check_points(page, nsg.compile(nsg.load(EXAMPLES / f"{name}.nsg")))


def check_points(page: Any, program: Program, inside: int = 500, near: float = np.inf) -> None:
    """Ten thousand points around objects have the field's distance, colour and medium, up to a distance."""
    rng = np.random.default_rng(0)
    balls = program.bounds[rng.integers(0, len(program), 10_000)]
    points = (balls[:, :3] + balls[:, 3:].clip(0, 3) * rng.uniform(-0.6, 0.6, (10_000, 3))).astype(np.float32)
    data = called(page, "answered", program, points.reshape(-1).tolist())
    found, known = np.frombuffer(data, np.float32).reshape(-1, 5), field_at(program, points)
    assert (known[:, 0] < 0).sum() > inside
    seen = known[:, 0] < near
    # on the border of a ball nothing may have been met, by the last bits
    border = seen & ((found[:, 0] == EMPTY) != (known[:, 0] == EMPTY))
    assert border.sum() <= 2
    seen &= ~border
    np.testing.assert_allclose(found[seen, 0], known[seen, 0], atol=1e-4)
    assert (found[~seen & ~border, 0] > near - 1e-3).all()
    # a colour gives way to another within 0.001 of distance, and so follows its last bits
    assert (abs(found - known)[seen].max(1) > 1e-4).mean() < 1e-3
