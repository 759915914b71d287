"""Mistakes: each is reported once, with its code, at its place."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from scenelang.language.pages import CODES
from tests.language.cases import HERE, Outcome, mismatch, run_text
from tests.language.reading import apply

CASES = [case.partition("\n")[::2] for case in (HERE / "errors.nsgs").read_text("utf-8").split("=== ")[1:]]
MALFORMED = sorted((HERE / "mistaken").glob("*.nsg"))


@cache
def outcome_of(text: str) -> Outcome:
    """What running a case finds; two tests look at it."""
    return run_text(text)


@pytest.mark.parametrize(("title", "text"), CASES, ids=[title for title, _ in CASES])
def test_one_mistake(title: str, text: str) -> None:
    outcome = outcome_of(text)
    assert mismatch(text, outcome.diagnostics) == ""
    assert (outcome.scene is None) == bool(outcome.diagnostics.errors)


@pytest.mark.parametrize("path", MALFORMED, ids=lambda p: p.stem)
def test_many_mistakes(path: Path) -> None:
    text = path.read_text("utf-8")
    assert len([line for line in text.splitlines() if "//!" in line]) >= 3
    assert mismatch(text, run_text(text).diagnostics) == ""


def test_ten_malformed_scenes() -> None:
    assert len(MALFORMED) >= 10


def test_messages_keep_the_house_style() -> None:
    for title, text in CASES:
        for d in outcome_of(text).diagnostics:
            assert d.code in CODES, title
            assert not d.message.endswith("."), d.message
            assert d.message[0] == d.message[0].lower(), d.message
            assert d.help is None or not d.help.endswith("."), d.help


def apply_fix(text: str) -> str:
    """The text with the fix of its only diagnostic applied."""
    fix = run_text(text).only().fix
    assert fix is not None
    return apply(text, fix)


def test_labels_show_both_places() -> None:
    label = run_text("let a = 1;\nlet a = 2;").only().labels[0]
    assert (label.span.locate()[0], label.message) == ((1, 5), "first defined here")
    label = run_text("square { material flat; material flat; }").only().labels[0]
    assert label.span.text == "material flat"
    inside = run_text("module m(a) { square { scale(1 / a); } }\nm(0);").only()
    assert [x.span.locate()[0] for x in inside.labels] == [(2, 1)]


@pytest.mark.parametrize(
    ("text", "labels"),
    [
        ('square { translate("a" + 1, 0); }', [("1", "a number")]),
        ('square { translate(1 - "a", 0); }', [("1", "a number")]),
        ("square { translate([1, 2] + [1, 2, 3]); }", [("[1, 2]", "2 items"), ("[1, 2, 3]", "3 items")]),
        ("square { rotate(45deg + 1); }", [("45deg", "an angle")]),
        ("if (1 == true) { square {} }", [("1", "a number")]),
        ('if ("a" < 1) { square {} }', [("1", "a number")]),
        (
            "module m(a, b, c = 1) { square { scale(a * b * c); } } m(c = 2);",
            [("a", "needs a value"), ("b", "needs a value")],
        ),
    ],
)
def test_labels_show_what_else_takes_part(text: str, labels: list[tuple[str, str]]) -> None:
    found = run_text(text).only()
    assert [(label.span.text, label.message) for label in found.labels] == labels


def test_a_late_version_moves_to_the_top() -> None:
    assert apply_fix("// a scene\nsquare {}\nnsg 1;\nstar {}\n") == "// a scene\nnsg 1;\nsquare {}\nstar {}\n"
