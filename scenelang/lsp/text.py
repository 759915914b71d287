"""Positions of the protocol and offsets of ours.

The protocol counts lines, ended by LF, CRLF or CR, and columns in code units of an encoding that client and
server agree on; everything here counts code points of the whole text.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from lsprotocol import types

from scenelang.diagnostics.span import Span

Encoding = Literal["utf-8", "utf-16", "utf-32"]
_NEWLINE: Final = re.compile(r"\r\n|\n|\r")


@dataclass(frozen=True)
class Edit:
    """``old[start:old_end]`` became ``new[start:new_end]``; offsets in code points."""

    start: int
    old_end: int
    new_end: int

    @property
    def delta(self) -> int:
        return self.new_end - self.old_end


def difference(old: Sequence[str], new: Sequence[str]) -> Edit:
    """The shortest single edit from one text, or list of lines, to another."""
    start = _alike(old, new)
    end = _alike(old[start:][::-1], new[start:][::-1])
    return Edit(start, len(old) - end, len(new) - end)


def _alike(left: Sequence[str], right: Sequence[str]) -> int:
    """Number of items with which both sequences begin."""
    pairs = enumerate(zip(left, right, strict=False))
    return next((at for at, (a, b) in pairs if a != b), min(len(left), len(right)))


class Lines:
    """The lines of one text."""

    def __init__(self, text: str, encoding: Encoding = "utf-16") -> None:
        self.text = text
        self.encoding = encoding
        self.starts = [0, *(match.end() for match in _NEWLINE.finditer(text))]
        self._plain = text.isascii()

    def _end(self, line: int) -> int:
        """Where a line ends, its newline left out."""
        if line + 1 == len(self.starts):
            return len(self.text)
        end = self.starts[line + 1] - 1
        return end - (self.text[end] == "\n" and end > self.starts[line] and self.text[end - 1] == "\r")

    def offset(self, position: types.Position) -> int:
        """The offset of a position; one past the end of its line or of the text is the end of that."""
        line = position.line
        if line >= len(self.starts):
            return len(self.text)
        start, end = self.starts[max(line, 0)], self._end(max(line, 0))
        wanted = max(position.character, 0)
        if self._plain or self.encoding == "utf-32":
            return min(start + wanted, end)
        units = 0
        for at in range(start, end):
            if units >= wanted:
                return at
            units += width(self.text[at], self.encoding)
            if units > wanted:
                return at  # inside a character: before it
        return end

    def position(self, offset: int) -> types.Position:
        """The position of an offset."""
        offset = min(max(offset, 0), len(self.text))
        line = bisect_right(self.starts, offset) - 1
        start = self.starts[line]
        if self._plain or self.encoding == "utf-32":
            return types.Position(line, offset - start)
        return types.Position(line, width(self.text[start:offset], self.encoding))

    def range(self, start: int, end: int) -> types.Range:
        """The range between two offsets."""
        return types.Range(self.position(start), self.position(end))

    def span(self, span: Span) -> types.Range:
        """The range of a span of this text."""
        return self.range(span.start, span.end)


def width(text: str, encoding: Encoding) -> int:
    """How many code units a text has."""
    if encoding == "utf-32" or text.isascii():
        return len(text)
    if encoding == "utf-8":
        return len(text.encode("utf-8", "surrogatepass"))
    return len(text) + sum(character > "\uffff" for character in text)


def applied(lines: Lines, change: types.TextDocumentContentChangeEvent) -> tuple[str, Edit]:
    """The text after one change, and what changed."""
    text = lines.text
    if not isinstance(change, types.TextDocumentContentChangePartial):
        return change.text, difference(text, change.text)
    start, end = sorted((lines.offset(change.range.start), lines.offset(change.range.end)))
    return text[:start] + change.text + text[end:], Edit(start, end, start + len(change.text))
