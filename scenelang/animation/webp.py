"""Animated WebP, by Pillow.

Source: Google, WebP Container Specification, for what Pillow does not write: a picture that is held.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

from PIL import Image

from scenelang.animation.store import Film
from scenelang.animation.timing import delays, runs

PER_SECOND = 1000
_ANIMATED, _ALPHA = 0x02, 0x10


class _Reel(Image.Image):
    """A film as Pillow's writer takes it: it seeks each frame when its turn comes, and holds one."""

    def __init__(self, film: Film, files: list[Path], progress: Callable[[float], None]) -> None:
        super().__init__()
        self._film, self._files, self._progress = film, files, progress
        self.n_frames = len(files)
        self.seek(0)

    def seek(self, frame: int) -> None:
        self._progress(frame / self.n_frames)
        image = Image.fromarray(self._film.read(self._files[frame]))
        self.im, self._mode, self._size = image.im, image.mode, image.size
        self._at = frame

    def tell(self) -> int:
        return self._at


def write_webp(film: Film, part: Path, progress: Callable[[float], None]) -> None:
    """Encode a film, losslessly, with alpha where it has any."""
    shown = runs(film.files, delays(len(film.files), film.fps, PER_SECOND))
    reel = _Reel(film, [file for file, _ in shown], progress)
    with part.open("wb") as out:
        reel.save(
            out,
            "WEBP",
            save_all=True,
            lossless=True,
            quality=80,  # of the search, not of the picture
            method=4,
            duration=[length for _, length in shown],
            loop=0 if film.loop else 1,
        )
    with part.open("rb") as written:
        head = written.read(21)
    animated = head[12:16] == b"VP8X" and head[20] & _ANIMATED
    if len(film.files) > 1 and not animated:
        part.write_bytes(_held(film, sum(length for _, length in shown)))


def _held(film: Film, length: int) -> bytes:
    """A film whose pictures are equal, of which libwebp makes a still that has no length.

    Its second half shows one pixel of the picture over itself.
    """
    image = Image.fromarray(film.read(film.files[0]))
    width, height = (struct.pack("<I", side - 1)[:3] for side in film.size)
    parts = [
        _chunk(b"VP8X", bytes([_ANIMATED | _ALPHA * film.alpha, 0, 0, 0]) + width + height),
        _chunk(b"ANIM", struct.pack("<IH", 0, 0 if film.loop else 1)),
    ]
    for shown, time in ((image, length - length // 2), (image.crop((0, 0, 1, 1)), length // 2)):
        data = io.BytesIO()
        shown.save(data, "WEBP", lossless=True, quality=80, method=4)
        pixels = next(chunk for chunk in _chunks(data.getvalue()) if chunk.startswith(b"VP8L"))
        place = b"".join(struct.pack("<I", n)[:3] for n in (0, 0, shown.width - 1, shown.height - 1, time))
        parts.append(_chunk(b"ANMF", place + b"\x02" + pixels))  # put in the place of what is there
    return _chunk(b"RIFF", b"WEBP" + b"".join(parts))


def _chunk(name: bytes, data: bytes) -> bytes:
    return name + struct.pack("<I", len(data)) + data + b"\0" * (len(data) % 2)


def _chunks(file: bytes) -> Iterator[bytes]:
    """The chunks of a WebP file, with their heads."""
    at = 12
    while at < len(file):
        end = at + 8 + struct.unpack_from("<I", file, at + 4)[0]
        end += end % 2
        yield file[at:end]
        at = end
