"""Grids that are settled on a surface: nearer to it, and true elsewhere."""

from __future__ import annotations

import numpy as np

from scenelang.assets.pyramid import finest
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.neural.assets import GridShape
from scenelang.inverse.grids import settled

HALF = 0.53  # of a cube's side: no node lies on a face


def cube(*p: np.ndarray) -> np.ndarray:
    q = np.stack(p) - HALF * np.sign(p)
    away = q * np.sign(p)
    return np.linalg.norm(np.maximum(away, 0), axis=0) + np.minimum(away.max(0), 0)


def surface(random: np.random.Generator, count: int, d: int) -> np.ndarray:
    points = random.uniform(-HALF, HALF, (count, d))
    points[np.arange(count), random.integers(d, size=count)] = HALF * random.choice((-1, 1), count)
    return points


def test_a_cube_has_its_edges() -> None:
    axis = np.linspace(-1, 1, 33)
    grid = cube(*np.meshgrid(*[axis] * 3, indexing="ij")).astype(np.float32)
    random = np.random.default_rng(1)
    made = settled(grid, surface(random, 60_000, 3))
    asked = surface(random, 20_000, 3).T.astype(np.float32)

    def off(of: np.ndarray) -> np.ndarray:
        drawn = finest(of)
        return abs(GridShape(NUMPY, drawn.reshape(-1), len(drawn), 3).distance(asked))

    assert off(made).mean() < 0.6 * off(grid).mean()
    assert np.quantile(off(made), 0.99) < 0.6 * np.quantile(off(grid), 0.99)
    far = abs(grid) > 3 * 2 / 32
    np.testing.assert_array_equal(made[far], grid[far])
    assert abs(made - grid).max() < 2 / 32
