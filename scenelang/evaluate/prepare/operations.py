"""Operators in expressions: arithmetic, comparisons, logic, choice."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any, Final

from scenelang.evaluate.file_context import Unit
from scenelang.evaluate.names import Env, Scope
from scenelang.evaluate.prepare.expressions import POISONED, Code, Run, folded, guarded, prepare
from scenelang.evaluate.values import operators
from scenelang.evaluate.values.value import POISON, unexpected
from scenelang.syntax import nodes

_FAST: Final[dict[str, Callable[[Any, Any], Any]]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "%": operator.mod,
    "^": math.pow,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}


def _meaning(op: str) -> Callable[[Any, Any], Any]:
    if op in operators.ARITHMETIC:
        return lambda a, b: operators.binary(op, a, b)
    if op in operators.COMPARE:
        return lambda a, b: operators.compare(op, a, b)
    if op == "==":
        return operators.equal
    return lambda a, b: not operators.equal(a, b)


def _join(left: Run, right: Run, op: str, slow: Callable[[Any, Any], Any]) -> Run:
    """A closure for one operator, with the common case of two numbers inline."""
    fast = _FAST[op]
    if op in operators.ARITHMETIC:

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

        return arithmetic

    def compare(env: Env) -> Any:
        a, b = left(env), right(env)
        if a.__class__ is float and b.__class__ is float:
            return fast(a, b)
        return slow(a, b)

    return compare


def prepare_binary(expr: nodes.Binary, unit: Unit, scope: Scope) -> Code:
    if expr.op in ("&&", "||"):
        return _logic(expr, unit, scope)
    left, right = prepare(expr.left, unit, scope), prepare(expr.right, unit, scope)
    if expr.op not in _FAST:
        return POISONED  # recovery kept what was written, and reported it
    meaning = _meaning(expr.op)
    slow = guarded(unit, meaning, expr.op_span, (expr.left, expr.right))
    return folded(unit, [left, right], meaning, _join(left.run, right.run, expr.op, slow))


def _truth(value: Any, operand: int = 0) -> bool:
    if value.__class__ is bool:
        return value
    help = "compare it with something, as in n != 0" if value.__class__ is float else None
    raise unexpected("a boolean", value, help, operand)


def condition(expr: nodes.Expr, unit: Unit, scope: Scope) -> Code:
    """A prepared expression that is true, false or poison."""
    code = prepare(expr, unit, scope)
    if code.value is True or code.value is False:
        return code
    get = code.run
    slow = guarded(unit, _truth, expr.span, (expr,))

    def run(env: Env) -> Any:
        value = get(env)
        return value if value is True or value is False else slow(value)

    return Code(run)


def _logic(expr: nodes.Binary, unit: Unit, scope: Scope) -> Code:
    left = condition(expr.left, unit, scope).run
    right = condition(expr.right, unit, scope).run
    decides = expr.op == "||"

    def run(env: Env) -> Any:
        value = left(env)
        return value if value is decides or value is POISON else right(env)

    return Code(run)


def prepare_unary(expr: nodes.Unary, unit: Unit, scope: Scope) -> Code:
    if expr.op == "!":
        truth = condition(expr.operand, unit, scope).run

        def invert(env: Env) -> Any:
            value = truth(env)
            return POISON if value is POISON else not value

        return Code(invert)
    code = prepare(expr.operand, unit, scope)
    meaning = operators.negate if expr.op == "-" else operators.plus
    slow = guarded(unit, meaning, expr.span, (expr.operand,))
    get = code.run
    return folded(unit, [code], meaning, lambda env: slow(get(env)))


def prepare_conditional(expr: nodes.Conditional, unit: Unit, scope: Scope) -> Code:
    test = condition(expr.condition, unit, scope).run
    then = prepare(expr.then, unit, scope).run
    otherwise = prepare(expr.otherwise, unit, scope).run

    def run(env: Env) -> Any:
        value = test(env)
        if value is True:
            return then(env)
        return otherwise(env) if value is False else POISON

    return Code(run)
