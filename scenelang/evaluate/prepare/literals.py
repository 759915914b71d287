"""Literals, vectors and ranges, and the parts of vectors."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from scenelang.diagnostics.suggest import did_you_mean
from scenelang.evaluate.file_context import Unit
from scenelang.evaluate.names import Env, Scope
from scenelang.evaluate.prepare.expressions import (
    POISONED,
    Code,
    constant,
    folded,
    guarded,
    prepare,
)
from scenelang.evaluate.values import operators
from scenelang.evaluate.values.functions import number
from scenelang.evaluate.values.value import (
    COMPONENTS,
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


def prepare_number(expr: nodes.Number, unit: Unit, scope: Scope) -> Code:
    value = float(expr.value)
    if not math.isfinite(value):
        unit.session.report.error("E0306", "the number is too large", expr.span)
        return POISONED
    match expr.unit:
        case "deg":
            return constant(Angle(math.radians(value)))
        case "rad":
            return constant(Angle(value))
        case "turn":
            return _finite_literal(Angle, value * math.tau, expr, unit)
        case "s":
            return constant(Time(value))
        case "ms":
            return constant(Time(value / 1000.0))
        case _:
            return constant(value)


def _finite_literal(make: Callable[[float], Any], value: float, expr: nodes.Number, unit: Unit) -> Code:
    if math.isfinite(value):
        return constant(make(value))
    unit.session.report.error("E0306", "the number is too large", expr.span)
    return POISONED


def prepare_literal(expr: nodes.String | nodes.Bool, unit: Unit, scope: Scope) -> Code:
    return constant(expr.value)


def prepare_color(expr: nodes.Color, unit: Unit, scope: Scope) -> Code:
    return constant(Vec(tuple([float(c) for c in expr.rgb])))


def skip_bad(expr: nodes.BadExpr, unit: Unit, scope: Scope) -> Code:
    return POISONED


def prepare_vector(expr: nodes.Vector, unit: Unit, scope: Scope) -> Code:
    codes = [prepare(item, unit, scope) for item in expr.items]
    getters = tuple([code.run for code in codes])

    def make(*items: Any) -> Vec:
        for index, item in enumerate(items):
            if item.__class__ is RangeValue:
                raise Problem("E0301", "a range inside a vector", "write it without brackets", index)
        return Vec(items)

    slow = guarded(unit, make, expr.span, expr.items, item_steps=0)
    return folded(unit, codes, make, lambda env: slow(*[get(env) for get in getters]))


def prepare_range(expr: nodes.Range, unit: Unit, scope: Scope) -> Code:
    parts = [expr.start, expr.stop] + ([expr.step] if expr.step is not None else [])
    codes = [prepare(part, unit, scope) for part in parts]
    exclusive = expr.exclusive

    def make(start: Any, stop: Any, step: Any = None) -> RangeValue:
        for index, value in enumerate((start, stop, step)):
            if value.__class__ not in UNITS and (index < 2 or value is not None):
                raise unexpected("a number", value, operand=index)
        (a, ua), (b, ub) = unpack(start), unpack(stop)
        kind = operators.same_unit(a, ua, b, ub)
        if step is None:
            return RangeValue(a, b, exclusive, None, kind)
        s, us = unpack(step)
        if kind == "angle" and us != "angle":
            raise Problem("E0302", "a bare number as the step of angles", operand=2, fix="angle")
        kind = operators.same_unit(b, kind, s, us) if us != kind else kind
        if s == 0.0:
            raise Problem("E0311", "a step of 0", operand=2)
        return RangeValue(a, b, exclusive, s, kind)

    getters = [code.run for code in codes]
    slow = guarded(unit, make, expr.span, tuple(parts))
    return folded(unit, codes, make, lambda env: slow(*[get(env) for get in getters]))


# ---------------------------------------------------------------- parts of values


def member(code: Code, name: nodes.Name, unit: Unit, of: nodes.Expr | None = None) -> Code:
    """``code.name``, a component of a vector."""
    index = COMPONENTS.get(name.text)
    if index is None:
        from scenelang.evaluate.report.habits import member_advice  # only mistakes need it

        hint, fix = member_advice(of, name)
        if hint is None:
            hint, fix = did_you_mean(name.text, COMPONENTS, name.span)
        hint = hint or "vectors have .x .y .z, or .r .g .b, or [i]"
        unit.session.report.error(
            "E0212", f"no value has a member `{name.text}`", name.span, help=hint, fix=fix
        )
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
    slow = guarded(unit, pick, name.span, (of,), item_steps=0)
    return folded(unit, [code], pick, run)


def prepare_index(expr: nodes.Index, unit: Unit, scope: Scope) -> Code:
    codes = [prepare(expr.value, unit, scope), prepare(expr.index, unit, scope)]

    def pick(value: Any, index: Any) -> Any:
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

    value, index = codes[0].run, codes[1].run
    slow = guarded(unit, pick, expr.span, (expr.value, expr.index), item_steps=0)
    return folded(unit, codes, pick, lambda env: slow(value(env), index(env)))
