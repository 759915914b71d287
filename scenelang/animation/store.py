"""Frames on the disk while an animation is made, so that a run that was killed goes on where it stopped.

A frame's file is named by a digest of all that decides its pixels: the compiled Program, the weights, the
renderer and how it splits the picture. A frame of another text, import, param, size or model therefore
never is taken for one of this run, and equal frames share a file.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import sys
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Final

from scenelang.backend.errors import RenderError

if TYPE_CHECKING:
    from scenelang.image import Image

_LOCK: Final = "lock"


class Busy(RenderError):
    """Another process makes the same animation."""


def frame_key(*parts: object) -> str:
    """A digest, hex, of what decides a frame's pixels."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:40]


class Store:
    """A folder of frames; while it is open no other process may use it.

    Args:
        folder: made if it is not there.
        suffix: of the frames' files, which names their format.

    Raises:
        Busy: another process has it.
        OSError: the folder cannot be made.
    """

    def __init__(self, folder: Path, suffix: str = ".png") -> None:
        self.folder, self.suffix = folder, suffix
        self._made = [p for p in (folder, *folder.parents) if not p.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = (folder / _LOCK).open("wb")
        if not _locked(self._lock.fileno()):
            self._lock.close()
            raise Busy(f"another process is drawing into '{folder}'")
        for part in folder.glob(".*.part"):  # half-written when a run was killed
            part.unlink(missing_ok=True)

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._lock.close()
        if kind is not None and not any(self.folder.glob(f"*{self.suffix}")):
            self.remove()  # nothing worth keeping

    def file(self, key: str) -> Path:
        """Where the frame of a key lies, or will lie."""
        return self.folder / f"{key}{self.suffix}"

    def has(self, key: str) -> bool:
        """Whether a frame is there, whole: files are renamed into place."""
        try:
            return self.file(key).stat().st_size > 0
        except FileNotFoundError:
            return False

    def put(self, key: str, image: Image) -> None:
        """Keep a frame.

        Raises:
            OSError: it cannot be written.
        """
        image.save(self.file(key))

    def remove(self) -> None:
        """Take the folder away, and those above it that were made for it and are empty."""
        self._lock.close()
        shutil.rmtree(self.folder, ignore_errors=True)
        for folder in self._made[1:]:
            with contextlib.suppress(OSError):
                folder.rmdir()


def _locked(handle: int) -> bool:
    """Take a lock that ends with the process, however it ends."""
    if sys.platform == "win32":
        return True  # where two runs at once do work twice, and harm nothing
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True  # a file system without locks
    return True


def deliver(part: Path, target: Path) -> None:
    """Flush a finished file of the same file system to the disk and rename it over ``target``.

    Raises:
        OSError: it cannot; ``target`` stays as it was.
    """
    place = target.resolve() if target.is_symlink() else target
    with part.open("rb") as file:
        os.fsync(file.fileno())
    os.replace(part, place)
