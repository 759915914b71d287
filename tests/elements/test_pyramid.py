"""Pyramids of distances: how near they are, and that any bytes are one."""

from __future__ import annotations

import zlib

import numpy as np
import pytest

from scenelang.elements.element import Element
from scenelang.elements.pyramid import between, unpacked
from tests.elements.shapes import Formula, ball, element, torus


@pytest.mark.parametrize("d", [2, 3])
def test_cubics_come_out_as_they_are(d: int) -> None:
    def cubic(n: int) -> np.ndarray:
        axes = np.meshgrid(*[np.linspace(-1, 1, n)] * d, indexing="ij")
        return sum((k + 1) * x**3 - x * x + 0.5 * k for k, x in enumerate(axes)).astype(np.float32)

    np.testing.assert_allclose(between(cubic(7)), cubic(13), atol=3e-6)


@pytest.mark.parametrize(("formula", "cells"), [(ball, 4), (torus, 4), (torus, 6)])
def test_nodes_near_the_surface_are_off_by_half_a_step(formula: Formula, cells: int) -> None:
    made = element(formula, cells=cells, levels=4)
    grid = unpacked(made)
    axis = np.linspace(-1, 1, len(grid))
    true = formula(*np.meshgrid(*[axis] * 3, indexing="ij"))
    side = 2 / (made.sides[-1] - 1)
    known = (slice(None, None, 2),) * 3  # those between are expected
    near = abs(true[known]) < side / 4
    assert abs(grid[known] - true[known])[near].max() <= side / 48 * 1.001
    inside = np.linalg.norm(np.meshgrid(*[axis] * 3, indexing="ij"), axis=0) < 1
    share = abs(grid - true)[inside] / (abs(true[inside]) + side)
    assert share.max() < 0.2  # farther away a share of the distance


def test_smooth_shapes_are_small() -> None:
    assert len(element(torus, levels=5).data) < 7000  # 65 nodes a side, 274,625 in all


@pytest.mark.parametrize("value", [1, 127, 128, 129, 255])
def test_any_bytes_are_distances(value: int) -> None:
    count = sum((4 * 2**level + 1) ** 3 for level in range(5))
    grid = unpacked(Element("x", "pyramid", (3, 4, 5), "deflate", zlib.compress(bytes([value]) * count)))
    assert grid.shape == (129, 129, 129)
    assert abs(grid).max() < 8
