"""Animated WebP, by Pillow."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PIL import Image

from scenelang.animation.store import Film
from scenelang.animation.timing import delays, runs

PER_SECOND = 1000


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
    """Encode a film, losslessly, with alpha where it has any; of equal pictures it becomes a still."""
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
