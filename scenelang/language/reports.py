"""Diagnostics as text for people, with marked source lines, and the exception that carries them.

Nothing in a scene may move the cursor or colour a terminal: what does not print is shown as U+FFFD.

Words stand beside the last mark of a line; those of others stand below it, each under its own mark. Of a
mark over several lines the first is underlined to its end::

    3 |     subtract star { … }
      |     -------- this is subtracted from
    4 |     intersect {
      |     ^^^^^^^^^^^

Columns are counted in code points; on the screen tabs are widened and wide characters take two cells, so
marks stay under what they mark.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import groupby
from unicodedata import category, east_asian_width

from scenelang.assets.records import Record
from scenelang.language.diagnostics import Diagnostic, Edit, Fix, SourceFile, Span, plural

TAB = 4
LONGEST = 4000
"""Code points of a line that are laid out at most, near the part that is shown.

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
    """Number of code points before offset ``at`` that are not laid out: none but in a very long line."""
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
        result = []
        for row in self.rows:
            while row and not row[-1][0].strip() and (row[-1][0] or row[-2][0].isspace()):
                row.pop()
            runs = groupby(row, key=lambda cell: cell[1])
            result.append("".join(paint(style, "".join(c for c, _ in run), color) for style, run in runs))
        return result


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


WIDTH = 140
"""Cells of a line where no terminal says otherwise."""
_MOST_LINES = 6
"""Lines of a change that are shown at most."""


def in_order(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """All diagnostics as every format gives them: by file, place and code; what has no place comes first."""

    def key(d: Diagnostic) -> tuple[str, int, int, str]:
        return (d.span.source.name, d.span.start, d.span.end, d.code) if d.span else ("", -1, -1, d.code)

    return sorted(diagnostics, key=key)


def render_text(
    diagnostics: Iterable[Diagnostic],
    color: bool = False,
    *,
    width: int = WIDTH,
    most: int | None = None,
    summary: bool = True,
    fixer: str = "scenelang check --fix",
    fixable: int | None = None,
) -> str:
    """Snippets with marks, and a line that counts the diagnostics.

    Args:
        diagnostics: in any order.
        color: with ANSI colours.
        width: cells of the screen; longer source lines are shown around their marks only.
        most: show so many at most; the rest is only counted.
        summary: whether to count.
        fixer: the command that applies fixes, for the summary.
        fixable: how many it would apply; by default all that there are.

    Returns:
        Text that ends in a newline; empty where there is nothing to say.
    """
    ordered = in_order(diagnostics)
    if not ordered:
        return ""
    blocks = [_block(diagnostic, width, color) for diagnostic in ordered[:most]]
    if most is not None and len(ordered) > most:
        left = len(ordered) - most
        blocks.append(paint("bold", f"… and {left:,} more", color))
    if summary:
        if fixable is None:
            fixable = sum(d.fix is not None for d in ordered)
        blocks.append(_count(ordered, fixer, fixable, color))
    return "\n\n".join(blocks) + "\n"


def _count(found: Sequence[Diagnostic], fixer: str, fixable: int, color: bool) -> str:
    errors = sum(d.severity == "error" for d in found)
    warnings = len(found) - errors
    parts = [plural(n, noun) for n, noun in ((errors, "error"), (warnings, "warning")) if n]
    text = paint("error" if errors else "warning", ", ".join(parts), color)
    return f"{text}; {fixable:,} fixable with `{fixer}`" if fixable else text


def _block(diagnostic: Diagnostic, width: int, color: bool) -> str:
    severity = diagnostic.severity
    head = paint(severity, f"{severity}[{diagnostic.code}]", color)
    lines = [head + paint("bold", f": {printable(diagnostic.message)}", color)]
    marks = [] if diagnostic.span is None else [Mark(diagnostic.span, "", True)]
    marks += [Mark(label.span, label.message) for label in diagnostic.labels]
    numbers = [mark.span.locate()[1][0] for mark in marks]
    fix = diagnostic.fix
    gutter = len(str(max([1, *numbers, _largest_line(fix) if fix else 1])))
    lines += draw(marks, severity, gutter, width, color)
    said = (("help", diagnostic.help), ("fix", fix.message if fix else None))
    notes = [f"{paint('bold', word, color)}: {printable(text)}" for word, text in said if text is not None]
    if notes and marks:
        lines.append(paint("frame", " " * gutter + " |", color))
    lines += [paint("frame", " " * gutter + " =", color) + f" {note}" for note in notes]
    if fix is not None:
        lines += _preview(fix, gutter, width, color)
    return "\n".join(lines)


# ---------------------------------------------------------------- what a fix does


def _largest_line(fix: Fix) -> int:
    """The largest line number that a preview may show."""
    return max(
        (e.span.locate()[0][0] + max(e.span.text.count("\n"), e.replacement.count("\n")) for e in fix.edits),
        default=0,
    )


def _preview(fix: Fix, gutter: int, width: int, color: bool) -> list[str]:
    """Lines with what is inserted underlined by `+`; other changes as the lines before and after."""
    edits = sorted(fix.edits, key=lambda edit: (edit.span.start, edit.span.end))
    if not edits or any(edit.span.source is not edits[0].span.source for edit in edits):
        return []
    source = edits[0].span.source
    rows = [paint("frame", " " * gutter + " |", color)]
    before = 0
    for first, last, own in _places(source, edits):
        if before and first > before + 1:
            rows.append(paint("frame", "...", color))
        before = last
        if all(edit.span.start == edit.span.end and "\n" not in edit.replacement for edit in own):
            rows += _inserted(source, first, own, gutter, width, color)
        else:
            rows += _changed(source, first, last, own, gutter, width, color)
    return rows


def _places(source: SourceFile, edits: list[Edit]) -> list[tuple[int, int, list[Edit]]]:
    """Edits together with those on the same lines: first line, last line, edits."""
    places: list[tuple[int, int, list[Edit]]] = []
    for edit in edits:
        (first, _), (last, column) = edit.span.locate()
        if last > first and column == 1 and (not edit.replacement or edit.replacement.endswith("\n")):
            last -= 1  # it takes whole lines
        if places and places[-1][1] >= first:
            places[-1] = (places[-1][0], max(last, places[-1][1]), places[-1][2])
            places[-1][2].append(edit)
        else:
            places.append((first, last, [edit]))
    return places


def _inserted(
    source: SourceFile, number: int, edits: list[Edit], gutter: int, width: int, color: bool
) -> list[str]:
    old, at = source.line(number), 0
    start = edits[0].span.start - edits[0].span.locate()[0][1] + 1
    skipped = left_out(old, edits[0].span.start - start)
    start, old = start + skipped, old[skipped : skipped + LONGEST]
    new = ""
    marks: list[tuple[int, int]] = []
    for edit in edits:
        cut = edit.span.start - start
        if cut > len(old) and marks:
            break
        new += old[at:cut]
        marks.append((len(new) + 1, len(new) + len(edit.replacement) + 1))
        new += edit.replacement
        at = min(cut, len(old))
    new += old[at:]
    line = in_cells(new)
    places = [(line.cell(left), line.cell(right)) for left, right in marks]
    room = max(width - gutter - 3, 30)
    cells, moved = window(line, places[0][0], places[-1][1], room)
    canvas = Canvas()
    canvas.put(0, 0, cells)
    for (left, right), (first, stop) in zip(places, marks, strict=True):
        text = new[first - 1 : stop - 1]
        lead = len(in_cells(text[: len(text) - len(text.lstrip())]).cells)
        tail = len(in_cells(text[len(text.rstrip()) :]).cells)
        if left - moved + lead < len(cells):
            canvas.put(1, max(left - moved + lead, 0), "+" * (right - left - lead - tail), "added")
    shown, under = (*canvas.lines(color), "")[:2]
    head, bare = (paint("frame", f"{n:>{gutter}} |", color) for n in (number, ""))
    return [f"{head} {shown}", f"{bare} {under}".rstrip()]


def _changed(
    source: SourceFile, first: int, last: int, edits: list[Edit], gutter: int, width: int, color: bool
) -> list[str]:
    start = edits[0].span.start - edits[0].span.locate()[0][1] + 1
    stop = start
    for _ in range(first, last + 1):
        stop = source.text.find("\n", stop) + 1 or len(source.text) + 1
    old = source.text[start:stop]
    new, at = "", 0
    for edit in edits:
        new += old[at : edit.span.start - start] + edit.replacement
        at = edit.span.end - start
    rows = []
    for sign, text, style in (("-", old, "removed"), ("+", new + old[at:], "added")):
        lines = text.removesuffix("\n").split("\n") if text.strip() or sign == "-" else []
        for offset, line in enumerate(lines[:_MOST_LINES]):
            near = 0 if offset else edits[0].span.start - start
            shown = "".join(_shown(line.rstrip("\r"), near, max(width - gutter - 3, 30)))
            head = paint("frame", f"{first + offset:>{gutter}}", color)
            rows.append(f"{head} {paint(style, f'{sign} {shown}'.rstrip(), color)}")
        rows += [paint("frame", "...", color)] * (len(lines) > _MOST_LINES)
    return rows


def _shown(text: str, at: int, width: int) -> Sequence[str]:
    """The beginning of a line, or of a very long one what is near offset ``at``."""
    cut = left_out(text, at)
    line = in_cells(text[cut : cut + LONGEST])
    near = line.cell(at - cut + 1) if cut else 0
    return window(line, near, near, width)[0]


class SceneError(Exception):
    """Raised by the library where a scene has errors; ``diagnostics`` is all that was found."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)

        super().__init__(render_text(self.diagnostics, fixable=0))
