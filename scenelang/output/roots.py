"""Zeros of a function between points where its signs differ, and the product that tells sides in the plane.

Source: G. Dahlquist, Å. Björck, Numerical methods, 1974, section 6.3 (the Illinois method).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def crossed(a: Floats, b: Floats) -> Floats:
    """Cross products (…) of vectors (…, 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def zeros(
    at: Callable[[Floats], Floats], a: Floats, b: Floats, f: Floats, g: Floats, steps: int, halved: bool
) -> tuple[Floats, Floats]:
    """Points (d, n) where a function is 0, and the ends outside of what is left to look in.

    Args:
        at: values (n,) at points (d, n); one of a step is a jump, for which ways are ``halved``.
        a, b: points (d, n) between which there are zeros.
        f, g: values (n,) there, of different signs.
        steps: how often the function is asked.
    """
    for _ in range(steps):
        middle = a + (0.5 if halved else (f / (f - g)).clip(0.01, 0.99)) * (b - a)
        value = at(middle)
        same = (value < 0) == (f < 0)
        f, g = np.where(same, value, f / 2), np.where(same, g / 2, value)
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    zero = a + (0.5 if halved else f / (f - g)) * (b - a)
    return zero, np.where(f < 0, b, a)
