"""`noise` against its definition in numpy's 32 bits, and as a field: 0 on the lattice, smooth, bounded."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from scenelang.language.values import FUNCTIONS, Vec

NOISE = FUNCTIONS["noise"]
SIGNS = [*itertools.product((1.0, -1.0), repeat=2)]
GRADIENTS = np.array(
    [(a, b, 0.0) for a, b in SIGNS] + [(a, 0.0, b) for a, b in SIGNS] + [(0.0, a, b) for a, b in SIGNS]
)


def slow(point: Any, seed: int) -> float:
    """Noise by its definition, in uint32 and float64."""

    def word(n: int) -> np.uint32:
        return np.uint32(n % 2**32)

    base = [math.floor(c) for c in point]
    rest = np.array(point) - np.array(base, float)
    corners = np.zeros((2, 2, 2))
    with np.errstate(over="ignore"):
        for offset in np.ndindex(2, 2, 2):
            i, j, k = (word(b + d) for b, d in zip(base, offset, strict=True))
            h = (
                i * word(0x8DA6B343)
                ^ j * word(0xD8163841)
                ^ k * word(0xCB1AB31F)
                ^ word(seed) * word(0x9E3779B9)
            )
            h = (h ^ (h >> np.uint32(16))) * word(0x21F0AAAD)
            h = (h ^ (h >> np.uint32(15))) * word(0x735A2D97)
            corners[offset] = GRADIENTS[int(h ^ (h >> np.uint32(15))) % 12] @ (rest - offset)
    for t in rest:  # along x, then y, then z
        f = t**3 * (t * (6 * t - 15) + 10)
        corners = (1 - f) * corners[0] + f * corners[1]
    return float(corners)


def test_noise_is_its_definition() -> None:
    rng = np.random.default_rng(1)
    for scale in (1.0, 30.0, 1e6, 1e12):
        for point in rng.uniform(-scale, scale, (400, 3)).tolist():
            seed = int(rng.integers(-(2**40), 2**40))
            assert NOISE(Vec(tuple(point)), float(seed)) == pytest.approx(slow(point, seed), abs=1e-12)
    for x, y in rng.uniform(-20, 20, (300, 2)).tolist():
        assert NOISE(x) == pytest.approx(slow((x, 0, 0), 0), abs=1e-13)
        assert NOISE(Vec((x, y)), 7.0) == pytest.approx(slow((x, y, 0), 7), abs=1e-13)


def test_noise_on_the_lattice_is_0_and_smooth_between() -> None:
    rng = np.random.default_rng(2)
    for point in rng.integers(-(10**6), 10**6, (200, 3)).tolist():
        assert NOISE(Vec(tuple(map(float, point)))) == 0.0
    step = 1e-4
    for x, y, z in rng.uniform(-50, 50, (200, 3)).tolist():
        x = round(x)  # a face between two cells
        left, at, right = (NOISE(Vec((x + d, y, z))) for d in (-step, 0.0, step))
        assert abs(right - at) < 3 * step
        assert abs(at - left) < 3 * step
        assert abs(right - 2 * at + left) < 100 * step**2  # derivatives on both sides agree


def test_noise_fills_its_range() -> None:
    rng = np.random.default_rng(3)
    found = np.array([NOISE(Vec(tuple(p))) for p in rng.uniform(-99, 99, (6000, 3)).tolist()])
    assert 0.75 < found.max() <= 1.04
    assert -1.04 <= found.min() < -0.75
    assert abs(found.mean()) < 0.02
    seeds = [NOISE(Vec((0.4, 0.3, 0.7)), float(seed)) for seed in range(40)]
    assert len(set(seeds)) > 30
