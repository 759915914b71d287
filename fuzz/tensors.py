"""Mutations of safetensors files: of the length, the outer header, the header inside, and the numbers."""

from __future__ import annotations

import json
import math
import struct
from random import Random
from typing import Any, Final

from fuzz import trees

SIZES: Final = {
    "F64": 8,
    "F32": 4,
    "F16": 2,
    "BF16": 2,
    "I64": 8,
    "I32": 4,
    "I16": 2,
    "I8": 1,
    "U8": 1,
    "BOOL": 1,
}
LENGTHS: Final = (0, 1, 7, 8, 2, 1 << 20, (1 << 20) + 1, 1 << 31, 1 << 62, (1 << 64) - 1)
FLOATS: Final = (
    0.0, -0.0, 1.0, -1.0, 1e-45, 1e-38, 1e-20, 1e-6, 0.5, 2.0, 1e3, 1e6, 1e10, 1e19, 1e20, 1e30, 3.4e38,
    -3.4e38, math.inf, -math.inf, math.nan,
)  # fmt: skip


def parts(data: bytes) -> tuple[dict[str, Any], bytes] | None:
    """Outer header and body of a file; None where it has none."""
    if len(data) < 8:
        return None
    (length,) = struct.unpack("<Q", data[:8])
    if length > len(data) - 8:
        return None
    try:
        outer = trees.load(data[8 : 8 + length])
    except (ValueError, RecursionError):
        return None
    return (outer, data[8 + length :]) if isinstance(outer, dict) else None


def quoted(words: str) -> list[bytes]:
    """Words in quotes, as headers and JSON have them."""
    return [f'"{word}"'.encode() for word in words.split()]


def joined(outer: Any, body: bytes) -> bytes:
    """The bytes of a file."""
    text = trees.dump(outer)
    return struct.pack("<Q", len(text)) + text + body


def mutate(data: bytes, generator: Random) -> bytes:
    """One change of a file, at any of its levels."""
    found = parts(data)
    if found is None or generator.random() < 0.08:
        return trees.flip(data, generator)
    outer, body = found
    change = generator.randrange(10)
    if change == 0:
        return struct.pack("<Q", generator.choice(LENGTHS)) + data[8:]
    if change == 1:
        return joined(outer, generator.choice((body[:-1], body + b"\0", b"", body * 2)))
    if change in (2, 3):
        return joined(trees.mutate(outer, generator), body)
    if change in (4, 5):
        return joined(_inner(outer, generator), body)
    if change == 6:
        return _rows(outer, body, generator)
    return joined(outer, _numbers(outer, body, generator))


def _inner(outer: dict[str, Any], generator: Random) -> dict[str, Any]:
    """The header of scenelang changed, which stands as text in the outer one."""
    metadata = outer.get("__metadata__")
    text = metadata.get("scenelang") if isinstance(metadata, dict) else None
    if not isinstance(metadata, dict) or not isinstance(text, str):
        return outer
    try:
        inner = json.loads(text)
    except (ValueError, RecursionError):
        return outer
    changed = trees.dump(trees.mutate(inner, generator)).decode("utf-8", "surrogatepass")
    return {**outer, "__metadata__": {**metadata, "scenelang": changed}}


def _entries(outer: dict[str, Any], body: bytes) -> dict[str, tuple[str, list[int], int, int]]:
    """Type, shape, start and end of the tensors that lie inside the body."""
    found: dict[str, tuple[str, list[int], int, int]] = {}
    for name, entry in outer.items():
        if not isinstance(entry, dict) or str(entry.get("dtype")) not in SIZES:
            continue
        offsets, shape = entry.get("data_offsets"), entry.get("shape")
        if not isinstance(shape, list) or not isinstance(offsets, list) or len(offsets) != 2:
            continue
        whole = all(type(number) is int and 0 <= number < 1 << 20 for number in (*shape, *offsets))
        if whole and offsets[0] <= offsets[1] <= len(body):
            found[name] = entry["dtype"], shape, offsets[0], offsets[1]
    return found


def _numbers(outer: dict[str, Any], body: bytes, generator: Random) -> bytes:
    """One to three numbers of the tensors replaced."""
    buffer = bytearray(body)
    entries = [entry for entry in _entries(outer, body).values() if entry[3] > entry[2]]
    for _ in range(generator.randint(1, 3) if entries else 0):
        dtype, _, start, end = generator.choice(entries)
        size = SIZES[dtype]
        at = start + size * generator.randrange((end - start) // size or 1)
        if dtype == "F32":
            value = struct.unpack("<f", buffer[at : at + 4])[0] if at + 4 <= end else 0.0
            near = value * generator.choice((-1, 0.5, 2, 10, 1.0001)) if math.isfinite(value) else 1.0
            new = struct.pack("<f", generator.choice((*FLOATS, min(max(near, -3e38), 3e38))))
        else:
            new = generator.choice((0, 1, 2, 3, 4, -1, 100, 127, -128)).to_bytes(size, "little", signed=True)
        buffer[at : at + len(new)] = new
    return bytes(buffer[: len(body)])


def _rows(outer: dict[str, Any], body: bytes, generator: Random) -> bytes:
    """All tensors with a row more, a row less or none, and headers that agree."""
    entries = _entries(outer, body)
    index, count = generator.randrange(8), generator.choice((0, 1, 2, 2, 5))
    new = {key: value for key, value in outer.items() if key not in entries}
    data = b""
    for name, (dtype, shape, start, end) in entries.items():
        rows = shape[0] if shape else 0
        each = (end - start) // rows if rows else 0
        at = start + each * min(index, max(rows - 1, 0))
        tensor = body[start:at] + body[at : at + each] * count + body[at + each : end] if rows else b""
        sides = [max(0, rows + count - 1) if rows else 0, *shape[1:]]
        new[name] = {"dtype": dtype, "shape": sides, "data_offsets": [len(data), len(data) + len(tensor)]}
        data += tensor
    return joined(new, data)
