"""Habits of other languages: one diagnostic each, at its place, and fixes that mend."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from scenelang.language.diagnostics import Diagnostic, apply_fixes, settle
from tests.language.cases import HERE, mismatch, run_text

CASES = [
    (title, *body.partition("---\n")[::2])
    for title, _, body in (
        case.partition("\n")
        for case in Path(HERE, "habits.nsgs").read_text("utf-8").removeprefix("=== ").split("\n=== ")
    )
]
"""The title of each habit, what is written, and what the fixes make of it: empty where there is none."""


def without_mark(text: str) -> str:
    return "\n".join(line.partition("//!")[0].rstrip() for line in text.split("\n"))


def check(text: str) -> list[Diagnostic]:
    return list(run_text(text).diagnostics)


@pytest.mark.parametrize(("title", "text", "meant"), CASES, ids=[case[0] for case in CASES])
def test_habit(title: str, text: str, meant: str) -> None:
    outcome = run_text(text)
    assert mismatch(text, outcome.diagnostics) == ""
    bare = without_mark(text)
    done = settle({0: bare}, lambda texts: [(0, d) for d in check(texts[0])])
    assert done.texts[0].strip() == (meant or bare).strip()
    assert not any(d.fix for _, d in done.left)


@pytest.mark.parametrize(
    ("text", "code", "meant"),
    [
        ("let a = 7 // 2;\nsquare { scale(a / 7); }", "E0102", None),
        (
            "let a = 7 // of them\nsquare { scale(a / 7); }",
            "E0102",
            "let a = 7; // of them\nsquare { scale(a / 7); }",
        ),
        ("#define K 0.5\nsquare { scale(K); }", "E0133", "let K = 0.5;\nsquare { scale(K); }"),
        ("#declare K = 0.5;\nsquare { scale(K); }", "E0133", "let K = 0.5;\nsquare { scale(K); }"),
    ],
)
def test_habit_in_what_is_taken_for_a_comment(text: str, code: str, meant: str | None) -> None:
    found = run_text(text).only()
    assert found.code == code
    assert (found.fix and apply_fixes(text, [found])[0]) == meant
    assert meant is None or not check(meant)


def test_habits_next_to_each_other_are_told_apart() -> None:
    """One after the other in one text, each is reported where it is."""
    own = [text for _, text, _ in CASES if set(re.findall("[EW][0-9]{4}", text)) == {"E0133"}]
    texts = [text for text in own if not re.search("let |for i|param|uniform|import|define", text)]
    together = "".join(f"group {{\n{text}\n}}\n" for text in texts)
    assert len(texts) > 20
    assert mismatch(together, run_text(together).diagnostics) == ""
