"""The solids' field at points anywhere, asked as far as it matters, against the exact reference."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.drawing.closed import ClosedSolids
from scenelang.drawing.exact.solid import ExactField
from tests.drawing.solids import Object, field, graph, moved, random_tree, scaled, tree_field, tree_graph

CLOSED = ClosedSolids("solids3d")


def points(seed: int, spread: float, count: int = 4000) -> tuple[np.ndarray, np.ndarray]:
    """Points (3, M) and a reach (M,) for each."""
    rng = np.random.default_rng(seed)
    reach = 0.03 * 1.75 ** rng.integers(0, 7, count)
    return rng.uniform(-spread, spread, (3, count)).astype(np.float32), reach.astype(np.float32)


@pytest.mark.parametrize("seed", range(8))
def test_distances_of_trees_are_those_of_the_reference(seed: int) -> None:
    """Within the reach, on both sides of surfaces."""
    tree = random_tree(np.random.default_rng(seed), 3, (0.0, 0.5)[seed % 2])
    p, reach = points(seed, 1.5)
    result = tree_field(tree, CLOSED).near(p, reach, gradient=True, every=True)
    truth = ExactField(tree_graph(tree)).at(p.astype(float)).d
    assert abs(np.clip(result.distance, -reach, reach) - np.clip(truth, -reach, reach)).max() < 2e-3


def test_far_objects_are_not_met() -> None:
    """Each point meets those in its reach."""
    rng = np.random.default_rng(5)
    balls = [Object("sphere", (scaled(0.1), moved(*rng.uniform(-2, 2, 3)))) for _ in range(48)]
    p, reach = points(6, 2.5)
    result = field(balls, CLOSED).near(p, reach)
    truth = ExactField(graph(balls)).at(p.astype(float)).d
    assert abs(np.minimum(result.distance, reach) - np.minimum(truth, reach)).max() < 1e-4
    assert result.met < p.shape[1] * len(balls) / 4
