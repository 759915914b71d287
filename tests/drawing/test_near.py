"""Parts of exact pictures, with what can matter in each: the picture is that of all objects everywhere."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import scenelang as nsg
from lab.sets.plane import SETS, random_scene
from scenelang.compiler.graph import Fold, Node, leaves
from scenelang.drawing.exact import field
from scenelang.drawing.exact.field import Brought, evaluate, parts, within
from scenelang.drawing.exact.picture import graph_outputs, reference_image
from scenelang.drawing.render import exact_graph

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
        whole.setattr("scenelang.drawing.exact.picture.parts", everywhere)
        assert np.array_equal(drawn, reference_image(graph))
        assert np.array_equal(found.object, graph_outputs(graph).object)
        assert np.array_equal(found.alpha, graph_outputs(graph).alpha)


@pytest.mark.parametrize(
    "name", ["shapes2d", "chains", "groups", "twelve", "tree", "wide", "tiny", "strong", "many"]
)
def test_pictures_are_those_of_all_objects_everywhere(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(list(name.encode()))
    for _ in range(3):
        check(random_scene(rng, SETS[name]).model_copy(update={"canvas": (90, 70)}), monkeypatch)


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
    graph, _ = exact_graph(nsg.loads(f"canvas(320, 240); {text}"))
    seen, met = np.zeros((240, 320), int), 0
    for node, rows, columns in parts(graph.root, graph.canvas, None):
        seen[rows.start : rows.stop, columns.start : columns.stop] += 1
        met += len(rows) * len(columns) * sum(1 for _ in leaves(node))
    assert (seen == 1).all()
    assert met < 8 * seen.size  # of 400
