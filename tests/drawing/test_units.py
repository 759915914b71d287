"""Norm units of the plane's leaves: exact everywhere, in both libraries, with their gradients."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from scenelang.compiler.geometries import GEOMETRIES
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.load import load_model

NAMES = load_manifest("shapes2d").geometries
NETWORK = load_arrays("shapes2d").network
DECODERS = dict(zip(NAMES, NETWORK.decoders(NETWORK.codes), strict=True))
TORCH = load_model("shapes2d").framed


@pytest.mark.parametrize("name", NAMES)
def test_a_leaf_is_exact(name: str) -> None:
    p = np.random.default_rng(1).uniform(-1.5, 1.5, (2, 20_000))
    p[:, :4] = [[0, 0, 1, -1], [0, 1, 0, 0]]
    for far, most in ((1.0, 1e-6), (1e6, 1.0)):  # shares of a distance are float32's
        exact = GEOMETRIES[name].distance(far * p)
        found = DECODERS[name].distance((far * p).astype(np.float32))
        assert abs(found - exact).max() < most


@pytest.mark.parametrize("name", NAMES)
def test_torch_answers_the_same_with_gradients(name: str) -> None:
    p = np.random.default_rng(2).uniform(-1.5, 1.5, (2, 5000))
    q = torch.from_numpy(p.astype(np.float32)).requires_grad_()
    decoder = TORCH.decoders(TORCH.codes)[NAMES.index(name)]
    found = decoder.distance(q)
    assert abs(found.detach().numpy() - DECODERS[name].distance(p.astype(np.float32))).max() < 1e-6
    found.sum().backward()
    h = 1e-4
    exact = GEOMETRIES[name].distance
    steps = h * np.eye(2)[:, :, None]
    by = np.stack([(exact(p + step) - exact(p - step)) / (2 * h) for step in steps])
    off = abs(q.grad.numpy() - by).max(0)
    assert (
        off < 1e-3
    ).mean() > 0.99  # the others lie on a ridge, or so near an outline that a step crosses one
    assert off.max() < 2.1
