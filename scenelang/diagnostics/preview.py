"""What a fix does, as the lines that it changes."""

from __future__ import annotations

from collections.abc import Sequence

from scenelang.diagnostics.cells import LONGEST, Canvas, in_cells, left_out, paint, window
from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import SourceFile

_MOST_LINES = 6
"""Of a longer change the rest is left out."""


def largest_line(fix: Fix) -> int:
    """The largest line number that a preview may show."""
    return max(
        (e.span.locate()[0][0] + max(e.span.text.count("\n"), e.replacement.count("\n")) for e in fix.edits),
        default=0,
    )


def preview(fix: Fix, gutter: int, width: int, color: bool) -> list[str]:
    """Lines with what is inserted underlined by `+`; other changes as the lines before and after.

    Args:
        fix: its edits lie in one file.
        gutter: digits of the largest line number.
        width: cells of the screen.
        color: with ANSI colours.
    """
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
