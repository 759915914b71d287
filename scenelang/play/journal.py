"""Texts that are not saved yet, kept in a folder of the user's: they outlive this process and the browser."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from scenelang.evaluate.limits import MAX_BYTES
from scenelang.files import read_json, read_regular, write_whole
from scenelang.records import Record

MOST_DAYS: Final = 30
MOST_KEPT: Final = 100


class Unsaved(Record):
    """A text that was not saved."""

    text: str
    disk: str | None  # digest of the file that it was an edit of; None where there was none
    seconds: float  # how long ago it was kept


class Journal:
    """A folder with one file for each scene that has unsaved text."""

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder if folder is not None else state_folder(os.environ, sys.platform) / "play"

    def keep(self, path: Path, text: str, disk: str | None) -> None:
        """Keep a scene's unsaved text; raises `OSError`."""
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        entry = {"file": str(path), "text": text, "disk": disk, "time": time.time()}
        place = self._place(path)
        if not place.exists():
            place.touch(mode=0o600)  # which the file that replaces it takes over
        write_whole(place, json.dumps(entry).encode())

    def find(self, path: Path) -> Unsaved | None:
        """What was kept of a scene."""
        try:
            entry = read_json(read_regular(self._place(path), 8 * MAX_BYTES))
            text, disk, at = entry["text"], entry["disk"], entry["time"]
            if entry["file"] != str(path) or not isinstance(text, str) or not isinstance(disk, str | None):
                return None
            return Unsaved(text, disk, max(0.0, time.time() - float(at)))
        except (OSError, ValueError, TypeError, KeyError):
            return None

    def drop(self, path: Path) -> None:
        """Forget a scene's text."""
        with contextlib.suppress(OSError):
            self._place(path).unlink()

    def tidy(self) -> None:
        """Remove what is older than `MOST_DAYS`, and all but the newest `MOST_KEPT`."""
        with contextlib.suppress(OSError):
            times = {entry: entry.stat().st_mtime for entry in self.folder.glob("*.json")}
            newest = sorted(times, key=times.__getitem__, reverse=True)
            old = time.time() - MOST_DAYS * 86400
            for index, entry in enumerate(newest):
                if index >= MOST_KEPT or times[entry] < old:
                    entry.unlink()

    def _place(self, path: Path) -> Path:
        name = hashlib.sha256(str(path).encode("utf-8", "surrogateescape")).hexdigest()[:32]
        return self.folder / f"{name}.json"


def state_folder(environment: Mapping[str, str], platform: str) -> Path:
    """Where programs of a user keep what is neither theirs to edit nor worth a backup."""
    if own := environment.get("SCENELANG_STATE"):
        return Path(own)
    if platform == "win32":
        base = environment.get("LOCALAPPDATA")
        return Path(base) / "scenelang" if base else Path.home() / "AppData/Local/scenelang"
    if platform == "darwin":
        return Path.home() / "Library/Application Support/scenelang"
    base = environment.get("XDG_STATE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".local/state") / "scenelang"
