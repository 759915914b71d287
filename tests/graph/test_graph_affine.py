"""Affine maps in closed form, against numpy's matrices."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from scenelang.graph import affine

RNG = np.random.default_rng(11)
MAPS = [tuple(RNG.normal(size=12).tolist()) for _ in range(20)]


def matrix(rows: affine.Rows) -> np.ndarray:
    return np.vstack([np.array(rows).reshape(3, 4), [0, 0, 0, 1]])


def test_maps_compose_and_invert_as_matrices_do() -> None:
    for outer, inner in itertools.pairwise(MAPS):
        np.testing.assert_allclose(matrix(affine.compose(outer, inner)), matrix(outer) @ matrix(inner))
        flat = matrix(affine.flattened(outer))
        np.testing.assert_array_equal(flat[:2][:, [0, 1, 3]], matrix(outer)[:2][:, [0, 1, 3]])
        np.testing.assert_array_equal(flat[2], [0, 0, 1, 0])
        np.testing.assert_array_equal(flat[:2, 2], [0, 0])
        back = matrix(affine.inverted(affine.flattened(outer)))
        np.testing.assert_allclose(back, np.linalg.inv(flat), rtol=1e-9, atol=1e-12)


def test_a_rotation_is_the_exponential_of_its_axis() -> None:
    for _ in range(20):
        axis, angle = RNG.normal(size=3), float(RNG.uniform(-4, 4))
        x, y, z = axis / np.linalg.norm(axis)
        turn = angle * np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        term, total = np.eye(3), np.eye(3)
        for n in range(1, 60):
            term = term @ turn / n
            total = total + term
        found = matrix(affine.rotation(angle, tuple(axis.tolist())))
        np.testing.assert_allclose(found[:3, :3], total, atol=1e-10)
        np.testing.assert_array_equal(found[:3, 3], 0)


def test_scales_shifts_and_shears() -> None:
    np.testing.assert_array_equal(matrix(affine.scaling(2, 3, 5)), np.diag([2, 3, 5, 1]))
    np.testing.assert_array_equal(matrix(affine.translation(2, 3, 5))[:, 3], [2, 3, 5, 1])
    np.testing.assert_array_equal(matrix(affine.translation(2, 3, 5))[:, :3], np.eye(4)[:, :3])
    for row, column in itertools.permutations(range(3), 2):
        expected = np.eye(4)
        expected[row, column] = 0.7
        np.testing.assert_array_equal(matrix(affine.shearing("xyz"[row] + "xyz"[column], 0.7)), expected)


@pytest.mark.parametrize("ratio", [1.0, 1e-3, 1e-6])
def test_stretches_of_maps_made_of_known_ones(ratio: float) -> None:
    """Turned about known axes, from the largest to the smallest stretch, in the plane and in space."""
    for _ in range(20):
        u, v = (
            affine.rotation(float(RNG.uniform(-4, 4)), tuple(RNG.normal(size=3).tolist())) for _ in range(2)
        )
        rows = affine.compose(u, affine.compose(affine.scaling(2.0, 2.0 * ratio, 2.0 * ratio**0.5), v))
        assert affine.stretches(rows, 3) == pytest.approx((2.0 * ratio, 2.0), rel=1e-6, abs=1e-15)
        u, v = affine.rotation(float(RNG.uniform(-4, 4))), affine.rotation(float(RNG.uniform(-4, 4)))
        rows = affine.compose(u, affine.compose(affine.scaling(-2.0, 2.0 * ratio, 9.0), v))
        assert affine.stretches(rows, 2) == pytest.approx((2.0 * ratio, 2.0), rel=1e-6, abs=1e-15)
    assert (
        affine.stretches(affine.scaling(0, 0, 0), 3) == affine.stretches(affine.scaling(0, 0, 0), 2) == (0, 0)
    )


def test_what_is_a_similarity() -> None:
    for angle in RNG.uniform(-4, 4, 20).tolist():
        turned = affine.compose(affine.rotation(angle), affine.scaling(0.3, 0.3))
        assert affine.similarity(turned) == (pytest.approx(0.3), 1.0)
        assert affine.similarity(affine.compose(turned, affine.scaling(-1, 1))) == (pytest.approx(0.3), -1.0)
        for other in (
            affine.translation(1e-3, 0), affine.translation(0, 1e-3), affine.scaling(1, 1.001),
            affine.scaling(1.001, 1),
            affine.shearing("xy", 1e-3), affine.shearing("yx", 1e-3), affine.translation(0, -1e-11),
        ):  # fmt: skip
            assert affine.similarity(affine.compose(other, turned)) is None
        rounded = affine.compose(affine.translation(1e-14, -1e-14), turned)
        assert affine.similarity(rounded) == (pytest.approx(0.3), 1.0)
