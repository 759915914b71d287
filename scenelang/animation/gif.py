"""GIF, written frame by frame: Pillow writes each, and only two are held.

Pillow's own writer of films holds every frame until the last has come, and gives each a palette of its own.

Source: CompuServe, Graphics Interchange Format, version 89a.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np
import numpy.typing as npt
from PIL import GifImagePlugin, Image

from scenelang.animation.palette import Census, Colours, Mapper
from scenelang.animation.pictures import Box, Film, changed
from scenelang.animation.timing import delays

Palette = Literal["auto", "global", "frame"]

PER_SECOND = 100
SHORTEST = 2  # hundredths of a second; browsers take shorter ones for a tenth
_LONGEST = 65535
_KEEP, _CLEAR = 1, 2  # what becomes of a frame when the next one comes


def write_gif(
    film: Film,
    part: Path,
    progress: Callable[[float], None],
    *,
    palette: Palette = "auto",
    dither: bool = False,
) -> None:
    """Encode a film.

    Args:
        film: finished frames; of transparent ones, pixels of less than half coverage are left out.
        part: file to write.
        progress: called with the share done.
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
    bits = 0 if common is None else _bits(common)
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


def _bits(colours: Colours) -> int:
    """Bits of an index; the colour after the last is the transparent one."""
    return max(1, len(colours).bit_length())
