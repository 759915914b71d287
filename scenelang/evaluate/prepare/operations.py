"""Literals, operators, vectors and ranges, and the parts of vectors."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from scenelang.diagnostics.suggest import did_you_mean
from scenelang.evaluate.file_context import Place
from scenelang.evaluate.names import Env
from scenelang.evaluate.prepare.expressions import (
    POISONED,
    Code,
    computed,
    constant,
    folded,
    guarded,
    prepare,
)
from scenelang.evaluate.values import operators
from scenelang.evaluate.values.functions import number
from scenelang.evaluate.values.value import (
    COMPONENTS,
    POISON,
    UNITS,
    Angle,
    Problem,
    RangeValue,
    Time,
    Vec,
    describe,
    unexpected,
    unpack,
)
from scenelang.syntax import nodes

_LITERALS: Final[dict[str, Callable[[float], Any]]] = {
    "deg": lambda value: Angle(math.radians(value)),
    "rad": Angle,
    "turn": lambda value: Angle(value * math.tau),
    "s": Time,
    "ms": lambda value: Time(value / 1000.0),
}


def prepare_number(expr: nodes.Number, place: Place) -> Code:
    value = float(expr.value)
    if not math.isfinite(value * math.tau if expr.unit == "turn" else value):
        place.report.error("E0306", "the number is too large", expr.span)
        return POISONED
    return constant(_LITERALS[expr.unit](value) if expr.unit else value)


def prepare_literal(expr: nodes.String | nodes.Bool, place: Place) -> Code:
    return constant(expr.value)


def prepare_color(expr: nodes.Color, place: Place) -> Code:
    return constant(Vec(tuple([float(c) for c in expr.rgb])))


def skip_bad(expr: nodes.BadExpr, place: Place) -> Code:
    return POISONED


def _vector(*items: Any) -> Vec:
    for index, item in enumerate(items):
        if item.__class__ is RangeValue:
            raise Problem("E0301", "a range inside a vector", "write it without brackets", index)
    return Vec(items)


def prepare_vector(expr: nodes.Vector, place: Place) -> Code:
    return computed(place, _vector, expr.span, expr.items, item_steps=0)


def prepare_range(expr: nodes.Range, place: Place) -> Code:
    def make(start: Any, stop: Any, step: Any = 1.0) -> RangeValue:
        for index, value in enumerate((start, stop, step)):
            if value.__class__ not in UNITS:
                raise unexpected("a number", value, operand=index)
        (a, ua), (b, ub), (s, us) = unpack(start), unpack(stop), unpack(step)
        kind = operators.same_unit(a, ua, b, ub)
        if expr.step is None:
            return RangeValue(a, b, expr.exclusive, None, kind)
        if kind == "angle" and us != "angle":
            raise Problem("E0302", "a bare number as the step of angles", operand=2, fix="angle")
        kind = operators.same_unit(b, kind, s, us) if us != kind else kind
        if s == 0.0:
            raise Problem("E0311", "a step of 0", operand=2)
        return RangeValue(a, b, expr.exclusive, s, kind)

    parts = [part for part in (expr.start, expr.stop, expr.step) if part is not None]
    return computed(place, make, expr.span, parts)


# ---------------------------------------------------------------- parts of values


def member(code: Code, name: nodes.Name, place: Place, of: nodes.Expr) -> Code:
    """``code.name``, a component of a vector."""
    index = COMPONENTS.get(name.text)
    if index is None:
        from scenelang.evaluate.report.advice import member_advice  # only mistakes need it

        help, fix = member_advice(name), None
        if help is None:
            help, fix = did_you_mean(name.text, COMPONENTS, name.span)
        help = help or "vectors have .x .y .z, or .r .g .b, or [i]"
        place.report.error("E0212", f"no value has a member `{name.text}`", name.span, help=help, fix=fix)
        return POISONED
    at = index

    def pick(value: Any) -> Any:
        if value.__class__ is not Vec:
            kind = describe(value)
            message = f"`.{name.text}` of {kind}, which is not a vector"
            raise Problem("E0301", message, found=kind)
        if at >= len(value.items):
            raise Problem("E0307", f"`.{name.text}` of {describe(value)}")
        return value.items[at]

    def run(env: Env) -> Any:
        value = get(env)
        return value.items[at] if value.__class__ is Vec and len(value.items) > at else slow(value)

    get = code.run
    slow = guarded(place, pick, name.span, (of,), item_steps=0)
    return folded([code], pick, run)


def _item(value: Any, index: Any) -> Any:
    at = number(index, 1)
    if value.__class__ is Vec:
        length = len(value.items)
    elif value.__class__ is RangeValue:
        length = value.count()
    else:
        raise unexpected("a vector or a range", value, operand=0)
    if not at.is_integer():
        raise Problem("E0307", f"index {at:.6g} is not a whole number", "round it with floor(…)", 1)
    if not 0 <= at < length:
        where = f"outside 0..{length - 1}" if length else "into an empty vector"
        help = "items are counted from 0; the last is v[len(v) - 1]" if at < 0 else None
        raise Problem("E0307", f"index {at:.0f} is {where}", help, operand=1)
    return value.items[int(at)] if value.__class__ is Vec else value.item(int(at))


def prepare_index(expr: nodes.Index, place: Place) -> Code:
    return computed(place, _item, expr.span, (expr.value, expr.index), item_steps=0)


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
