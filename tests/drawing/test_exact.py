"""The exact picture of the plane against slow loops in plain floats, closed forms, and itself in parts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import scenelang as nsg
from lab.sets.plane import SETS, random_scene
from scenelang.assets.picture import painted as of_texels
from scenelang.compiler.geometries import SECTORS
from scenelang.compiler.graph import ColourStep, Fold, Look, Node, leaves
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.program import Paint
from scenelang.compiler.steps import Affine, composed
from scenelang.drawing.exact import field
from scenelang.drawing.exact.field import (
    Brought,
    carry_back,
    colour_at,
    evaluate,
    leaf_distance,
    parts,
    within,
)
from scenelang.drawing.exact.picture import graph_outputs, reference_image
from scenelang.drawing.render import exact_graph
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import (
    Color,
    Grayscale,
    Hue,
    Material,
    Object,
    Scale,
    Scene,
)
from tests.assets.shapes import noise
from tests.drawing import oracle
from tests.drawing.slow import painted


def picture(scene: Scene) -> np.ndarray:
    return np.asarray(reference_image(lower(scene, load_manifest("shapes2d"), None, Diagnostics())))


@pytest.mark.parametrize("geometry", SECTORS)
def test_distance_equals_a_loop_over_edges(geometry: str) -> None:
    points = np.random.default_rng(1).uniform(-2.5, 2.5, (2000, 2))
    corners = oracle.outline(geometry)
    slow = [oracle.polygon_distance(corners, *p) for p in points.tolist()]
    np.testing.assert_allclose(leaf_distance(geometry, points.T), slow, atol=1e-12)


@pytest.mark.parametrize(
    "name", ["shapes2d", "chains", "groups", "twelve", "shuffled", "tree", "wide", "skins"]
)
def test_picture_equals_the_slow_loop(name: str) -> None:
    rng = np.random.default_rng(list(name.encode()))
    for _ in range(2):
        scene = random_scene(rng, SETS[name]).model_copy(update={"canvas": (16, 12)})
        np.testing.assert_allclose(picture(scene), oracle.draw(scene), atol=1e-6)


def test_colour_operations_equal_the_slow_loop() -> None:
    ops = (Color(rgb=(0.9, 0.3, 1.7)), Hue(angle=1.1), Grayscale(amount=0.3), Color(rgb=(0.5, 1.0, 0.8)))
    scene = Scene(canvas=(8, 8), nodes=(Object(geometry="square", material=Material(name="flat", ops=ops)),))
    np.testing.assert_allclose(picture(scene), oracle.draw(scene), atol=1e-6)


def test_without_background_alpha_is_coverage() -> None:
    disc = Object(geometry="square", transforms=(Scale(x=2, y=2, z=1),))
    image = picture(Scene(canvas=(4, 8), background=None, nodes=(disc,)))
    assert image.shape == (8, 4, 4)
    assert image[3, 2, 3] == 1.0
    assert image[0, 0, 3] == 0.0


def test_nothing_blends_with_the_empty_set() -> None:
    """However it is written, and whichever comes first."""
    canvas, shape = "canvas(16, 16); background(#000);", "square { scale(0.5); }"
    alone = nsg.render(nsg.loads(f"{canvas} {shape}"), backend="reference")
    empty = "group { }", "group { group { } }", "subtract { group { } star { } }"
    for nothing in (*empty, "intersect { star { } group { } }"):
        for both in (f"{shape} {nothing}", f"{nothing} {shape}"):
            found = nsg.render(nsg.loads(f"{canvas} smooth {{ {both} }}"), backend="reference")
            np.testing.assert_array_equal(found, alone, nothing)


STEPS: list[tuple[ColourStep, ...]] = [
    (),
    (("color", 0.5, 2.0, 0.9), ("hue", 0.3)),
    (("hue", -1.7), ("grayscale", 0.4), ("color", 0.2, 1.0, 1.0), ("hue", 0.05)),
    (("grayscale", 1.0), ("hue", 0.5)),
]


@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize("light", [False, True])
@pytest.mark.parametrize("sides", [(5, 7), (1, 3), (4, 4, 4)])
def test_colours_are_those_of_a_loop(
    sides: tuple[int, ...], light: bool, steps: tuple[ColourStep, ...]
) -> None:
    rng = np.random.default_rng(3)
    flat = len(sides) == 2
    matrix = np.eye(4)
    matrix[:2, [0, 1, 3]] = rng.normal(size=(2, 3))
    moves = (Affine((2.0, 0, 0, 0.3, 0, -0.5, 0, 0, 0, 0, 1, 0)), Affine(tuple(matrix[:3].reshape(-1))))
    element = noise(*sides)
    look = Look("flat", steps, element=element, texture=moves if flat else ())
    points = rng.uniform(-3, 3, (60, 2 if flat else 3))
    found = colour_at(look, carry_back(look.texture, points.T), light)
    back = np.linalg.inv(np.vstack([np.reshape(composed(look.texture), (3, 4)), (0, 0, 0, 1)]))
    frame = back[:2, [0, 1, 3]].reshape(-1)
    expected = painted(Paint(element, steps), frame, points, light=light)
    np.testing.assert_allclose(found, expected, atol=2e-7)


def test_hues_of_grey_and_of_pure_colours() -> None:
    """A third of a turn makes red green and yellow cyan; grey has no hue."""
    colours = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [128] * 3, [255] * 3, [0] * 3, [255, 255, 0]])
    expected = np.array([[0, 255, 0], [0, 0, 255], [255, 0, 0], [128] * 3, [255] * 3, [0] * 3, [0, 255, 255]])
    row = of_texels("row", colours[None].astype(np.uint8))
    look = Look("flat", (("hue", 1 / 3),), element=row)
    middles = (np.arange(7) + 0.5) / 7 * 2 - 1
    np.testing.assert_allclose(colour_at(look, (middles, 0 * middles)), expected / 255, atol=1e-12)


TREES = """canvas(90, 70); background(none);
square { scale(3, 0.02); translate(0, 0.3); }
subtract {
  group { star { scale(0.3); } pentagon { scale(0.2); translate(0.5, 0); } }
  triangle { scale(0.1); }
}
smooth { square { scale(0.2); translate(-0.6, 0.5); } star { scale(0.2); translate(-0.4, 0.6); } }
chain {
  triangle { scale(0.2); translate(0.8, -0.6); }
  subtract square { scale(0.1); translate(0.8, -0.6); }
  star { scale(0.2); translate(-0.9, -0.7); }
  intersect square { scale(0.5); translate(-0.8, -0.7); }
  subtract pentagon { scale(0.1); translate(-0.9, -0.7); }
}
group { square { scale(0.1); translate(0.5, 0.5); } bend(1.5); translate(0.1, 0.2); twirl(2); }
"""


def everywhere(root: Fold, canvas: tuple[int, int], _: Brought | None) -> Iterator[tuple[Node, range, range]]:
    """One part with everything."""
    yield root, range(canvas[1]), range(canvas[0])


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small pictures have many parts too."""
    monkeypatch.setattr(field, "_LEAST", 50)
    monkeypatch.setattr(field, "_FEW", 0)


def check(scene: nsg.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    graph, _ = exact_graph(scene)
    drawn, found = reference_image(graph), graph_outputs(graph)
    with monkeypatch.context() as whole:
        whole.setattr("scenelang.drawing.exact.picture.parts", everywhere)
        assert np.array_equal(drawn, reference_image(graph))
        assert np.array_equal(found.object, graph_outputs(graph).object)
        assert np.array_equal(found.alpha, graph_outputs(graph).alpha)


@pytest.mark.parametrize("name", ["shapes2d", "chains", "groups", "twelve", "tree", "wide", "tiny", "strong"])
def test_pictures_are_those_of_all_objects_everywhere(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(list(name.encode()))
    check(random_scene(rng, SETS[name]).model_copy(update={"canvas": (56, 40)}), monkeypatch)


def test_all_booleans_and_far_coordinates(monkeypatch: pytest.MonkeyPatch) -> None:
    check(nsg.loads(TREES), monkeypatch)
    there, back = (f"translate({sign}1e15, 0.3);" for sign in ("", "-"))
    check(nsg.loads(f"canvas(64, 64); star {{ {there} rotate(1rad); rotate(-1rad); {back} }}"), monkeypatch)


def test_distances_in_a_disc_are_above_their_bound() -> None:
    rng = np.random.default_rng(5)
    near_ones = 0
    for scene in (nsg.loads(TREES), *(random_scene(rng, SETS["strong"]) for _ in range(5))):
        root = exact_graph(scene)[0].root
        for _ in range(40):
            centre, radius = rng.uniform(-1, 1, (2, 1)), float(rng.uniform(0, 0.4))
            angle, r = rng.uniform(0, 2 * np.pi, 300), radius * np.sqrt(rng.uniform(0, 1, 300))
            p = centre + r * np.stack([np.cos(angle), np.sin(angle)])
            low, kept = within(root, centre, radius)
            d, c = evaluate(root, p)
            assert low <= d.min() + 1e-9
            near_ones += low > d.min() - 3 * radius
            other, colour = evaluate(kept, p)
            assert np.array_equal(other < 0, d < 0)
            assert np.array_equal(colour[d < 0], c[d < 0])
    assert near_ones > 20  # the bound says something


def test_each_pixel_is_in_one_part_and_meets_few_of_many_objects() -> None:
    text = (
        "for (i in 0..<400) { star { scale(0.03); translate(0.1 * (i % 20) - 1, 0.1 * floor(i / 20) - 1); } }"
    )
    graph, _ = exact_graph(nsg.loads(f"canvas(160, 120); {text}"))
    seen, met = np.zeros((120, 160), int), 0
    for node, rows, columns in parts(graph.root, graph.canvas, None):
        seen[rows.start : rows.stop, columns.start : columns.stop] += 1
        met += len(rows) * len(columns) * sum(1 for _ in leaves(node))
    assert (seen == 1).all()
    assert met < 8 * seen.size  # of 400
