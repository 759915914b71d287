"""Exact colours of what users bring, in float64: of pictures that repeat, and of colours of space."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from scenelang.elements.element import Element
from scenelang.elements.picture import texels
from scenelang.graph.looks import LUMA, ColourStep, Look
from scenelang.image import decoded

Array = npt.NDArray[np.float64]


def colour_at(look: Look, q: Sequence[Array], light: bool = False) -> Array:
    """Colours (M, 3) of a look with an element.

    Args:
        q: its own coordinates (d, M): those of the leaf, through the moves of the texture.
        light: whether they are linear, decoded before anything is mixed.
    """
    assert look.element is not None
    values = _values(look.element, light)
    if values.ndim == 4:
        places = [(np.clip(x, -1, 1) + 1) / 2 * (len(values) - 1) for x in q]
    else:
        (u, v), (high, wide) = q, values.shape[:2]
        places = [(1 - v) / 2 * high - 0.5, (u + 1) / 2 * wide - 0.5]
    return _stepped(_mixed(values, places), look.colours)


@lru_cache(maxsize=16)
def _values(element: Element, light: bool) -> Array:
    """Colours (h, w, 3) or (n, n, n, 3)."""
    found = texels(element).astype(np.float64)
    if element.form == "picture":  # of 8 bits
        found = np.rint(found * 255) / 255
    return np.asarray(decoded(found), np.float64) if light else found


def _mixed(values: Array, places: list[Array]) -> Array:
    """Colours between the nearest nodes along each axis, where the first follows the last."""
    total: Array = np.zeros((len(places[0]), 3))
    first = [np.floor(place).astype(int) for place in places]
    for corner in np.ndindex(*(2,) * len(places)):
        share, index = np.ones(len(places[0])), []
        for place, low, side, up in zip(places, first, values.shape, corner, strict=False):
            share = share * (place - low if up else 1 - (place - low))
            index.append((low + up) % side)
        total += share[:, None] * values[tuple(index)]
    return total


def _stepped(rgb: Array, steps: Iterable[ColourStep]) -> Array:
    """Colours behind operations, clamped after each."""
    for kind, *numbers in steps:
        if kind == "color":
            rgb = rgb * numbers
        elif kind == "grayscale":
            rgb = rgb + numbers[0] * ((rgb @ LUMA)[:, None] - rgb)
        else:
            rgb = _turned(rgb, numbers[0])
        rgb = np.clip(rgb, 0.0, 1.0)
    return rgb


def _turned(rgb: Array, turns: float) -> Array:
    """The same S and V of HSV, and H further by so many turns."""
    most, least = rgb.max(1), rgb.min(1)
    first = rgb.argmax(1)
    other = [np.take_along_axis(rgb, ((first + k) % 3)[:, None], 1)[:, 0] for k in (1, 2)]
    span = np.where(most > least, most - least, 1.0)
    hue = (2 * first + (other[0] - other[1]) / span) / 6 + turns
    # a channel is full within a sixth of a turn of its own hue, and empty beyond a third
    away = [abs((hue - own / 3 + 0.5) % 1 - 0.5) for own in range(3)]
    return np.stack([least + (most - least) * np.clip(2 - 6 * a, 0, 1) for a in away], 1)
