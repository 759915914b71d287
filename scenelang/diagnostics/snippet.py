"""Source lines with marks under them.

Words stand beside the last mark of a line; those of others stand below it, each under its own mark. Of a
mark over several lines the first is underlined to its end::

    3 |     subtract star { … }
      |     -------- this is subtracted from
    4 |     intersect {
      |     ^^^^^^^^^^^
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from scenelang.diagnostics.cells import LONGEST, Canvas, in_cells, left_out, paint, printable, window
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.records import Record

_LEAST_WIDTH = 30


class Mark(Record):
    """A place in a text, and what is said there; the primary one is that of the mistake itself."""

    span: Span
    words: str = ""
    primary: bool = False


def draw(marks: Iterable[Mark], severity: str, gutter: int, width: int, color: bool) -> list[str]:
    """The marks of one diagnostic, the primary one first, file by file.

    Args:
        marks: at least one.
        severity: the style of the primary mark.
        gutter: digits of the largest line number.
        width: cells of the screen.
        color: with ANSI colours.
    """
    files: dict[SourceFile, dict[int, list[Mark]]] = {}
    for mark in marks:
        line = mark.span.locate()[0][0]
        files.setdefault(mark.span.source, {}).setdefault(line, []).append(mark)
    bare = paint("frame", " " * gutter + " |", color)
    rows = []
    for index, (source, lines) in enumerate(files.items()):
        line, column = next(iter(lines.values()))[0].span.locate()[0]
        arrow = paint("frame", " " * gutter + (":::" if index else "-->"), color)
        rows += [bare] if index else []
        rows += [f"{arrow} {printable(source.name)}:{line}:{column}", bare]
        before = 0
        for number in sorted(lines | {n + 1: [] for n in lines if n + 2 in lines and n + 1 not in lines}):
            if before and number > before + 1:
                rows.append(paint("frame", "...", color))
            before = number
            head = paint("frame", f"{number:>{gutter}} |", color)
            room = max(width - gutter - 3, _LEAST_WIDTH)
            for row, text in enumerate(_line(source, number, lines.get(number, []), severity, room, color)):
                rows.append(f"{bare if row else head} {text}".rstrip(" ") if text else bare if row else head)
    return rows


def _line(
    source: SourceFile, number: int, marks: Sequence[Mark], severity: str, width: int, color: bool
) -> list[str]:
    """One source line, its underlines, and words beside and below them."""
    text = source.line(number)
    columns = [mark.span.locate()[0][1] for mark in marks]
    cut = left_out(text, min(columns, default=1) - 1)
    line = in_cells(text[cut : cut + LONGEST])
    notes = []
    for mark, column in zip(marks, columns, strict=True):
        bottom, last = mark.span.locate()[1]
        left = line.cell(max(1, column - cut))
        right = line.cell(max(1, (last if bottom == number else len(text) + 1) - cut))
        notes.append((left, max(right, left + 1), mark))
    notes.sort(key=lambda note: note[:2])
    first, last = min((n[0] for n in notes), default=0), max((n[1] for n in notes), default=0)
    words = len(notes[-1][2].words) + 1 if notes else 0
    cells, moved = window(line, first, last + words if last + words - first < width else last, width)
    canvas = Canvas()
    canvas.put(0, 0, cells)
    row, limit = 1, len(cells)
    placed = []
    for left, right, mark in notes:
        start = min(max(left - moved, 0), limit)
        placed.append((start, max(min(right - moved, limit), start + 1), mark))
    for start, stop, mark in sorted(placed, key=lambda note: (note[2].primary, note[0] - note[1])):
        style = severity if mark.primary else "frame"
        canvas.put(1, start, ("^" if mark.primary else "-") * (stop - start), style)
    ends = max((stop for _, stop, _ in placed), default=0)
    beside = next((n for n in reversed(placed) if n[2].words and n[1] == ends), None)
    for start, stop, mark in reversed(placed):
        if not mark.words:
            continue
        style = severity if mark.primary else "frame"
        if mark is (beside and beside[2]):
            canvas.put(1, stop + 1, printable(mark.words), style)
            continue
        row += 1
        canvas.put(row, start, printable(mark.words), style)
    return canvas.lines(color)
