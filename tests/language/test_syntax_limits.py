"""Hostile and huge texts: no crash, no deep tree, work in proportion to size."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import pytest

from scenelang.language import habits, recovery
from scenelang.language.parser import MAX_DEPTH
from tests.language.reading import read
from tests.work import ends, lines_run

MANY = 20_000


def depth(node: Any) -> int:
    """How deep a tree is, without recursion."""
    deepest = 0
    todo: list[tuple[Any, int]] = [(node, 0)]
    while todo:
        at, level = todo.pop()
        deepest = max(deepest, level)
        if isinstance(at, tuple):
            todo += [(item, level) for item in at]
        elif is_dataclass(at) and type(at).__name__ not in ("Span", "Name"):
            todo += [(getattr(at, field.name), level + 1) for field in fields(at)]
    return deepest


DEEP = [
    "let a = " + "(" * MANY + "1" + ")" * MANY + ";",
    "let a = " + "[" * MANY + "]" * MANY + ";",
    "let a = " + "f(" * MANY + ")" * MANY + ";",
    "let a = " + "-" * MANY + "1;",
    "let a = " + "1 + " * MANY + "1;",
    "let a = " + "2 ^ " * MANY + "1;",
    "let a = " + "b ? 1 : " * MANY + "1;",
    "let a = b" + ".x" * MANY + ";",
    "let a = b" + "[0]" * 150 + ";",
    "group {" * MANY + "}" * MANY,
    "if (a) { }" + " else if (a) { }" * MANY,
    "let a = " + "material m { let b = " * MANY + "1" + "; }" * MANY + ";",
]
OPENINGS = ["(", "[", "{", "f(", "group {", "let a = (", "if (a) {", "-", "a ? "]


@pytest.mark.parametrize("text", DEEP + [text * MANY for text in OPENINGS], ids=lambda text: text[:20])
def test_deep_nesting_is_one_mistake(text: str) -> None:
    tree, diagnostics = read(text)
    if text in DEEP:
        assert [d.code for d in diagnostics] in (["E0120"], [])
    else:
        assert 1 <= len(diagnostics) <= 201  # unclosed
    # A level of blocks is two nodes, a call and its argument three.
    assert depth(tree) <= 3 * MAX_DEPTH + 10


def test_only_what_stands_before_deep_nesting_is_checked() -> None:
    tree, diagnostics = read(
        "let a = 1 2; group { let b = " + "(" * 300 + "1" + ")" * 300 + "; } let c = 3 4;"
    )
    assert [d.code for d in diagnostics] == ["E0101", "E0120"]
    assert [type(statement).__name__ for statement in tree.statements] == ["Let", "BadStmt"]


@pytest.mark.parametrize("brace", ["{", "}", "a {"])
def test_braces_of_one_line_beside_others(brace: str) -> None:
    """They are not mended one by one, each by looking at its whole line."""

    def work(count: int) -> int:
        return lines_run(lambda: read("let x = 1;\nlet y = 1;\n" + brace * count))

    work(1)
    assert work(500) < 6 * work(100)


@pytest.fixture
def _few_in_detail(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the cause of twenty mistakes looked for in detail, and not of a hundred, which takes as long."""
    monkeypatch.setattr(recovery, "_THOROUGH", 20)
    monkeypatch.setattr(habits, "_MOST", 20)


@pytest.mark.usefixtures("_few_in_detail")
def test_the_cause_of_many_mistakes_is_not_looked_for_far_away() -> None:
    """The first are told in detail; what comes behind costs less, and the rest of the text nothing."""

    def work(count: int) -> int:
        return lines_run(lambda: read("..\n(1,2)\n" * count))

    work(1)
    first, many = work(8), work(120)  # mistakes, at least
    assert many < 20 * first
    assert work(600) < 1.2 * many


GARBAGE = ["}", ")", ";", "@ ", "'", '"', "/*", "a$", "1 ", "{", "let = 1\n", "k = ", "scale(2) "]


@pytest.mark.usefixtures("_few_in_detail")
@pytest.mark.parametrize("text", GARBAGE)
def test_garbage_takes_little_work(text: str) -> None:
    """Work grows no faster than the text, and a further token of garbage costs little.

    Looking through the whole text at each of the 200 mistakes that are reported would be 200 lines a token.
    """
    few, many = text * 500, text * 1500
    found: list[int] = []
    read(text * 2)  # fills what is made once
    small, large = lines_run(lambda: read(few)), lines_run(lambda: found.append(len(read(many)[1])))
    assert large < 3.6 * small
    assert large - small < 150 * 1000  # 25 to 70 a token as it is
    assert found[0] <= 201


STRETCHES = [
    *(("", text) for text in ("9", ".", "a", "é", " ", "\n", "\0", "/", "#", "/* ", '"a', " \ufeff// \n")),
    *(("1", "e"), ("#", "a"), ("/*", "*"), ('"', "a"), ('"', "\\"), ('"', '\\"'), ("'", "a"), ("“", "a")),
]
"""How a token begins, and what may follow without end."""


def test_no_text_takes_long_to_split_into_tokens() -> None:
    """The lexer's expression tries nothing in more than one way: its work is in C and cannot be counted."""
    ends(
        f"""
from scenelang.language.diagnostics import SourceFile
from scenelang.language.lexer import scan
from scenelang.language.lexer import Report
for start, text in {STRETCHES}:
    source = SourceFile("", start + text * {20 * MANY} + " ;")
    scan(source, Report(source))
"""
    )


def test_mistakes_at_the_ends_of_a_long_statement() -> None:
    _, diagnostics = read("let v = [" + "1, " * MANY + "; let a = 3;")
    assert 1 <= len(diagnostics) <= 2
