"""Part of a text to the canonical layout: `format_range`, for editors."""

from __future__ import annotations

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.span import SourceFile
from scenelang.formatting.format import format_text
from scenelang.formatting.trivia import comments_of
from scenelang.syntax import parse
from scenelang.syntax.lexer import scan
from scenelang.syntax.tokens import Report


def format_range(text: str, start: int, end: int, *, name: str = "<text>") -> tuple[int, int, str]:
    """Lay out the statements of the file's top level that a range touches, and nothing else.

    Args:
        text: the whole text.
        start, end: the range, in code points.
        name: what errors call the text.

    Returns:
        Start and end of what to replace, and the text to put there; an empty range where nothing changes.

    Raises:
        SceneError: the text has syntax errors, in the range or elsewhere.
    """
    result = format_text(text, name=name)
    strays = Diagnostics()
    before, after = _statements(text, strays), _statements(result, Diagnostics())
    gone = [d.span.start for d in strays if d.span is not None]  # semicolons that stand for nothing
    if not all(any(first < at < last for first, last in before) for at in gone):
        return 0, len(text), result
    touched = [k for k, (first, last) in enumerate(before) if first < max(end, start + 1) and last > start]
    if not touched:
        return start, start, ""
    low, high = touched[0], touched[-1]
    place, there = slice(before[low][0], before[high][1]), slice(after[low][0], after[high][1])
    if _comments(text[place]) != _comments(result[there]):
        # A comment has gone behind the last semicolon: what stands up to the next statement goes along.
        place = slice(place.start, [*(first for first, _ in before), len(text)][high + 1])
        there = slice(there.start, [*(first for first, _ in after), len(result)][high + 1])
    if text[place] == result[there]:
        return start, start, ""
    return place.start, place.stop, result[there]


def _comments(text: str) -> list[str]:
    source = SourceFile("", text)
    return comments_of(scan(source, Report(source)))


def _statements(text: str, found: Diagnostics) -> list[tuple[int, int]]:
    """Start and end of each statement of the top level of a text without errors."""
    return [(s.span.start, s.span.end) for s in parse(SourceFile("", text), found).statements]
