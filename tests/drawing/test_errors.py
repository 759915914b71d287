"""Bounds of learned distances: attacked at random, with shipped weights and others."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from lab import errors as lab
from scenelang.compiler.geometries import SECTORS
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.weights import ModelError
from scenelang.drawing import proof
from scenelang.drawing.exact.field import leaf_distance
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.network import RADIUS
from scenelang.drawing.proof import PROVER, Errors, layers_of, load_errors
from tests.pictures import Array

NETWORK = load_arrays(PROVER).network
NAMES = load_manifest(PROVER).geometries
ROUNDING = 1e-9


def polygon_distance(name: str, p: Array) -> Array:
    """Of a leaf, by all of its edges and the number of turns around a point."""
    n, phase, outer, inner = SECTORS[name]
    angle = phase + np.pi / n * np.arange(2 * n)
    corners = np.where(np.arange(2 * n) % 2, inner, outer) * np.exp(1j * angle)
    z, d, turns = p[0] + 1j * p[1], np.full(p.shape[1], np.inf), np.zeros(p.shape[1])
    for a, b in zip(corners, np.roll(corners, -1), strict=True):
        t = (((z - a) * np.conj(b - a)).real / abs(b - a) ** 2).clip(0, 1)
        d = np.minimum(d, abs(z - a - t * (b - a)))
        turns += np.angle((b - z) / (a - z))
    return np.where(abs(turns) > 1, -d, d)


def attacked(found: Errors, name: str, seed: int) -> float:
    """By how much the exact distance stays within its bounds at the worst point of a search."""
    rng, worst = np.random.default_rng(seed), np.inf
    p = rng.uniform(-1.3, 1.3, (2, 100_000)) * RADIUS ** rng.choice([0, 0.5, 1.2], 100_000)
    for step in 10.0 ** -np.arange(1, 8):
        low, high = found.exact(p)
        exact = polygon_distance(name, p)
        left = np.minimum(high - exact, exact - low)
        worst = min(worst, left.min())
        p = np.repeat(p[:, np.argsort(left)[:2000]], 10, 1)
        p = p + step * rng.standard_normal(p.shape)
    return worst


@pytest.mark.parametrize("at", range(len(NAMES)))
def test_no_point_breaks_the_bounds_of_a_shipped_geometry(at: int) -> None:
    found = load_errors()[NAMES[at]]
    assert attacked(found, NAMES[at], at) > -ROUNDING
    p = np.random.default_rng(at).uniform(-1, 1, (2, 5000))
    low, high = found.exact(p)
    near = abs(leaf_distance(NAMES[at], p)) < 0.05
    assert np.median((high - low)[near]) < 2e-3  # they are of use
    # the attack finds what is wrong: a weight that is another, and a bound that is
    layers = [(w.copy(), b) for w, b in layers_of(NETWORK, at)]
    layers[1][0][:] *= 1.001
    assert attacked(Errors(layers, found._low, found._high), NAMES[at], at) < -1e-6
    assert attacked(Errors(layers_of(NETWORK, at), found._low / 2, found._high / 2), NAMES[at], at) < -1e-6


@pytest.mark.parametrize("name", ["square", "star"])
def test_bounds_hold_for_networks_of_any_kind(name: str) -> None:
    """Random ones are steep and full of corners."""
    rng = np.random.default_rng(3)
    layers = [
        (rng.standard_normal((6, 2)), rng.standard_normal(6)),
        (0.5 * rng.standard_normal((6, 6)), rng.standard_normal(6)),
        (0.5 * rng.standard_normal((1, 6)), rng.standard_normal(1)),
    ]
    found = Errors(layers, *lab.proved_errors(layers, name, near=0.02))
    p = rng.uniform(-1.4, 1.4, (2, 200_000))
    low, high = found.exact(p)
    exact = leaf_distance(name, p)
    assert np.minimum(high - exact, exact - low).min() > -ROUNDING
    assert np.median(high - low) < 0.2


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("half", [0.1, 1e-3])
def test_gradients_of_exact_distances_are_enclosed(name: str, half: float) -> None:
    rng = np.random.default_rng(1)
    p = rng.uniform(-2, 2, (20_000, 2))
    q = p + half * rng.uniform(-1, 1, p.shape)
    low, high = lab.gradients(name, p, half)
    h = 1e-7
    for axis, step in enumerate(h * np.eye(2)):
        slope = (polygon_distance(name, (q + step).T) - polygon_distance(name, (q - step).T)) / (2 * h)
        # a step may leave the box
        inside = (abs(q - p) < half - 2 * h).all(1)
        assert (slope - high[:, axis])[inside].max() < 1e-6
        assert (low[:, axis] - slope)[inside].max() < 1e-6


def test_files_of_others_are_left_alone_and_damaged_ones_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "errors.safetensors"
    shutil.copy(proof.errors_path(PROVER), path)
    monkeypatch.setattr(proof, "errors_path", lambda name: path)
    load = load_errors.__wrapped__  # without what is kept
    assert set(load()) == set(NAMES)
    assert load("shapes2d-w16") == {}
    path.write_bytes(path.read_bytes()[:-2])
    with pytest.raises(ModelError, match="damaged"):
        load()
    path.unlink()
    assert load() == {}
