"""Parsing again after an edit equals parsing the whole text: tree, spans, diagnostics, tokens."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.syntax import nodes, parse
from scenelang.syntax.incremental import Edit, Parsed, parse_edited, parse_whole

ROOT = Path(__file__).parents[2]
EXAMPLES = [path.read_text("utf-8") for path in sorted(ROOT.glob("examples/**/*.nsg"))]
PARTS = [
    f"// part {i}\nmodule part{i}(at, c = #d3{i % 16:x}) {{\n"
    f"  star {{ scale(0.{i + 1}); translate(at); }}\n}}\n"
    f"let a{i} = [{i}, 0.5] * 2;\npart{i}(at = a{i});\nsquare {{ rotate({i}deg); }}\n"
    for i in range(40)
]
LONG, SHORT = "".join(PARTS), "".join(PARTS[:2])
TYPED = ["let x = mix(1, 2, t);\n", "star { scale(0.5); }\n", "canvas(64, 64);"]
SNIPPETS = [
    *"{}()[];,\"'\n =.é°\t𝄞a\\-",
    *("/*", "*/", "//", "..", "let x = 1;", "square { }", "else { }", "if (a) ", "fn f(x) = ", "group {\n  "),
    *(
        "30 deg",
        "# d",
        "subtract ",
        "module m(",
        "0.5",
        "in ",
        "lte y = 2;\n",
        "scale(0.5)\n",
        "\r\n",
        "// ok\n",
        *("translate(1, 0) ", "for (i = [0:3]) { ", "k = 1;\n", "material { color(#f00); }", "x if y else "),
    ),
]


def spans(value: object) -> list[Span]:
    """All spans of a tree, in one order."""
    if isinstance(value, Span):
        return [value]
    if isinstance(value, tuple):
        return [span for item in value for span in spans(item)]
    names = getattr(value, "__dataclass_fields__", ())
    return [span for name in names for span in spans(getattr(value, name))]


def same(new: Parsed, text: str) -> None:
    """Hold a version against a parse of its whole text."""
    found = Diagnostics()
    file = parse(SourceFile("t.nsg", text), found)
    assert new.source.text == text
    assert list(new.diagnostics) == found.items
    assert new.file == file
    assert new.starts == [s.span.start for s in file.statements]
    assert new.ends == [s.span.end for s in file.statements]
    whole = parse_whole(SourceFile("t.nsg", text)).tokens
    assert (new.tokens.kinds, new.tokens.starts, new.tokens.ends) == (whole.kinds, whole.starts, whole.ends)
    assert new.tokens.reported == whole.reported
    for span in [*spans(new.file), *(d.span for d in new.diagnostics if d.span)]:
        assert span.source is new.source


def replaced(old: Parsed, start: int, end: int, text: str) -> Parsed:
    before = old.source.text
    after = before[:start] + text + before[end:]
    return parse_edited(old, SourceFile("t.nsg", after), Edit(start, end, start + len(text)))


@st.composite
def edits(draw: st.DrawFn) -> tuple[str, list[tuple[float, int, str]]]:
    text = draw(st.sampled_from([*EXAMPLES, LONG, LONG[:900]]))
    piece = st.one_of(
        st.sampled_from(SNIPPETS), st.sampled_from(EXAMPLES).map(lambda t: t[50:110]), st.just("")
    )
    one = st.tuples(st.floats(0, 1), st.integers(0, 12), piece)
    return text, draw(st.lists(one, min_size=1, max_size=5))


@settings(max_examples=80)
@given(edits())
def test_random_edits_equal_a_whole_parse(case: tuple[str, list[tuple[float, int, str]]]) -> None:
    text, changes = case
    version = parse_whole(SourceFile("t.nsg", text))
    for where, length, new in changes:
        start = round(where * len(version.source.text))
        version = replaced(version, start, min(start + length, len(version.source.text)), new)
        same(version, version.source.text)


def typed_into(text: str, at: int, typed: str) -> None:
    """Type letter by letter at the start of a line, each version held against a parse of its whole text."""
    at = text.find("\n", at) + 1
    version = parse_whole(SourceFile("t.nsg", text))
    for count, letter in enumerate(typed):
        version = replaced(version, at + count, at + count, letter)
        same(version, version.source.text)


@pytest.mark.parametrize("typed", TYPED)
def test_typing_letter_by_letter_equals_a_whole_parse(typed: str) -> None:
    for line in range(SHORT.count("\n")):
        start = len("".join(SHORT.splitlines(keepends=True)[:line]))
        typed_into(SHORT, max(0, start - 1), typed)


@pytest.mark.slow
@settings(max_examples=60)
@given(st.integers(0, len(LONG)), st.sampled_from(TYPED))
def test_typing_into_a_long_text_equals_a_whole_parse(at: int, typed: str) -> None:
    typed_into(LONG, at, typed)


def test_only_the_statements_near_an_edit_are_read() -> None:
    old = parse_whole(SourceFile("t.nsg", LONG))
    at = LONG.index("let a20 = ") + len("let a20 = ")
    new = replaced(old, at, at, "3 * ")
    assert new.reparsed <= 5 < len(old.pieces)
    broken = replaced(new, at, at, "* ")
    assert [d.code for d in broken.diagnostics]
    assert broken.reparsed < len(old.pieces) / 2


def test_trees_are_moved_only_when_looked_at() -> None:
    old = parse_whole(SourceFile("t.nsg", LONG))
    new = replaced(old, 0, 0, "// a line more\n")
    last = len(new.pieces) - 1
    assert new.pieces[last].node is old.pieces[last].node
    moved = new.statement(last)
    assert moved.span.start == old.statement(last).span.start + len("// a line more\n")
    assert moved.span.text == old.statement(last).span.text


@pytest.mark.parametrize("lost", ["{", "}", "/*", '"'])
def test_what_concerns_the_whole_text_is_parsed_whole(lost: str) -> None:
    old = parse_whole(SourceFile("t.nsg", LONG))
    at = LONG.index("let a20")
    new = replaced(old, at, at, lost)
    same(new, new.source.text)
    again = replaced(new, at, at + len(lost), "")
    same(again, LONG)


def test_an_else_joins_the_statement_before_it() -> None:
    text = "let a = 1;\nif (a == 1) { square; }\nlet b = 2;\nlet c = 3;\n"
    old = parse_whole(SourceFile("t.nsg", text))
    at = text.index("let b")
    new = replaced(old, at, at, "else { star; }\n")
    same(new, new.source.text)
    assert isinstance(new.file.statements[1], nodes.If)
    assert new.file.statements[1].otherwise is not None
