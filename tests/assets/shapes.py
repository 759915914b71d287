"""Elements whose shapes are formulas."""

from __future__ import annotations

from array import array
from collections.abc import Callable

import numpy as np

from scenelang.assets.element import Element
from scenelang.assets.element_file import TENSORS, Font
from scenelang.assets.picture import painted
from scenelang.assets.pyramid import Grid, packed, packed_colours, refine

Formula = Callable[..., np.ndarray]


def ball(*p: np.ndarray) -> np.ndarray:
    return np.sqrt(sum(x * x for x in p)) - 1


def torus(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return np.hypot(np.hypot(x, z) - 0.7, y) - 0.3


def square(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    half = 0.5**0.5
    return np.hypot(np.maximum(abs(x) - half, 0), np.maximum(abs(y) - half, 0)) + np.minimum(
        np.maximum(abs(x), abs(y)) - half, 0
    )


def element(
    formula: Formula, name: str = "made", *, cells: int = 4, levels: int = 4, d: int = 3, finer: bool = False
) -> Element:
    """A pyramid of a formula, true at every node; the last one's steps may be finer."""
    grid: Grid | None = None
    steps = []
    for level in range(levels):
        axis = np.linspace(-1, 1, cells * 2**level + 1)
        true = formula(*np.meshgrid(*[axis] * d, indexing="ij")).astype(np.float32)
        grid, found = refine(grid, len(axis), d, lambda _, true=true: true, finer and level == levels - 1)
        steps.append(found)
    return packed(name, cells, steps, {"license": "none needed"}, finer)


def letters() -> Font:
    """A font of a space and of an A that is a triangle, with kerning of two A."""
    corners = np.array([(-20000, -15000), (20000, -15000), (0, 25000)])
    ends = np.roll(corners, -1, 0)
    curves = np.stack([corners, (corners + ends) // 2, ends], 1).astype("<i2").tobytes()
    numbers = [0.25, 0, 0, 0, 0.7, 0.35, 0.3, 0.35]
    values = [0x20, 0x41], numbers, [0, 3], [0, 1, 0, 1], [0, 0, 0, -800], curves
    tables = {name: array(TENSORS[name][1], value) for name, value in zip(TENSORS, values, strict=True)}
    return Font(tables, 2, {"license": "none needed"})


def noise(*shape: int, name: str = "bark", seed: int = 0) -> Element:
    """A picture (h, w), or colours of space (n, n, n), at random."""
    colours = np.random.default_rng(seed).integers(0, 256, (*shape, 3), np.uint8)
    if len(shape) == 3:
        grid = np.moveaxis(colours, -1, 0) / np.float32(255)
        return packed_colours(name, grid, np.ones(shape, bool), {"license": "none needed"})
    return painted(name, colours, {"license": "none needed"})
