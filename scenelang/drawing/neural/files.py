"""Networks out of weights files as numpy arrays, and the proved slopes beside them.

`python -m lab.slopes NAME` proves slopes. Without them every block is drawn pixel by pixel.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from scenelang.assets.files import read_regular
from scenelang.assets.tensors import TensorError, read_tensors
from scenelang.compiler.manifest import Manifest
from scenelang.compiler.weights import (
    ModelError,
    check_shapes,
    manifest_of,
    open_weights,
    replaced,
    shipped_weights,
    weights_folder,
)
from scenelang.drawing.neural.network import (
    CELLS,
    LEVEL_NODES,
    NODE,
    RADII,
    STEEP,
    FramedArrays,
    FramedConfig,
    Slopes,
    parameter_shapes,
)
from scenelang.drawing.solid.network import SolidArrays, SolidConfig, solid_shapes

MOST_BYTES = 1 << 20
Arrays = dict[str, npt.NDArray[Any]]


def slopes_path(name: str, digest: str = "") -> Path:
    """File of a shipped model's weights, those of today or those `replaced`."""
    return weights_folder(name, digest) / "slopes.safetensors"


def read_proof(path: Path, header: Mapping[str, Any], shapes: Mapping[str, tuple[int, ...]]) -> Arrays | None:
    """The arrays of a file of proofs; None if missing or of another header, `ModelError` if damaged."""
    try:
        result = read_tensors(read_regular(path, MOST_BYTES), MOST_BYTES)
        arrays = result.arrays()
    except OSError:
        return None
    except TensorError as error:
        raise ModelError(f"damaged file `{path.name}`: {error}") from None
    if any(result.header.get(key) != value for key, value in header.items()):
        return None
    if {key: value.shape for key, value in arrays.items()} != shapes:
        raise ModelError(f"damaged file `{path.name}`: not the arrays that it should have")
    return arrays


def load_slopes(name: str, digest: str, codes: npt.NDArray[np.float32], far: float) -> Mapping[bytes, Slopes]:
    """Slopes by the bytes of codes (geometries, C); none where the file is missing or of other weights."""
    header = {"weights": digest, "node": NODE, "steep": STEEP}
    arrays = read_proof(slopes_path(name, digest), header, {"cells": (len(codes), len(RADII), CELLS, CELLS)})
    if arrays is None:
        return {}
    if (arrays["cells"] < 0).any():
        raise ModelError(f"damaged slopes of `{name}`: negative ones")
    return {code.tobytes(): Slopes(own, far) for code, own in zip(codes, arrays["cells"], strict=True)}


MOST_SIZE: Final = 128  # Most units of a layer for solids: their square, times the code, is 9 MB
MOST_WIDTH: Final = 1024  # Most units of a layer in the plane
Config = TypeVar("Config", FramedConfig, SolidConfig)


@lru_cache(maxsize=8)
def load_levels(name: str, digest: str) -> Mapping[bytes, npt.NDArray[np.float32]]:
    """By the bytes of codes, what leaves' decoders are short of far from their outlines (`LEVEL_NODES`,
    `LEVEL_NODES`), which leaves that grow and shells show; none where there is no file for these weights.
    """
    path, network = weights_folder(name, digest) / "levels.safetensors", load_arrays(name, digest).network
    shape = len(network.codes), LEVEL_NODES, LEVEL_NODES
    arrays = read_proof(path, {"weights": digest}, {"levels": shape})
    rows = () if arrays is None else arrays["levels"].astype(np.float32)
    return {code.tobytes(): row for code, row in zip(network.codes, rows, strict=False)}


def sizes_of(kind: type[Config], config: Any, size: int) -> Config:
    """Sizes of a network by the header of a file of ``size`` bytes; raises ModelError where they are bad."""
    sizes = config.get("network") if isinstance(config, dict) else None
    if not isinstance(sizes, dict):
        raise ModelError("no network sizes")
    most = MOST_SIZE if kind is SolidConfig else MOST_WIDTH
    least = {"segment": 0, "units": 0, "hidden": 0, "answered": 0}
    if any(type(v) is not int or not least.get(name, 1) <= v <= most for name, v in sizes.items()):
        raise ModelError("a network size is out of range")
    try:
        known = kind(**sizes)
    except TypeError as error:
        raise ModelError(f"bad network sizes: {error}") from None
    if isinstance(known, FramedConfig):
        decoder = (known.code + 1) * known.decoder_width * (known.decoder_width + known.features)
        rows = known.state + known.paint_lines
        cell = (known.features + known.state) * rows + known.features * known.state
        if 4 * max(decoder, cell) > size:
            raise ModelError("a network larger than its file")
    return known


def solid_arrays(data: bytes, geometries: int, materials: int) -> SolidArrays:
    """The network in a weights file, if it has so many geometries and materials; else raises ModelError."""
    header, arrays = open_weights(data)
    config = sizes_of(SolidConfig, header.get("config"), len(data))
    check_shapes(arrays, solid_shapes(config, geometries, materials))
    return SolidArrays(config, arrays)


class ArrayModel(NamedTuple):
    """A shipped network that numpy draws with, and the SHA-256 of its weights file, hex."""

    network: FramedArrays | SolidArrays
    digest: str


def framed_arrays(data: bytes, manifest: Manifest) -> FramedArrays:
    """The network that a weights file holds; raises ModelError where it does not fit the manifest."""
    header, arrays = open_weights(data)
    config = sizes_of(FramedConfig, header.get("config"), len(data))
    check_shapes(arrays, parameter_shapes(config, len(manifest.geometries), len(manifest.materials)))
    return FramedArrays(config, arrays)


def load_arrays(name: str, weights: str = "") -> ArrayModel:
    """Load a shipped model; ``weights`` is the digest of ones that were `replaced`, others are today's.
    Raises `KeyError` where there is none, `ModelError` where weights are missing or damaged.
    """
    return _load(name, replaced(weights))


@lru_cache(maxsize=8)
def _load(name: str, weights: str) -> ArrayModel:
    manifest, data = manifest_of(name, weights), shipped_weights(name, weights)
    digest = hashlib.sha256(data).hexdigest()
    if manifest.renderer == "solid":
        return ArrayModel(solid_arrays(data, len(manifest.geometries), len(manifest.materials)), digest)
    network = framed_arrays(data, manifest)
    network.slopes = load_slopes(name, digest, network.codes, float(network.far[0]))
    network.levels = partial(load_levels, name, digest)
    return ArrayModel(network, digest)
