"""Files from strangers, read within bounds, and files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import stat
import sys
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from itertools import accumulate
from pathlib import Path
from typing import Any, Final

# Places where shells put the pipes of ``<(…)``; somebody writes to them.
_PIPES: Final = ("/dev/fd/", "/dev/stdin", "/proc/self/fd/")
_FLAGS: Final = sum(getattr(os, f"O_{name}", 0) for name in ("NOFOLLOW", "NONBLOCK", "CLOEXEC", "BINARY"))
_INPUTS: Final[ContextVar[set[str] | None]] = ContextVar("inputs", default=None)
_JSON_DEPTH: Final = 64
# Possessive: a string without end is read once, not once for each of its characters.
_NO_BRACKETS: Final = re.compile(r'(?:"(?:[^"\\]++|\\.)*+"?|[^\[\]{}"]++)++', re.DOTALL)
_STEPS: Final = {"[": 1, "{": 1, "]": -1, "}": -1}


def reason(error: BaseException) -> str:
    """Reason that the system gives for an error, in lower case."""
    return (getattr(error, "strerror", None) or str(error) or "unreadable").lower()


class NotWritten(OSError):
    """A file could not be written; its name is the one that was asked for."""


def read_regular(path: str | os.PathLike[str], most_bytes: int) -> bytes:
    """The bytes of a file or a shell's pipe, at most one more than ``most_bytes``; raises OSError.

    Opening never waits: a named pipe without a writer, a terminal or ``/dev/zero`` is refused unread.
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
        note_input(name)
        with os.fdopen(handle, "rb", closefd=False) as file:
            return file.read(most_bytes + 1)
    finally:
        os.close(handle)


def read_json(data: bytes, *, most_depth: int = _JSON_DEPTH) -> Any:
    """The value of JSON text from a stranger; raises ValueError, also for a key twice or too deep nesting."""
    import json  # not at the top: a command's help needs none

    text = data.decode("utf-8")
    if depth_of_json(text) > most_depth:
        raise ValueError(f"brackets nested deeper than {most_depth}")
    return json.loads(text, object_pairs_hook=_once, parse_constant=no_number)


def depth_of_json(text: str) -> int:
    """Depth of nested brackets, without those in strings."""
    return max(accumulate(map(_STEPS.__getitem__, _NO_BRACKETS.sub("", text))), default=0)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise ValueError(f"the key `{repr(twice[:40])[1:-1]}` is given twice")
    return result


def no_number(constant: str) -> float:
    """Refuse the constants of JSON in Python, such as NaN."""
    raise ValueError(f"{constant} is not a JSON number")


@contextlib.contextmanager
def inputs_kept() -> Iterator[None]:
    """Within it, `write_output` refuses every file that `read_regular` has opened."""
    token = _INPUTS.set(set())
    try:
        yield
    finally:
        _INPUTS.reset(token)


def note_input(name: str) -> None:
    """Have `write_output` refuse a file, within `inputs_kept`."""
    if (inputs := _INPUTS.get()) is not None:
        inputs.add(name)


def write_whole(target: str | os.PathLike[str], data: bytes, *, flush: bool = True) -> None:
    """Write to a temporary file beside ``target``, flush it to the disk, then rename it over ``target``.

    For names that no user wrote: a link or pipe in its place is replaced, never written through. A file that
    is there keeps its permissions. Remains of a killed process that wrote the same file are removed.

    Args:
        flush: wait until the bytes are on the disk, which for a small file takes longer than all else.
            Without it a power cut may leave a file of zeros.

    Raises:
        NotWritten: nothing is left behind and an old ``target`` stays as it was.
    """
    with _naming(target):
        _replace(Path(target), data, flush)


def write_output(target: str | os.PathLike[str], data: bytes) -> None:
    """Write a file that a user named, through a link, device or pipe; otherwise as `write_whole`."""
    place = output_place(target)
    with _naming(target):
        if (mode := _mode(os.stat, target)) is None or stat.S_ISREG(mode) or stat.S_ISDIR(mode):
            _replace(place, data)
            return
        with open(target, "wb", buffering=0) as device:
            view = memoryview(data)
            while view:
                view = view[device.write(view) :]


def output_place(target: str | os.PathLike[str]) -> Path:
    """The file that a user means by the name of an output; raises `NotWritten` if it is an input as well."""
    inputs = (_INPUTS.get() or set()) if os.path.isfile(target) else set()
    for name in inputs:
        same = False
        with contextlib.suppress(OSError):  # it is gone by now
            same = os.path.samefile(name, target)
        if same:
            raise NotWritten(errno.EINVAL, "it is an input of the same command", os.fspath(target))
    return followed(target)


def followed(path: str | os.PathLike[str]) -> Path:
    """Target of a link; any other path unchanged."""
    return Path(os.path.realpath(path) if os.path.islink(path) else path)


def open_own(path: Path) -> int:
    """Open a file to lock, made if it is not there; nothing of it changes, and a link is an `OSError`."""
    return os.open(path, os.O_RDWR | os.O_CREAT | _FLAGS, 0o666)


def lock(handle: int, path: Path) -> bool | None:
    """Lock the open file at ``path`` while the process lives: False if another has it, None without locks."""
    if sys.platform == "win32":
        return None
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    with contextlib.suppress(FileNotFoundError):
        return os.path.samestat(os.fstat(handle), os.lstat(path))
    return False


@contextlib.contextmanager
def _naming(target: str | os.PathLike[str]) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise NotWritten(error.errno, error.strerror or str(error), os.fspath(target)) from None


def _mode(look: Callable[[Any], os.stat_result], path: str | os.PathLike[str]) -> int | None:
    with contextlib.suppress(FileNotFoundError):
        return look(path).st_mode
    return None


def _replace(place: Path, data: bytes, flush: bool = True) -> None:
    if (mode := _mode(os.lstat, place)) is not None and stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if mode is not None and not stat.S_ISREG(mode):
        mode = None
    if mode is not None and not os.access(place, os.W_OK):  # renaming would not ask
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    handle, part = _begin(place)
    try:
        with os.fdopen(handle, "wb") as file:
            if mode is not None and hasattr(os, "fchmod"):
                os.fchmod(file.fileno(), stat.S_IMODE(mode))
            file.write(data)
            file.flush()
            if flush:
                os.fsync(file.fileno())
            if sys.platform == "win32":
                file.close()  # no open file is renamed there; elsewhere it stays locked until it is
            os.replace(part, place)
    except BaseException:  # an interruption, too, leaves nothing
        with contextlib.suppress(OSError):
            os.unlink(part)
        raise


def _begin(place: Path) -> tuple[int, Path]:
    """A new file beside ``place``, open and locked; what a killed process left is removed first."""
    start = place.with_name("." + place.name.encode()[:200].decode(errors="ignore"))  # at most 255 bytes
    usual = Path(f"{start}.scenelang.part")
    with contextlib.suppress(OSError):
        left = os.open(usual, os.O_RDONLY | _FLAGS)
        try:
            if lock(left, usual):
                os.unlink(usual)
        finally:
            os.close(left)
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | _FLAGS
    with contextlib.suppress(FileExistsError):
        handle = os.open(usual, flags, 0o666)
        if lock(handle, usual) is not False:
            return handle, usual
        os.close(handle)  # another process took it for one that was left
    other = Path(f"{start}.{os.urandom(6).hex()}.part")
    return os.open(other, flags, 0o666), other
