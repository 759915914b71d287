"""Colours of pictures for formats that hold 256 of them.

Pillow chooses a palette for one picture; one that is exact for all frames of a film is found here.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from scenelang.animation.pictures import Pixels

Colours = npt.NDArray[np.uint8]
"""(K, 3)."""
_SAMPLE = 1 << 18  # pixels that a palette is chosen from
_MOST_KNOWN = 1 << 20  # colours that are counted; more are thinned to the most frequent half


def packed(pixels: Pixels) -> npt.NDArray[np.uint32]:
    """Colours (H, W, 3) as one number each, of any shape before the last axis."""
    wide = pixels[..., :3].astype(np.uint32)
    return np.asarray((wide[..., 0] << 16) | (wide[..., 1] << 8) | wide[..., 2], np.uint32)


def unpacked(numbers: npt.NDArray[np.uint32]) -> Colours:
    """Numbers (K,) as colours (K, 3)."""
    return np.stack([numbers >> 16, (numbers >> 8) & 255, numbers & 255], axis=-1).astype(np.uint8)


def opaque(pixels: Pixels) -> npt.NDArray[np.uint32]:
    """The colours, packed (N,), of pixels that a format with one transparent colour shows."""
    numbers = packed(pixels)
    return numbers[pixels[..., 3] >= 128] if pixels.shape[2] == 4 else numbers.ravel()


@dataclass(slots=True)
class Census:
    """How often each colour comes up in all pictures, counted one picture at a time."""

    most: int  # whether any single picture has more colours than this is noted in `crowded`
    colours: npt.NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, np.uint32))
    counts: npt.NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    crowded: bool = False
    thinned: bool = False

    def add(self, pixels: Pixels, weight: int = 1) -> None:
        """Count a picture."""
        found, counts = np.unique(opaque(pixels), return_counts=True)
        self.crowded |= len(found) > self.most
        both = np.concatenate([self.colours, found])
        self.colours, index = np.unique(both, return_inverse=True)
        total = np.zeros(len(self.colours), np.int64)
        np.add.at(total, index, np.concatenate([self.counts, counts * weight]))
        self.counts = total
        if len(self.colours) > _MOST_KNOWN:
            kept = np.sort(np.argsort(total, kind="stable")[len(total) // 2 :])
            self.colours, self.counts, self.thinned = self.colours[kept], total[kept], True

    @property
    def fits(self) -> bool:
        """Whether all colours together are few enough."""
        return not self.thinned and len(self.colours) <= self.most

    def choose(self) -> Colours:
        """At most `most` colours, (K, 3): all of them, or a selection near to all."""
        if self.fits:
            return unpacked(self.colours)
        return _selected(self.colours, self.counts, self.most)


def _selected(colours: npt.NDArray[np.uint32], counts: npt.NDArray[np.int64], most: int) -> Colours:
    """By median cut over pixels as frequent as the square root of each colour's count, then k-means.

    The square root keeps small coloured things from drowning in a large background.
    """
    from PIL import Image

    share = np.sqrt(counts.astype(np.float64))
    repeat = np.maximum(1, np.floor(share * (_SAMPLE / share.sum())).astype(np.int64))
    sample = np.repeat(colours, repeat)
    side = int(np.ceil(np.sqrt(len(sample))))
    square = np.resize(sample, side * side)
    image = Image.fromarray(unpacked(square).reshape(side, side, 3))
    reduced = image.quantize(most, method=Image.Quantize.MEDIANCUT, kmeans=2)
    used = len(reduced.getcolors(256) or ())
    table = np.array(reduced.getpalette() or [], np.uint8).reshape(-1, 3)
    return np.unique(table[: max(used, 1)], axis=0)


class Mapper:
    """Pictures to indices of a palette: exact where the colour is in it, the nearest otherwise.

    Args:
        colours: (K, 3).
        dither: spread the error to neighbouring pixels (Floyd and Steinberg 1976).
    """

    def __init__(self, colours: Colours, dither: bool) -> None:
        self.colours, self.dither = colours, dither
        self._wide = colours.astype(np.int32)
        self._known: dict[int, int] = {}

    def __call__(self, pixels: Pixels) -> npt.NDArray[np.uint8]:
        """Indices (H, W)."""
        flat = packed(pixels)
        found, inverse = np.unique(flat, return_inverse=True)
        index = np.array([self._nearest(number) for number in found.tolist()], np.uint8)
        exact = (self.colours[index] == unpacked(found)).all(axis=1).all()
        if self.dither and not exact:
            return self._dithered(pixels)
        return index[inverse].reshape(flat.shape)

    def _nearest(self, number: int) -> int:
        known = self._known.get(number)
        if known is None:
            rgb = np.array([number >> 16, (number >> 8) & 255, number & 255], np.int32)
            known = int(((self._wide - rgb) ** 2).sum(axis=1).argmin())
            if len(self._known) < _MOST_KNOWN:
                self._known[number] = known
        return known

    def _dithered(self, pixels: Pixels) -> npt.NDArray[np.uint8]:
        from PIL import Image

        table = Image.new("P", (1, 1))
        table.putpalette(self.colours.tobytes())
        image = Image.fromarray(np.ascontiguousarray(pixels[..., :3]))
        index = np.asarray(image.quantize(palette=table, dither=Image.Dither.FLOYDSTEINBERG))
        return np.asarray(np.minimum(index, len(self.colours) - 1), np.uint8)
