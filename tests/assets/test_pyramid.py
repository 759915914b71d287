"""Pyramids of distances and of colours: how near they are, and that any bytes are one."""

from __future__ import annotations

import bz2
import hashlib
import zlib
from dataclasses import replace

import numpy as np
import pytest

from scenelang.assets.element import Element
from scenelang.assets.element_file import element_file_bytes, read_zoo
from scenelang.assets.picture import texels
from scenelang.assets.pyramid import between, packed_colours, unpacked, unpacked_colours
from scenelang.assets.tensors import TensorError
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
    (back,) = read_zoo(element_file_bytes([new])).elements
    assert (back, back.digest) == (new, new.digest)


def test_smooth_shapes_are_small() -> None:
    assert len(element(torus, levels=5).data) < 7000  # 65 nodes a side, 274,625 in all


@pytest.mark.parametrize("value", [1, 127, 128, 129, 255])
def test_any_bytes_are_distances(value: int) -> None:
    count = sum((4 * 2**level + 1) ** 3 for level in range(5))
    grid = unpacked(Element("x", "pyramid", (3, 4, 5), "deflate", zlib.compress(bytes([value]) * count)))
    assert grid.shape == (129, 129, 129)
    assert abs(grid).max() < 8


HALF = 1.5 / 40  # of a step of luma, and of two of colour, that halve


def cube(side: int) -> np.ndarray:
    """Colours that change with each axis in another way, (3, n, n, n)."""
    x, y, z = np.meshgrid(*[np.linspace(-1, 1, side)] * 3, indexing="ij")
    return np.stack([0.5 + x / 2, np.sin(3 * y) ** 2, (abs(z) < 0.3) * 1.0]).astype(np.float32)


@pytest.mark.parametrize("sides", [(2,), (5, 9), (7, 13), (7, 13, 25, 49)])
def test_every_node_that_counts_is_within_half_a_step(sides: tuple[int, ...]) -> None:
    side = sides[-1]
    made = packed_colours("hide", cube(side), np.ones((side,) * 3, bool), {})
    assert made.sides == sides
    assert made.held == 3 * sum(side**3 for side in sides)
    assert abs(unpacked_colours(made) - cube(side)).max() <= HALF + 1e-6
    assert np.array_equal(np.moveaxis(texels(made), -1, 0), unpacked_colours(made))
    assert read_zoo(element_file_bytes([made])).materials == {"hide": made}


def test_nodes_off_the_surface_cost_little_and_do_not_disturb() -> None:
    side, random = 33, np.random.default_rng(0)
    noise = random.random((3, side, side, side), np.float32)
    near = np.zeros((side,) * 3, bool)
    near[:, 10:12] = True
    made = packed_colours("hide", noise, near, {})
    assert abs(unpacked_colours(made) - noise)[:, near].max() <= HALF + 1e-6
    assert len(made.data) * 5 < len(packed_colours("hide", noise, ~near, {}).data)


def slow(element: Element) -> np.ndarray:
    """The colours of an element by loops over its nodes."""
    data, first, grid = bz2.decompress(element.data), 0, {}
    for side in element.sides:
        grids = {}
        for channel in range(3):
            for at in np.ndindex(side, side, side):
                ends = [{k // 2, (k + 1) // 2} for k in at]
                around = [(a, b, c) for a in ends[0] for b in ends[1] for c in ends[2]]
                expected = sum(grid[channel, *p] for p in around) / len(around) if grid else 0.0
                step = int.from_bytes(data[first : first + 1], signed=True)
                grids[channel, *at] = expected + step * (1 / 16 if channel else 1 / 32)
                first += 1
        grid = grids
    found = np.zeros((3, side, side, side))
    for at in np.ndindex(side, side, side):
        luma, orange, green = (grid[channel, *at] for channel in range(3))
        rest = luma - green / 2
        found[:, *at] = rest + orange / 2, luma + green / 2, rest - orange / 2
    return found.clip(0, 1)


def test_a_pyramid_is_what_loops_make_of_it() -> None:
    random = np.random.default_rng(1)
    element = Element("hide", "colours", (9, 32), "bzip2", b"")
    steps = random.integers(-20, 21, element.held).astype(np.int8)
    made = Element("hide", "colours", (9, 32), "bzip2", bz2.compress(steps.tobytes()))
    np.testing.assert_allclose(unpacked_colours(made), slow(made), atol=1e-5)


def test_damaged_colours() -> None:
    for held in (b"", b"\0" * 80, b"\0" * 82, b"\0" * (1 << 24)):
        made = Element("hide", "colours", (3, 32), "bzip2", bz2.compress(held))
        with pytest.raises(TensorError, match="does not hold 81 bytes"):
            read_zoo(element_file_bytes([made]))
    made = packed_colours("hide", cube(9), np.ones((9,) * 3, bool), {})
    for data in (made.data[:-1], made.data + b"x", made.data[:9] + b"!!!!" + made.data[13:]):
        with pytest.raises(TensorError, match="`hide`"):
            replace(made, data=data).inflated()
