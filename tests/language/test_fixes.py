"""Fixes applied to texts: which win, which wait, and that it comes to an end."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenelang.language.diagnostics import (
    MAX_CROWDED,
    Diagnostic,
    Edit,
    Fix,
    SourceFile,
    Span,
    apply_fixes,
    removal,
    settle,
)

TEXT = "abcdef"
SOURCE = SourceFile("a.nsg", TEXT)


def fix(*edits: tuple[int, int, str], source: SourceFile = SOURCE, code: str = "E0101") -> Diagnostic:
    changes = tuple(Edit(Span(source, start, end), new) for start, end, new in edits)
    return Diagnostic(code, "m", changes[0].span, fix=Fix("do it", changes))


@pytest.mark.parametrize(
    ("fixes", "after", "count"),
    [
        ([], "abcdef", 0),
        ([[(0, 1, "X")], [(3, 4, "")]], "Xbcef", 2),
        ([[(3, 4, "")], [(0, 1, "X")]], "Xbcef", 2),
        ([[(0, 3, "X")], [(2, 4, "Y")]], "Xdef", 1),  # overlap
        ([[(0, 3, "X")], [(3, 4, "Y")]], "XYef", 2),  # neighbours
        ([[(0, 3, "X")], [(3, 3, "Y")]], "Xdef", 1),  # which comes first?
        ([[(2, 2, "X")], [(2, 2, "Y")]], "abXcdef", 1),
        ([[(2, 2, "X")], [(2, 2, "X")]], "abXcdef", 2),  # the same thing twice
        ([[(2, 4, "X")], [(3, 3, "Y")]], "abXef", 1),  # inside
        ([[(0, 1, "X"), (5, 6, "Z")], [(4, 6, "Y")]], "XbcdeZ", 1),  # whole or not at all
        ([[(0, 1, "X")], [(0, 1, "Z"), (3, 4, "Y")]], "Xbcdef", 1),
        ([[(0, 1, "a")]], "abcdef", 0),  # changes nothing
        ([[(6, 6, "X")], [(0, 0, "Y")]], "YabcdefX", 2),
    ],
)
def test_which_go_together(fixes: list[list[tuple[int, int, str]]], after: str, count: int) -> None:
    text, applied = apply_fixes(TEXT, [fix(*edits) for edits in fixes])
    assert (text, len(applied)) == (after, count)


def test_applied_are_in_the_order_of_the_text() -> None:
    first, last = fix((0, 1, "X")), fix((4, 5, "Y"))
    assert apply_fixes(TEXT, [last, first])[1] == (first, last)


def test_diagnostics_without_a_fix_and_of_other_texts_are_left_out() -> None:
    other = fix((0, 1, "X"), source=SourceFile("b.nsg", "abcdefg"))
    none = Diagnostic("E0101", "m", Span(SOURCE, 0, 1))
    assert apply_fixes(TEXT, [other, none]) == (TEXT, ())


def test_one_fix_of_two_edits() -> None:
    assert apply_fixes(TEXT, [fix((4, 5, "Y"), (0, 0, "X"))])[0] == "XabcdYf"


@pytest.mark.parametrize(
    ("text", "after"),
    [
        ("a;\n  b;\nc;", "a;\nc;"),
        ("b;\nc;", "c;"),
        ("a;\nb;", "a;\n"),
        ("a; b; c;", "a; c;"),
        ("a;\nb; // why\n", "a;\n// why\n"),
        ("b;", ""),
    ],
)
def test_removal(text: str, after: str) -> None:
    at = text.index("b;")
    source = SourceFile("a.nsg", text)
    gone = Diagnostic("E0101", "m", Span(source, at, at + 2), fix=removal(source, at, at + 2))
    assert apply_fixes(text, [gone])[0] == after


@given(
    st.text(alphabet="abc\n", max_size=12),
    st.lists(st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), max_size=3), max_size=6),
)
def test_any_fixes(text: str, fixes: list[list[tuple[int, int]]]) -> None:
    """What is applied equals its edits made one after the other from the end; nothing else changes."""
    source = SourceFile("a.nsg", text)
    given_fixes = []
    for edits in fixes:
        spans = sorted({(min(a, b, len(text)), min(max(a, b), len(text))) for a, b in edits})
        if any(x[1] >= y[0] for x, y in pairwise(spans)):
            continue
        if spans:
            given_fixes.append(fix(*((a, b, "X") for a, b in spans), source=source))
    after, applied = apply_fixes(text, given_fixes)
    edits = {edit for d in applied if d.fix for edit in d.fix.edits}
    slow = text
    for edit in sorted(edits, key=lambda e: (-e.span.start, -e.span.end)):
        slow = slow[: edit.span.start] + edit.replacement + slow[edit.span.end :]
    assert after == slow
    changes = [d for d in given_fixes if d.fix and any(e.span.text != "X" for e in d.fix.edits)]
    assert bool(applied) == bool(changes)


# ---------------------------------------------------------------- rounds

Found = list[tuple[str | None, Diagnostic]]


def replacing(rules: Mapping[str, str], code: str = "E0201") -> object:
    """A checker that finds some letters wrong."""

    def check(texts: Mapping[str, str]) -> Found:
        found: Found = []
        for key, text in texts.items():
            source = SourceFile(key, text)
            for at, letter in enumerate(text):
                if letter in rules:
                    found.append((key, fix((at, at + 1, rules[letter]), source=source, code=code)))
        return found

    return check


def test_rounds_go_on_until_nothing_is_found() -> None:
    done = settle({"one": "aba", "two": "c"}, replacing({"a": "b", "b": "c"}))  # type: ignore[arg-type]
    assert done.texts == {"one": "ccc", "two": "c"}
    assert [len(done.applied[key]) for key in ("one", "two")] == [5, 0]
    assert (done.left, done.stable) == ((), True)


def test_fixes_that_undo_each_other_come_to_an_end() -> None:
    done = settle({"one": "a"}, replacing({"a": "b", "b": "a"}))  # type: ignore[arg-type]
    assert not done.stable
    assert done.texts == {"one": "b"}
    assert len(done.left) == 1


def test_fixes_that_grow_for_ever_come_to_an_end() -> None:
    done = settle({"one": "a"}, replacing({"a": "xa"}))  # type: ignore[arg-type]
    assert not done.stable


def test_a_fix_that_breaks_the_syntax_is_dropped() -> None:
    def check(texts: Mapping[str, str]) -> Found:
        text = texts["one"]
        source = SourceFile("one", text)
        wrong: Found = [("one", fix((0, 1, "!"), source=source, code="E0201"))]
        broken: Found = [("one", Diagnostic("E0101", "m", Span(source, 0, 1)))]
        return wrong if text == "a" else broken

    done = settle({"one": "a"}, check)
    assert (done.texts, done.applied, done.stable) == ({"one": "a"}, {"one": ()}, False)


def test_files_that_may_not_change() -> None:
    def check(texts: Mapping[str, str]) -> Found:
        return [(None, fix((0, 1, "X")))]

    done = settle({"one": TEXT}, check)
    assert (done.texts, done.stable, len(done.left)) == ({"one": TEXT}, True, 1)


@pytest.mark.parametrize(("code", "most"), [("E0121", 1 + MAX_CROWDED), ("E0322", 1)])
def test_texts_that_take_long_are_not_checked_on_and_on(code: str, most: int) -> None:
    """More mistakes than are kept, and more steps than may be: what is left stays for the next run."""
    rounds = 0

    def check(texts: Mapping[str, str]) -> list[tuple[str, Diagnostic]]:
        nonlocal rounds
        rounds += 1
        source = SourceFile("a.nsg", texts["one"])
        found = [fix((at, at + 1, "b"), source=source) for at in range(99) if source.text[at] == "a"][:1]
        return [("one", d) for d in (*found, *[Diagnostic(code, "m", None)] * (100 - len(found)))]

    done = settle({"one": "a" * 99}, check)
    assert (rounds, done.stable) == (most, True)
    assert done.texts["one"].count("b") == most - 1
    assert len(done.left) == 100
