"""Diagnostics as text for people: snippets with marks, help, and what a fix would change.

Columns are counted in code points; on the screen tabs are widened and wide characters take two cells, so
marks stay under what they mark (`diagnostics.cells`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from scenelang.diagnostics.cells import LONGEST, Canvas, in_cells, left_out, paint, printable, window
from scenelang.diagnostics.diagnostic import Diagnostic, Edit, Fix
from scenelang.diagnostics.snippet import Mark, draw
from scenelang.diagnostics.span import SourceFile
from scenelang.diagnostics.suggest import plural

WIDTH = 140
"""Cells of a line where no terminal says otherwise."""
_MOST_LINES = 6
"""Of a longer change the rest is left out."""


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
    found = in_order(diagnostics)
    if not found:
        return ""
    blocks = [_block(diagnostic, width, color) for diagnostic in found[:most]]
    if most is not None and len(found) > most:
        left = len(found) - most
        blocks.append(paint("bold", f"… and {left:,} more", color))
    if summary:
        if fixable is None:
            fixable = sum(d.fix is not None for d in found)
        blocks.append(_count(found, fixer, fixable, color))
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
