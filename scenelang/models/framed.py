"""A framed network out of a weights file as numpy arrays, without torch."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from scenelang.models.manifest import Manifest, load_manifest
from scenelang.models.slopes import load_slopes
from scenelang.models.weights import ModelError, check_shapes, open_weights, replaced, shipped_weights
from scenelang.renderers.network import FramedArrays, FramedConfig, parameter_shapes

if TYPE_CHECKING:
    from scenelang.renderers.solid.network import SolidArrays

MOST_WIDTH = 1024


class ArrayModel(NamedTuple):
    """A shipped network that numpy draws with, and the SHA-256 of its weights file, hex."""

    network: FramedArrays | SolidArrays
    digest: str


def framed_config(config: dict[str, Any], size: int) -> FramedConfig:
    """Sizes of the network in a weights file of ``size`` bytes.

    Raises:
        ModelError: they are missing, unknown, out of range, or larger than the file.
    """
    sizes = config.get("network") if isinstance(config, dict) else None
    if not isinstance(sizes, dict):
        raise ModelError("no network sizes")
    if "cell_width" in sizes:
        raise ModelError("weights of an earlier framed renderer, whose cell was another; train them again")
    if any(type(v) is not int or not 1 <= v <= MOST_WIDTH for v in sizes.values()):
        raise ModelError("a network size is out of range")
    try:
        known = FramedConfig(**sizes)
    except TypeError as error:
        raise ModelError(f"bad network sizes: {error}") from None
    decoder = (known.code + 1) * known.decoder_width * (known.decoder_width + known.features)
    rows = known.state + known.paint_lines
    cell = (known.features + known.state) * rows + known.features * known.state
    if 4 * max(decoder, cell) > size:
        raise ModelError("a network larger than its file")
    return known


def framed_arrays(data: bytes, manifest: Manifest) -> FramedArrays:
    """The network that a weights file holds.

    Raises:
        ModelError: the file does not fit the manifest or itself, or holds numbers that are not finite.
    """
    header, arrays = open_weights(data)
    config = framed_config(header.get("config", {}), len(data))
    check_shapes(arrays, parameter_shapes(config, len(manifest.geometries), len(manifest.materials)))
    return FramedArrays(config, arrays)


def load_arrays(name: str, weights: str = "") -> ArrayModel:
    """Load a shipped model.

    Args:
        weights: digest of weights that were `replaced`; with any other, those of today are loaded.

    Raises:
        KeyError: there is no such model.
        ModelError: its weights are missing or damaged.
    """
    return _load(name, replaced(weights))


@lru_cache(maxsize=8)
def _load(name: str, weights: str) -> ArrayModel:
    manifest, data = load_manifest(name), shipped_weights(name, weights)
    digest = hashlib.sha256(data).hexdigest()
    if manifest.renderer == "solid":
        from scenelang.models.solid import solid_arrays

        return ArrayModel(solid_arrays(data, len(manifest.geometries), len(manifest.materials)), digest)
    network = framed_arrays(data, manifest)
    network.slopes = load_slopes(name, digest, network.codes, float(network.far[0]))
    return ArrayModel(network, digest)
