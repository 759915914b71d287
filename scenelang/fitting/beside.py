"""The files that a file of a mesh names: read where it lies, so that what reads meshes opens none."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Final

from scenelang.files import read_regular

MOST_BYTES: Final = 1 << 26  # of a file
MOST_TOGETHER: Final = 1 << 28  # bytes of all that one names
_MOST_NAMES: Final = 1000
_NAMES: Final = {
    ".obj": re.compile(rb"mtllib([^\r\n]*)"),
    ".mtl": re.compile(rb"map_kd[ \t]([^\r\n]*)", re.IGNORECASE),
    ".ply": re.compile(rb"texturefile([^\r\n]*)", re.IGNORECASE),
    ".glb": re.compile(rb'"uri"\s*:\s*"((?:[^"\\]|\\.){1,1000})"'),
}
"""What stands in front of names, by suffix; what finds more of them than trimesh does no harm."""


def files_beside(data: bytes, suffix: str, folder: Path) -> dict[str, bytes]:
    """The bytes of the files that a mesh names, and of those that its materials name, by these names.

    What is not a regular file in the folder or below, or is larger than `MOST_BYTES`, is left out, as is what
    would be more than `MOST_TOGETHER`.
    """
    found: dict[str, bytes] = {}
    left = MOST_TOGETHER
    waiting = [(data, suffix)]
    for text, kind in waiting:
        for name in islice(_names(text, kind), _MOST_NAMES):
            held = None if name in found else _read(folder, name, min(left, MOST_BYTES))
            if held is not None:
                found[name] = held
                left -= len(held)
                if kind == ".obj":
                    waiting.append((held, ".mtl"))
    return found


def _names(data: bytes, suffix: str) -> Iterator[str]:
    ends = {".ply": data.find(b"end_header"), ".glb": 20 + int.from_bytes(data[12:16], "little")}
    pattern = _NAMES.get(suffix)
    for match in pattern.finditer(data, 0, ends.get(suffix, len(data))) if pattern else ():
        name = match[1].decode(errors="replace").strip()
        try:
            yield json.loads(f'"{name}"') if suffix == ".glb" else name
        except ValueError:
            continue


def _read(folder: Path, name: str, most: int) -> bytes | None:
    try:
        path = (folder / name.replace("\\", "/").lstrip("/")).resolve()
        if not path.is_relative_to(folder.resolve()):
            return None
        found = read_regular(path, most)
    except (OSError, ValueError, RuntimeError):  # of a link to itself before Python 3.13
        return None
    return found if len(found) <= most else None
