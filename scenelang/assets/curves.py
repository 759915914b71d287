"""Curves of outlines as arrays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import GRAIN, Element


def curves_of(element: Element) -> npt.NDArray[np.float64]:
    """Curves (n, 3, 2) of an outline: start, control point and end, leaf units; any bytes give some."""
    curves = np.frombuffer(element.data, "<i2").reshape(-1, 3, 2) / GRAIN
    straight = (curves[:, 1] == curves[:, 0]).all(1) | (curves[:, 1] == curves[:, 2]).all(1)
    curves[straight, 1] = curves[straight][:, ::2].mean(1)
    return curves
