"""Affine maps in closed form, against numpy's matrices."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from scenelang.compiler import steps
from scenelang.compiler.spaces import PLANE, SPACES, Plane, flattened
from scenelang.compiler.steps import Affine, Rows, Warp

RNG = np.random.default_rng(11)
MAPS = [tuple(RNG.normal(size=12).tolist()) for _ in range(20)]
SOLID = SPACES[3]


def matrix(rows: Rows) -> np.ndarray:
    return np.vstack([np.array(rows).reshape(3, 4), [0, 0, 0, 1]])


def turned(plane: bool = False) -> Rows:
    """A rotation by a random angle, about a random axis or about z."""
    axis = (0.0, 0.0, 1.0) if plane else tuple(RNG.normal(size=3).tolist())
    return steps.rotation(float(RNG.uniform(-4, 4)), axis)


def similarity(rows: Rows) -> tuple[float, float] | None:
    """Scale, and -1 where it mirrors, as they show in what a twirl of 1 becomes before the map."""
    found = PLANE.before(rows, Warp(1.0, (0.0, 0.0)))
    return None if found is None else (abs(found.twirl), 1.0 if found.twirl > 0 else -1.0)


def test_spaces_know_their_dimension() -> None:
    assert {dimension: space.dimension for dimension, space in SPACES.items()} == {2: 2, 3: 3}


def test_maps_compose_and_invert_as_matrices_do() -> None:
    for outer, inner in itertools.pairwise(MAPS):
        np.testing.assert_allclose(matrix(steps.compose(outer, inner)), matrix(outer) @ matrix(inner))
        flat = matrix(flattened(outer))
        np.testing.assert_array_equal(flat[:2][:, [0, 1, 3]], matrix(outer)[:2][:, [0, 1, 3]])
        np.testing.assert_array_equal(flat[2], [0, 0, 1, 0])
        np.testing.assert_array_equal(flat[:2, 2], [0, 0])
        disc = Plane().disc("square", (Affine(flattened(outer)),))
        assert disc is not None
        np.testing.assert_allclose(matrix(disc[1]), np.linalg.inv(flat), rtol=1e-9, atol=1e-12)


def test_a_rotation_is_the_exponential_of_its_axis() -> None:
    for _ in range(20):
        axis, angle = RNG.normal(size=3), float(RNG.uniform(-4, 4))
        x, y, z = axis / np.linalg.norm(axis)
        turn = angle * np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        term, total = np.eye(3), np.eye(3)
        for n in range(1, 60):
            term = term @ turn / n
            total = total + term
        found = matrix(steps.rotation(angle, tuple(axis.tolist())))
        np.testing.assert_allclose(found[:3, :3], total, atol=1e-10)
        np.testing.assert_array_equal(found[:3, 3], 0)


def test_scales_shifts_and_shears() -> None:
    np.testing.assert_array_equal(matrix(steps.scaling(2, 3, 5)), np.diag([2, 3, 5, 1]))
    np.testing.assert_array_equal(matrix(steps.translation(2, 3, 5))[:, 3], [2, 3, 5, 1])
    np.testing.assert_array_equal(matrix(steps.translation(2, 3, 5))[:, :3], np.eye(4)[:, :3])
    for row, column in itertools.permutations(range(3), 2):
        expected = np.eye(4)
        expected[row, column] = 0.7
        np.testing.assert_array_equal(matrix(steps.shearing("xyz"[row] + "xyz"[column], 0.7)), expected)


@pytest.mark.parametrize("ratio", [1.0, 1e-3, 1e-6])
def test_stretches_of_maps_made_of_known_ones(ratio: float) -> None:
    for _ in range(20):
        scales = steps.scaling(2.0, 2.0 * ratio, 2.0 * ratio**0.5)
        rows = steps.compose(turned(), steps.compose(scales, turned()))
        assert SOLID.stretches(rows) == pytest.approx((2.0 * ratio, 2.0), rel=1e-6)
        scales = steps.scaling(-2.0, 2.0 * ratio, 9.0)
        rows = steps.compose(turned(True), steps.compose(scales, turned(True)))
        assert PLANE.stretches(rows) == pytest.approx((2.0 * ratio, 2.0), rel=1e-6)
    for space in (PLANE, SOLID):
        assert space.stretches(steps.scaling(0, 0, 0)) == (0, 0)


def test_what_is_a_similarity() -> None:
    for _ in range(20):
        rows = steps.compose(turned(True), steps.scaling(0.3, 0.3))
        assert similarity(rows) == (pytest.approx(0.3), 1.0)
        assert similarity(steps.compose(rows, steps.scaling(-1, 1))) == (pytest.approx(0.3), -1.0)
        for other in (
            *(steps.translation(x, y) for x, y in ((1e-3, 0), (0, 1e-3), (-1e-3, 0), (0, -1e-11))),
            *(steps.scaling(x, y) for x, y in ((1, 1.001), (1.001, 1), (-1, 1.001))),
            *(steps.shearing(axes, 1e-3) for axes in ("xy", "yx")),
        ):
            assert similarity(steps.compose(other, rows)) is None
        rounded = steps.compose(steps.translation(1e-14, -1e-14), rows)
        assert similarity(rounded) == (pytest.approx(0.3), 1.0)
