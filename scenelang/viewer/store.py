"""The arrays of a view in one piece.

They are named in the data as ``[kind, offset, count]``, with a kind of `KINDS`, an offset in bytes into the
blob, a multiple of 4, and a count of numbers.
"""

from __future__ import annotations

import base64
import zlib
from typing import Any, Final

import numpy as np

KINDS: Final = {
    "float32": "f32",
    "int8": "i8",
    "uint8": "u8",
    "int16": "i16",
    "uint16": "u16",
    "int32": "i32",
}


class Store:
    """Arrays one after the other, as they lie in the blob."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, array: np.ndarray) -> list[Any]:
        """Take in an array of a dtype of `KINDS` and return what names it in the data."""
        data = np.ascontiguousarray(array).astype(array.dtype.newbyteorder("<")).tobytes()
        name = [KINDS[array.dtype.name], self._size, array.size]
        self._parts.append(data + bytes(-len(data) % 4))
        self._size += len(self._parts[-1])
        return name

    def bytes(self) -> bytes:
        """The blob."""
        return b"".join(self._parts)


def packed(data: bytes) -> str:
    """Deflated (zlib), in base64."""
    return base64.b64encode(zlib.compress(data, 9)).decode()
