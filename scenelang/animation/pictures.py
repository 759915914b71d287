"""Frames read back from the store, and what changes from one to the next."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from scenelang.animation.timing import runs

Pixels = npt.NDArray[np.uint8]
Box = tuple[int, int, int, int]
"""left, top, right, bottom; the last two exclusive."""


@dataclass(frozen=True, slots=True)
class Film:
    """Finished frames in the order in which they are shown; read from the disk one at a time."""

    files: Sequence[Path]  # one for each frame; equal frames have the same
    fps: float  # frames a second
    loop: bool  # whether it starts again at its end
    size: tuple[int, int]  # width and height in pixels
    alpha: bool  # whether the pictures are transparent

    def read(self, file: Path) -> Pixels:
        """The pixels (H, W, 3 or 4) of a frame; raises `OSError` where its file is damaged."""
        from PIL import Image

        with Image.open(file) as image:
            pixels = np.asarray(image.convert("RGBA" if self.alpha else "RGB"))
        if pixels.shape[:2] != (self.size[1], self.size[0]):
            raise OSError(f"{file} has another size")
        return pixels

    def runs(self, lengths: Sequence[int]) -> Iterator[tuple[Pixels, int]]:
        """Pictures that differ from their neighbours, and how long each is shown."""
        for file, length in runs(self.files, lengths):
            yield self.read(file), length


Encoder = Callable[[Film, Path, Callable[[float], None]], None]
"""Writes a film to a file in one format, and says which share of it is done."""


def changed(before: Pixels | None, now: Pixels) -> Box:
    """The smallest box around all pixels that differ; one pixel where none does."""
    height, width = now.shape[:2]
    if before is None:
        return 0, 0, width, height
    differs = (before != now).any(axis=2)
    rows, columns = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
    if not len(rows):
        return 0, 0, 1, 1
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
