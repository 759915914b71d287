"""Waiting until files change.

Whether something changed is decided by looking at the files: size, time and identity. The system's
notifications only say when to look. So nothing is lost when an editor renames a new file over the old one,
when a folder comes into being, or between two waits; and where notifications do not work, looking every
now and then does.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Final

Stamp = tuple[int, int, int] | None
Stamps = dict[Path, Stamp]

SETTLE_S: Final = 0.02  # files must have been still for so long
PATIENCE_S: Final = 0.3  # a file that is gone, or empty, may be in the middle of being written
LOOK_S: Final = 0.25  # how often to look without notifications
GLANCE_MS: Final = 1000  # how often to look with them, for what they may miss


def stamp(path: Path) -> Stamp:
    """What tells a file's contents apart without reading them; None where there is no file."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


def stamps(paths: Collection[Path]) -> Stamps:
    """The stamp of each file."""
    return {path: stamp(path) for path in paths}


def folders(paths: Collection[Path]) -> set[Path]:
    """The folder of each file, or the nearest above it that is there."""
    found = set()
    for path in paths:
        folder = path.parent
        while not folder.is_dir() and folder != folder.parent:
            folder = folder.parent
        found.add(folder)
    return found


class Changes:
    """Waits for changes.

    Args:
        polls: look every now and then instead of being notified.
        say: told once why notifications do not work.
    """

    def __init__(self, *, polls: bool = False, say: Callable[[str], None] = lambda _: None) -> None:
        self.polls, self._say = polls, say

    def wait(self, before: Stamps) -> None:
        """Return as soon as any file is not as it was, and has come to rest.

        Args:
            before: the files, as they were before they were read.

        Raises:
            KeyboardInterrupt: as anywhere.
        """
        ticks = self._ticks(before)
        try:
            while stamps(before) == before:
                next(ticks)
        finally:
            ticks.close()  # type: ignore[attr-defined]
        settle(before)

    def _ticks(self, paths: Collection[Path]) -> Iterator[None]:
        """Something for each time to look."""
        watched = folders(paths)
        while not self.polls:
            try:
                from watchfiles import watch
            except ImportError:
                self._give_up("watchfiles is not installed (pip install 'scenelang[watch]')")
                break
            try:
                for _ in watch(
                    *watched,
                    watch_filter=None,
                    debounce=100,
                    step=10,
                    rust_timeout=GLANCE_MS,
                    yield_on_timeout=True,
                    recursive=False,
                ):
                    yield
                    if folders(paths) != watched:
                        break
                watched = folders(paths)
            except (OSError, RuntimeError) as error:  # no more watches, a folder that goes away
                if folders(paths) != watched:
                    watched = folders(paths)
                    yield
                    continue
                self._give_up(str(error).splitlines()[0])
        while True:
            time.sleep(LOOK_S)
            yield

    def _give_up(self, why: str) -> None:
        self.polls = True
        self._say(f"looking every {LOOK_S:g} s: {why}")


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
