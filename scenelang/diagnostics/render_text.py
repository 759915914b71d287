"""Diagnostics as text for people: snippets with carets, help and fixes.

Columns are counted in code points; on the screen tabs are widened to `TAB` and wide characters take two
cells, so carets stay under what they mark.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from unicodedata import combining, east_asian_width

from scenelang.diagnostics.diagnostic import Diagnostic
from scenelang.diagnostics.span import SourceFile, Span

TAB = 4
_MAX_LINE = 160
"""Longer lines are shown around the mark only."""

_STYLES = {"error": "\x1b[1;31m", "warning": "\x1b[1;33m", "note": "\x1b[1;36m", "bold": "\x1b[1m"}
_STYLES |= {"frame": "\x1b[1;34m", "off": "\x1b[0m"}

Mark = tuple[Span, str, bool]
"""A place, the words beside it, and whether it is the primary one."""


def sort_key(diagnostic: Diagnostic) -> tuple[str, int, int, str]:
    """File, then place, then code; what has no place comes first."""
    span = diagnostic.span
    if span is None:
        return "", -1, -1, diagnostic.code
    return span.source.name, span.start, span.end, diagnostic.code


def in_order(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """All diagnostics in the order in which every format gives them."""
    return sorted(diagnostics, key=sort_key)


def render_text(diagnostics: Iterable[Diagnostic], color: bool = False) -> str:
    """Snippets with carets, and a line that counts them.

    Args:
        diagnostics: in any order.
        color: with ANSI colours.

    Returns:
        Text that ends in a newline; empty where there is nothing to say.
    """
    found = in_order(diagnostics)
    if not found:
        return ""
    paint = _Paint(color)
    blocks = [_block(diagnostic, paint) for diagnostic in found]
    return "\n\n".join(blocks) + "\n\n" + _count(found, paint) + "\n"


def plural(count: int, noun: str) -> str:
    """`1 error`, `2 errors`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _count(found: Sequence[Diagnostic], paint: _Paint) -> str:
    errors = sum(d.severity == "error" for d in found)
    warnings = len(found) - errors
    parts = [plural(n, noun) for n, noun in ((errors, "error"), (warnings, "warning")) if n]
    return paint("error" if errors else "warning", ", ".join(parts))


class _Paint:
    """Wraps text in ANSI codes, or leaves it."""

    def __init__(self, color: bool) -> None:
        self.color = color

    def __call__(self, style: str, text: str) -> str:
        return f"{_STYLES[style]}{text}{_STYLES['off']}" if self.color and text else text


def _block(diagnostic: Diagnostic, paint: _Paint) -> str:
    severity = diagnostic.severity
    head = paint(severity, f"{severity}[{diagnostic.code}]") + paint(
        "bold", f": {printable(diagnostic.message)}"
    )
    lines = [head]
    width = 1
    if diagnostic.span is not None:
        marks: list[Mark] = [(diagnostic.span, "", True)]
        marks += [(label.span, label.message, False) for label in diagnostic.labels]
        width = max(len(str(mark[0].locate()[1][0])) for mark in marks)
        sources: list[SourceFile] = []
        for span, _, _ in marks:
            if not any(span.source is source for source in sources):
                sources.append(span.source)
        for number, source in enumerate(sources):
            own = [mark for mark in marks if mark[0].source is source]
            lines += _snippet(source, own, width, severity, number == 0, paint)
    gutter = " " * width
    if diagnostic.help is not None:
        lines.append(f"{gutter} {paint('frame', '=')} {paint('bold', 'help')}: {printable(diagnostic.help)}")
    if diagnostic.fix is not None:
        lines.append(
            f"{gutter} {paint('frame', '=')} {paint('bold', 'fix')}: {printable(diagnostic.fix.message)}"
        )
    return "\n".join(lines)


def _snippet(
    source: SourceFile, marks: Sequence[Mark], width: int, severity: str, first: bool, paint: _Paint
) -> list[str]:
    """The lines of one file with their marks."""
    line, column = marks[0][0].locate()[0]
    gutter = " " * width
    arrow = paint("frame", "-->" if first else ":::")
    rows = [f"{gutter}{arrow} {printable(source.name)}:{line}:{column}", f"{gutter} {paint('frame', '|')}"]
    by_line: dict[int, list[tuple[int, int, str, bool]]] = {}
    for span, words, primary in marks:
        (top, left), (bottom, right) = span.locate()
        if bottom == top:
            by_line.setdefault(top, []).append((left, max(right, left + 1), words, primary))
            continue
        # A span over several lines is marked where it begins; a label that says so carries the rest.
        until = len(source.line(top)) + 1
        by_line.setdefault(top, []).append((left, max(until, left + 1), words, primary))
    shown = 0
    for number in sorted(by_line):
        if shown and number > shown + 1:
            rows.append(paint("frame", "..."))
        shown = number
        rows += _marked_line(source.line(number), number, by_line[number], width, severity, paint)
    return rows


def _marked_line(
    text: str, number: int, marks: list[tuple[int, int, str, bool]], width: int, severity: str, paint: _Paint
) -> list[str]:
    """One source line, a row of carets, and a row for each label that has no room beside them."""
    text, marks = _clip(text, marks)
    cells = _cells(text)
    rows = [f"{paint('frame', f'{number:>{width}} |')} {_widened(text)}".rstrip()]
    bar = " " * width + " " + paint("frame", "|")
    placed = sorted(
        ((_cell(cells, left), _cell(cells, right), words, primary) for left, right, words, primary in marks),
        key=lambda mark: mark[0],
    )
    carets = [" "] * max(max(right, left + 1) for left, right, _, _ in placed)
    styles = ["frame"] * len(carets)
    for left, right, _, primary in sorted(placed, key=lambda mark: mark[3]):
        for cell in range(left, max(right, left + 1)):
            carets[cell] = "^" if primary else "-"
            styles[cell] = severity if primary else "frame"
    row = "".join(
        char if char == " " else paint(style, char) for char, style in zip(carets, styles, strict=True)
    )
    named = [mark for mark in placed if mark[2]]
    # The words of the last mark stand beside it, those of the others below, from right to left.
    beside = named.pop() if named and named[-1][0] == placed[-1][0] else None
    if beside is not None:
        row += " " + paint(severity if beside[3] else "frame", printable(beside[2]))
    rows.append(f"{bar} {row}")
    for left, _, words, primary in reversed(named):
        rows.append(f"{bar} {' ' * left}{paint(severity if primary else 'frame', printable(words))}")
    return rows


def _clip(text: str, marks: list[tuple[int, int, str, bool]]) -> tuple[str, list[tuple[int, int, str, bool]]]:
    """A window around the marks of a very long line."""
    if len(text) <= _MAX_LINE:
        return text, marks
    start = max(0, min(left for left, _, _, _ in marks) - 1 - _MAX_LINE // 4)
    window = text[start : start + _MAX_LINE]
    before = "…" if start else ""
    after = "…" if start + _MAX_LINE < len(text) else ""
    shift = start - len(before)
    limit = len(before) + len(window) + 1
    moved = [
        (min(left - shift, limit), min(right - shift, limit), words, primary)
        for left, right, words, primary in marks
    ]
    return before + window + after, moved


def _char_width(char: str) -> int:
    if char == "\t":
        return TAB
    if combining(char) or char in "\u200b\u200d\ufe0f":
        return 0
    return 2 if east_asian_width(char) in "WF" else 1


def _cells(text: str) -> list[int]:
    """The screen cell at which each character of a line begins, and where the line ends."""
    cells = [0]
    for char in text:
        cells.append(cells[-1] + _char_width(char))
    return cells


def _cell(cells: list[int], column: int) -> int:
    """The screen cell of a column from 1; past the end the line goes on in single cells."""
    index = column - 1
    return cells[index] if index < len(cells) else cells[-1] + index - len(cells) + 1


def _widened(text: str) -> str:
    return printable(text.replace("\t", " " * TAB))


def printable(text: str) -> str:
    """Text without control characters, so that no file can move the cursor or colour a terminal."""
    if text.isprintable():
        return text
    return "".join(
        char if char.isprintable() or char == " " else "\N{REPLACEMENT CHARACTER}" for char in text
    )
