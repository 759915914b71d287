"""The folder that `play` serves, unsaved texts, files for download, and messages of the page."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import json
import os
import re
import secrets
import sys
import time
from collections.abc import Collection, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, Final

from scenelang.assets.files import read_json, read_regular, reason, write_whole
from scenelang.assets.records import Record
from scenelang.language.limits import MAX_BYTES
from scenelang.language.session import Unreadable, decode_source

MOST_FILES: Final = 2000
MOST_LOOKED: Final = 20_000
"""Files that are searched for scenes; in a folder with more only those at its top are watched."""
_MOST_PARTS: Final = 8
_MOST_NAME: Final = 200  # bytes of a name; a temporary file beside it has a few more
# Control characters, what Windows gives a meaning, what turns the direction of a text, halves of characters.
_PART: Final = re.compile(
    r'[^\x00-\x1f\x7f-\x9f\\/:*?"<>|\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]+'
)
_DEVICE: Final = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[0-9¹²³]) *(\..*)?", re.IGNORECASE)


class Denied(Exception):
    """Raised where a request cannot be granted; the message says why."""


class JobFailed(Exception):
    """Raised where a job has no result; the message says why."""


class Answer(Record):
    """Result of a job: what is sent to the page, and facts for the server."""

    data: bytes
    head: dict[str, Any] = field(default_factory=dict)


class Changed(Exception):
    """The file is not as the page has seen it."""

    def __init__(self, text: str | None, disk: str | None) -> None:
        super().__init__()
        self.text, self.disk = text, disk


class Folder:
    """A folder of scenes, and the root that imports cannot leave; None for each scene's own folder."""

    def __init__(self, path: Path, root: Path | None = None) -> None:
        self.path, self.root = path.resolve(), root.resolve() if root is not None else None
        self.is_large = False

    def names(self) -> list[str]:
        """The scenes in it and below, sorted; hidden folders and links to folders left out."""
        result: list[str] = []
        looked = 0
        for where, inner, files in os.walk(self.path):
            deep = len(Path(where).relative_to(self.path).parts)
            inner[:] = sorted(name for name in inner if name[0] != "." and name != "node_modules")
            if deep + 1 >= _MOST_PARTS:
                inner.clear()
            for file in files:
                name = Path(where, file).relative_to(self.path).as_posix()
                if fits(name):
                    result.append(name)
            looked += len(files) + len(inner)
            self.is_large = looked > MOST_LOOKED
            if self.is_large or len(result) > MOST_FILES:
                break
        return sorted(result, key=lambda name: (name.count("/"), name))[:MOST_FILES]

    def place(self, name: str) -> Path:
        """The path of a file, which need not be there; raises `Denied` for other names than scenes'."""
        if not fits(name):
            raise Denied(f"`{repr(name[:80])[1:-1]}` is not the name of a scene in this folder")
        path = self.path / name
        if not self.holds(str(path)):
            raise Denied(f"`{name}` lies outside the folder")
        return path

    def read(self, name: str) -> tuple[str | None, str | None]:
        """The text of a file, lines ended by ``\\n``, and its digest; None and None without a file."""
        try:
            data = read_regular(self.place(name), MAX_BYTES)
            text = decode_source(data, name).text
        except FileNotFoundError:
            return None, None
        except Unreadable as error:
            raise Denied(f"cannot read `{name}`: {error}") from None
        except OSError as error:
            raise Denied(f"cannot read `{name}`: {reason(error)}") from None
        return text.replace("\r\n", "\n").replace("\r", "\n"), _digest(data)

    def write(self, name: str, text: str, base: str | None) -> str:
        """Write a file whole, with the line ends that it has; its digest.

        Raises `Changed` where the file's digest is not ``base``, None for no file, and `Denied` where it
        cannot be written, or is, or lies behind, a link.
        """
        path = self.place(name)
        for part in (path, *path.parents[: len(Path(name).parts) - 1]):
            if part.is_symlink():
                raise Denied(f"`{name}` is a link, which is not written through")
        old, disk = self.read(name)
        if disk != base:
            raise Changed(old, disk)
        crlf = old is not None and b"\r\n" in read_regular(path, MAX_BYTES).partition(b"\n")[0] + b"\n"
        data = (text.replace("\n", "\r\n") if crlf else text).encode("utf-8", "strict")
        if len(data) > MAX_BYTES:
            raise Denied(f"a text of more than {MAX_BYTES // 1_000_000} MB")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, data)
        except OSError as error:
            raise Denied(f"cannot write `{name}`: {reason(error)}") from None
        return _digest(data)

    def rename(self, name: str, to: str) -> None:
        """Give a file a name that no other has; raises `Denied`."""
        old, new = self.place(name), self.place(to)
        if old.is_symlink() or not old.is_file():
            raise Denied(f"there is no file `{name}`")
        try:
            new.parent.mkdir(parents=True, exist_ok=True)
            os.close(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL))  # the name is ours from here on
            os.replace(old, new)
        except FileExistsError:
            raise Denied(f"there is a file `{to}` already") from None
        except OSError as error:
            raise Denied(f"cannot rename `{name}`: {reason(error)}") from None

    def holds(self, path: str) -> bool:
        """True where an absolute path leads to a place in the folder."""
        try:
            return "\0" not in path and Path(path).resolve().is_relative_to(self.path)
        except (OSError, RuntimeError, ValueError):
            return False

    def name_of(self, path: Path) -> str | None:
        """The name of a path in this folder; None where it is not a scene of it."""
        try:
            name = path.relative_to(self.path).as_posix()
        except ValueError:
            return None
        return name if fits(name) else None


def fits(name: str) -> bool:
    """True for names that a scene may have on any system, such as ``a/b.nsg``."""
    parts = name.split("/")
    if not (name.endswith(".nsg") and len(parts) <= _MOST_PARTS and all(map(_PART.fullmatch, parts))):
        return False
    plain = all(part == part.strip(". ") and not _DEVICE.fullmatch(part) for part in parts)
    return plain and all(len(part.encode()) <= _MOST_NAME for part in parts)


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:32]


MOST_DAYS: Final = 30
MOST_KEPT: Final = 100


class Unsaved(Record):
    """A text that was not saved."""

    text: str
    disk: str | None  # digest of the file that it was an edit of; None where there was none
    seconds: float  # since it was stored


class Journal:
    """A folder with one file for each scene that has unsaved text."""

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder if folder is not None else state_folder(os.environ, sys.platform) / "play"

    def keep(self, path: Path, text: str, disk: str | None) -> None:
        """Store a scene's unsaved text; raises `OSError`."""
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        entry = {"file": str(path), "text": text, "disk": disk, "time": time.time()}
        place = self._place(path)
        if not place.exists():
            place.touch(mode=0o600)  # which the file that replaces it takes over
        write_whole(place, json.dumps(entry).encode())

    def find(self, path: Path) -> Unsaved | None:
        """The unsaved text of a scene, if there is one."""
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
    """The folder for a user's program state, which is neither to be edited nor worth a backup."""
    if own := environment.get("SCENELANG_STATE"):
        return Path(own)
    if platform == "win32":
        base = environment.get("LOCALAPPDATA")
        return Path(base) / "scenelang" if base else Path.home() / "AppData/Local/scenelang"
    if platform == "darwin":
        return Path.home() / "Library/Application Support/scenelang"
    base = environment.get("XDG_STATE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".local/state") / "scenelang"


class Files:
    """Files for download, each to be fetched once, in some seconds; beyond ``most`` bytes the oldest go."""

    def __init__(self, seconds: float = 600.0, most: int = 1 << 29) -> None:
        self._seconds, self._most = seconds, most
        self._stored: dict[str, tuple[str, str, bytes]] = {}

    def put(self, name: str, kind: str, data: bytes) -> str:
        """Store a file of a media type; return the key that fetches it."""
        key = secrets.token_urlsafe(16)
        self._stored[key] = name, kind, data
        while len(self._stored) > 1 and sum(len(data) for _, _, data in self._stored.values()) > self._most:
            del self._stored[next(iter(self._stored))]
        asyncio.get_running_loop().call_later(self._seconds, self._stored.pop, key, None)
        return key

    def take(self, key: str) -> tuple[str, str, bytes] | None:
        """The name, media type and bytes."""
        return self._stored.pop(key, None)


MOST_SIDE: Final = 8192
Json = dict[str, Any]


def string_of(message: Json, key: str) -> str:
    value = message.get(key)
    if not isinstance(value, str):
        raise ValueError(f"`{key}` is not a text")
    return value


def choice_of(message: Json, key: str, choices: Collection[str]) -> str:
    value = string_of(message, key)
    if value not in choices:
        raise ValueError(f"`{key}` is `{value[:40]}`")
    return value


def text_of(message: Json) -> str:
    """A scene's text."""
    text = string_of(message, "text")
    try:
        if len(text.encode()) > MAX_BYTES:
            raise Denied(f"a text of more than {MAX_BYTES // 1_000_000} MB")
    except UnicodeEncodeError:
        raise Denied("the text has halves of characters") from None
    return text


def id_of(message: Json) -> int | str:
    id = message.get("id")
    if isinstance(id, bool) or not isinstance(id, int | str) or len(str(id)) > 100:
        raise ValueError("`id` is neither a whole number nor a short text")
    return id


def whole_of(message: Json, key: str, low: int, high: int) -> int:
    value = message.get(key)
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ValueError(f"`{key}` is not a whole number in {low}..{high}")
    return value


def wishes(message: Json) -> Json:
    """Params, frame and size of a message that asks for a drawing."""
    params, size = message.get("params") or {}, message.get("size")
    if not isinstance(params, dict):
        raise ValueError("`params` is not an object")
    if size is not None and (not isinstance(size, list) or len(size) != 2):
        raise ValueError("`size` is neither null nor two numbers")
    size = size and [whole_of({"size": side}, "size", 1, MOST_SIDE) for side in size]
    frame = whole_of({"frame": 0, **message}, "frame", 0, 1 << 31)
    return {"params": params, "frame": frame, "size": size}
