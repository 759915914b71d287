"""Colours that users bring, at leaf coordinates: pictures of the plane, and grids of colours of space."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from scenelang.elements.element import Element
from scenelang.elements.picture import texels
from scenelang.graph.looks import LUMA, ColourStep
from scenelang.image import decoded
from scenelang.program.paints import Paint
from scenelang.program.program import ProgramError
from scenelang.renderers.arrays import Array, Arrays
from scenelang.renderers.frames import Affine
from scenelang.renderers.grid import Lattice, blended
from scenelang.tensors import TensorError

MOST = 1e20  # of a frame's numbers: points times these stay in float32


class Texture:
    """What a paint makes of leaf coordinates.

    Args:
        xp: the library.
        paint: the element and the steps of its colours.
        frame: the way (6,) from leaf coordinates x and y to the picture's.
        like: an array that lies where the colours are asked for.
        light: whether colours are linear there, not as they are written.

    Raises:
        ProgramError: the element is damaged, or the frame beyond float32.
    """

    def __init__(self, xp: Arrays, paint: Paint, frame: np.ndarray, like: Array, light: bool) -> None:
        self._xp, self.steps = xp, paint.steps
        values = _nodes(paint.element, light)
        flat = xp.array(values.reshape(3, -1), like)
        self._lattice = Lattice(xp, flat, len(values[0]), 3) if values.ndim == 4 else None
        if not abs(frame).max() < MOST:
            raise ProgramError("a texture's frame beyond float32")
        # from leaf coordinates to shares of the picture's sides, from its upper left corner
        (a, b, u), (c, d, v) = frame.astype(np.float64).reshape(2, 3).tolist()
        self.place = Affine(((a / 2, b / 2, (u + 1) / 2 % 1.0), (-c / 2, -d / 2, (1 - v) / 2 % 1.0)))
        self.texels, self.sides = flat, values.shape[-2:]
        across = abs(np.array([row[:2] for row in self.place.rows])).max() if values.ndim == 3 else 0.5
        self.detail = float(across) * max(values.shape)
        """Texels that a way of a leaf unit may cross, about."""

    def at(self, q: Array) -> Array:
        """Colours (3, M) at leaf coordinates (d, M)."""
        found = self._picture(q) if self._lattice is None else self._lattice.at(q.clip(-1.0, 1.0))
        return stepped(self._xp, found, self.steps)

    def _picture(self, q: Array) -> Array:
        xp, (high, wide) = self._xp, self.sides
        cells, shares = [], []
        for share, count in zip(self.place(xp, [q[0], q[1]]), (wide - 2, high - 2), strict=True):
            place = (share - xp.floor(share)) * count + 0.5  # among the texels and the one before the first
            cells.append(xp.whole(place))
            shares.append(place - xp.narrow(cells[-1]))
        return blended(xp, self.texels, cells[1] * wide + cells[0], shares[::-1], [0, wide])


@lru_cache(maxsize=32)
def _nodes(element: Element, light: bool) -> np.ndarray:
    """Colours (3, n, n, n) of space, or (3, h + 2, w + 2) of a picture, which goes on beyond its sides."""
    try:
        values = texels(element)
    except TensorError as error:
        raise ProgramError(str(error)) from None
    if values.ndim == 3:
        values = np.pad(values, ((1, 1), (1, 1), (0, 0)), "wrap")
    if light:
        values = decoded(values).astype(np.float32)
    return np.ascontiguousarray(np.moveaxis(values, -1, 0))


def stepped(xp: Arrays, rgb: Array, steps: tuple[ColourStep, ...]) -> Array:
    """Colours (3, M) behind colour steps, clamped after each.

    Args:
        steps: of a paint.
    """
    for name, *numbers in steps:
        if name == "color":
            rgb = rgb * xp.array(np.array(numbers, np.float32)[:, None], rgb)
        elif name == "grayscale":
            luma = LUMA[0] * rgb[0] + LUMA[1] * rgb[1] + LUMA[2] * rgb[2]
            rgb = rgb + float(numbers[0]) * (luma - rgb)
        else:
            rgb = turned(xp, rgb, float(numbers[0]))
        rgb = rgb.clip(0.0, 1.0)
    return rgb


def turned(xp: Arrays, rgb: Array, turns: float) -> Array:
    """Colours (3, M) with another hue of HSV, in turns, of the same saturation and value."""
    r, g, b = rgb
    value, least = xp.maximum(xp.maximum(r, g), b), xp.minimum(xp.minimum(r, g), b)
    chroma = value - least
    sixth = 1.0 / chroma.clip(1e-12)  # of grey, which has no hue, 0 of it is taken
    of_green, of_blue = (b - r) * sixth + 2.0, (r - g) * sixth + 4.0
    hue = xp.select(value == r, (g - b) * sixth, xp.select(value == g, of_green, of_blue)) / 6.0 + turns % 1.0
    hue = (hue - xp.floor(hue)) * 6.0
    shares = abs(hue - 3.0) - 1.0, 2.0 - abs(hue - 2.0), 2.0 - abs(hue - 4.0)
    return xp.stack([least + chroma * share.clip(0.0, 1.0) for share in shares], 0)
