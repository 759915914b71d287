"""Source lines with marks under them, drawn as rustc draws them.

A mark inside one line is underlined; its words stand beside it where there is room and hang below it
otherwise. A mark over several lines has a bar at the left from where it begins to where it ends::

    3 |     subtract star { … }
      |     -------- this is subtracted from
    4 |   / intersect {
    5 |   |   square {}
    6 |   | }
      |   |_^
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from scenelang.diagnostics.cells import LONGEST, Canvas, Line, in_cells, left_out, paint, printable, window
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.records import Record

_LEAST_WIDTH = 30
_HEAD, _TAIL = 2, 1
"""Of a mark over many lines so many are shown after its first line and before its last."""


class Mark(Record):
    """A place in a text, and what is said there; the primary one is that of the mistake itself."""

    span: Span
    words: str = ""
    primary: bool = False


class _Bar(Record, frozen=False):
    """A mark over several lines: where it begins and ends, and its column of the margin."""

    mark: Mark
    top: int
    left: int
    bottom: int
    right: int
    column: int = 0
    slash: bool = False


class _Note(Record, frozen=False):
    """What one line has to show of a mark, in cells ``[left, right)``."""

    left: int
    right: int
    mark: Mark
    words: str
    bar: _Bar | None = None


class Snippet:
    """The marks of one file, at least one, on a screen of ``width`` cells."""

    def __init__(
        self, source: SourceFile, marks: Sequence[Mark], severity: str, gutter: int, width: int
    ) -> None:
        self.source = source
        self.severity = severity  # style of the primary mark
        self.gutter = gutter  # digits of the largest line number
        self.notes: dict[int, list[_Note]] = {}
        self.bars: list[_Bar] = []
        self.laid: dict[int, tuple[Line, int]] = {}
        self.columns: dict[int, int] = {}
        for mark in marks:
            for line, column in mark.span.locate():
                self.columns[line] = min(column, self.columns.get(line, column))
        for mark in marks:
            self._sort_in(mark)
        self._give_columns()
        self.margin = 1 + max(bar.column for bar in self.bars) + 1 if self.bars else 0
        self.width = max(width - gutter - 3 - self.margin, _LEAST_WIDTH)

    def _sort_in(self, mark: Mark) -> None:
        (top, first), (bottom, last) = mark.span.locate()
        if bottom > top and last == 1:  # it ends with a line break
            bottom -= 1
            last = len(self.source.line(bottom)) + 1
        start, end = self._cell(top, first), self._cell(bottom, last)
        if top == bottom:
            note = _Note(start, max(end, start + 1), mark, printable(mark.words))
            self.notes.setdefault(top, []).append(note)
        else:
            self.bars.append(_Bar(mark, top, start, bottom, max(end, 1)))

    def _lay(self, number: int) -> tuple[Line, int]:
        """A line in cells, and how many of its code points are left out in front."""
        if number not in self.laid:
            text = self.source.line(number)
            cut = left_out(text, self.columns.get(number, 1) - 1)
            self.laid[number] = in_cells(text[cut : cut + LONGEST]), cut
        return self.laid[number]

    def _cell(self, number: int, column: int) -> int:
        """The cell of a place; what is left out in front takes none."""
        line, cut = self._lay(number)
        return line.cell(max(1, column - cut))

    def _give_columns(self) -> None:
        """Bars that share a line stand in different columns, the outer ones further to the left."""
        self.bars.sort(key=lambda bar: (bar.top, -bar.bottom))
        for index, bar in enumerate(self.bars):
            taken = {b.column for b in self.bars[:index] if b.bottom >= bar.top}
            bar.column = next(c for c in range(len(self.bars)) if c not in taken)
            line, cut = self._lay(bar.top)
            alone = bar.top not in self.notes and all(
                b is bar or bar.top not in (b.top, b.bottom) for b in self.bars
            )
            bar.slash = alone and not cut and not "".join(line.cells[: bar.left]).strip()
        for bar in self.bars:
            if not bar.slash:
                note = _Note(bar.left, bar.left + 1, bar.mark, "", bar)
                self.notes.setdefault(bar.top, []).append(note)
            note = _Note(bar.right - 1, bar.right, bar.mark, printable(bar.mark.words), bar)
            self.notes.setdefault(bar.bottom, []).append(note)

    # ------------------------------------------------------------ drawing

    def lines(self, color: bool) -> list[str]:
        """The rows, each with its gutter."""
        rows: list[str] = []
        before = 0
        for number in self._shown():
            if before and number > before + 1:
                canvas = Canvas()
                self._margin(canvas, 0, number, number)
                dots = paint("frame", "...", color)
                rows.append(f"{dots}{' ' * self.gutter}{canvas.lines(color)[0]}".rstrip())
            before = number
            head = paint("frame", f"{number:>{self.gutter}} |", color)
            bare = paint("frame", " " * self.gutter + " |", color)
            for index, text in enumerate(self._line(number).lines(color)):
                rows.append(f"{bare if index else head} {text}" if text else bare if index else head)
        return rows

    def _shown(self) -> list[int]:
        """Line numbers to show; a single line between two of them is shown too."""
        wanted = set(self.notes)
        for bar in self.bars:
            wanted.update(range(bar.top, min(bar.top + _HEAD, bar.bottom) + 1))
            wanted.update(range(max(bar.bottom - _TAIL, bar.top), bar.bottom + 1))
        wanted |= {line + 1 for line in wanted if line + 2 in wanted}
        return sorted(wanted)

    def _style(self, mark: Mark) -> str:
        return self.severity if mark.primary else "frame"

    def _margin(self, canvas: Canvas, row: int, above: int, below: int) -> None:
        """Bars that run through a row: they began before line ``above`` and end at ``below`` or later."""
        canvas.put(row, 0, " " * self.margin)
        for bar in self.bars:
            if bar.top < above and bar.bottom >= below:
                canvas.put(row, bar.column, "|", self._style(bar.mark))

    def _line(self, number: int) -> Canvas:
        """One source line, its underlines and its words."""
        canvas = Canvas()
        self._margin(canvas, 0, number, number)
        for bar in self.bars:
            if bar.top == number and bar.slash:
                canvas.put(0, bar.column, "/", self._style(bar.mark))
        notes = sorted(self.notes.get(number, ()), key=lambda note: (note.left, note.right))
        line, _ = self._lay(number)
        first = min((note.left for note in notes), default=0)
        last = max((note.right for note in notes), default=0)
        words = len(notes[-1].words) + 1 if notes else 0
        cells, moved = window(
            line, first, last + words if last + words - first < self.width else last, self.width
        )
        canvas.put(0, self.margin, cells)
        limit = len(cells) + self.margin
        for note in notes:
            note.left = min(max(note.left - moved, 0) + self.margin, limit)
            note.right = max(min(note.right - moved + self.margin, limit), note.left + 1)
        if notes:
            self._annotate(canvas, number, notes)
        return canvas

    def _annotate(self, canvas: Canvas, number: int, notes: list[_Note]) -> None:
        """Underlines in row 1, words beside them or hanging from them in the rows below."""
        beside = _beside(notes)
        # From right to left, so that no words stand in the way of what hangs further down.
        hanging = [note for note in notes if (note.words or note.bar) and note is not beside]
        hanging.sort(key=lambda note: (-note.left, note.bar is None))
        placed: list[tuple[int, _Note]] = [] if beside is None else [(1, beside)]
        last = 1
        for note in hanging:
            last = max(last + 1, 2 if note.bar else 3)
            placed.append((last, note))
        for row in range(1, last + 1):
            self._margin(canvas, row, number, number + 1)
        self._ends_of_bars(canvas, number, {id(note.bar): row for row, note in placed}, last)
        for row, note in placed:
            if note.bar:
                line = "_" * (note.left - note.bar.column - 1)
                canvas.put(row, note.bar.column + 1, line, self._style(note.mark))
        for row, note in placed:
            for above in range(2, row + (note.bar is not None)):
                canvas.put(above, note.left, "|", self._style(note.mark))
        for note in sorted(notes, key=lambda note: (note.mark.primary, note.left - note.right)):
            sign = "^" if note.mark.primary else "-"
            canvas.put(1, note.left, sign * (note.right - note.left), self._style(note.mark))
        for row, note in placed:
            at = note.right + 1 if row == 1 else note.left + 2 if note.bar else note.left
            canvas.put(row, at, note.words, self._style(note.mark))

    def _ends_of_bars(self, canvas: Canvas, number: int, rows: dict[int, int], last: int) -> None:
        """The bars that begin or end in a line, in the rows below it."""
        for bar in self.bars:
            if bar.top == number:
                below = range(1 if bar.slash else rows[id(bar)] + 1, last + 1)
            elif bar.bottom == number:
                below = range(1, rows[id(bar)] + 1)
            else:
                continue
            for row in below:
                canvas.put(row, bar.column, "|", self._style(bar.mark))


def _beside(notes: Sequence[_Note]) -> _Note | None:
    """The note whose words, or whose bar, fit into the row of the underlines."""
    if len(notes) == 1:
        return notes[0]
    end = max(note.right for note in notes)
    named = [note for note in notes if note.words and note.right == end and note.bar is None]
    return named[-1] if named else None


def draw(marks: Iterable[Mark], severity: str, gutter: int, width: int, color: bool) -> list[str]:
    """The marks of one diagnostic, the primary one first, file by file; see `Snippet`."""
    files: dict[SourceFile, list[Mark]] = {}
    for mark in marks:
        files.setdefault(mark.span.source, []).append(mark)
    blank = paint("frame", " " * gutter + " |", color)
    rows = []
    for index, (source, own) in enumerate(files.items()):
        line, column = own[0].span.locate()[0]
        arrow = paint("frame", " " * gutter + (":::" if index else "-->"), color)
        rows += [blank] if index else []
        rows += [f"{arrow} {printable(source.name)}:{line}:{column}", blank]
        rows += Snippet(source, own, severity, gutter, width).lines(color)
    return rows
