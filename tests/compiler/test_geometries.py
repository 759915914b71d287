"""The table of geometries: what its rows say of a leaf agrees."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.compiler.geometries import GEOMETRIES
from scenelang.language import words

SOLID, FLAT = words.LEAVES[3], words.LEAVES[2]
RNG = np.random.default_rng(1)


def test_every_geometry_of_the_language_has_a_row() -> None:
    assert GEOMETRIES.keys() == words.GEOMETRIES.keys()


@pytest.mark.parametrize("name", GEOMETRIES)
def test_bounds_hold_the_leaf(name: str) -> None:
    row, d = GEOMETRIES[name], 2 if name in FLAT else 3
    p = RNG.uniform(-1.1, 1.1, (d, 20_000))
    inside = p[:, row.distance(p) < 0]
    assert np.linalg.norm(inside, axis=0).max() <= 1.0
    assert (row.distance(p[:, np.linalg.norm(p, axis=0) < row.inner]) < 0).all()
    if d == 3:
        assert (abs(inside).max(1) <= row.half).all()
    for (ax, ay), (bx, by) in zip(row.corners, (*row.corners[1:], *row.corners[:1]), strict=True):
        left = (bx - ax) * (inside[1] - ay) - (by - ay) * (inside[0] - ax)
        assert (left > -1e-12).all()


@pytest.mark.parametrize("name", SOLID)
def test_gradients_and_surfaces_are_those_of_the_distance(name: str) -> None:
    row = GEOMETRIES[name]
    assert row.slopes is not None
    assert row.surface is not None
    assert abs(row.distance(row.surface(RNG.random((2, 1000))))).max() < 1e-12
    p, step = RNG.uniform(-1, 1, (3, 1000)), 1e-6
    d, *slopes = row.slopes(p)
    np.testing.assert_allclose(d, row.distance(p))
    for axis, slope in enumerate(slopes):
        move = step * np.eye(3)[:, axis, None]
        np.testing.assert_allclose(
            slope, (row.distance(p + move) - row.distance(p - move)) / (2 * step), atol=1e-3
        )
    assert row.distance([0.1, 0.2, 0.3]) == pytest.approx(row.distance(np.array([[0.1], [0.2], [0.3]]))[0])
    assert row.thickness <= 2 * min(row.half) + 1e-12
