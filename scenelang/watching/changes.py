"""Waiting until files change.

They are looked at often, by size, time and identity, which takes microseconds a file. So nothing is lost
when an editor renames a new file over the old one, when a folder comes into being, between two waits, or on
network folders, of whose changes the system gives no notice.
"""

from __future__ import annotations

import time
from collections.abc import Collection
from pathlib import Path
from typing import Final

Stamp = tuple[int, int, int] | None
Stamps = dict[Path, Stamp]

LOOK_S: Final = 0.03  # between two looks
SETTLE_S: Final = 0.02  # files must have been still for so long
PATIENCE_S: Final = 0.3  # a file that is gone, or empty, may be in the middle of being written


def stamps(paths: Collection[Path]) -> Stamps:
    """What tells each file's contents apart without reading them; None where there is no file."""
    return {path: _stamp(path) for path in paths}


def _stamp(path: Path) -> Stamp:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


def wait(before: Stamps) -> None:
    """Return as soon as any file is not as it was before it was read, and has come to rest."""
    while stamps(before) == before:
        time.sleep(LOOK_S)
    settle(before)


def settle(paths: Collection[Path]) -> None:
    """Wait until files have stopped changing; longer for one that is gone or empty, but not for ever."""
    started = time.monotonic()
    last = stamps(paths)
    while True:
        time.sleep(SETTLE_S)
        now = stamps(paths)
        if now == last:
            first = next(iter(now.values()), None)
            whole = first is not None and first[1] > 0
            if whole or time.monotonic() - started > PATIENCE_S:
                return
        last = now
        if time.monotonic() - started > 10 * PATIENCE_S:
            return  # something writes all the time
