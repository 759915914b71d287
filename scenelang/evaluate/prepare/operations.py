"""Operators in expressions: arithmetic, comparisons, logic, choice."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from scenelang.evaluate.file_context import Place
from scenelang.evaluate.names import Env
from scenelang.evaluate.prepare.expressions import POISONED, Code, computed, folded, guarded, prepare
from scenelang.evaluate.values import operators
from scenelang.evaluate.values.value import POISON, unexpected
from scenelang.syntax import nodes

_FAST: Final[dict[str, Callable[[Any, Any], Any]]] = {
    **operators.ARITHMETIC,
    **operators.COMPARE,
    "/": operator.truediv,
    "%": operator.mod,
    "^": math.pow,
    "==": operator.eq,
    "!=": operator.ne,
}
"""What operators mean on two numbers, unless that is an error or not finite."""
_MEANINGS: Final[dict[str, Callable[[Any, Any], Any]]] = {
    **{op: partial(operators.binary, op) for op in operators.ARITHMETIC},
    **{op: partial(operators.compare, op) for op in operators.COMPARE},
    "==": operators.equal,
    "!=": lambda a, b: not operators.equal(a, b),
}


def prepare_binary(expr: nodes.Binary, place: Place) -> Code:
    op = expr.op
    if op in ("&&", "||"):
        return _logic(expr, place)
    codes = [prepare(expr.left, place), prepare(expr.right, place)]
    if op not in _FAST:
        return POISONED  # recovery kept what was written, and reported it
    fast, meaning = _FAST[op], _MEANINGS[op]
    slow = guarded(place, meaning, expr.op_span, (expr.left, expr.right))
    left, right = codes[0].run, codes[1].run

    def arithmetic(env: Env) -> Any:
        a, b = left(env), right(env)
        if a.__class__ is float and b.__class__ is float:
            try:
                result = fast(a, b)
                if result - result == 0.0:
                    return result
            except (ArithmeticError, ValueError):
                pass
        return slow(a, b)

    def compare(env: Env) -> Any:
        a, b = left(env), right(env)
        return fast(a, b) if a.__class__ is float and b.__class__ is float else slow(a, b)

    return folded(codes, meaning, arithmetic if op in operators.ARITHMETIC else compare)


def _truth(value: Any, operand: int = 0) -> bool:
    if value.__class__ is bool:
        return value
    help = "compare it with something, as in n != 0" if value.__class__ is float else None
    raise unexpected("a boolean", value, help, operand)


def condition(expr: nodes.Expr, place: Place) -> Code:
    """A prepared expression that is true, false or poison."""
    code = prepare(expr, place)
    if code.value is True or code.value is False:
        return code
    get = code.run
    slow = guarded(place, _truth, expr.span, (expr,))

    def run(env: Env) -> Any:
        value = get(env)
        return value if value is True or value is False else slow(value)

    return Code(run)


def _logic(expr: nodes.Binary, place: Place) -> Code:
    left, right = condition(expr.left, place).run, condition(expr.right, place).run
    decides = expr.op == "||"

    def run(env: Env) -> Any:
        value = left(env)
        return value if value is decides or value is POISON else right(env)

    return Code(run)


def prepare_unary(expr: nodes.Unary, place: Place) -> Code:
    if expr.op != "!":
        meaning = operators.negate if expr.op == "-" else operators.plus
        return computed(place, meaning, expr.span, (expr.operand,))
    truth = condition(expr.operand, place).run

    def invert(env: Env) -> Any:
        value = truth(env)
        return POISON if value is POISON else not value

    return Code(invert)


def prepare_conditional(expr: nodes.Conditional, place: Place) -> Code:
    test = condition(expr.condition, place).run
    then, otherwise = prepare(expr.then, place).run, prepare(expr.otherwise, place).run

    def run(env: Env) -> Any:
        value = test(env)
        if value is True:
            return then(env)
        return otherwise(env) if value is False else POISON

    return Code(run)
