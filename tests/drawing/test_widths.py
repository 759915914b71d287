"""Blends of any width: pictures of the plane against the exact ones."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.compiler import steps
from scenelang.compiler.emit import emit
from scenelang.compiler.graph import Fold, Graph, Leaf, Link, Look, Move
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.spaces import PLANE
from scenelang.compiler.steps import Affine
from scenelang.compiler.weights import load_codes
from scenelang.drawing.exact.picture import reference_image
from scenelang.drawing.neural.draw import draw_objects
from scenelang.drawing.neural.files import load_arrays
from scenelang.language.words import Combine


def placed(geometry: str, x: float, y: float, rgb: tuple[float, float, float]) -> Leaf:
    rows = steps.compose(steps.translation(x, y), steps.scaling(0.35, 0.35))
    return Leaf(geometry, Look("flat", rgb=rgb), (Move(Affine(rows)),))


def scene(k: float, more: float) -> Graph:
    rows: list[tuple[Combine, Leaf, float]] = [
        ("union", placed("square", -0.4, -0.2, (0.9, 0.3, 0.2)), 0.15),
        ("smooth", placed("pentagon", 0.35, 0.1, (0.2, 0.5, 0.9)), k),
        ("subtract", placed("square", 0.0, -0.5, (0.0, 0.0, 0.0)), 0.15),
        ("smooth", placed("pentagon", -0.1, 0.7, (0.3, 0.8, 0.3)), more),
    ]
    links = tuple(Link(op, leaf, k) for op, leaf, k in rows)
    return Graph(Fold("scene", links), (96, 96), (1.0, 1.0, 1.0), PLANE)


@pytest.mark.parametrize(("k", "more"), [(0.15, 0.15), (0.02, 0.6), (0.6, 0.05), (1.2, 2.5)])
def test_pictures_are_those_of_the_reference(k: float, more: float) -> None:
    network, _ = load_arrays("shapes2d")
    graph = scene(k, more)
    exact = np.asarray(reference_image(graph), float)
    program = emit(graph, load_manifest("shapes2d"), load_codes("shapes2d"))
    image = np.asarray(draw_objects(network, program).image, float)
    every = np.asarray(draw_objects(network, program, skip=False).image, float)
    assert abs(image - every).mean() < 2e-4
    wrong = -10 * np.log10(np.square(image - exact).mean())
    usual = np.asarray(reference_image(scene(0.15, 0.15)), float)
    assert wrong > 33
    if k != 0.15:
        assert wrong > 8 - 10 * np.log10(np.square(usual - exact).mean())
