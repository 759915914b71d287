"""Pyramids of distances: how near they are, and that any bytes are one."""

from __future__ import annotations

import hashlib
import zlib

import numpy as np
import pytest

from scenelang.assets.element import Element
from scenelang.assets.pyramid import between, unpacked
from scenelang.assets.zoo import read_zoo, zoo_bytes
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.neural.assets import GridShape
from tests.assets.shapes import Formula, ball, element, torus


@pytest.mark.parametrize("d", [2, 3])
def test_cubics_come_out_as_they_are(d: int) -> None:
    def cubic(n: int) -> np.ndarray:
        axes = np.meshgrid(*[np.linspace(-1, 1, n)] * d, indexing="ij")
        return sum((k + 1) * x**3 - x * x + 0.5 * k for k, x in enumerate(axes)).astype(np.float32)

    np.testing.assert_allclose(between(cubic(7)), cubic(13), atol=3e-6)


@pytest.mark.parametrize("finer", [False, True])
@pytest.mark.parametrize(("formula", "cells"), [(ball, 4), (torus, 4), (torus, 6)])
def test_nodes_near_the_surface_are_off_by_half_a_step(formula: Formula, cells: int, finer: bool) -> None:
    made = element(formula, cells=cells, levels=4, finer=finer)
    grid = unpacked(made)
    axis = np.linspace(-1, 1, len(grid))
    true = formula(*np.meshgrid(*[axis] * 3, indexing="ij"))
    side = 2 / (made.sides[-1] - 1)
    known = (slice(None, None, 2),) * 3  # those between are expected
    near = abs(true[known]) < side * (1.9 if finer else 0.25)
    assert abs(grid[known] - true[known])[near].max() <= side / (128 if finer else 48) * 1.001
    inside = np.linalg.norm(np.meshgrid(*[axis] * 3, indexing="ij"), axis=0) < 1
    share = abs(grid - true)[inside] / (abs(true[inside]) + side)
    assert share.max() < 0.2  # farther away a share of the distance


def test_normals_of_finer_steps_are_those_of_the_shape() -> None:
    """Steps of a 24th of a cell tilt normals by degrees, which makes a smooth surface look hammered."""
    random = np.random.default_rng(0)
    u, v = random.uniform(0, 2 * np.pi, (2, 4000))
    out = np.stack([np.cos(u) * np.cos(v), np.sin(v), np.sin(u) * np.cos(v)])
    points = 0.7 * np.stack([np.cos(u), 0 * u, np.sin(u)]) + 0.3 * out

    def worst_deg(finer: bool) -> float:
        """What one normal of a hundred is off by."""
        grid = unpacked(element(torus, cells=6, levels=5, finer=finer))
        shape = GridShape(NUMPY, grid.reshape(-1), len(grid), 3)
        slope = shape.field(points.astype(np.float32), gradient=True)[1:]
        facing = (slope * out).sum(0) / np.linalg.norm(slope, axis=0)
        return float(np.quantile(np.degrees(np.arccos(facing.clip(-1, 1))), 0.99))

    assert worst_deg(True) < 0.8 < 2 < worst_deg(False)


def test_elements_of_either_coding_keep_their_digest() -> None:
    """Scenes and Programs of earlier versions hold those of the first."""
    old, new = (element(torus, levels=2, finer=finer) for finer in (False, True))
    said = b"pyramid 3 4 2 "
    assert old.digest == hashlib.sha256(said + old.data).hexdigest()
    assert new.digest == hashlib.sha256(said + b"bzip2 " + new.data).hexdigest()
    (back,) = read_zoo(zoo_bytes([new])).elements
    assert (back, back.digest) == (new, new.digest)


def test_smooth_shapes_are_small() -> None:
    assert len(element(torus, levels=5).data) < 7000  # 65 nodes a side, 274,625 in all


@pytest.mark.parametrize("value", [1, 127, 128, 129, 255])
def test_any_bytes_are_distances(value: int) -> None:
    count = sum((4 * 2**level + 1) ** 3 for level in range(5))
    grid = unpacked(Element("x", "pyramid", (3, 4, 5), "deflate", zlib.compress(bytes([value]) * count)))
    assert grid.shape == (129, 129, 129)
    assert abs(grid).max() < 8
