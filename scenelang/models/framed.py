"""A framed network out of a weights file as numpy arrays, without torch."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from scenelang.lifting.layout import LAYOUTS
from scenelang.models.manifest import Manifest, load_manifest
from scenelang.models.weights import ModelError, open_weights, shipped_weights
from scenelang.renderers.network import FramedArrays, FramedConfig, parameter_shapes
from scenelang.tensors import TensorError

MOST_WIDTH = 1024


@dataclass(frozen=True, slots=True)
class ArrayModel:
    """A shipped model that numpy draws with.

    Args:
        name: its name.
        network: the trained network.
        digest: SHA-256 of the weights file, hex.
    """

    name: str
    network: FramedArrays
    digest: str


def framed_config(config: dict[str, Any], size: int) -> FramedConfig:
    """Sizes of the network in a weights file of ``size`` bytes.

    Raises:
        ModelError: they are out of range, or larger than the file.
        KeyError, TypeError, AttributeError: ``config`` holds none, or others.
    """
    sizes = config["network"]
    if "cell_width" in sizes:
        raise ModelError("weights of an earlier framed renderer, whose cell was another; train them again")
    if any(type(v) is not int or not 1 <= v <= MOST_WIDTH for v in sizes.values()):
        raise ModelError("a network size is out of range")
    known = FramedConfig(**sizes)
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
    file = open_weights(data)
    try:
        config = framed_config(file.header["config"], len(data))
        arrays = file.arrays()
    except (KeyError, TypeError, AttributeError) as error:
        raise ModelError(f"bad network sizes: {error}") from None
    except TensorError as error:
        raise ModelError(f"damaged weights: {error}") from None
    shapes = parameter_shapes(config, len(manifest.geometries), len(manifest.materials))
    for name in sorted(shapes.keys() | arrays.keys()):
        found = arrays.get(name)
        if name not in shapes or found is None or found.shape != shapes[name] or found.dtype != "float32":
            held = "is missing" if found is None else f"is {found.dtype} {list(found.shape)}"
            wanted = f"float32 {list(shapes[name])} is needed" if name in shapes else "none is known"
            raise ModelError(f"damaged weights: tensor `{name}` {held}, where {wanted}")
    made = FramedArrays(config, arrays)
    made.layout = LAYOUTS[manifest.layout]
    return made


@lru_cache(maxsize=8)
def load_arrays(name: str) -> ArrayModel:
    """Load a shipped model.

    Raises:
        KeyError: there is no such model.
        ModelError: its weights are missing or damaged.
    """
    manifest = load_manifest(name)
    data = shipped_weights(name)
    return ArrayModel(name, framed_arrays(data, manifest), hashlib.sha256(data).hexdigest())
