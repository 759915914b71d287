"""Limits: a clear error, soon, with bounded memory, and never a traceback."""

from __future__ import annotations

import sys
import threading
from functools import partial

import pytest

from scenelang.language import reporter, session
from scenelang.language import tree as nodes
from scenelang.language.definitions import find_unused
from scenelang.language.diagnostics import MOST, Diagnostics, SourceFile, Span
from scenelang.language.evaluation import Source
from scenelang.language.limits import MAX_DEPTH, MAX_OBJECTS
from scenelang.language.parser import parse
from scenelang.language.reports import render_text
from tests.language.cases import Outcome, run_text, transform
from tests.work import lines_run


def test_objects_at_the_limit() -> None:
    text = "for (i in 0..<{}) {{ square; }}"
    assert len(run_text(text.format(MAX_OBJECTS)).good().nodes) == MAX_OBJECTS
    outcome = run_text(text.format(MAX_OBJECTS + 1))
    assert outcome.codes == ["E0320"]
    assert outcome.only().message == "more than 100,000 objects in one scene"


def test_calls_at_the_limit() -> None:
    for text in (
        "fn f(n) = n <= 1 ? 1 : 1 + f(n - 1); square {{ translate(f({}), 0); }}",
        "module m(n) {{ group {{ square; if (n > 1) {{ m(n - 1) {{ scale(2); }} }} }} }} m({});",
    ):
        run_text(text.format(MAX_DEPTH)).good()
        assert run_text(text.format(MAX_DEPTH + 1)).codes == ["E0321"]


def test_a_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "MAX_STEPS", 100_000)
    monkeypatch.setattr(session, "MAX_PARTS", 1_000)
    wrong = []
    for text, code in (
        ("for (i in 0..1e300) {}", "E0322"),
        ("for (i in 0..1e9) { for (j in 0..1e9) {} }", "E0322"),
        ("fn f(n) = n < 1 ? 1 : f(n - 1) + f(n - 1); square { translate(f(60), 0); }", "E0322"),
        ("for (i in 0..1e9) { group {} }", "E0320"),
        ("square { for (i in 0..1e9) { translate(i, i); } }", "E0320"),
        ("square { for (i in 0..1e9) { translate(1, 1); } }", "E0320"),
        ("square { material flat { for (i in 0..1e9) { hue(1rad); } } }", "E0320"),
        ("fn wrap(v, n) = n < 1 ? v : wrap([v], n - 1); let a = wrap(1, 100);", "E0323"),
        ("fn twice(v, n) = n < 1 ? v : twice([v, v, v, v], n - 1); let a = twice(1, 10);", "E0323"),
        ("let a = 9 ^ 9 ^ 9 ^ 9;", "E0306"),
        ("let a = 0..1e308 step 1e-308; for (i in a) {}", "E0306"),
        ("animate(1e9, 1e9);", "E0311"),
        (f'import "std/letters" as abc; abc.text("{"A" * 10_001}");', "E0370"),
    ):
        codes = run_text(text).codes
        wrong += [(text, codes)] if codes != [code] else []
    assert wrong == []


def test_the_step_limit_is_one_of_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step is at most twenty lines of Python, whatever is done, so that the limit is met in seconds."""
    monkeypatch.setattr(session, "MAX_STEPS", 10_000)
    for text in (
        "for (i in 0..1e9) { for (j in 0..1e9) {} }",
        "for (i in 0..1e9) { let x = i" + " + i" * 100 + "; }",
        "for (i in 0..1e9) { let x = i * 1deg" + " + 1deg" * 20 + "; }",
        "for (i in 0..1e9) { let x = mix(i, 1, 1) + max(i, 1, 2, 3, 4, 5, 6, 7, 8, 9); }",
        "for (i in 0..1e9) { let x = [i" + ", i" * 20 + "]; }",
        "for (i in 0..1e9) { let x = material flat { hue(1rad * i); }; }",
        "for (i in 0..1e9) { let x = 1 / (i - i); }",
        "for (i in 0..1e9) { if (i == 2) {} else { } }",
        "for (i in 0..1e9) { group {} }",
        "for (i in 0..1e9) { chain { square; smooth star; } }",
        "square { for (i in 0..1e9) { translate(i, i); } }",
        "fn f(n) = n < 1 ? 1 : f(n - 1) + f(n - 1); let a = f(60);",
        "module m(n) { group { if (n > 0) { m(n - 1); m(n - 1); } } } m(60);",
        "let v = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]; for (i in 0..1e9) { let x = mix(v, v, i) + v; }",
    ):
        assert "E0322" in run_text(text).codes, text
        assert lines_run(partial(run_text, text)) < 20 * 10_000, text
    # a vector's length is no cost of taking one number out of it, and a range has none
    table = ", ".join(str(n) for n in range(1000))
    run_text(f"let v = [{table}]; for (i in 0..<300) {{ let x = v[i] + len(v); }} star;").good()
    run_text("let r = 0..1e15; square { translate(r[3], len(r)); }").good()


def test_a_hundred_thousand_objects_stay_within_the_steps() -> None:
    text = """for (i in 0..<{}) {{ square {{ scale(0.01); rotate(1deg * i); translate(rand(i), rand(i + 1));
        material flat {{ color(#d33); }} }} }}"""
    few = Diagnostics()
    evaluation = Source(text=SourceFile("a.nsg", text.format(1000))).evaluation(few)
    evaluation.run(0)
    assert 100 * evaluation._session.steps < session.MAX_STEPS


def test_the_recursion_limit_is_put_back() -> None:
    before = sys.getrecursionlimit()
    run_text("fn f(n) = f(n + 1); let a = f(0);")
    assert sys.getrecursionlimit() == before


def test_deep_calls_in_a_thread_with_a_small_stack() -> None:
    """Python frames need no C stack, so 200 calls of 100 levels each fit into 512 KB."""
    deep = "(" * 90 + "f(n - 1)" + " + 1)" * 90
    text = f"fn f(n) = n < 1 ? 0 : {deep}; square {{ translate(f(199), 0); }}"
    results: list[Outcome] = []
    old = threading.stack_size(512 * 1024)
    try:
        thread = threading.Thread(target=lambda: results.append(run_text(text)))
        thread.start()
        thread.join()
    finally:
        threading.stack_size(old)
    assert transform(results[0].good()).x == 199 * 90


def test_work_grows_linearly() -> None:
    text = """for (i in 0..<{}) {{
      square {{ scale(0.01 + 0.001 * rand(i)); rotate(1turn * i / 7); translate(rand(i + 1), rand(i + 2));
        material flat {{ color(hsv(i / 100, 0.5, 0.9)); }} }}
    }}"""

    def lines(n: int) -> int:
        return lines_run(lambda: run_text(text.format(n)).good())

    lines(1)
    assert lines(1000) < 11 * lines(100)


def test_trees_made_by_hand_can_be_too_deep() -> None:
    """Text is cut off by the parser; a tree from elsewhere meets a limit of its own."""
    source = SourceFile("made.nsg", "")
    span = Span(source, 0, 0)
    expr: nodes.Expr = nodes.NumberLiteral(span, 1.0, "")
    for _ in range(5000):
        expr = nodes.Unary(span, "-", expr)
    file = nodes.File(span, (nodes.Let(span, nodes.Name(span, "a"), expr),))
    found = Diagnostics()
    assert Source(tree=file).scene(found)[0] is None
    assert [d.code for d in found] == ["E0324"]


UNITS = (
    "let a¤ = b¤;\n",  # as many unknown names as known ones
    "squar; ",
    "let a¤ = lib.x¤; ",
    "f(b¤ = 1); ",
    "square { translate(f, 0); } ",
    "fn f( ",
    "\\q",
    "(1 2 3); ",
    "for (i in 0..0) ",
)


def test_mistakes_cost_the_same_however_many_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice the text takes at most twice the work, and less where the limit on reports is met."""
    monkeypatch.setattr(reporter, "MAX_COMPARED", 5_000)

    def check(unit: str, count: int) -> None:
        text = "module f(a) {} " + "".join(unit.replace("¤", str(n)) for n in range(count))
        found = run_text(text).diagnostics
        assert found
        render_text(found)

    for unit in UNITS:
        check(unit, 2)
        count = 2000 // len(unit)
        less, more = (lines_run(partial(check, unit, n)) for n in (count, 2 * count))
        assert more < 2.5 * less, unit


def test_a_thousand_mistakes_are_enough() -> None:
    for text, code, last in (
        ("let a¤ = b¤; ", "E0201", "E0121"),
        ("param a¤ = 1; square { rotate(30deg); }", "W0201", "W0102"),
    ):
        source = SourceFile("long.nsg", "".join(text.replace("¤", str(n)) for n in range(1500)))
        found = Diagnostics()
        tree = parse(source, found)
        Source(tree=tree).scene(found)
        find_unused(tree, found) if code == "W0201" else None
        codes = [d.code for d in found]
        assert codes.count(code) == MOST
        assert codes.count(last) == 1
