"""A process of its own for libraries that read strangers' files, and the files that a mesh names.

A request is a line of JSON and bytes; answers are lines of JSON, the last of which states an error or the
number of bytes that follow. A crash of the process is an error of that file alone.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import IO, Any, Final

from scenelang.assets.files import read_regular
from scenelang.drawing.exact.mesh import FitError

MEMORY: Final = 6 << 30  # bytes that the process may hold, where the system can bound them
CPU_S: Final = 300.0  # of processor time for one file
# until a file is read and the first line about it is reported, tighter bounds hold:
READ_S: Final = 10.0  # processor time, and
MEGABYTE_S: Final = 1.0  # more for each MB of the file,
MOST_READ_S: Final = 60.0  # at most this;
READ: Final = 1 << 30  # bytes of memory, and
TIMES: Final = 48  # more for each byte of the file
_CODE: Final = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from scenelang.inverse import learn, sandbox
sandbox.serve(learn.make)
"""
_SENDS: Final = ("socket.connect", "socket.getaddrinfo", "socket.sendto")
_REFUSED: Final = (*_SENDS, "subprocess.", "os.system", "os.exec")
# packages that make elements besides ours; other versions may give other bytes
LIBRARIES: Final = ("contourpy", "libigl", "pillow", "scipy", "svgelements", "trimesh", "uharfbuzz")
Hear = Callable[..., None]
Asked = tuple[dict[str, Any], bytes]  # a request, and the bytes that it is about


class SandboxProcess:
    """The process; it starts with the first request, and again after it has ended."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> SandboxProcess:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None:
            self._process.kill()
            self._end()

    def __call__(self, request: Mapping[str, Any], data: bytes, hear: Mapping[str, Hear]) -> bytes:
        """Send a request, JSON but for bytes by name in ``files``; returns the bytes that are made of it.

        ``hear`` has functions for the reports meanwhile, by their first word. Raises `FitError` where nothing
        can be made, it takes more memory than allowed or processor time than ``cpu_s``, or a library fails.
        """
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-c", _CODE, json.dumps(sys.path)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=_environment(),
                start_new_session=True,  # an interruption is ours to tell it
            )
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        files = request.get("files", {})
        sizes = {"bytes": len(data), "files": {name: len(held) for name, held in files.items()}}
        with suppress(BrokenPipeError):
            process.stdin.write(json.dumps({**request, **sizes}).encode() + b"\n")
            process.stdin.writelines([data, *files.values()])
            process.stdin.flush()
        while line := process.stdout.readline():
            kind, *values = json.loads(line)
            if kind == "made":
                return process.stdout.read(*values)
            if kind == "error":
                raise FitError(*values)
            hear[kind](*values)
        raise FitError(_ended(self._end()))

    def _end(self) -> int:
        process, self._process = self._process, None
        assert process is not None
        process.communicate()
        return process.returncode


def _environment() -> dict[str, str]:
    """Environment of the process: libigl uses the threads of the others, and freed memory is not returned.

    Workers of dask have glibc return every 64 KB, which costs meshes a page fault for each page of an array.
    """
    result = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    result.pop("MALLOC_TRIM_THRESHOLD_", None)
    if "OMP_NUM_THREADS" in result:
        result.setdefault("IGL_NUM_THREADS", result["OMP_NUM_THREADS"])
    return result


def run_alone(asked: Asked) -> tuple[list[str], bytes | FitError]:
    """Run one request in a sandbox, as workers do; returns its lines, and the bytes or the error."""
    lines: list[str] = []
    with SandboxProcess() as apart:
        try:
            return lines, apart(*asked, {"say": lines.append, "progress": lambda *_: None})
        except FitError as error:
            return lines, error


def _ended(status: int) -> str:
    import signal

    if -status == getattr(signal, "SIGXCPU", None):
        return "reading it, or making something of it, takes too much processor time"
    return f"what reads it has failed ({f'signal {-status}' if status < 0 else f'status {status}'})"


def serve(make: Callable[[dict[str, Any], bytes, Callable[..., None]], bytes]) -> None:
    """Answer requests until there are none; to be called in a process of its own."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print
    sys.addaudithook(_refuse)
    while line := sys.stdin.buffer.readline():
        request = json.loads(line)
        data = sys.stdin.buffer.read(request["bytes"])
        request["files"] = {name: sys.stdin.buffer.read(size) for name, size in request["files"].items()}
        size = len(data) + sum(map(len, request["files"].values()))
        read_s = min(READ_S + MEGABYTE_S * size / 1e6, MOST_READ_S, request["cpu_s"])
        memory = _bound(read_s, READ + TIMES * size)
        limits = iter([request["cpu_s"]])

        def tell(kind: str, *values: Any, limits: Iterator[float] = limits) -> None:
            nonlocal memory
            if kind == "say" and (limit_s := next(limits, None)):
                memory = _bound(limit_s, MEMORY)
            _tell(out, kind, *values)

        try:
            result = make(request, data, tell)
        except FitError as error:
            _tell(out, "error", str(error))
        except MemoryError:
            _tell(out, "error", f"it takes more than {memory >> 20:,} MiB of memory")
        except Exception as error:
            said = " ".join(f"{type(error).__name__}: {error}".split())
            _tell(out, "error", f"what reads it has failed ({said[:200]})")
        else:
            _tell(out, "made", len(result), then=result)


def _tell(out: IO[bytes], *values: Any, then: bytes = b"") -> None:
    out.write(json.dumps(values).encode() + b"\n" + then)
    out.flush()


def _refuse(event: str, arguments: object) -> None:
    if event.startswith(_REFUSED):
        raise PermissionError(f"{event} is not allowed here")


def _bound(cpu_s: float, memory: int) -> int:
    """Bound memory, and the processor time from now on, where the system does such; returns the former."""
    memory = min(memory, MEMORY)
    if sys.platform == "win32":
        return memory
    import resource

    spent = resource.getrusage(resource.RUSAGE_SELF)
    for kind, most in (
        (resource.RLIMIT_DATA, memory),
        (resource.RLIMIT_CPU, int(spent.ru_utime + spent.ru_stime + cpu_s) + 1),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(kind)[1]
        with suppress(ValueError, OSError):
            resource.setrlimit(kind, (most if hard < 0 else min(most, hard), hard))
    return memory


MOST_BYTES: Final = 1 << 26  # of a file
MOST_TOGETHER: Final = 1 << 28  # bytes of all that one names
_MOST_NAMES: Final = 1000
_NAMES: Final = {
    ".obj": re.compile(rb"mtllib([^\r\n]*)"),
    ".mtl": re.compile(rb"map_kd[ \t]([^\r\n]*)", re.IGNORECASE),
    ".ply": re.compile(rb"texturefile([^\r\n]*)", re.IGNORECASE),
    ".glb": re.compile(rb'"uri"\s*:\s*"((?:[^"\\]|\\.){1,1000})"'),
}
"""Patterns of the names in a file, by suffix; more matches than trimesh reads do no harm."""


def files_beside(data: bytes, suffix: str, folder: Path) -> dict[str, bytes]:
    """The bytes of the files that a mesh and its materials name, by these names.

    Only regular files in the folder or below it are read, within `MOST_BYTES` each and `MOST_TOGETHER`.
    """
    result: dict[str, bytes] = {}
    left = MOST_TOGETHER
    waiting = [(data, suffix)]
    for text, kind in waiting:
        for name in islice(_names(text, kind), _MOST_NAMES):
            held = None if name in result else _read(folder, name, min(left, MOST_BYTES))
            if held is not None:
                result[name] = held
                left -= len(held)
                waiting += [(held, ".mtl")] * (kind == ".obj")
    return result


def _names(data: bytes, suffix: str) -> Iterator[str]:
    ends = {".ply": data.find(b"end_header"), ".glb": 20 + int.from_bytes(data[12:16], "little")}
    for match in _NAMES[suffix].finditer(data, 0, ends.get(suffix, len(data))) if suffix in _NAMES else ():
        name = match[1].decode(errors="replace").strip()
        with suppress(ValueError):
            yield json.loads(f'"{name}"') if suffix == ".glb" else name


def _read(folder: Path, name: str, most: int) -> bytes | None:
    try:
        path = (folder / name.replace("\\", "/").lstrip("/")).resolve()
        if not path.is_relative_to(folder.resolve()):
            return None
        result = read_regular(path, most)
    except (OSError, ValueError, RuntimeError):  # of a link to itself before Python 3.13
        return None
    return result if len(result) <= most else None
