"""The vectorised reference against a slow loop in plain floats, and against facts known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

import scenelang as nsg
from lab.sets.plane import SETS, random_scene
from scenelang.compiler.geometries import SECTORS
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.exact.field import leaf_distance
from scenelang.drawing.exact.picture import reference_image
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import (
    Chain,
    Color,
    Grayscale,
    Hue,
    Link,
    Material,
    Object,
    Rotate,
    Scale,
    Scene,
)
from tests.drawing import oracle


def picture(scene: Scene) -> np.ndarray:
    return np.asarray(reference_image(lower(scene, load_manifest("shapes2d"), None, Diagnostics())))


@pytest.mark.parametrize("geometry", SECTORS)
def test_distance_equals_a_loop_over_edges(geometry: str) -> None:
    points = np.random.default_rng(1).uniform(-2.5, 2.5, (2000, 2))
    corners = oracle.outline(geometry)
    slow = [oracle.polygon_distance(corners, *p) for p in points.tolist()]
    np.testing.assert_allclose(leaf_distance(geometry, points.T), slow, atol=1e-12)


def test_solid_distances_equal_the_nearest_of_many_points() -> None:
    rng = np.random.default_rng(2)
    points, (u, v) = rng.uniform(-2, 2, (3, 60)), np.mgrid[0 : math.tau : 900j, 0 : math.tau : 900j]
    surfaces = {
        "sphere": (np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)),
        "torus": ((0.7 + 0.3 * np.cos(v)) * np.cos(u), 0.3 * np.sin(v), (0.7 + 0.3 * np.cos(v)) * np.sin(u)),
    }
    for geometry, surface in surfaces.items():
        on = np.stack([c.ravel() for c in surface], 1)
        nearest = [np.sqrt(((on - p) ** 2).sum(1).min()) for p in points.T]
        d = leaf_distance(geometry, points)
        np.testing.assert_allclose(abs(d), nearest, atol=2e-4)
        inside = points[0] ** 2 + points[1] ** 2 + points[2] ** 2 < 1
        if geometry == "torus":
            inside = (np.hypot(points[0], points[2]) - 0.7) ** 2 + points[1] ** 2 < 0.09
        assert ((d < 0) == inside).all()


@pytest.mark.parametrize("name", ["shapes2d", "chains", "groups", "twelve", "shuffled", "tree", "wide"])
def test_picture_equals_the_slow_loop(name: str) -> None:
    rng = np.random.default_rng(list(name.encode()))
    for _ in range(2):
        scene = random_scene(rng, SETS[name]).model_copy(update={"canvas": (26, 18)})
        np.testing.assert_allclose(picture(scene), oracle.draw(scene), atol=1e-6)


def test_colour_operations_equal_the_slow_loop() -> None:
    ops = (Color(rgb=(0.9, 0.3, 1.7)), Hue(angle=1.1), Grayscale(amount=0.3), Color(rgb=(0.5, 1.0, 0.8)))
    scene = Scene(canvas=(8, 8), nodes=(Object(geometry="square", material=Material(name="flat", ops=ops)),))
    np.testing.assert_allclose(picture(scene), oracle.draw(scene), atol=1e-6)


def test_areas_are_those_of_the_polygons() -> None:
    for geometry, area in (
        ("square", 2.0),
        ("triangle", 3 * math.sqrt(3) / 4),
        ("pentagon", 2.5 * math.sin(math.tau / 5)),
        ("star", 5 * 0.381966 * math.sin(math.pi / 5)),
    ):
        scene = Scene(canvas=(512, 512), background=(0, 0, 0), nodes=(Object(geometry=geometry),))
        assert picture(scene)[..., 0].mean() * 4 == pytest.approx(area, rel=1e-3)


def test_an_empty_scene_is_its_background() -> None:
    assert np.all(picture(Scene(canvas=(5, 3), background=(0.25, 0.5, 1.0))) == (0.25, 0.5, 1.0))


def test_without_background_alpha_is_coverage() -> None:
    disc = Object(geometry="square", transforms=(Scale(x=2, y=2, z=1),))
    image = picture(Scene(canvas=(4, 8), background=None, nodes=(disc,)))
    assert image.shape == (8, 4, 4)
    assert image[3, 2, 3] == 1.0
    assert image[0, 0, 3] == 0.0


def test_rows_run_downwards_and_y_upwards() -> None:
    image = picture(Scene(canvas=(64, 64), background=(0, 0, 0), nodes=(Object(geometry="triangle"),)))
    widths = image[..., 0].sum(1)
    assert widths[4] < widths[40]  # a vertex at +y: narrow above, wide below


def test_a_quarter_turn_is_counter_clockwise() -> None:
    turned = Object(geometry="triangle", transforms=(Rotate(angle=math.pi / 2),))
    image = picture(Scene(canvas=(64, 64), background=(0, 0, 0), nodes=(turned,)))
    heights = image[..., 0].sum(0)
    assert heights[4] < heights[40]  # the vertex now points to -x


def test_later_objects_are_drawn_over_earlier_ones() -> None:
    red = Object(geometry="square", material=Material(name="flat", ops=(Color(rgb=(1, 0, 0)),)))
    blue = Object(geometry="star", material=Material(name="flat", ops=(Color(rgb=(0, 0, 1)),)))
    image = picture(Scene(canvas=(9, 9), nodes=(Chain(children=(Link(node=red), Link(node=blue))),)))
    assert image[4, 4].tolist() == [0, 0, 1]


@pytest.mark.parametrize(
    "nothing",
    [
        "group { }",
        "group { group { } }",
        "subtract { group { } star { } }",
        "intersect { star { } group { } }",
    ],
)
def test_nothing_blends_with_the_empty_set(nothing: str) -> None:
    """However it is written, and whichever comes first."""
    canvas, shape = "canvas(16, 16); background(#000);", "square { scale(0.5); }"
    alone = nsg.render(nsg.loads(f"{canvas} {shape}"), backend="reference")
    for both in (f"{shape} {nothing}", f"{nothing} {shape}"):
        found = nsg.render(nsg.loads(f"{canvas} smooth {{ {both} }}"), backend="reference")
        np.testing.assert_array_equal(found, alone)
