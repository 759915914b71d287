"""Expressions in a page have the values that the evaluator gives them, or are refused as it does."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest

from scenelang.compiler.manifest import load_manifest
from scenelang.language import tree as nodes
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source
from scenelang.language.parser import parse
from scenelang.language.values import POISON, Angle, RangeValue, Time, Vec
from scenelang.language.words import FUNCTIONS
from scenelang.web.form import Scope, Writer

pytestmark = pytest.mark.browser
MODEL = load_manifest("shapes2d")
TABLE = Path(__file__).parents[1] / "language" / "expressions.nsgs"
LITERALS = """0 1 2 3 0.5 -1 -2.5 7 1e-3 10 0.1 -0 1e200 255 30deg -45deg 0.5rad 0.25turn 0deg 2s 40ms -1s 0s
    [1,2] [0,1,0.5] X #d33 #7a5c3e [] [1,[2,3]] [10deg,20deg] [-1,0.5] true false "a" "day" "ä😀" none PI TAU
    t u frame frames (0..3) (0..<4step(0.5)) (0deg..90deg/**/step/**/30deg) (5..1)
    (5..1/**/step-2) (0s..2s)"""
RUN = """(expressions) => {
  const told = (value) => {
    if (value instanceof Vec) return value.items.map(told);
    if (value instanceof Angle) return { angle: value.size };
    if (value instanceof Time) return { time: value.size };
    if (!(value instanceof Progression)) return value;
    return { range: [value.start, value.stop, value.exclusive, value.unit] };
  };
  return expressions.map((expression) => {
    const run = new SceneRun({ body: [], slots: 0, calls: [] });
    Object.assign(run, { work: 0, animated: [0, 0, 0, 1] });
    try {
      return { value: told(prepared(expression, run)()) };
    } catch (error) {
      if (error instanceof NotLive) return { refused: error.message };
      throw error;
    }
  });
}"""


def evaluated(text: str) -> tuple[Any, Any] | None:
    """The value and the form of an expression; None where it does not parse."""
    found = Diagnostics()
    tree = parse(SourceFile("", f"let v = {text};"), found)
    if found.errors:
        return None
    evaluation = Source(tree=tree).evaluation(found)
    evaluation.run(0)
    context, stmt = evaluation.context, tree.statements[0]
    assert isinstance(stmt, nodes.Let)
    form = Writer(context, MODEL, ()).expression(stmt.value, Scope())
    return context.env[context.scope.names["v"].slot], form


def told(value: Any) -> Any:
    """A value as the page tells it."""
    if isinstance(value, Vec):
        return [told(item) for item in value.items]
    if isinstance(value, RangeValue):
        unit = ("number", "angle", "time").index(value.unit)
        return {"range": [value.start, value.stop, value.exclusive, unit]}
    if isinstance(value, Angle | Time):
        return {type(value).__name__.lower(): value.size}
    return value


def alike(one: Any, other: Any) -> bool:
    """Equal, or for numbers nearly: mathematical functions may differ in their last digit."""
    if isinstance(one, dict | list):
        items = list(one.items()) if isinstance(one, dict) else one
        others = list(other.items()) if isinstance(other, dict) else other
        return len(items) == len(others) and all(map(alike, items, others))
    if isinstance(one, tuple):
        return one[0] == other[0] and alike(one[1], other[1])
    if isinstance(one, float) and not isinstance(other, bool):
        return bool(one == pytest.approx(other, rel=1e-13, abs=0))
    return type(one) is type(other) and bool(one == other)


def written(pick: random.Random, depth: int) -> str:
    """A random expression; most of the deep ones are mistakes."""
    if depth == 0 or pick.random() < 0.15:
        return pick.choice(LITERALS.split())
    a, b, c = (written(pick, depth - 1) for _ in range(3))
    order, sign = pick.choice(["<", "<=", ">", ">=", "==", "!="]), pick.choice(["-", "+", "!"])
    word = pick.choice([*FUNCTIONS.values()])
    count = pick.randint(1, 3) if word.variadic else word.required
    ways = [
        *[f"({a} {op} {b})" for op in pick.sample(["+", "-", "*", "/", "%", "^"], 3)],
        *(f"-{a} ^ {b}", f"({sign}{a})", f"({a} {order} {b} ? {c} : {a})", f"({a} {order} {b} && {c})"),
        *(f"[{a}, {b}]", f"[{a}]", f"({a})[{b}]", f"({a}).{pick.choice('xyzrgb')}"),
        *[f"{word.name}({', '.join([a, b, c][:count])})"] * 5,
    ]
    return pick.choice(ways)


def test_random_expressions(viewer_page: Any) -> None:
    pick = random.Random(1)
    texts = [written(pick, pick.randint(1, 3)) for _ in range(2500)]
    texts += [f"rand({pick.choice([n, n / 7, -n, [n, n + 1]])})" for n in range(200)]
    made = [(text, *pair) for text in texts if (pair := evaluated(text)) is not None]
    shown = viewer_page.evaluate(RUN, [form for _, _, form in made])
    for (text, value, _), answer in zip(made, shown, strict=True):
        assert ("refused" in answer) == (value is POISON), (text, answer)
        assert value is POISON or alike(told(value), answer["value"]), (text, value, answer)
    good = sum(value is not POISON for _, value, _ in made)
    assert 600 < good < len(made) - 600


def test_expressions_worked_out_by_hand(viewer_page: Any) -> None:
    lines = [line for line in TABLE.read_text().splitlines() if " = " in line and not line.startswith("#")]
    pairs = [line.rsplit(" = ", 1) for line in lines]
    forms = [pair[1] for text, _ in pairs if (pair := evaluated(text)) is not None]
    assert len(forms) == len(pairs) > 100
    for line, answer in zip(lines, viewer_page.evaluate(RUN, forms), strict=True):
        number = float(line.rsplit(" = ", 1)[1])
        assert answer.get("value") == pytest.approx(number, rel=1e-12, abs=1e-12), (line, answer)
