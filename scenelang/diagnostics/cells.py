"""Text in screen cells: tabs are widened, wide characters take two cells, combining marks none.

Nothing in a scene may move the cursor or colour a terminal: what does not print is shown as U+FFFD.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import groupby
from unicodedata import category, east_asian_width

from scenelang.records import Record

TAB = 4
LONGEST = 4000
"""Of a line with more code points only so many are laid out, near what is shown of it.

A file of one line may have 10 MB and 200 mistakes.
"""
_BEFORE = 500

STYLES = {
    "error": "\x1b[1;31m",
    "warning": "\x1b[1;33m",
    "frame": "\x1b[1;34m",
    "bold": "\x1b[1m",
    "added": "\x1b[32m",
    "removed": "\x1b[31m",
    "off": "\x1b[0m",
}


def printable(text: str) -> str:
    """Text without control characters and invisible ones that reorder it."""
    if text.isprintable():
        return text
    return "".join(char if char.isprintable() else "\N{REPLACEMENT CHARACTER}" for char in text)


def paint(style: str, text: str, color: bool) -> str:
    """Text in ANSI codes, or as it is."""
    return f"{STYLES[style]}{text}{STYLES['off']}" if color and style and text else text


class Line(Record):
    """One source line in cells."""

    cells: Sequence[str]  # what stands in each; empty behind a wide character
    starts: Sequence[int]  # the cell of each code point, and after the last one where the line ends

    def cell(self, column: int) -> int:
        """The cell of a column from 1; past the end the line goes on in single cells."""
        index = column - 1
        if index < len(self.starts):
            return self.starts[index]
        return self.starts[-1] + index - len(self.starts) + 1


@lru_cache(maxsize=64)  # diagnostics that follow each other often share lines
def in_cells(text: str) -> Line:
    """Lay a line out in cells."""
    if text.isascii() and text.isprintable():
        return Line(text, range(len(text) + 1))
    cells: list[str] = []
    starts = []
    for char in text:
        starts.append(len(cells))
        if char == "\t":
            cells += [" "] * TAB
        elif category(char) in ("Mn", "Me") and char.isprintable():
            if cells:
                cells[-1] += char
        else:
            cells.append(printable(char))
            if east_asian_width(char) in "WF":
                cells.append("")
    starts.append(len(cells))
    return Line(cells, starts)


def left_out(text: str, at: int) -> int:
    """How many code points in front of offset ``at`` are not laid out: none but in a very long line."""
    return max(0, at - _BEFORE) // _BEFORE * _BEFORE if len(text) > LONGEST else 0


def window(line: Line, first: int, last: int, width: int) -> tuple[Sequence[str], int]:
    """The part of a line that is shown in ``width`` cells, and how far to the left it moves.

    The cells from ``first`` to ``last`` should be seen; where not all fit, the first of them are.
    """
    cells = line.cells
    if len(cells) <= width:
        return cells, 0
    start = 0
    if last >= width:
        spare = width - 2 - (last - first)
        start = first - 1 - (spare // 2 if spare > 0 else 4)
        start = max(0, min(start, max(len(cells), last + 1) - width))
    end = min(len(cells), start + width)
    shown = list(cells[start:end])
    # A cut may go through a wide character; the half that is left becomes a space.
    if start:
        shown[0] = "…"
        if shown[1:2] == [""]:
            shown[1] = " "
    if end < len(cells):
        if shown[-1] == "":
            shown[-2] = " "
        shown[-1] = "…"
    return shown, start


class Canvas:
    """Rows of cells with styles, written to at any place."""

    def __init__(self) -> None:
        self.rows: list[list[tuple[str, str]]] = []

    def put(self, row: int, cell: int, text: Sequence[str], style: str = "") -> None:
        """Write over what is there; a string takes its cells by `in_cells`."""
        while len(self.rows) <= row:
            self.rows.append([])
        line = self.rows[row]
        cells = in_cells(text).cells if isinstance(text, str) else text
        line.extend([(" ", "")] * (cell + len(cells) - len(line)))
        for at, content in enumerate(cells, cell):
            line[at] = (content, style)

    def lines(self, color: bool) -> list[str]:
        """The rows as text, without white space at their ends."""
        found = []
        for row in self.rows:
            while row and not row[-1][0].strip() and (row[-1][0] or row[-2][0].isspace()):
                row.pop()
            runs = groupby(row, key=lambda cell: cell[1])
            found.append("".join(paint(style, "".join(c for c, _ in run), color) for style, run in runs))
        return found
