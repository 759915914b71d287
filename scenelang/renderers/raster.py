"""Pixels of the plane in blocks, and where they lie in the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenelang.renderers.meetings import Index

LEVELS = 8, 4  # sides of blocks, pixels


@dataclass(frozen=True, slots=True)
class Raster:
    """Pixels in rows of blocks, of the largest size in both directions.

    Args:
        px: world units.
        canvas: width, and rows of pixels that are wanted.
        wide, high: pixels up to the ends of the last blocks.
        left, top: world coordinates of the middle of the first pixel.
    """

    px: float
    canvas: tuple[int, int]
    wide: int
    high: int
    left: float
    top: float

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


def raster(canvas: tuple[int, int], rows: range) -> Raster:
    """The blocks that hold some rows of a picture."""
    width, height = canvas
    px = 2 / min(width, height)  # world units
    wide, high = (-(-n // LEVELS[0]) * LEVELS[0] for n in (width, len(rows)))
    left, top = (0.5 - width / 2) * px, (height / 2 - 0.5 - rows.start) * px
    return Raster(px, (width, len(rows)), wide, high, left, top)
