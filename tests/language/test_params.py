"""Params and the values that come from outside."""

from __future__ import annotations

from typing import Any

import pytest

from tests.language.cases import Outcome, run_text, transform


def given(declaration: str, use: str, **defines: Any) -> Outcome:
    return run_text(f"param p = {declaration}; square {{ translate({use}); }}", params=defines)


@pytest.mark.parametrize(
    ("declaration", "use", "text", "x"),
    [
        ("1", "p, 0", "2.5", 2.5),
        ("1", "p, 0", "-2", -2),
        ("1 in 0..3", "p, 0", "3", 3),
        ("1 in 0..3", "p, 0", " 2 ", 2),
        ("30deg", "p / 1deg, 0", "60deg", 60),
        ("30deg in 0deg..90deg", "p / 1deg, 0", "0.25turn", 90),
        ("30deg", "p / 1deg, 0", "0", 0),
        ("1s", "p / 1s, 0", "1500ms", 1.5),
        ("1s in 0s..2s", "p / 1s, 0", "2", 2),
        ("true", "p ? 1 : 0, 0", "false", 0),
        ("#d33", "p.r, 0", "#0f0", 0),
        ("#d33", "p.g, 0", "[0, 1, 0]", 1),
        ("#d33", "p.b, 0", "rgb(0, 0, 1)", 1),
        ("[1, 2]", "p", "[3, 4]", 3),
        ('"day"', 'p == "night" ? 1 : 0, 0', "night", 1),
        ('"day" in ["day", "night"]', 'p == "night" ? 1 : 0, 0', "night", 1),
        ("2 in 1..7 step 2 ", "p, 0", "5", 5),
    ],
)
def test_text_from_outside(declaration: str, use: str, text: str, x: float) -> None:
    if "step" in declaration:
        declaration = declaration.replace("2 in", "3 in", 1)
    outcome = given(declaration, use, p=text)
    assert transform(outcome.good()).x == pytest.approx(x)


@pytest.mark.parametrize(
    ("declaration", "value", "code"),
    [
        ("1 in 0..1", "2", "E0309"),
        ("1 in 0..<2", "2", "E0309"),
        ("1 in 1..7 step 2", "2", "E0309"),
        ("1", "1 + 1", "E0310"),
        ("1", "k", "E0310"),
        ("1", "PI", "E0310"),
        ("1", "", "E0310"),
        ("1", "1; square {}", "E0310"),
        ("1", "2 ^ 9", "E0310"),
        ("1", "30deg", "E0310"),
        ("1", "true", "E0310"),
        ("1", "nan", "E0310"),
        ("1", "1e999", "E0310"),
        ("1", "[1]", "E0310"),
        ("30deg", "30", "E0310"),
        ("30deg in 0deg..45deg", "90deg", "E0309"),
        ("#d33 in 0..1", "[0, 2, 0]", "E0309"),
        ('"a" in ["a", "b"]', "c", "E0309"),
        ("true", "1", "E0310"),
        ("1", float("nan"), "E0310"),
        ("1", 10**400, "E0310"),
        ("1", object(), "E0310"),
        ("1", None, "E0310"),
    ],
)
def test_what_does_not_fit(declaration: str, value: Any, code: str) -> None:
    outcome = run_text(f"param p = {declaration};", params={"p": value})
    assert outcome.codes == [code]
    assert outcome.only().span is not None
    assert outcome.only().span.text == "p"  # type: ignore[union-attr]


def test_python_values() -> None:
    assert transform(given("1", "p, 0", p=2).good()).x == 2
    assert transform(given("[1, 2]", "p", p=(3, 4.5)).good()).y == 4.5
    assert transform(given("true", "p ? 1 : 2, 0", p=False).good()).x == 2
    assert transform(given("30deg", "p / 1deg, 0", p="45deg").good()).x == pytest.approx(45)


def test_unused_values_are_errors() -> None:
    outcome = run_text("param size = 1; square { scale(size); }", params={"sise": "2"})
    assert outcome.codes == ["E0211"]
    assert outcome.only().help == "did you mean `size`?"
    assert run_text("square {}", params={"k": "2"}).codes == ["E0211"]


def test_a_range_may_be_computed() -> None:
    text = "let top = 2; param p = top / 2 in 0..top * 2; square { translate(p, 0); }"
    assert transform(run_text(text, params={"p": "4"}).good()).x == 4
    assert run_text(text, params={"p": "4.5"}).codes == ["E0309"]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("param p = none;", "E0301"),
        ("param p = 0..1;", "E0301"),
        ("param p = material flat;", "E0301"),
        ("param p = 1 in 2;", "E0301"),
        ('param p = "a" in 0..1;', "E0301"),
        ("param p = 1 in 0deg..90deg;", "E0302"),
        ("param p = 2 in 1..0;", "E0309"),
    ],
)
def test_declarations_that_are_wrong(text: str, code: str) -> None:
    assert run_text(text).codes == [code]


def test_a_colour_by_its_name_is_told_its_number() -> None:
    outcome = run_text("param main = #d33;", params={"main": "red"})
    assert outcome.only().help == "colours have no names; red is #f00"
