"""The codec of colours of space: what comes back, how little it takes, and what damage does."""

from __future__ import annotations

import bz2
from dataclasses import replace

import numpy as np
import pytest

from scenelang.assets.colours import packed, unpacked
from scenelang.assets.element import Element
from scenelang.assets.picture import texels
from scenelang.assets.tensors import TensorError
from scenelang.assets.zoo import read_zoo, zoo_bytes

HALF = 1.5 / 40  # of a step of luma, and of two of colour, that halve


def cube(side: int) -> np.ndarray:
    """Colours that change with each axis in another way, (3, n, n, n)."""
    x, y, z = np.meshgrid(*[np.linspace(-1, 1, side)] * 3, indexing="ij")
    return np.stack([0.5 + x / 2, np.sin(3 * y) ** 2, (abs(z) < 0.3) * 1.0]).astype(np.float32)


@pytest.mark.parametrize(("side", "sides"), [(2, (2,)), (9, (5, 9)), (13, (7, 13)), (49, (7, 13, 25, 49))])
def test_every_node_that_counts_is_within_half_a_step(side: int, sides: tuple[int, ...]) -> None:
    made = packed("hide", cube(side), np.ones((side,) * 3, bool), {})
    assert made.sides == sides
    assert made.held == 3 * sum(side**3 for side in sides)
    assert abs(unpacked(made) - cube(side)).max() <= HALF + 1e-6
    assert np.array_equal(np.moveaxis(texels(made), -1, 0), unpacked(made))
    assert read_zoo(zoo_bytes([made])).materials == {"hide": made}


def test_nodes_off_the_surface_cost_little_and_do_not_disturb() -> None:
    side, random = 33, np.random.default_rng(0)
    noise = random.random((3, side, side, side), np.float32)
    near = np.zeros((side,) * 3, bool)
    near[:, 10:12] = True
    made = packed("hide", noise, near, {})
    assert abs(unpacked(made) - noise)[:, near].max() <= HALF + 1e-6
    assert len(made.data) * 5 < len(packed("hide", noise, ~near, {}).data)


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
    np.testing.assert_allclose(unpacked(made), slow(made), atol=1e-5)


@pytest.mark.parametrize("held", [b"", b"\0" * 80, b"\0" * 82, b"\0" * (1 << 24)])
def test_colours_of_another_length(held: bytes) -> None:
    made = Element("hide", "colours", (3, 32), "bzip2", bz2.compress(held))
    with pytest.raises(TensorError, match="does not hold 81 bytes"):
        read_zoo(zoo_bytes([made]))


@pytest.mark.parametrize("change", [lambda d: d[:-1], lambda d: d + b"x", lambda d: d[:9] + b"!!!!" + d[13:]])
def test_damaged_colours(change: object) -> None:
    made = packed("hide", cube(9), np.ones((9,) * 3, bool), {})
    with pytest.raises(TensorError, match="`hide`"):
        replace(made, data=change(made.data)).inflated()  # type: ignore[operator]
