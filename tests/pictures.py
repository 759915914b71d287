"""Comparison of pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def premultiplied(picture: Array) -> Array:
    """A picture as float64; the colour of what is transparent does not count."""
    values = np.asarray(picture, np.float64)
    if values.shape[2] == 4:
        values = np.concatenate([values[..., :3] * values[..., 3:], values[..., 3:]], 2)
    return values


def psnr_db(picture: Array, exact: Array) -> float:
    """Peak signal-to-noise ratio, at most 120."""
    return float(-10 * np.log10(np.mean((picture - exact) ** 2) + 1e-12))
