"""Frames on the disk while an animation is made, so that a run that was killed goes on where it stopped.

A frame's file is named by a digest of all that decides its pixels: the compiled Program, the weights, the
renderer and how it splits the picture. A frame of another text, import, param, size or model therefore
never is taken for one of this run, and equal frames share a file.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt
from PIL import Image as pillow

from scenelang.animation.timing import runs
from scenelang.backend.options import RenderError
from scenelang.files import lock, open_own, output_place, write_whole
from scenelang.image import image_format

_LOCK: Final = "lock"
_FRAME: Final = re.compile(r"[0-9a-f]{40}(\.\w+){1,3}")
_PASSING: Final = re.compile(r"film\.\w+|\.[0-9a-f]{40}(\.\w+){1,3}\.[0-9a-z]+\.part")
"""What was half-written when a run was killed."""
Pixels = npt.NDArray[np.uint8]
Box = tuple[int, int, int, int]
"""left, top, right, bottom; the last two exclusive."""


class Busy(RenderError):
    """Another process makes the same animation."""


def frame_key(*parts: object) -> str:
    """A digest, hex, of what decides a frame's pixels."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:40]


class Store:
    """A folder of frames, made if it is not there; while it is open no other process may use it.

    The folder may be a stranger's: no link in it is followed, and only files named like our own are removed.

    Raises:
        Busy: another process has it.
        RenderError: the folder, or what is locked in it, is a link.
        OSError: the folder cannot be made.
    """

    def __init__(self, folder: Path, suffix: str = ".png") -> None:
        self.folder, self.suffix = folder, suffix
        self._made = [p for p in (folder, *folder.parents) if not p.exists()]
        for place in (folder, folder / _LOCK):
            if place.is_symlink():
                raise RenderError(f"cannot keep frames in `{folder}`: `{place.name}` is a link")
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = os.fdopen(open_own(folder / _LOCK), "rb")
        if lock(self._lock.fileno(), folder / _LOCK) is False:
            self._lock.close()
            raise Busy(f"another process is drawing into `{folder}`")
        for part in self._named(_PASSING):
            part.unlink()

    def __enter__(self) -> Store:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None and not self._named(_FRAME):
            self.remove()  # nothing worth keeping
        self._lock.close()

    def file(self, key: str) -> Path:
        """Where the frame of a key lies, or will lie."""
        return self.folder / f"{key}{self.suffix}"

    def beside(self, key: str, number: int, suffix: str) -> Path:
        """Where a file beside the frame of a key lies, of one number."""
        return self.folder / f"{key}.{number}{suffix}"

    def adopt(self, frame: Path, file: Path) -> None:
        """Take a file that lies elsewhere, and stays there, for one of a frame."""
        if not frame.exists() and not file.is_symlink():
            try:
                os.link(file, frame)
            except OSError:  # the file system has no such links
                write_whole(frame, file.read_bytes())

    def has(self, key: str, size: tuple[int, int]) -> bool:
        """Whether a frame is there, whole and of a size (width, height)."""
        file = self.file(key)
        if file.is_symlink() or not file.is_file():
            return False
        # Pillow has no base class for what its readers raise
        with contextlib.suppress(Exception), pillow.open(file, formats=[image_format(file)]) as image:
            if image.size == size:
                image.load()
                return True
        return False

    def remove(self) -> None:
        """Take our files away, and where nothing else is there the folder and those that were made for it."""
        for file in (*self._named(_FRAME), *self._named(_PASSING), self.folder / _LOCK):
            with contextlib.suppress(OSError):
                file.unlink()
        self._lock.close()
        for folder in (self.folder, *self._made[1:]):
            with contextlib.suppress(OSError):
                folder.rmdir()

    def _named(self, pattern: re.Pattern[str]) -> list[Path]:
        with contextlib.suppress(FileNotFoundError):
            return [self.folder / name for name in os.listdir(self.folder) if pattern.fullmatch(name)]
        return []


def put_frame(files: Mapping[Path, bytes]) -> None:
    """Write the files of a frame, the first last: where that one is, the others are; links are replaced.

    They are not flushed: a frame that a power cut damaged is drawn again.
    """
    for file, data in reversed(list(files.items())):
        write_whole(file, data, flush=False)


def deliver(part: Path, target: Path) -> None:
    """Flush a finished file to the disk and rename it over ``target``, which stays as it was if it cannot."""
    place = output_place(target)
    with part.open("rb") as file:
        os.fsync(file.fileno())
    os.replace(part, place)


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
        with pillow.open(file) as image:
            pixels = np.asarray(image.convert("RGBA" if self.alpha else "RGB"))
        if pixels.shape[:2] != (self.size[1], self.size[0]):
            raise OSError(f"{file} has another size")
        return pixels

    def runs(self, lengths: Sequence[int]) -> Iterator[tuple[Pixels, int]]:
        """Pictures that differ from their neighbours, and how long each is shown."""
        for file, length in runs(self.files, lengths):
            yield self.read(file), length


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


Encoder = Callable[[Film, Path, Callable[[float], None]], None]
"""Writes a film to a file in one format, and says which share of it is done."""
