"""How fast the distances of shipped geometries change, as it was proved: a file beside the weights.

`python -m lab.slopes NAME` writes it. Weights without one are drawn without blocks being ruled out.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.files import read_regular
from scenelang.models.weights import ModelError, weights_folder
from scenelang.renderers.slopes import CELLS, NODE, RADII, STEEP, Slopes
from scenelang.tensors import TensorError, read_tensors

MOST_BYTES = 1 << 20
Arrays = dict[str, npt.NDArray[Any]]


def slopes_path(name: str, digest: str = "") -> Path:
    """File of a shipped model's weights, those of today or those `replaced`."""
    return weights_folder(name, digest) / "slopes.safetensors"


def read_proof(path: Path, header: Mapping[str, Any], shapes: Mapping[str, tuple[int, ...]]) -> Arrays | None:
    """The arrays of a file of proofs; None where it is missing or about something else, as its header says.

    Args:
        header: what it has to say, among it the digest of the weights.
        shapes: of its arrays.

    Raises:
        ModelError: it is damaged.
    """
    try:
        found = read_tensors(read_regular(path, MOST_BYTES), MOST_BYTES)
        arrays = found.arrays()
    except OSError:
        return None
    except TensorError as error:
        raise ModelError(f"damaged file `{path.name}`: {error}") from None
    if any(found.header.get(key) != value for key, value in header.items()):
        return None
    if {key: value.shape for key, value in arrays.items()} != shapes:
        raise ModelError(f"damaged file `{path.name}`: not the arrays that it should have")
    return arrays


def load_slopes(name: str, digest: str, codes: npt.NDArray[np.float32], far: float) -> Mapping[bytes, Slopes]:
    """Slopes by the bytes of codes (geometries, C); none where the file is missing or of other weights.

    Raises:
        ModelError: it is damaged.
    """
    header = {"weights": digest, "node": NODE, "steep": STEEP}
    arrays = read_proof(slopes_path(name, digest), header, {"cells": (len(codes), len(RADII), CELLS, CELLS)})
    if arrays is None:
        return {}
    if (arrays["cells"] < 0).any():
        raise ModelError(f"damaged slopes of `{name}`: negative ones")
    return {code.tobytes(): Slopes(own, far) for code, own in zip(codes, arrays["cells"], strict=True)}
