"""Files that strangers wrote, read within bounds, and files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import stat
from itertools import accumulate
from pathlib import Path
from typing import Any, Final

_PIPES: Final = ("/dev/fd/", "/dev/stdin", "/proc/self/fd/")
"""Where shells put the pipes of ``<(…)``; somebody writes to them."""
_JSON_DEPTH: Final = 64
# Possessive: a string without end is read once, not once for each of its characters.
_NO_BRACKETS: Final = re.compile(r'(?:"(?:[^"\\]++|\\.)*+"?|[^\[\]{}"]++)++', re.DOTALL)
_STEPS: Final = {"[": 1, "{": 1, "]": -1, "}": -1}


class NotWritten(OSError):
    """A file could not be written; its name is the one that was asked for."""


def read_regular(path: str | os.PathLike[str], most_bytes: int) -> bytes:
    """The bytes of a regular file, or of a pipe that a shell has opened.

    Opening never waits: a named pipe without a writer, a terminal or ``/dev/zero`` is refused unread.

    Args:
        path: the file.
        most_bytes: stop one byte after so many, so that the caller sees that there are more.

    Raises:
        OSError: as the system says, or that it is no regular file.
    """
    name = os.fspath(path)
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0)
    handle = os.open(name, flags | getattr(os, "O_BINARY", 0))
    try:
        mode = os.fstat(handle).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), name)
        if stat.S_ISFIFO(mode) and name.startswith(_PIPES):
            os.set_blocking(handle, True)
        elif not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "not a regular file", name)
        with os.fdopen(handle, "rb", closefd=False) as file:
            return file.read(most_bytes + 1)
    finally:
        os.close(handle)


def read_json(data: bytes, *, most_depth: int = _JSON_DEPTH) -> Any:
    """The value of JSON text from a stranger.

    Raises:
        ValueError: it is no JSON, nests deeper than ``most_depth``, or says something twice, in which case
            two readers could take different meanings from it.
    """
    import json  # not at the top: a command's help needs none

    text = data.decode("utf-8")
    if depth_of_json(text) > most_depth:
        raise ValueError(f"brackets nested deeper than {most_depth}")
    return json.loads(text, object_pairs_hook=_once, parse_constant=_no_number)


def depth_of_json(text: str) -> int:
    """How deep brackets nest, those in strings left out."""
    return max(accumulate(map(_STEPS.__getitem__, _NO_BRACKETS.sub("", text))), default=0)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise ValueError(f"the key {twice[:40]!r} is given twice")
    return found


def _no_number(constant: str) -> float:
    raise ValueError(f"{constant} is no JSON number")


def write_whole(target: str | os.PathLike[str], data: bytes) -> None:
    """Write to a temporary file beside ``target``, flush it to the disk, then rename it over ``target``.

    A file that is there keeps its permissions, a link is followed. Where ``target`` is a device or a pipe,
    such as ``/dev/stdout``, the bytes are written into it.

    Raises:
        NotWritten: nothing is left behind and an old ``target`` stays as it was.
    """
    try:
        _write(Path(target), data)
    except OSError as error:
        raise NotWritten(error.errno, error.strerror or str(error), os.fspath(target)) from None


def _write(target: Path, data: bytes) -> None:
    mode = None
    with contextlib.suppress(FileNotFoundError):
        mode = target.stat().st_mode
    if mode is not None and stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if mode is not None and not stat.S_ISREG(mode):
        with target.open("wb", buffering=0) as device:
            view = memoryview(data)
            while view:
                view = view[device.write(view) :]
        return
    if mode is not None and not os.access(target, os.W_OK):  # renaming would not ask
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    place = target.resolve() if target.is_symlink() else target
    name = place.name.encode()[:200].decode(errors="ignore")  # a name has at most 255 bytes
    part = place.with_name(f".{name}.{os.urandom(6).hex()}.part")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
    try:
        with os.fdopen(os.open(part, flags, 0o666), "wb") as file:
            if mode is not None and hasattr(os, "fchmod"):
                os.fchmod(file.fileno(), stat.S_IMODE(mode))
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, place)
    except BaseException:  # an interruption, too, leaves nothing
        with contextlib.suppress(OSError):
            os.unlink(part)
        raise
