"""Places in source text: files, spans, lines and columns."""

from __future__ import annotations

import re
from bisect import bisect_right
from functools import cached_property
from operator import attrgetter
from typing import Final

from scenelang.records import Record


class SourceFile:
    """One text a scene was read from.

    Args:
        name: what diagnostics print, usually the path as the user wrote it.
        text: the whole text, decoded, newlines as they were.
    """

    def __init__(self, name: str, text: str) -> None:
        self.name: Final = name
        self.text: Final = text

    @cached_property
    def _starts(self) -> list[int]:
        """Where each line begins."""
        return [0, *(newline.end() for newline in re.finditer("\n", self.text))]

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of a code-point offset, both from 1."""
        starts = self._starts
        offset = min(max(offset, 0), len(self.text))
        line = bisect_right(starts, offset)
        return line, offset - starts[line - 1] + 1

    def line(self, number: int) -> str:
        """The text of line ``number`` (from 1) without its newline; empty past the end."""
        starts = self._starts
        if not 1 <= number <= len(starts):
            return ""
        end = starts[number] if number < len(starts) else len(self.text)
        return self.text[starts[number - 1] : end].rstrip("\r\n")


class Span(Record):
    """A half-open range ``[start, end)`` of code points in one file."""

    source: SourceFile
    start: int
    end: int

    _key = attrgetter("start", "end")

    def __repr__(self) -> str:
        return f"Span(start={self.start}, end={self.end})"

    def to(self, other: Span) -> Span:
        """The span from the start of this one to the end of ``other`` (same file)."""
        return Span(self.source, min(self.start, other.start), max(self.end, other.end))

    @property
    def text(self) -> str:
        """The source text that the span covers."""
        return self.source.text[self.start : self.end]

    def locate(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """``((line, column), (line, column))`` of start and end, from 1, in code points."""
        return self.source.position(self.start), self.source.position(self.end)
