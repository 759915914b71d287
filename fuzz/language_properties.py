"""Properties of texts that are drawn from the language: sentences, expressions, ranges, strings."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from typing import Any, Final

from hypothesis import assume
from hypothesis import strategies as st

from fuzz.drawn import drawn
from fuzz.target import Failure, hold, load_target
from fuzz.targets.parse import BEYOND
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import loads
from scenelang.language.parser import parse
from scenelang.language.reports import SceneError

# ---------------------------------------------------------------- sentences of the grammar

_TOKENS: Final = {
    "NAME": ("a", "lib", "star", "scale", "x", "color", "f"),
    "NUMBER": ("0", "1", ".5", "2.", "1e-3", "30deg", "0.25turn", "2s", "40ms", "1.5rad"),
    "STRING": ('""', '"s"', '"a\\"b\\\\\\n"', '"π // no comment"'),
    "COLOR": ("#d33", "#dd3333"),
}
_SPACES: Final = (" ", " ", " ", "\n", "\t", "\r\n", " // to the end\n", " /* in * between */ ", "\n\n\n")


@cache
def _rules() -> dict[str, list[list[str]]]:
    """The grammar as Lark reads it: expansions of each rule; terminals are ``'let`` and ``'<NAME>``."""
    from lark import Lark
    from lark.lexer import PatternStr

    from scenelang.language.tables import grammar_path

    lark = Lark(
        grammar_path().read_text(encoding="utf-8"), parser="lalr", lexer="basic", maybe_placeholders=False
    )
    words = {t.name: t.pattern.value for t in lark.terminals if isinstance(t.pattern, PatternStr)}
    found: dict[str, list[list[str]]] = {}
    for rule in lark.rules:
        expansion = [
            f"'{words.get(s.name, f'<{s.name}>')}" if s.is_term else str(s.name) for s in rule.expansion
        ]
        if not any(symbol.startswith("'<BAD_") for symbol in expansion):
            found.setdefault(str(rule.origin.name), []).append(expansion)
    return {
        name: [e for e in expansions if all(symbol[0] == "'" or symbol in found for symbol in e)]
        for name, expansions in found.items()
    }


@st.composite
def sentences(draw: st.DrawFn) -> str:
    """A text of the language by its grammar alone, whatever it means."""
    rules = _rules()
    shortest = _shortest()
    budget = draw(st.integers(0, 60))
    todo, words = ["start"], []
    while todo:
        symbol = todo.pop()
        if symbol[0] != "'":
            budget -= 1
            choices = rules[symbol] if budget > 0 else [shortest[symbol]]
            todo.extend(reversed(draw(st.sampled_from(choices))))
        elif symbol[1:-1].startswith("<") and symbol[2:-1] in _TOKENS:
            words.append(draw(st.sampled_from(_TOKENS[symbol[2:-1]])))
        else:
            words.append(symbol[1:])
    between = [draw(st.sampled_from(_SPACES)) for _ in words] if len(words) < 200 else [" "] * len(words)
    return "".join(word + space for word, space in zip(words, between, strict=True))


@cache
def _shortest() -> dict[str, list[str]]:
    """The expansion of each rule that ends soonest."""
    rules = _rules()
    size: dict[str, int] = {}
    best: dict[str, list[str]] = {}
    changed = True
    while changed:
        changed = False
        for name, expansions in rules.items():
            for expansion in expansions:
                if all(symbol[0] == "'" or symbol in size for symbol in expansion):
                    total = 1 + sum(size.get(symbol, 1) for symbol in expansion)
                    if total < size.get(name, total + 1):
                        size[name], best[name], changed = total, expansion, True
    return best


@drawn(sentences())
def sentences_are_read_and_formatted(text: str) -> None:
    """A sentence of the grammar has no syntax mistake and keeps its tree when formatted."""
    source, found = SourceFile("s.nsg", text), Diagnostics()
    parse(source, found)
    assume(not {d.code for d in found} & {"E0120", *BEYOND})
    hold(not len(found), "sentences of the grammar have no mistake", (text, list(found)[:2]))
    load_target("formatting").check(text.encode())


# ---------------------------------------------------------------- expressions against Python's numbers

_NUMBERS: Final = st.one_of(
    st.sampled_from([0.0, 1.0, 2.0, 0.5, 3.0, 1e-3, 7.25, 1e308, 5e-324, 1e16, 0.1]),
    st.floats(0, 1e6, allow_nan=False),
)
_LEVEL: Final = {"+": 1, "-": 1, "*": 2, "/": 2, "%": 2, "neg": 3, "^": 4}
Expression = Any  # a float, ("neg", e), (op, e, e), ("call", name, [e]), ("if", relation, e, e, e, e)


def _expressions() -> st.SearchStrategy[Expression]:
    return st.recursive(
        _NUMBERS,
        lambda inner: st.one_of(
            st.tuples(st.sampled_from(["+", "-", "*", "/", "%", "^"]), inner, inner),
            st.tuples(st.just("neg"), inner),
            st.tuples(st.just("call"), st.sampled_from(["abs", "floor", "ceil", "sqrt"]), st.tuples(inner)),
            st.tuples(st.just("call"), st.sampled_from(["min", "max"]), st.tuples(inner, inner)),
            st.tuples(
                st.just("if"), st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), inner, inner, inner, inner
            ),
        ),
        max_leaves=12,
    )


_FUNCTIONS: Final[dict[str, Callable[..., float]]] = {
    "abs": abs,
    "min": min,
    "max": max,
    "sqrt": math.sqrt,
    "floor": math.floor,
    "ceil": math.ceil,
}
_OPERATORS: Final[dict[str, Callable[..., float]]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "%": operator.mod,
    "^": math.pow,
    "neg": operator.neg,
}


class NoNumber(Exception):
    """The expression has no finite value."""


def value_of(expression: Expression) -> float:
    """The value by Python's own arithmetic; raises NoNumber."""
    if isinstance(expression, float):
        return expression
    kind, *parts = expression
    if kind == "if":
        relations = {
            "<": operator.lt,
            "<=": operator.le,
            ">": operator.gt,
            ">=": operator.ge,
            "==": operator.eq,
        }
        left, right = value_of(parts[1]), value_of(parts[2])
        truth = left != right if parts[0] == "!=" else relations[parts[0]](left, right)
        return value_of(parts[3] if truth else parts[4])
    if kind == "call":
        values = [value_of(part) for part in parts[1]]
        run = _FUNCTIONS[parts[0]]
    else:
        values = [value_of(part) for part in parts]
        run = _OPERATORS[kind]
    try:
        result = run(*values)
    except (ArithmeticError, ValueError):
        raise NoNumber from None
    if not math.isfinite(result):
        raise NoNumber
    return float(result)


def text_of(expression: Expression, leaf: Callable[[float], str], level: int = 0) -> str:
    """The expression with no more parentheses than precedence asks for."""
    if isinstance(expression, float):
        return leaf(expression)
    kind, *parts = expression
    if kind == "call":
        return f"{parts[0]}({', '.join(text_of(part, leaf) for part in parts[1])})"
    if kind == "if":
        relation, *inner = parts
        a, b = (text_of(part, leaf, 1) for part in inner[:2])
        text = f"{a} {relation} {b} ? {text_of(inner[2], leaf, 1)} : {text_of(inner[3], leaf)}"
        return f"({text})" if level else text
    own = _LEVEL[kind]
    if kind == "neg":
        text = "-" + text_of(parts[0], leaf, own)
    elif kind == "^":  # binds to the right, and a sign may follow it
        text = f"{text_of(parts[0], leaf, own + 1)} ^ {text_of(parts[1], leaf, 3)}"
    else:
        text = f"{text_of(parts[0], leaf, own)} {kind} {text_of(parts[1], leaf, own + 1)}"
    return f"({text})" if own < level else text


@drawn(_expressions(), st.booleans())
def expressions_have_the_values_that_python_gives(expression: Expression, known: bool) -> None:
    """Bit for bit, whether the evaluator knows the numbers beforehand or meets them as params."""
    head: list[str] = []

    def leaf(number: float) -> str:
        if known:
            return repr(number)
        head.append(f"param p{len(head)} = {number!r};")
        return f"p{len(head) - 1}"

    body = text_of(expression, leaf)
    text = f"{' '.join(head)} square {{ translate({body}, 0); }}"
    try:
        expected = value_of(expression)
    except NoNumber:
        expected = None
    try:
        got = loads(text).nodes[0].transforms[0].x  # type: ignore[union-attr]
    except SceneError as error:
        codes = {d.code for d in error.diagnostics}
        # Branches that are not taken may be folded, and are then reported: that is no wrong value.
        hold(codes <= {"E0304", "E0305", "E0306"}, "expressions of numbers fail as such", (text, codes))
        hold(expected is None or known, "a finite value is one", (text, expected, codes))
        return
    if expected is None:
        raise Failure("no finite value is an error", (text, got))
    alike = got == expected and math.copysign(1, got) == math.copysign(1, expected)
    hold(alike, "values are Python's", (text, got, expected))


@drawn(st.integers(-50, 50), st.integers(-50, 50), st.integers(1, 40), st.booleans(), st.booleans())
def ranges_hold_what_fractions_count(start: int, stop: int, step: int, down: bool, open_: bool) -> None:
    """``a..b step c`` in tenths has as many values as in exact arithmetic."""
    size = Fraction(-step if down else step, 10)
    a, b = Fraction(start, 10), Fraction(stop, 10)
    steps = (b - a) / size
    count = max(0, math.ceil(steps) if open_ else math.floor(steps) + 1)
    dots = "..<" if open_ else ".."
    text = (
        f"for (i in {float(a)!r}{dots}{float(b)!r} step {float(size)!r}) {{ square {{ translate(i, 0); }} }}"
    )
    nodes = loads(text).nodes
    hold(len(nodes) == count, "ranges have the right number of values", (text, len(nodes), count))
    for index, node in enumerate(nodes):
        x = node.transforms[0].x  # type: ignore[union-attr]
        hold(abs(x - float(a + index * size)) < 1e-9, "ranges step evenly", (text, index, x))


@drawn(st.text(max_size=30))
def strings_are_what_their_literals_say(value: str) -> None:
    """Any text that UTF-8 has, written with the language's escapes, equals itself from outside."""
    assume(value.isascii() or value.encode("utf-8", "replace").decode() == value)
    named = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\t": "\\t"}
    literal = "".join(named.get(char, char) for char in value)
    text = f'param s = "x"; if (s == "{literal}") {{ star {{ }} }} else {{ square {{ }} }}'
    scene = loads(text, s=value)
    hold([node.geometry for node in scene.nodes] == ["star"], "strings are as written", value)  # type: ignore[union-attr]
