"""How far learned distances may be from exact ones, by place: a file beside the weights.

`python -m lab.errors` proves it. Within `RADIUS` a cell of leaf coordinates says between which
numbers learned less exact distance lies. Farther points are seen at the rim: a leaf lies in the unit disc,
so from there on its distance grows outwards by 1 per leaf unit at most, and at least by the cosine of the
largest angle between the ways from the origin and from a point of the disc.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.models.framed import load_arrays
from scenelang.models.manifest import load_manifest, model_folder
from scenelang.models.slopes import read_proof
from scenelang.proof.fold import Enclosure, Floats
from scenelang.renderers.arrays import NUMPY, Layers
from scenelang.renderers.network import RADIUS, FramedNetwork

CELLS = 128  # along a side of [-RADIUS, RADIUS]
PROVER = "shapes2d"
"""The model whose distances are proved. It has every leaf of the plane; they tell of any model's pictures."""
_SLOWEST = (1 - RADIUS**-2) ** 0.5
_CHUNK = 2048  # points that go through a decoder at once


class Errors:
    """Learned less exact distance of a leaf.

    Args:
        layers: of the decoder, in float64.
        low, high: bounds (CELLS, CELLS), leaf units, rows from the least y up.
    """

    def __init__(self, layers: Layers, low: npt.NDArray[Any], high: npt.NDArray[Any]) -> None:
        self._layers = layers
        self._low, self._high = (np.asarray(side, np.float64) for side in (low, high))

    def exact(self, q: Floats) -> Enclosure:
        """The exact distance (M,) at leaf coordinates (2, M), leaf units, by the learned one."""
        length = np.sqrt(q[0] * q[0] + q[1] * q[1])
        beyond = np.maximum(length - RADIUS, 0.0)
        seen = q * (RADIUS / np.maximum(length, RADIUS))
        parts = [seen[:, at : at + _CHUNK] for at in range(0, seen.shape[1], _CHUNK)]
        learned = np.concatenate([NUMPY.perceptron(part, self._layers)[0] for part in parts])
        x, y = ((seen + RADIUS) * (CELLS / (2 * RADIUS))).astype(np.intp).clip(0, CELLS - 1)
        return Enclosure(learned - self._high[y, x] + _SLOWEST * beyond, learned - self._low[y, x] + beyond)


def errors_path(name: str) -> Path:
    """Where the file of a shipped model lies."""
    return model_folder(name) / "errors.safetensors"


@lru_cache(maxsize=4)
def load_errors(name: str = PROVER) -> dict[str, Errors]:
    """By geometry; none where the file is missing or of other weights.

    Raises:
        ModelError: it is damaged.
    """
    network, digest = load_arrays(name)
    assert isinstance(network, FramedNetwork)
    names = load_manifest(name).geometries
    shape = len(names), CELLS, CELLS
    arrays = read_proof(errors_path(name), {"weights": digest}, {"low": shape, "high": shape})
    if arrays is None:
        return {}
    rows = zip(names, arrays["low"], arrays["high"], strict=True)
    return {name: Errors(layers_of(network, at), *ends) for at, (name, *ends) in enumerate(rows)}


def layers_of(network: FramedNetwork, geometry: int) -> Layers:
    """The decoder of a geometry in float64, so that every machine computes the same distances."""
    one = np.append(network.codes[geometry].astype(np.float64), 1.0)
    parts = [[part.astype(np.float64) for part in found] for found in (network.decoder_w, network.decoder_b)]
    return [(np.tensordot(one, w, 1).T, one @ b) for w, b in zip(*parts, strict=True)]
