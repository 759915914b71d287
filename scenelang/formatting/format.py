"""Text to text: `format_text`, and `format_range` for editors."""

from __future__ import annotations

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.span import SourceFile
from scenelang.formatting.documents import Part, render
from scenelang.formatting.layout import Layout
from scenelang.formatting.trivia import attach, comments_of
from scenelang.syntax import parse
from scenelang.syntax.automaton import run
from scenelang.syntax.lexer import Report, Tokens, scan
from scenelang.syntax.parser import limit_nesting

_BOM = "\ufeff"


def format_text(text: str, *, name: str = "<text>") -> str:
    """Lay a scene's text out in the canonical way.

    Args:
        text: the whole text of a file. A byte order mark at its beginning is kept; all lines end as the
            first one does, in LF or CRLF.
        name: what errors call it.

    Returns:
        The same tokens and comments in the canonical layout, but for stray semicolons, which go; equal to
        ``text`` if it has that already.

    Raises:
        SceneError: the text has syntax errors.
    """
    mark = _BOM if text.startswith(_BOM) else ""
    first = text.find("\n")
    newline = "\r\n" if first > 0 and text[first - 1] == "\r" else "\n"
    source = SourceFile(name, text.replace("\r\n", "\n"))
    report = Report(source)
    tokens = scan(source, report)
    limit_nesting(tokens, report)
    layout = Layout(tokens, attach(tokens))
    document: Part | None = None
    if not report.found:  # read as the parser reads it; None at a mistake
        document = run(tokens.kinds, layout.callbacks(), lambda states, values, at: None)
    if document is None or layout.doubtful:
        diagnostics = Diagnostics()
        parse(SourceFile(name, text), diagnostics)
        if diagnostics.errors:
            raise SceneError(diagnostics)
        if diagnostics.items:
            return format_text(_without_strays(text, diagnostics), name=name)
    assert document is not None, "a text without mistakes that the tables do not read"
    result = "".join(line + "\n" for line in render(document))
    _compare(tokens, result)
    return mark + result.replace("\n", newline)


def _without_strays(text: str, diagnostics: Diagnostics) -> str:
    """A text without the semicolons that stand for nothing, all that a parse warns about."""
    for d in sorted(diagnostics, key=lambda d: -d.span.start if d.span is not None else 0):
        assert d.code == "W0101", "a warning about more than stray semicolons"
        assert d.span is not None
        text = text[: d.span.start] + text[d.span.end :]
    return text


def _compare(before: Tokens, result: str) -> None:
    """Fail if formatting would change anything but the layout: a bug, and no file is to suffer from it."""
    source = SourceFile("", result)
    after = scan(source, Report(source))
    if _significant(before) != _significant(after) or comments_of(before) != comments_of(after):
        raise AssertionError("formatting changed the text's tokens or comments")


def _significant(tokens: Tokens) -> list[str]:
    """The texts of the tokens but for commas before a closing bracket, which make no difference."""
    texts = [tokens.source.text[s:e] for s, e in zip(tokens.starts, tokens.ends, strict=True)]
    return [
        word
        for word, following in zip(texts, [*texts[1:], ""], strict=True)
        if word != "," or following not in (")", "]")
    ]


# ---------------------------------------------------------------- parts of a text


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
