"""Polygons of outlines lie where the reference's distance is 0, and are painted as its unions are."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from lab.frontier.outlines import TOLERANCE, outlines
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.graph.lower import lower
from scenelang.graph.nodes import Graph
from scenelang.models.manifest import load_manifest
from scenelang.reference.field import evaluate


def graph_of(text: str) -> Graph:
    scene = nsg.loads(f"nsg 1; {text}")
    return lower(scene, load_manifest("shapes2d"), None, Diagnostics())


@pytest.mark.parametrize("geometry", ["square", "triangle", "star", "pentagon"])
@pytest.mark.parametrize(
    "moves",
    [
        "scale(0.5, 0.3); rotate(20deg); translate(0.2, -0.1);",
        "twirl(0.8); bend(-0.8); scale(0.5, 0.3); rotate(70deg); translate(-0.3, 0.4);",
        "scale(0.4); bend(0.9); shear(xy = 0.3); rotate(1rad); twirl(2);",
    ],
)
def test_the_middles_of_edges_are_within_a_fiftieth_of_a_pixel(geometry: str, moves: str) -> None:
    """How far a point is off: the distance over its slope, which is 1 for equal scales alone."""
    graph = graph_of(f"canvas(300, 200); {geometry} {{ {moves} }}")
    ((points, _),) = outlines(graph)
    unit = 100
    world = (points - [[150], [100]]) / [[unit], [-unit]]
    for middle in (0.0, 0.25, 0.5):
        p = (1 - middle) * world + middle * np.roll(world, -1, 1)
        step = 1e-6
        d = evaluate(graph.root, p)[0]
        slope = np.stack(
            [
                evaluate(graph.root, p + e)[0] - evaluate(graph.root, p - e)[0]
                for e in (np.array([[step], [0]]), np.array([[0], [step]]))
            ]
        )
        off = unit * abs(d) / np.hypot(*slope / (2 * step)).clip(1e-3)
        assert off.max() < (1e-4 if middle == 0 else TOLERANCE)
    assert points.shape[1] < 3000


def test_later_objects_hide_earlier_ones_as_in_the_definition() -> None:
    graph = graph_of("square { scale(0.5); material flat { color(#f00); } } star { scale(0.3); }")
    assert [outline.colour[1] for outline in outlines(graph)] == [0.0, 1.0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("chain { square; smooth star; }", "`smooth` is not drawn"),
        ("square { scale(3); bend(0.8); }", "folds the object over itself"),
    ],
)
def test_what_no_polygon_says_is_refused(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        outlines(graph_of(text))
