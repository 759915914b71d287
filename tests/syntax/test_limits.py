"""Hostile and huge texts: no crash, no deep tree, time in proportion to size."""

from __future__ import annotations

import time
from dataclasses import fields, is_dataclass
from typing import Any

import pytest

from scenelang.syntax.nesting import MAX_DEPTH
from tests.syntax.reading import read

MANY = 100_000


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


@pytest.mark.parametrize(
    "text",
    [
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
    ],
    ids=lambda text: text[:20],
)
def test_deep_nesting_is_one_mistake(text: str) -> None:
    tree, diagnostics = read(text)
    assert [d.code for d in diagnostics] in (["E0120"], [])
    # A level of blocks is two nodes, a call and its argument three.
    assert depth(tree) <= 3 * MAX_DEPTH + 10


@pytest.mark.parametrize("opening", ["(", "[", "{", "f(", "group {", "let a = (", "if (a) {", "-", "a ? "])
def test_deep_and_unclosed(opening: str) -> None:
    tree, diagnostics = read(opening * MANY)
    assert 1 <= len(diagnostics) <= 201
    assert depth(tree) <= 3 * MAX_DEPTH + 10


def test_index_chains_are_bounded() -> None:
    tree, _ = read("let a = b" + "[0]" * MANY + ";")
    assert depth(tree) <= 3 * MAX_DEPTH + 10


@pytest.mark.parametrize(
    "text", ["}", ")", ";", "@ ", '"', "'", "/*", "let ", "a$", "1 ", "{", "let = 1\n", "1."]
)
def test_garbage_takes_little_time(text: str) -> None:
    start = time.process_time()
    _, diagnostics = read(text * MANY)
    assert time.process_time() - start < 5
    assert len(diagnostics) <= 201


def test_mistakes_at_the_ends_of_a_long_statement() -> None:
    _, diagnostics = read("let v = [" + "1, " * MANY + "; let a = 3;")
    assert 1 <= len(diagnostics) <= 2


def test_time_is_linear() -> None:
    def seconds(count: int) -> float:
        text = "square { scale(0.1234); rotate(30deg); translate(0.5, -0.25); }\n" * count
        start = time.process_time()
        _, diagnostics = read(text)
        assert diagnostics == []
        return time.process_time() - start

    seconds(100)
    small, large = min(seconds(500) for _ in range(3)), seconds(5000)
    assert large < 30 * small
    assert large < 5
