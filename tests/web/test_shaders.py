"""The page's shaders against the networks' fields and pictures, as numpy has them."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from lab.sets.plane import SETS, random_scene
from lab.sets.solids import SOLID_SETS, random_solid
from scenelang.assets.element_file import element_file_bytes
from scenelang.assets.pyramid import unpacked
from scenelang.compiler.groups import read_groups
from scenelang.compiler.program import Program
from scenelang.drawing.neural.draw import draw_objects
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.size import sized as usual_view
from scenelang.drawing.small import draw_small
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.network import EMPTY, SolidArrays
from scenelang.web.arrays import ArrayStore, script, shapes_of
from scenelang.web.export import has_sky, view_of
from scenelang.web.plane import leaves
from scenelang.web.volume import DRAFT, OPEN, Detail, volume
from tests.assets.shapes import ball, element, noise, square, torus
from tests.browser import watched
from tests.drawing import test_flush as flush
from tests.drawing.test_bounds import of_sets, rng_of, wild
from tests.drawing.test_opacity import see_through
from tests.drawing.test_size import SCENE
from tests.drawing.test_trees import LEFT, scene_of
from tests.pictures import premultiplied, psnr_db
from tests.test_examples import SCENES, sized

LEAST_DB = {2: 45.0, 3: 40.0}
SETUP = """
globalThis.opened = async (message, width, height) => {
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const gl = canvas.getContext("webgl2", { antialias: false });
  const view = await readView(message), drawer = (view.dimension === 3 ? solidDrawer : planeDrawer)(gl, view);
  const close = (array) => {
    drawer.dispose();
    gl.getExtension("WEBGL_lose_context").loseContext();
    let text = "";
    for (const byte of new Uint8Array(array.buffer)) text += String.fromCharCode(byte);
    return btoa(text);
  };
  return { gl, view, drawer, close };
};
globalThis.pictured = async (message, width, height, before = message) => {
  const { gl, view, drawer, close } = await opened(before, width, height);
  if (before !== message) {
    drawer.draw(view.program, { width, height, scale: 1 });
    drawer.relight((await readView(message)).around);
  }
  const pixels = new Uint8Array(4 * width * height);
  drawer.draw(view.program, { width, height, scale: 1 });
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  if (gl.getError()) throw new Error("an error of GL");
  return close(pixels);
};
globalThis.answered = async (message, points) => {
  const { view, drawer, close } = await opened(message, 1, 1);
  return close(Float32Array.from(drawer.points(view.program, new Float32Array(points))));
};
"""


@pytest.fixture(scope="module")
def page(chromium: Any) -> Iterator[Any]:
    """One page for all tests."""
    with watched(chromium) as page:
        page.add_script_tag(content=script() + SETUP)
        yield page


def called(page: Any, name: str, program: Program, *arguments: Any, draft: Detail | None = None) -> bytes:
    message = json.loads(view_of(program, draft=draft).message())
    return base64.b64decode(page.evaluate(f"(given) => {name}(...given)", [message, *arguments]))


def answered(page: Any, program: Program, points: np.ndarray) -> np.ndarray:
    """What the shader's field says of points (M, d): distance, colour, and of a solid its medium."""
    data = called(page, "answered", program, points.reshape(-1).tolist())
    return np.frombuffer(data, np.float32).reshape(len(points), -1)


def pictured(page: Any, program: Program, *before: Any, draft: Detail | None = None) -> np.ndarray:
    """The shader's picture (H, W, 4), premultiplied, in [0, 1]; perhaps that ``before`` was shown."""
    w, h = program.canvas
    pixels = np.frombuffer(called(page, "pictured", program, w, h, *before, draft=draft), np.uint8)
    return pixels.reshape(h, w, 4)[::-1] / 255.0


def compared(page: Any, program: Program, draft: Detail | None = None) -> float:
    """PSNR of the shader's picture from the network's, dB."""
    if program.stage is None:
        network = premultiplied(draw_small(program).image)
    else:
        network = premultiplied(draw_objects(solids(), program, threads=1, split=1).image)
    picture = pictured(page, program, draft=draft)
    if network.shape[2] == 3:
        assert (picture[..., 3] == 1).all()
    return psnr_db(picture[..., : network.shape[2]], network)


# ---------------------------------------------------------------- the plane


def asked(program: Program, p: np.ndarray) -> np.ndarray:
    """Distance and colour (M, 4) at points (M, 2) by the field, as precise as they are."""
    network, _ = load_arrays(program.model)
    field = Field(network, program.vectors, program.tokens, program.brought(), program.paints())  # type: ignore[arg-type]
    found: np.ndarray = field.folded(np.ascontiguousarray(p.T))[0].T
    found[:, 0] /= field.unit
    return found


def test_no_point_is_nearer_than_a_leafs_bounds() -> None:
    network, _ = load_arrays("shapes2d")
    p = np.random.default_rng(1).uniform(-5, 5, (2, 100_000))
    radius = np.hypot(*p)
    for leaf, decoder in zip(leaves(network), network.decoders(network.codes), strict=True):
        exact = decoder.distance(p)
        assert (exact >= np.max([*abs(p), radius] - np.reshape(leaf.bounds, (3, 1)), 0)).all()
        assert (exact[radius < leaf.inner] < 0).all()
        assert max(leaf.bounds) < 1.06  # or they would rule out little, and
        assert leaf.inner > 0.3


@pytest.mark.browser
def test_points_have_distance_and_colour_of_the_field(page: Any) -> None:
    """Of 5,000, most to 10⁻⁴; the others are textures so small that a point is not known well enough."""
    seeds, told, exact = iter(range(100)), 0, 0
    while told < 5000:
        seed = next(seeds)
        try:
            program = nsg.compile(wild(rng_of(seed, 0)))
        except nsg.SceneError:  # more deformations than the model takes
            continue
        p = np.random.default_rng(seed).uniform(-1.1, 1.1, (1000, 2)).astype(np.float32)
        off = abs(answered(page, program, p) - asked(program, p))
        shifts = 3e-7 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        near = [asked(program, p + shift) for shift in shifts]
        change = np.ptp(near, axis=0)
        assert off[:, 0].max() < 1e-4, seed
        assert (off < 1e-4 + change).all(), seed
        told += len(p)
        exact += int((off < 1e-4).all(1).sum())
    assert exact > 0.98 * told


@pytest.mark.browser
def test_pictures_of_examples_are_the_networks(page: Any) -> None:
    found = {}
    for path in SCENES:
        program = nsg.compile(sized(nsg.load(path), 128))
        if has_sky(program):  # which takes seconds each, see below
            continue
        found[path.stem] = compared(page, program), LEAST_DB[2 if program.stage is None else 3]
        if program.stage is not None:
            check_points(page, program)
    assert len(found) > 35
    assert not {name: (db, least) for name, (db, least) in found.items() if db < least}


GRADED = """
    nsg 1; canvas(96, 64); background(none);
    chain {
      square { scale(1.1, 0.6);
        material linear { stop(0.1, #f00); stop(0.4, #0f0); stop(1, #00f); rotate(40deg); } }
      smooth star { scale(0.7);
        material radial { stop(0, #ff0); stop(0.3, #f0f); stop(0.3, #000); hue(80deg); } }
      subtract pentagon { scale(0.2); translate(0.4, 0.2); }
      triangle { scale(0.5); bend(0.5); translate(-0.6, 0.2); material bricks { scale(0.5); } }
    }
"""


@pytest.mark.browser
def test_gradients_are_the_networks(page: Any) -> None:
    program = nsg.compile(nsg.loads(GRADED))
    assert compared(page, program) > LEAST_DB[2]
    points = np.random.default_rng(0).uniform(-1.2, 1.2, (500, 2)).astype(np.float32)
    np.testing.assert_allclose(answered(page, program, points), asked(program, points), atol=2e-3)


@pytest.mark.browser
def test_random_pictures_are_the_networks(page: Any) -> None:
    """Elements, textures, blends of any width and warps, through the lists of tiles."""
    look = "material flat { color(hsv(9deg * i, 1, 1)); }"
    hidden = f"for (i in 0..<90) {{ square {{ scale(3 - 0.03 * i); rotate(5deg * i); {look} }} }}"
    scenes = [("hidden", nsg.loads(hidden).sized((88, 80))), *of_sets()]
    scenes += [(f"wild {seed}", wild(rng_of(seed, 0)).sized((88, 80))) for seed in range(12)]
    found = {}
    for name, scene in scenes:
        try:
            program = nsg.compile(scene.model_copy(update={"background": None}), model="shapes2d")
        except nsg.SceneError:
            continue
        found[name] = compared(page, program)
    assert len(found) > 20
    assert not {name: db for name, db in found.items() if db < LEAST_DB[2]}


@pytest.mark.browser
def test_trees_are_the_networks(page: Any) -> None:
    """Groups in groups and rounded cuts, at points, which meet all rows, and in pictures, which skip some."""
    depths, found = set(), {}
    for seed in range(12):
        scene = random_scene(np.random.default_rng(seed), SETS["trees"]).sized((88, 80))
        program = nsg.compile(scene.model_copy(update={"background": None}))
        depths.add(read_groups(program.tokens).deepest)
        p = np.random.default_rng(seed).uniform(-1.1, 1.1, (1000, 2)).astype(np.float32)
        known = asked(program, p)
        off = abs(answered(page, program, p) - known)[known[:, 0] < 0.5]
        assert off[:, 0].max() < 1e-4, seed
        assert (off < 1e-3).all(1).mean() > 0.995, seed
        found[seed] = compared(page, program)
    assert depths == {1, 2, 3}
    assert not {name: db for name, db in found.items() if db < LEAST_DB[2]}


@pytest.mark.browser
def test_what_is_seen_through_and_sixteen_samples_are_the_networks(page: Any) -> None:
    found = {}
    for seed in range(12):
        rng = np.random.default_rng(seed)
        scene = see_through(random_scene(rng, SETS["trees" if seed % 2 else "textures2d"]), rng)
        changes = {"background": None if seed % 3 else "default", "samples": 16 if seed % 4 == 1 else 4}
        program = nsg.compile(scene.sized((88, 80)).model_copy(update=changes))
        found[seed] = compared(page, program)
    assert min(found.values()) > LEAST_DB[2], found
    solid = random_solid(np.random.default_rng(4), SOLID_SETS["diffuse"]).sized((48, 40))
    assert compared(page, nsg.compile(solid.model_copy(update={"samples": 16}))) > LEAST_DB[3]


@pytest.mark.browser
def test_pyramids_unfold_as_elements_do(page: Any) -> None:
    elements = [
        *(element(square, d=2, levels=levels) for levels in (1, 2, 5)),
        *(element(ball, cells=cells, levels=2) for cells in (2, 3, 4)),
        element(ball, levels=3, finer=True),
    ]
    for shape in elements:
        store = ArrayStore()
        shapes = shapes_of([shape], store)
        blob = base64.b64encode(zlib.compress(store.bytes())).decode()
        ask = "async (text) => Array.from(distances((await readView(JSON.parse(text))).shapes[0]))"
        found = page.evaluate(ask, json.dumps({"shapes": shapes, "blob": blob}))
        np.testing.assert_allclose(found, unpacked(shape).ravel(), atol=2e-6)


LETTERS = """import "std/letters" as abc; canvas(160, 120); background(#fed);
    abc.text("Twirl, ßΩ→", size = 0.4, align = "center") { twirl(0.7); translate(0, 0.5); }
    chain { square { scale(0.6); translate(0, -0.4); material flat { color(#148); } }
      subtract abc.text("ga@", size = 0.6, align = "right") { translate(0.4, -0.4); }
      smooth abc.text("i", size = 0.5) { translate(0.3, -0.6); material flat { color(#c40); } } }"""


@pytest.mark.browser
def test_letters_of_the_page_are_those_of_the_field(page: Any) -> None:
    program = nsg.compile(nsg.loads(LETTERS))
    p = np.random.default_rng(4).uniform(-1.3, 1.3, (2000, 2))
    off = abs(answered(page, program, p)[:, 0] - asked(program, p)[:, 0])
    assert np.quantile(off, 0.99) < 1e-4  # coarser lists may name another piece, where both are far
    assert off.max() < 3e-3
    assert compared(page, program) > LEAST_DB[2]


OUTLINES = """canvas(160, 120); background(#fed); let lean = 5deg;
    let star = [for (i in 0..<5) [cos(i * 144deg), sin(i * 144deg)]];
    module sail(at) {
      polygon([[0, 0], [3, 0.5], [1, 4]]) { shell(0.3); grow(0.1); scale(0.1); translate(at); } }
    polygon(star) { grow(0.05); scale(0.5); material linear { stop(0, #d33); stop(1, #33d); scale(0.5); } }
    smooth { spline([[5, 5], [9, 6], [7, 9]]) { scale(0.1); rotate(lean); material flat { color(#2a7); } }
      sail([0.4, 0.5]);
      spline([[-1, 0], [1, 0], [1, 1], [-1, -1]]) { scale(0.3); translate(0.9, 0.2); twirl(0.5); } }
    sail([-0.9, -0.7]);"""


@pytest.mark.browser
def test_polygons_and_splines_of_the_page_are_those_of_the_field(page: Any) -> None:
    program = nsg.compile(nsg.loads(OUTLINES))
    p = np.random.default_rng(4).uniform(-1.3, 1.3, (2000, 2))
    off = abs(answered(page, program, p)[:, 0] - asked(program, p)[:, 0])
    assert off.max() < 1e-4
    assert compared(page, program) > LEAST_DB[2]


@pytest.mark.browser
def test_elements_of_the_plane_grow_on_the_page(page: Any, tmp_path: Path) -> None:
    zoo = element_file_bytes([element(square, "tile", d=2)])
    (tmp_path / "zoo.safetensors").write_bytes(zoo)
    text = """import "zoo.safetensors" as zoo; canvas(96, 64);
        chain { zoo.tile { grow(0.4); scale(0.4); translate(-0.7, 0); material flat { color(#d33); } }
            subtract zoo.tile { shell(0.2); grow(0.1); scale(0.3); rotate(20deg); translate(-0.7, 0.2); }
            smooth zoo.tile { shell(0.4); scale(0.5); translate(0.6, 0); material flat { color(#36c); } } }"""
    program = nsg.compile(nsg.loads(text, root=tmp_path))
    p = np.random.default_rng(4).uniform(-1.3, 1.3, (2000, 2))
    assert abs(answered(page, program, p) - asked(program, p))[:, 0].max() < 1e-4
    assert compared(page, program) > LEAST_DB[2]


# ---------------------------------------------------------------- solids

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
    "gradients": """
        import "zoo.safetensors" as zoo; canvas(64, 48); background(none);
        torus { rotate(60deg, axis = X); scale(0.8); translate(-0.6, 0.2, 0);
            material radial { stop(0, #ff0); stop(0.5, #f00); stop(0.5, #00f); stop(1, #fff); hue(36deg); } }
        sphere { scale(0.6); translate(0.8, -0.2, 0.6);
            material volumetric linear { stop(0.2, #f22); stop(0.7, #22f); rotate(60deg); scale(0.6); } }
        sphere { scale(0.4); translate(0, -0.6, 1); material diffuse zoo.bark; }
        """,
    "lamps": """
        canvas(64, 48); light(position = [2, 3, 3], power = 12);
        light(position = [-2, 2, 1], power = 5, color = #8f8);
        light(position = [0, 0.2, 2], power = 1, color = #88f);
        sphere { scale(0.7); translate(-0.4, 0, 0); material volumetric { color(#8af); density(0.6); } }
        sphere { scale(0.5); translate(0.3, 0.1, 0.3);
            material volumetric { color(#fa6); density(9); glow(#f20, 0.3); } }
        torus { scale(0.5); translate(0.8, -0.4, 0.6); material diffuse { glow(#04f, 0.3); } }
        """,
    "dark": """
        canvas(48, 48); light(none); sphere { scale(0.5); translate(-0.7, 0, 0); }
        smooth { torus { material diffuse { glow(#f80, 2); } }
            sphere { scale(0.5); material diffuse { glow(#08f); } } }
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
    "grown elements": """
        import "zoo.safetensors" as zoo; canvas(64, 48);
        zoo.ring { grow(0.25); scale(0.6); rotate(50deg, axis = X); translate(-0.7, 0.3, 0); }
        subtract { zoo.ring { shell(0.2); scale(0.7); translate(0.7, -0.2, 0); }
            sphere { scale(0.6); translate(1.1, 0.2, 0.5); } }
        zoo.ring { grow(0.1); scale(0.4); translate(0.5, 0.8, 0.3); material volumetric { color(#8af); } }
        """,
    "edges": """
        canvas(96, 64);
        box { scale(0.7, 0.3, 0.5); rotate(30deg, axis = Y); translate(-1.5, 0.6, 0); }
        cylinder { twist(0.7); scale(0.6); translate(-0.5, 0.6, 0.2); }
        chain {
            cone { scale(0.6, 0.8, 0.6); translate(0.8, 0.4, 0); }
            smooth capsule { scale(0.5); rotate(40deg); translate(1.3, 0.6, 0.3); }
            subtract box { scale(0.3); translate(0.8, 0.2, 0.6); }
        }
        octahedron { scale(0.6); translate(-0.5, -0.4, 1.2); material volumetric { color(#8af); } }
        """,
    "skins": """
        canvas(64, 48);
        chain {
            sphere { shell(0.3); displace(0.05, 7); scale(0.7); translate(-0.7, 0, 0); }
            subtract sphere { grow(-0.2); scale(0.8); translate(-0.7, 0.5, 0.5); }
            torus { displace(0.04, 8); shell(0.2); grow(0.05); twist(0.5); scale(0.5); translate(0.7, 0.1, 0);
                material volumetric { color(#8af); } }
        }
        """,
}


SKIES = {  # and how near their pages are, dB: the light of nodes is mixed, and its shadows are as wide
    "balls": (
        40,
        """
        canvas(96, 72); sky(0.7); light([3, 4, 3], 18, radius = 0.6);
        sphere { scale(0.7); translate(-0.6, -0.3, 0); material diffuse { color(#d54); } }
        torus { scale(0.6); translate(0.7, -0.82, 0.6); }
        box { scale(0.6, 1.2, 0.6); translate(0.6, -0.3, -0.8); material diffuse { color(#59d); } }
        """,
    ),
    "room": (
        30,
        """
        canvas(96, 72); sky(5, #ffe, #def); light(none); ground(none); camera([0, 0, 2.4], [0, 0, -1], 60deg);
        chain {
            box { scale(2.6, 2, 2.6); material diffuse { color(#ddc); } }
            subtract box { scale(2.2, 1.6, 2.6); }
            subtract box { scale(2.6, 0.8, 0.8); translate(-1, 0.1, 0); }
        }
        sphere { scale(0.4); translate(0.3, -0.5, -0.4); material diffuse { color(#6a4); } }
        """,
    ),
    "clouds": (
        38,
        """
        canvas(96, 72); sky(0.6); light([-2, 3, 2], 14, #fdb, 0.7); light([2, 2, 3], 4);
        sphere { scale(0.7); translate(-0.6, 0, 0); material volumetric { color(#eef); density(4); } }
        sphere { scale(0.5); translate(0.7, -0.4, 0.3); }
        sphere { scale(1.2, 0.3, 0.7); translate(0, -0.9, 0.4); material volumetric { density(0.8); } }
        """,
    ),
    "glow": (
        32,
        """
        canvas(96, 72); sky(0.08); light(none); background(#112); ground(-1, #776);
        torus { scale(0.5); rotate(60deg, axis = X); material diffuse { color(#222); glow(#f84, 4); } }
        sphere { scale(0.4); translate(0.9, -0.6, 0.3); } box { scale(0.5); translate(-1, -0.7, 0.2); }
        """,
    ),
}


@pytest.mark.browser
@pytest.mark.parametrize("name", SKIES)
def test_light_from_everywhere_is_near_the_networks(page: Any, name: str) -> None:
    least, text = SKIES[name]
    assert compared(page, nsg.compile(nsg.loads(text))) > least


@pytest.mark.browser
@pytest.mark.parametrize("name", ["room", "clouds"])
def test_drafts_of_light_give_way_to_better_ones(page: Any, name: str) -> None:
    least, text = SKIES[name]
    program = nsg.compile(nsg.loads(text))
    first = json.loads(view_of(program, draft=OPEN).message())
    assert np.array_equal(pictured(page, program, first), pictured(page, program))
    assert compared(page, program, OPEN) > 20
    assert compared(page, program, DRAFT) > least


@pytest.mark.browser
def test_lamps_of_a_radius_are_the_networks(page: Any) -> None:
    """On surfaces, in mist and through it."""
    text = """canvas(96, 72); light([3, 4, 3], 20, radius = 0.9); light([-2, 2, 3], 5, #8cf, 0.3);
        light([0, 3, 0], 3);
        sphere { scale(0.7); translate(-0.6, -0.3, 0); } torus { scale(0.6); translate(0.7, -0.82, 0.6); }
        sphere { scale(0.5); translate(0.9, 0.3, -0.5); material volumetric { color(#afc); } }"""
    assert compared(page, nsg.compile(nsg.loads(text))) > LEAST_DB[3]


def test_in_an_even_sky_white_things_send_what_they_receive() -> None:
    scene = nsg.loads("""sky(2, #fff, #fff); light(none); ground(none); sphere { scale(0.6); }
        box { scale(0.3); translate(0.8, 0.4, 0); }""")
    store = ArrayStore()
    part = volume(nsg.compile(scene), solids(), store)
    blob = np.frombuffer(store.bytes(), np.uint8)
    light = blob[part["light"][1] :][: 2 * part["light"][2]].view(np.uint16).reshape(3, -1) / 65535.0
    ratios = blob[part["ratios"][1] :][: part["ratios"][2]].reshape(8, 3, -1) / 127.0 - 128 / 127
    free = blob[part["free"][1] :][: part["free"][2]] > 0
    assert 0.5 < free.mean() < 0.95
    mean = part["top"] * light[:, free] ** 2
    assert abs(mean / 2 - 1).max() < 0.06  # colours count at most 0.98
    assert abs(ratios[:6, :, free]).max() < 0.1
    assert abs(ratios[6:, :, free] - 1 / 3).max() < 0.06


def solids() -> SolidArrays:
    found = load_arrays("solids3d")[0]
    assert isinstance(found, SolidArrays)
    return found


def field_at(program: Program, points: np.ndarray) -> np.ndarray:
    """Distance, colour and medium (M, 5) at points (M, 3), as numpy has them."""
    field = SolidField(solids(), program.vectors, program.tokens, program.brought(), program.paints())
    found = field.near(points.T, 0.0, every=True)
    return np.concatenate([found.distance[None], found.register[:3], found.register[-1:]]).T


@pytest.mark.browser
@pytest.mark.parametrize("name", CORNERS)
def test_corners_are_the_networks(page: Any, tmp_path: Path, name: str) -> None:
    brought = [element(torus, "ring"), noise(9, 9, 9, name="space"), noise(24, 16)]
    (tmp_path / "zoo.safetensors").write_bytes(element_file_bytes(brought))
    program = nsg.compile(nsg.loads(CORNERS[name], root=tmp_path))
    check_points(page, program)
    assert compared(page, program) > LEAST_DB[3]


@pytest.mark.browser
def test_textures_of_space_are_the_networks(page: Any) -> None:
    program = nsg.compile(nsg.loads(TILTED))
    assert all(any(paint.tilt) for paint in program.palette)
    check_points(page, program)
    assert compared(page, program) > LEAST_DB[3]


TILTED = """canvas(96, 64); camera(eye = [1, 3, 5]);
box { scale(3, 0.1, 3); translate(0, -1, 0); material bricks { scale(0.4); rotate(90deg, axis = X); } }
cylinder { scale(0.7); translate(-1, 0, 0); material checker { scale(2); rotate(2rad, axis = X); } }
torus { scale(0.5); translate(0.9, 0, 0.3); material linear {
  stop(0, #f40); stop(1, #04f); translate(0, 0, 0.2); rotate(60deg, axis = Y); } }"""


@pytest.mark.browser
def test_solid_trees_are_the_networks(page: Any) -> None:
    """Groups in groups and rounded cuts, of solids and of media."""
    for seed in (0, 2, 6, 8):
        program = nsg.compile(random_solid(np.random.default_rng(seed), SOLID_SETS["trees"]).sized((64, 48)))
        assert read_groups(program.tokens).deepest > 0
        check_points(page, program, inside=10, near=0.05)
        assert compared(page, program) > LEAST_DB[3], seed


@pytest.mark.browser
def test_rays_meet_what_groups_leave(page: Any) -> None:
    for name in LEFT:
        scene = scene_of(name)
        exact = np.asarray(nsg.render(scene, backend="reference"))
        assert psnr_db(pictured(page, nsg.compile(scene))[..., :3], exact) > 45, name


def check_points(page: Any, program: Program, inside: int = 250, near: float = np.inf) -> None:
    """Points around objects have the field's distance, colour and medium, up to a distance."""
    assert program.stage is not None
    rng, by = np.random.default_rng(0), program.stage.growth  # lengths grow so in the usual view
    balls = program.bounds[rng.integers(0, len(program), 5_000)]
    points = (balls[:, :3] + balls[:, 3:].clip(0, 3) * rng.uniform(-0.6, 0.6, (5_000, 3))).astype(np.float32)
    found, known = answered(page, program, points), field_at(usual_view(program), points * np.float32(by))
    found = found * np.float32([by, 1, 1, 1, 1])
    near *= by
    assert (known[:, 0] < 0).sum() > inside
    seen = known[:, 0] < near
    # on the border of a ball nothing may have been met, by the last bits
    border = seen & ((found[:, 0] > 0.99 * EMPTY) != (known[:, 0] > 0.99 * EMPTY))
    assert border.sum() <= 2
    seen &= ~border
    np.testing.assert_allclose(found[seen, 0], known[seen, 0], atol=1e-4)
    assert (found[~seen & ~border, 0] > near - 1e-3).all()
    # a colour gives way to another within 0.001 of distance, and so follows its last bits
    assert (abs(found - known)[seen].max(1) > 1e-4).mean() < 1e-3


@pytest.mark.browser
@pytest.mark.parametrize("name", ["cut", "itself", "two", "on mist"])
def test_faces_in_one_plane_are_as_the_formulas_say(page: Any, name: str) -> None:
    text = flush.scene(flush.SCENES[name])
    assert flush.wrong(pictured(page, nsg.compile(text))[..., :3], nsg.render(text, backend="reference")) < 8


# ---------------------------------------------------------------- exposure


@pytest.mark.browser
@pytest.mark.parametrize("more", ["", "background(none);"])
def test_pages_multiply_light_by_the_exposure(page: Any, more: str) -> None:
    for e in (0.4, 2.5):
        program = nsg.compile(nsg.loads(f"{EXPOSED} {more} camera(exposure = {e});"))
        assert compared(page, program) > 40


EXPOSED = """canvas(64, 48); sphere { scale(0.8); material diffuse { color(#b55); } }
torus { translate(1.2, 0.3, 0); material volumetric; }"""

# ---------------------------------------------------------------- every size


@pytest.mark.browser
@pytest.mark.parametrize("sky", ["", "sky();"])
def test_pages_do_not_depend_on_the_unit(page: Any, sky: str) -> None:
    """A blend, a cut, mist, a turn behind the scale, a ground that fades, a soft lamp."""

    def shown(k: float) -> np.ndarray:
        text = f"nsg 1; let k = {k!r}; {sky} {SCENE}"
        return pictured(page, nsg.compile(nsg.loads(text)), draft=DRAFT if sky else None)

    usual = shown(1.0)
    assert usual.std() > 0.1
    for k in (1e-3, 0.05, 1e3):
        assert psnr_db(shown(k), usual) > 45
