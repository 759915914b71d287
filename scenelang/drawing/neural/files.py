"""Networks out of weights files as numpy arrays."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from typing import Any, Final, NamedTuple, TypeVar

from scenelang.compiler.manifest import Manifest
from scenelang.compiler.weights import (
    ModelError,
    check_shapes,
    manifest_of,
    open_weights,
    replaced,
    shipped_weights,
)
from scenelang.drawing.neural.network import FramedArrays, FramedConfig, parameter_shapes
from scenelang.drawing.neural.units import FEATURES
from scenelang.drawing.solid.network import SolidArrays, SolidConfig, solid_shapes
from scenelang.drawing.solid.norms import LINES

MOST_SIZE: Final = 128  # Most units of a layer for solids: their square, times the code, is 9 MB
MOST_WIDTH: Final = 1024  # Most units of a layer in the plane
Config = TypeVar("Config", FramedConfig, SolidConfig)


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
        if known.units:
            decoder = (known.code + known.hidden + 1) * LINES * (known.units + 2) * FEATURES
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
    return ArrayModel(framed_arrays(data, manifest), digest)
