"""Diagnostics as text for people: snippets with marks, help, and what a fix would change.

Columns are counted in code points; on the screen tabs are widened and wide characters take two cells, so
marks stay under what they mark (`diagnostics.cells`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from scenelang.diagnostics.cells import paint, printable
from scenelang.diagnostics.diagnostic import Diagnostic
from scenelang.diagnostics.preview import largest_line, preview
from scenelang.diagnostics.snippet import Mark, draw

WIDTH = 140
"""Cells of a line where no terminal says otherwise."""


def sort_key(diagnostic: Diagnostic) -> tuple[str, int, int, str]:
    """File, then place, then code; what has no place comes first."""
    span = diagnostic.span
    if span is None:
        return "", -1, -1, diagnostic.code
    return span.source.name, span.start, span.end, diagnostic.code


def in_order(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """All diagnostics in the order in which every format gives them."""
    return sorted(diagnostics, key=sort_key)


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


def plural(count: int, noun: str) -> str:
    """`1 error`, `2 errors`."""
    return f"{count:,} {noun}" if count == 1 else f"{count:,} {noun}s"


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
    gutter = len(str(max([1, *numbers, largest_line(fix) if fix else 1])))
    lines += draw(marks, severity, gutter, width, color)
    notes = []
    if diagnostic.help is not None:
        notes.append(_note("help", diagnostic.help, gutter, color))
    if fix is not None:
        notes.append(_note("fix", fix.message, gutter, color))
    if notes and marks:
        lines.append(paint("frame", " " * gutter + " |", color))
    lines += notes
    if fix is not None:
        lines += preview(fix, gutter, width, color)
    return "\n".join(lines)


def _note(word: str, text: str, gutter: int, color: bool) -> str:
    sign = paint("frame", " " * gutter + " =", color)
    return f"{sign} {paint('bold', word, color)}: {printable(text)}"
