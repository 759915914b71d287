"""What the client sends, with a bound on the length of a message."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import BinaryIO, Final

_LENGTH: Final = re.compile(rb"Content-Length: *(\d+)\r\n\Z")
_MOST_DIGITS: Final = 8  # below 100 MB: the largest text there may be, each character escaped
_CHUNK: Final = 1 << 16
_LONGEST: Final = 64  # bytes of a header that counts


class Incoming:
    """A stream whose messages of 100 MB and more are passed over, up to the next one's header.

    No JSON holds a line that ends like a header, as newlines in strings are escaped.

    Args:
        stream: the client's.
        refuse: called for each message that is passed over, from the thread that reads.
    """

    def __init__(self, stream: BinaryIO, refuse: Callable[[], None]) -> None:
        self._stream, self._refuse = stream, refuse

    def readline(self) -> bytes:
        """A line of a header; empty at the end."""
        line = b""
        while True:
            piece = self._stream.readline(_CHUNK)
            line = line[-_LONGEST:] + piece
            if not piece or piece.endswith(b"\n"):
                break
        length = _LENGTH.search(line)
        if length is None or len(length[1]) <= _MOST_DIGITS:
            return line if length is None else length[0]
        self._refuse()
        return b"\n"

    def read(self, size: int) -> bytes:
        """A message."""
        return self._stream.read(size)
