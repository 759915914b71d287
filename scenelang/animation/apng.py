"""APNG: Pillow compresses each frame as a PNG, whose data goes into one file, so that only two are held.

Pillow's own writer, also in 13.0, holds every frame until the last has come.

Source: W3C, Portable Network Graphics (PNG) Specification, third edition, 2025, chapter 4.9 and 11.3.6.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np

from scenelang.animation.store import Film, Pixels, changed
from scenelang.animation.timing import runs
from scenelang.outputs import SIGNATURE, chunk

_LONGEST = 65535


def write_apng(film: Film, part: Path, progress: Callable[[float], None]) -> None:
    """Encode a film, losslessly, with alpha where it has any; delays are exact fractions of a second."""
    shown = [
        (file, piece)
        for file, count in runs(film.files, [1] * len(film.files))
        for piece in _pieces(count, film.fps)
    ]
    with part.open("wb") as out:
        out.write(SIGNATURE)
        sequence, before, last = 0, None, None
        pixels: Pixels | None = None
        for index, (file, (numerator, denominator)) in enumerate(shown):
            if file != last or pixels is None:
                pixels = film.read(file)
            left, top, right, bottom = changed(before, pixels)
            chunks = _png(np.ascontiguousarray(pixels[top:bottom, left:right]))
            if index == 0:
                out.write(chunk(b"IHDR", next(body for kind, body in chunks if kind == b"IHDR")))
                out.write(chunk(b"acTL", struct.pack(">II", len(shown), 0 if film.loop else 1)))
            # what is shown stays (0), and the new pixels replace it (0) instead of being laid over it
            control = (sequence, right - left, bottom - top, left, top, numerator, denominator, 0, 0)
            out.write(chunk(b"fcTL", struct.pack(">IIIIIHHBB", *control)))
            sequence += 1
            for kind, body in chunks:
                if kind == b"IDAT" and index == 0:
                    out.write(chunk(b"IDAT", body))
                elif kind == b"IDAT":
                    out.write(chunk(b"fdAT", struct.pack(">I", sequence) + body))
                    sequence += 1
            before, last = pixels, file
            progress((index + 1) / len(shown))
        out.write(chunk(b"IEND", b""))


def _pieces(count: int, fps: float) -> Iterator[tuple[int, int]]:
    """How long ``count`` frames are shown, as fractions of 16 bits a part; more than one if it is long."""
    whole = (count / Fraction(fps).limit_denominator(1_000_000)).limit_denominator(_LONGEST)
    if whole.numerator <= _LONGEST:
        yield whole.numerator, whole.denominator
        return
    for share in (count // 2, count - count // 2):
        yield from _pieces(share, fps) if count > 1 else [(min(_LONGEST, round(float(whole))), 1)]


def _png(pixels: Pixels) -> list[tuple[bytes, bytes]]:
    """The chunks of a picture."""
    from PIL import Image

    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "PNG")
    raw, at, found = data.getvalue(), len(SIGNATURE), []
    while at < len(raw):
        (size,) = struct.unpack_from(">I", raw, at)
        found.append((raw[at + 4 : at + 8], raw[at + 8 : at + 8 + size]))
        at += 12 + size
    return found
