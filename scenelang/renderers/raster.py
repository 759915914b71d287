"""Pixels of the plane in blocks, and where they lie in the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenelang.renderers.frames import Floats, Frames
from scenelang.renderers.meetings import Index, Pairs

LEVELS = 8, 4  # sides of blocks, pixels
ROUNDING = 1e-6  # world units


@dataclass(frozen=True, slots=True)
class Raster:
    """Pixels in rows of blocks, of the largest size in both directions.

    Args:
        px: world units.
        canvas: width, and rows of pixels that are wanted.
        wide, high: pixels up to the ends of the last blocks.
        left, top: world coordinates of the middle of the first pixel.
        largest: side of the largest blocks, pixels.
    """

    px: float
    canvas: tuple[int, int]
    wide: int
    high: int
    left: float
    top: float
    largest: int = LEVELS[0]

    def place(self, block: Index, side: int) -> tuple[Index, Index]:
        """Column and row of the first pixels of blocks, numbered from the top row of them down."""
        down, across = np.divmod(block, self.wide // side)
        return across * side, down * side

    def blocks(self, pixels: np.ndarray, side: int) -> np.ndarray:
        """A view (down, row, across, column, .) by blocks of pixels (high, wide, .)."""
        return pixels.reshape(self.high // side, side, self.wide // side, side, -1)

    def inside(self, place: tuple[Index, Index], side: int) -> np.ndarray | None:
        """Which pixels (side * side, B) of blocks are wanted; None if all of the raster's are."""
        if self.canvas == (self.wide, self.high):
            return None
        down, across = np.divmod(np.arange(side * side)[:, None], side)
        found: np.ndarray = (place[0] + across < self.canvas[0]) & (place[1] + down < self.canvas[1])
        return found

    def centres(self, place: tuple[Index, Index], side: int) -> np.ndarray:
        """World coordinates (2, side * side, B), float32, of blocks' pixels row by row.

        They are float64 up to here: at 8192 pixels float32 would move samples by a hundredth of a pixel.
        """
        found = np.empty((2, side, side, len(place[0])), np.float32)
        steps = self.px * np.arange(side)[:, None]
        found[0] = (self.left + self.px * place[0]) + steps
        found[1] = ((self.top - self.px * place[1]) - steps)[:, None]
        return found.reshape(2, side * side, -1)

    def reached(self, frames: Frames, reach: Floats) -> Pairs:
        """Objects at the largest blocks where they may be within their reach (N,), leaf units."""
        size = self.largest * self.px
        every = np.isinf(reach)
        low, high = frames.boxes(np.where(every, 0.0, reach))
        corner = self.left - self.px / 2, self.top + self.px / 2
        most = np.array([[self.wide], [self.high]]) // self.largest
        first = np.stack([low[0] - corner[0], corner[1] - high[1]]) - ROUNDING
        last = np.stack([high[0] - corner[0], corner[1] - low[1]]) + ROUNDING
        # a box of what are no numbers is everywhere
        first = np.floor(np.fmin(np.fmax(first / size, 0), most)).astype(np.intp)
        last = np.ceil(np.fmax(np.fmin(last / size, most), 0)).astype(np.intp)
        first, last = np.where(every, 0, first), np.where(every, most, last)
        across, down = (last - first).clip(0)
        counts = across * down
        objects = np.repeat(np.arange(len(counts)), counts)
        at = np.arange(len(objects)) - np.repeat(np.cumsum(counts) - counts, counts)
        y, x = np.divmod(at, across[objects])
        return Pairs.of((first[1][objects] + y) * most[0] + first[0][objects] + x, objects)


def raster(canvas: tuple[int, int], rows: range, largest: int = LEVELS[0]) -> Raster:
    """The blocks that hold some rows of a picture."""
    width, height = canvas
    px = 2 / min(width, height)  # world units
    wide, high = (-(-n // largest) * largest for n in (width, len(rows)))
    left, top = (0.5 - width / 2) * px, (height / 2 - 0.5 - rows.start) * px
    return Raster(px, (width, len(rows)), wide, high, left, top, largest)
