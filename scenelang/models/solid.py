"""A solids' network out of a weights file as numpy arrays, without torch."""

from __future__ import annotations

from scenelang.models.framed import MOST_WIDTH
from scenelang.models.weights import ModelError, check_shapes, open_weights
from scenelang.renderers.solid.network import SolidArrays, SolidConfig, solid_shapes


def solid_arrays(data: bytes, geometries: int, materials: int) -> SolidArrays:
    """The network that a weights file holds, of so many geometries and materials.

    Raises:
        ModelError: the file does not fit the model or itself, or holds numbers that are not finite.
    """
    header, arrays = open_weights(data)
    try:
        config = SolidConfig(**header["config"]["network"])
    except (KeyError, TypeError) as error:
        raise ModelError(f"bad network sizes: {error}") from None
    sizes = (config.code, config.material_code, config.width, config.paint_lines, config.kind_lines)
    if any(type(v) is not int or not 1 <= v <= MOST_WIDTH for v in sizes):
        raise ModelError("a network size is out of range")
    check_shapes(arrays, solid_shapes(config, geometries, materials))
    return SolidArrays(config, arrays)
