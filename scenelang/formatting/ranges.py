"""Part of a text to the canonical layout: `format_range`, for editors."""

from __future__ import annotations

from scenelang.diagnostics.span import SourceFile
from scenelang.formatting.format import format_text
from scenelang.formatting.trivia import comments_of
from scenelang.syntax.lexer import scan
from scenelang.syntax.tables import tables
from scenelang.syntax.tokens import Report

_ENDED_BY_SEMICOLON = {"nsg", "model", "param", "let", "fn", "import"}


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
    before, after = _statements(text), _statements(result)
    if len(before) != len(after):  # statements that stand for nothing have gone
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


def _statements(text: str) -> list[tuple[int, int]]:
    """Start and end of each statement of the top level of a text without mistakes."""
    source = SourceFile("", text)
    tokens = scan(source, Report(source))
    kinds = [tables().kinds[kind] for kind in tokens.kinds]
    found: list[tuple[int, int]] = []
    depth = 0
    first: int | None = None
    for index, kind in enumerate(kinds[:-1]):
        if first is None:
            first = index
        depth += (kind in ("(", "[", "{")) - (kind in (")", "]", "}"))
        closed = kind == "}" and kinds[first] not in _ENDED_BY_SEMICOLON and kinds[index + 1] != "else"
        if depth == 0 and (kind == ";" or closed):
            found.append((tokens.starts[first], tokens.ends[index]))
            first = None
    return found
