"""Networks of the plane whose pictures change smoothly as outlines move.

A pixel's four samples see an outline jump from one to the next: a picture of few pixels stays as it is while
a param moves a little. Here one sample tells how much of its pixel is covered: the network's own gates (those
of union, subtraction and intersection, and the one that reads coverage) are made as wide as a pixel. Nothing
else of the network changes.
"""

from __future__ import annotations

import copy
import math
from functools import lru_cache

import numpy as np

from scenelang.models.framed import load_arrays
from scenelang.program.groups import UNION
from scenelang.renderers.network import Cell, FramedArrays


@lru_cache(maxsize=64)
def softened(name: str, width: float) -> FramedArrays:
    """A shipped model of the plane with gates that are at least so wide, world units."""
    network = load_arrays(name).network
    assert isinstance(network, FramedArrays)
    soft = copy.copy(network)
    cell = Cell(*network.cell_weights())
    unit = float(np.linalg.norm(cell.candidate[UNION, 0]))  # growth of the state per world unit
    soft.read_slope = np.float32(min(float(network.read_slope), math.log(4 / (unit * width))))
    features = network.config.features
    steep = np.linalg.norm(cell.lines[..., :features], axis=-1)  # (TOKENS, S + L), per world unit
    soft.cell_gain = network.cell_gain - np.log(np.maximum(1.0, steep * width)).astype(np.float32)
    return soft
