"""Boxes around leaves: where a decoder tells that nothing is left."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import product

import numpy as np

from scenelang.elements.element import Element
from scenelang.elements.pyramid import unpacked
from scenelang.renderers.arrays import NUMPY, Smooth

LEVELS = 7  # of halvings of the cube's cells
STEEPEST = 1.1  # change of a distance over a way of 1 at most; the march trusts in 1
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)), np.float32).T[:, None]  # (3, 1, 8)


@lru_cache(maxsize=64)
def decoder_box(shapes: tuple[tuple[int, ...], ...], numbers: bytes) -> np.ndarray:
    """The box (2, 3) of a decoder with weights and biases of such shapes, one after the other."""
    ends = np.cumsum([0, *(int(np.prod(shape)) for shape in shapes)])
    flat = np.frombuffer(numbers, np.float32)
    parts = [flat[a:b].reshape(shape) for a, b, shape in zip(ends, ends[1:], shapes, strict=False)]
    layers = Smooth(zip(parts[::2], parts[1::2], strict=True))
    return surrounding(lambda q: NUMPY.smooth(q, layers)[0])


@lru_cache(maxsize=8)
def element_box(element: Element) -> np.ndarray:
    """The box (2, 3) of the cells of an element's grid with something inside."""
    inside = unpacked(element) <= 0
    sides, box = len(inside) - 1, []
    for axis in range(3):
        filled = np.flatnonzero(inside.any(tuple(other for other in range(3) if other != axis)))
        box.append([filled[0] - 1, filled[-1] + 1] if len(filled) else [0, sides])
    return np.asarray(np.array(box, np.float32).T.clip(0, sides) * (2 / sides) - 1)


def surrounding(distance: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """The least and the greatest coordinates (2, 3) of what lies in [-1, 1]^3, at most 0.03 too far out.

    Cells are halved where something may lie in them that is not in the box of points that are known to be
    inside.

    Args:
        distance: of points (3, M), (M,); it changes by at most `STEEPEST` over a way of 1.
    """
    centre, half = np.zeros((3, 1), np.float32), 1.0
    low, high = np.full((3, 1), np.inf, np.float32), np.full((3, 1), -np.inf, np.float32)
    for _ in range(LEVELS):
        half /= 2
        centre = (centre[:, :, None] + half * CORNERS).reshape(3, -1)
        found = distance(centre)
        inside = centre[:, found <= 0]
        low = np.minimum(low, inside.min(1, keepdims=True, initial=np.inf))
        high = np.maximum(high, inside.max(1, keepdims=True, initial=-np.inf))
        wider = ((centre - half < low) | (centre + half > high)).any(0)
        centre = centre[:, wider & (found <= STEEPEST * half * 3**0.5)]
    low = np.minimum(low, (centre - half).min(1, keepdims=True, initial=np.inf))
    high = np.maximum(high, (centre + half).max(1, keepdims=True, initial=-np.inf))
    return np.concatenate([low, high], 1).T
