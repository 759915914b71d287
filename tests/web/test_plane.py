"""The shader of the plane against the numpy field and the network's pictures."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from lab.sets.plane import SETS, random_scene
from scenelang.assets.pyramid import unpacked
from scenelang.compiler.groups import read_groups
from scenelang.compiler.program import Program
from scenelang.drawing.neural.coverage import Coverage, Tile, add_textures
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.meetings import Pairs, meetings_of
from scenelang.drawing.neural.network import RADIUS
from scenelang.drawing.small import draw_small
from scenelang.web.arrays import Store, script, shapes_of
from scenelang.web.export import View, view_of
from scenelang.web.plane import leaves
from tests.assets.shapes import ball, element, square
from tests.browser import watched
from tests.drawing.test_bounds import of_sets, rng_of, wild
from tests.pictures import premultiplied, psnr_db
from tests.test_examples import SCENES, sized

LEAST_DB = 45.0
MODELS = "shapes2d", "shapes2d-w16", "shapes2d-w8"

ASK = """async ([message, points]) => {
  const view = await readView(JSON.parse(message));
  const gl = document.createElement("canvas").getContext("webgl2");
  const drawer = planeDrawer(gl, view);
  const found = drawer.points(view.program, new Float32Array(points));
  drawer.dispose();
  gl.getExtension("WEBGL_lose_context").loseContext();
  return Array.from(found);
}"""
DRAW = """async ([message, width, height]) => {
  const view = await readView(JSON.parse(message));
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const gl = canvas.getContext("webgl2", { antialias: false });
  const drawer = planeDrawer(gl, view);
  drawer.draw(view.program, { width, height });
  const pixels = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  drawer.dispose();
  gl.getExtension("WEBGL_lose_context").loseContext();
  let text = "";
  for (let at = 0; at < pixels.length; at += 4096) {
    text += String.fromCharCode(...pixels.subarray(at, at + 4096));
  }
  return btoa(text);
}"""


def drawn(page: Any, view: View, size: tuple[int, int]) -> np.ndarray:
    """Premultiplied pixels (H, W, 4) in [0, 1]."""
    data = page.evaluate(DRAW, [view.message(), *size])
    pixels = np.frombuffer(base64.b64decode(data), np.uint8).reshape(size[1], size[0], 4)
    found: np.ndarray = pixels[::-1] / 255.0
    return found


def asked(program: Program, p: np.ndarray) -> np.ndarray:
    """Distance and colour (M, 4) at points (M, 2) by the field, as precise as they are."""
    network, _ = load_arrays(program.model)
    field = Field(network, program.vectors, program.tokens, program.brought(), program.paints())  # type: ignore[arg-type]
    count = len(program)
    pairs = Pairs.of(np.zeros(count, np.intp), np.arange(count))
    meetings, _ = meetings_of(replace(pairs, far=np.ones(count, bool)))
    tile = Tile(np.empty((1, 1, 4), np.float32), None)
    coverage, points = Coverage(field, skip=False), np.ascontiguousarray(p.T)[:, :, None]
    trace = field.trace(len(p), count)
    memory = coverage.ask(meetings, points, tile, trace)[2]
    add_textures(field, meetings, trace, points, memory, np.ones((len(p), 1), bool), 0.0)
    found: np.ndarray = memory[:, :, 0]
    found[:, 0] /= field.unit
    return found


@pytest.fixture(scope="module")
def page(chromium: Any) -> Iterator[Any]:
    """One page for all tests."""
    with watched(chromium) as page:
        page.add_script_tag(content=script())
        yield page


@pytest.mark.parametrize("model", MODELS)
def test_units_that_are_left_out_never_fire(model: str) -> None:
    network, _ = load_arrays(model)
    p = np.random.default_rng(1).uniform(-3, 3, (2, 20_000))
    radius = np.hypot(*p)
    for leaf, decoder in zip(leaves(network), network.decoders(network.codes), strict=True):
        first, second, last = leaf.first, leaf.second, leaf.last
        hidden = np.maximum(first[:, :2] @ (p * (RADIUS / np.maximum(radius, RADIUS))) + first[:, 2:], 0)
        hidden = np.maximum(second[:, 1:] @ hidden + second[:, :1], 0)
        found = last[:-1] @ hidden + last[-1] + np.maximum(radius - RADIUS, 0) * leaf.far
        exact = network.decode(p, radius, 1.0, decoder)[0]
        assert abs(found - exact).max() < 1e-5
        least = np.max([*abs(p), radius] - np.reshape(leaf.bounds, (3, 1)), 0)
        assert (exact >= leaf.far * least).all()
        assert (exact[radius < leaf.inner] < 0).all()
        assert leaf.bounds[2] < 2  # or they would rule out nothing, and
        assert leaf.inner > 0.1
    shapes = leaves(load_arrays("shapes2d").network)
    assert max(leaf.second.size for leaf in shapes) < 0.6 * 32 * 32


@pytest.mark.browser
@pytest.mark.parametrize("model", MODELS)
def test_points_have_distance_and_colour_of_the_field(page: Any, model: str) -> None:
    """Of 10,000, most to 10⁻⁴; the others are textures so small that a point is not known well enough."""
    seeds, told, exact = iter(range(100)), 0, 0
    while told < 10_000:
        seed = next(seeds)
        try:
            program = nsg.compile(wild(rng_of(seed, 0)), model=model)
        except nsg.SceneError:  # more deformations than the model takes
            continue
        p = np.random.default_rng(seed).uniform(-1.1, 1.1, (1000, 2)).astype(np.float32)
        answer = page.evaluate(ASK, [view_of(program).message(), p.ravel().tolist()])
        off = abs(np.reshape(answer, (-1, 4)) - asked(program, p))
        shifts = 3e-7 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        near = [asked(program, p + shift) for shift in shifts]
        change = np.ptp(near, axis=0)
        assert off[:, 0].max() < 1e-4, seed
        assert (off < 1e-4 + change).all(), seed
        told += len(p)
        exact += int((off < 1e-4).all(1).sum())
    assert exact > 0.98 * told


@pytest.mark.browser
def test_pictures_are_the_networks(page: Any) -> None:
    """Of every example of the plane."""
    found = {}
    for path in SCENES:
        program = nsg.compile(sized(nsg.load(path), 128))
        if program.stage is None:
            found[path.stem] = compared(page, program)
    assert len(found) > 30
    assert not {name: db for name, db in found.items() if db < LEAST_DB}


@pytest.mark.browser
def test_random_pictures_are_the_networks(page: Any) -> None:
    """Elements, textures, blends of any width and warps, through the lists of tiles."""
    look = "material flat { color(hsv(9deg * i, 1, 1)); }"
    hidden = f"for (i in 0..<90) {{ square {{ scale(3 - 0.03 * i); rotate(5deg * i); {look} }} }}"
    scenes = [("hidden", nsg.loads(hidden).sized((88, 80))), *of_sets(0)]
    scenes += [(f"wild {seed}", wild(rng_of(seed, 0)).sized((88, 80))) for seed in range(12)]
    found = {}
    for name, scene in scenes:
        try:
            program = nsg.compile(scene.model_copy(update={"background": None}), model="shapes2d")
        except nsg.SceneError:
            continue
        found[name] = compared(page, program)
    assert len(found) > 20
    assert not {name: db for name, db in found.items() if db < LEAST_DB}


def compared(page: Any, program: Program) -> float:
    """PSNR of the shader's picture, dB."""
    network = premultiplied(draw_small(program).image)
    picture = drawn(page, view_of(program), program.canvas)
    if network.shape[2] == 3:
        assert (picture[..., 3] == 1).all()
    return psnr_db(picture[..., : network.shape[2]], network)


@pytest.mark.browser
def test_trees_are_the_networks(page: Any) -> None:
    """Groups in groups and rounded cuts, at points, which meet all rows, and in pictures, which skip some."""
    depths, found = set(), {}
    for seed in range(12):
        scene = random_scene(np.random.default_rng(seed), SETS["trees"]).sized((88, 80))
        program = nsg.compile(scene.model_copy(update={"background": None}))
        depths.add(read_groups(program.tokens).deepest)
        p = np.random.default_rng(seed).uniform(-1.1, 1.1, (1000, 2)).astype(np.float32)
        answer = page.evaluate(ASK, [view_of(program).message(), p.ravel().tolist()])
        known = asked(program, p)
        off = abs(np.reshape(answer, (-1, 4)) - known)[known[:, 0] < 0.5]
        assert off[:, 0].max() < 1e-4, seed
        assert (off < 1e-3).all(1).mean() > 0.995, seed
        found[seed] = compared(page, program)
    assert depths == {1, 2, 3}
    assert not {name: db for name, db in found.items() if db < LEAST_DB}


@pytest.mark.browser
def test_pyramids_unfold_as_elements_do(page: Any) -> None:
    elements = [
        *(element(square, d=2, levels=levels) for levels in (1, 2, 5)),
        *(element(ball, cells=cells, levels=2) for cells in (2, 3, 4)),
        element(ball, levels=3, finer=True),
    ]
    for shape in elements:
        store = Store()
        shapes = shapes_of([shape], store)
        blob = base64.b64encode(zlib.compress(store.bytes())).decode()
        ask = "async (text) => Array.from(distances((await readView(JSON.parse(text))).shapes[0]))"
        found = page.evaluate(ask, json.dumps({"shapes": shapes, "blob": blob}))
        np.testing.assert_allclose(found, unpacked(shape).ravel(), atol=2e-6)
