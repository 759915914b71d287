"""GIF, written frame by frame: Pillow writes each, and only two are held.

Pillow's own writer of films, also in 13.0, holds every frame until the last has come, and gives each a
palette of its own; one that is exact for all frames is found here.

Source: CompuServe, Graphics Interchange Format, version 89a.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np
import numpy.typing as npt
from PIL import GifImagePlugin, Image

from scenelang.animation.store import Box, Film, Pixels, changed
from scenelang.animation.timing import delays

Palette = Literal["auto", "global", "frame"]
Colours = npt.NDArray[np.uint8]
"""(K, 3)."""

PER_SECOND = 100
SHORTEST = 2  # hundredths of a second; browsers take shorter ones for a tenth
_LONGEST = 65535
_KEEP, _CLEAR = 1, 2  # what becomes of a frame when the next one comes
_SAMPLE = 1 << 18  # pixels that a palette is chosen from
_MOST_KNOWN = 1 << 20  # colours that are counted; more are thinned to the most frequent half


def write_gif(
    film: Film,
    part: Path,
    progress: Callable[[float], None],
    *,
    palette: Palette = "auto",
    dither: bool = False,
) -> None:
    """Encode a film; of transparent frames, pixels of less than half coverage are left out.

    Args:
        palette: ``"global"`` has one for all frames, ``"frame"`` one for each, ``"auto"`` the one that holds
            all colours exactly, if one does, and otherwise a global one, which keeps still parts still.
        dither: spread what a palette lacks over neighbouring pixels.
    """
    lengths = delays(len(film.files), film.fps, PER_SECOND, SHORTEST)
    most = 256 - 1  # one is for what is transparent, or stays as it was
    census = Census(most)
    count = len(lengths)
    if palette != "frame":
        for index, (pixels, length) in enumerate(film.runs(lengths)):
            census.add(pixels, length)
            progress(0.4 * index / count)
    own = palette == "frame" or (palette == "auto" and not census.fits and not census.crowded)
    common = None if own else census.choose()
    with part.open("wb") as out:
        _head(out, film, common)
        shown: npt.NDArray[np.uint8] | None = None
        mapper = Mapper(common, dither) if common is not None else None
        for index, (pixels, length) in enumerate(film.runs(lengths)):
            if own:
                one = Census(most)
                one.add(pixels)
                mapper = Mapper(one.choose(), dither)
            assert mapper is not None
            shown = _frame(out, film, pixels, shown, mapper, length, own)
            progress(0.4 + 0.6 * index / count)
        out.write(b";")


def _head(out: BinaryIO, film: Film, common: Colours | None) -> None:
    # of an index; the colour after the last is the transparent one
    bits = 0 if common is None else max(1, len(common).bit_length())
    flags = 0x70 | (0x80 | (bits - 1) if common is not None else 0)
    out.write(b"GIF89a" + struct.pack("<HHBBB", *film.size, flags, 0, 0))
    if common is not None:
        out.write(common.tobytes().ljust(3 << bits, b"\0"))
    if film.loop:
        out.write(b"!\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")


def _frame(
    out: BinaryIO,
    film: Film,
    pixels: npt.NDArray[np.uint8],
    shown: npt.NDArray[np.uint8] | None,
    mapper: Mapper,
    length: int,
    own: bool,
) -> npt.NDArray[np.uint8]:
    """Write one picture; returns what a viewer then shows, the colours that its palette gave."""
    colours = mapper.colours
    clear = len(colours)  # the index after the palette's own
    index = mapper(pixels)
    now = colours[index]
    box: Box = (0, 0, *film.size)
    if film.alpha:
        index[pixels[..., 3] < 128] = clear
    elif shown is not None:
        box = changed(shown, now)
        index = np.where((now == shown).all(axis=2), np.uint8(clear), index)
    left, top, right, bottom = box
    part = index[top:bottom, left:right]
    while True:  # a longer time than the format holds is a second picture of nothing
        image = Image.fromarray(np.ascontiguousarray(part))
        image.putpalette(np.append(colours, [[0, 0, 0]], axis=0).astype(np.uint8).tobytes())
        options = {
            "duration": 10 * min(length, _LONGEST),  # Pillow takes milliseconds
            "disposal": _CLEAR if film.alpha else _KEEP,
            "transparency": clear,
            "include_color_table": own,
        }
        out.writelines(GifImagePlugin.getdata(image, (left, top), **options))
        length -= _LONGEST
        if length <= 0:
            return now
        if not film.alpha:
            part = np.full((1, 1), clear, np.uint8)


# ---------------------------------------------------------------- colours


def packed(pixels: Pixels) -> npt.NDArray[np.uint32]:
    """Colours (H, W, 3) as one number each, of any shape before the last axis."""
    wide = pixels[..., :3].astype(np.uint32)
    return np.asarray((wide[..., 0] << 16) | (wide[..., 1] << 8) | wide[..., 2], np.uint32)


def unpacked(numbers: npt.NDArray[np.uint32]) -> Colours:
    """Numbers (K,) as colours (K, 3)."""
    return np.stack([numbers >> 16, (numbers >> 8) & 255, numbers & 255], axis=-1).astype(np.uint8)


@dataclass(slots=True)
class Census:
    """How often each colour comes up in all pictures, counted one picture at a time."""

    most: int  # whether any single picture has more colours than this is noted in `crowded`
    colours: npt.NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, np.uint32))
    counts: npt.NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    crowded: bool = False
    thinned: bool = False

    def add(self, pixels: Pixels, weight: int = 1) -> None:
        """Count what is shown of a picture where one colour is transparent."""
        numbers = packed(pixels)
        shown = numbers[pixels[..., 3] >= 128] if pixels.shape[2] == 4 else numbers
        found, counts = np.unique(shown, return_counts=True)
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
        """At most `most` colours, (K, 3): all of them, or a selection near to all.

        That is by median cut over pixels as frequent as the square root of each colour's count, then k-means.
        The square root keeps small coloured things from drowning in a large background.
        """
        if self.fits:
            return unpacked(self.colours)
        share = np.sqrt(self.counts.astype(np.float64))
        repeat = np.maximum(1, np.floor(share * (_SAMPLE / share.sum())).astype(np.int64))
        sample = np.repeat(self.colours, repeat)
        side = int(np.ceil(np.sqrt(len(sample))))
        square = np.resize(sample, side * side)
        image = Image.fromarray(unpacked(square).reshape(side, side, 3))
        reduced = image.quantize(self.most, method=Image.Quantize.MEDIANCUT, kmeans=2)
        used = len(reduced.getcolors(256) or ())
        table = np.array(reduced.getpalette() or [], np.uint8).reshape(-1, 3)
        return np.unique(table[: max(used, 1)], axis=0)


class Mapper:
    """Pictures to indices of a palette (K, 3): exact where the colour is in it, the nearest otherwise.

    If asked, the error is dithered over neighbouring pixels (Floyd and Steinberg 1976).
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
        table = Image.new("P", (1, 1))
        table.putpalette(self.colours.tobytes())
        image = Image.fromarray(np.ascontiguousarray(pixels[..., :3]))
        index = np.asarray(image.quantize(palette=table, dither=Image.Dither.FLOYDSTEINBERG))
        return np.asarray(np.minimum(index, len(self.colours) - 1), np.uint8)
