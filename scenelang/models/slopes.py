"""How fast the distances of shipped geometries change, as it was proved: a file beside the weights.

`python -m scenelang.lab.slopes NAME` writes it. Weights without one are drawn without blocks being ruled out.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from scenelang.files import read_regular
from scenelang.models.manifest import ROOT
from scenelang.models.weights import ModelError
from scenelang.renderers.slopes import CELLS, NODE, RADII, STEEP, Slopes
from scenelang.tensors import TensorError, read_tensors

MOST_BYTES = 1 << 20


def slopes_path(name: str) -> Path:
    """Where the file of a shipped model lies."""
    return ROOT / name / "slopes.safetensors"


def load_slopes(name: str, digest: str, codes: npt.NDArray[np.float32], far: float) -> Mapping[bytes, Slopes]:
    """Slopes by the bytes of codes (geometries, C); none where the file is missing or of other weights.

    Raises:
        ModelError: it is damaged.
    """
    try:
        found = read_tensors(read_regular(slopes_path(name), MOST_BYTES), MOST_BYTES)
        cells = found.arrays()["cells"]
    except OSError:
        return {}
    except (TensorError, KeyError) as error:
        raise ModelError(f"damaged slopes of `{name}`: {error}") from None
    if [found.header.get(key) for key in ("weights", "node", "steep")] != [digest, NODE, STEEP]:
        return {}
    if cells.shape != (len(codes), len(RADII), CELLS, CELLS) or (cells < 0).any():
        raise ModelError(f"damaged slopes of `{name}`: {list(cells.shape)} numbers")
    return {code.tobytes(): Slopes(own, far) for code, own in zip(codes, cells, strict=True)}
