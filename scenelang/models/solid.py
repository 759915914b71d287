"""A solids' network out of a weights file as numpy arrays, without torch."""

from __future__ import annotations

from dataclasses import astuple
from typing import Any, Final

from scenelang.models.weights import ModelError, check_shapes, open_weights
from scenelang.renderers.solid.network import SolidArrays, SolidConfig, solid_shapes

MOST_SIZE: Final = 128
"""Of a layer: so many units squared, times the code, are 9 MB."""


def solid_config(config: Any) -> SolidConfig:
    """Sizes of the network in a weights file.

    Raises:
        ModelError: they are missing, unknown or out of range.
    """
    try:
        found = SolidConfig(**config["network"])
    except (KeyError, TypeError) as error:
        raise ModelError(f"bad network sizes: {error}") from None
    *sizes, segment = astuple(found)
    if any(type(v) is not int or not 1 <= v <= MOST_SIZE for v in (*sizes, segment or 1)):
        raise ModelError("a network size is out of range")
    return found


def solid_arrays(data: bytes, geometries: int, materials: int) -> SolidArrays:
    """The network that a weights file holds, of so many geometries and materials.

    Raises:
        ModelError: the file does not fit the model or itself, or holds numbers that are not finite.
    """
    header, arrays = open_weights(data)
    config = solid_config(header.get("config"))
    check_shapes(arrays, solid_shapes(config, geometries, materials))
    return SolidArrays(config, arrays)
