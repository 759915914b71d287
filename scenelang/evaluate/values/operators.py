"""What operators mean on values, with their rules for units and vectors.

Everything here raises `Problem` and nothing else; results are finite.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any, Final

from scenelang.evaluate.values.value import (
    NAMED,
    UNITS,
    MaterialValue,
    Problem,
    RangeValue,
    Vec,
    describe,
    pack,
    unpack,
)

_VERBS: Final = {"+": "add", "-": "subtract", "*": "multiply", "/": "divide", "%": "divide", "^": "raise"}
_PREPOSITIONS: Final = {"+": "and", "-": "and", "*": "and", "/": "by", "%": "by", "^": "to"}


def finite(value: float) -> float:
    """``value``, if it is finite; raises Problem otherwise."""
    if value - value == 0.0:
        return value
    raise Problem("E0306", "the result is too large for a number")


def divide(a: float, b: float) -> float:
    if b == 0.0:
        raise Problem("E0304", "division by zero", operand=1)
    return a / b


def modulo(a: float, b: float) -> float:
    """The remainder with the sign of ``b``."""
    if b == 0.0:
        raise Problem("E0304", "division by zero", operand=1)
    return a % b


def power(a: float, b: float) -> float:
    try:
        return math.pow(a, b)
    except OverflowError:
        raise Problem("E0306", "the result is too large for a number") from None
    except ValueError:
        if a == 0.0:
            raise Problem("E0304", "division by zero: 0 to a negative power") from None
        raise Problem("E0305", "a negative number to a power that is not an integer") from None


ARITHMETIC: Final[dict[str, Callable[[float, float], float]]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": divide,
    "%": modulo,
    "^": power,
}
COMPARE: Final[dict[str, Callable[[float, float], bool]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


def same_unit(a: float, ua: str, b: float, ub: str) -> str:
    """The common unit of two scalars for sums and comparisons.

    A bare number beside a time is seconds; 0 goes with any angle.

    Raises:
        Problem: a number other than 0 with an angle, or a time with an angle.
    """
    if ua == ub:
        return ua
    if "angle" not in (ua, ub):
        return "number"
    bare = 0 if ua == "number" else 1 if ub == "number" else None
    if bare is None:
        raise Problem("E0303", "an angle and a time do not combine")
    if (a, b)[bare] == 0.0:
        return "angle"
    notes = {1 - bare: "an angle"}
    raise Problem("E0302", "a bare number beside an angle", None, bare, "angle", notes, "an angle")


def _unit_of(op: str, a: float, ua: str, b: float, ub: str) -> str:
    """The unit of ``a op b``; raises Problem where units do not combine."""
    if ua == "number" and ub == "number":
        return "number"
    if op in "+-%":
        return same_unit(a, ua, b, ub)
    if op == "*":
        if "number" in (ua, ub):
            return ub if ua == "number" else ua
        if ua != ub:
            return "angle"  # a rate times seconds
    elif op == "/":
        if ua == ub:
            return "number"
        if ub == "number" or (ua == "angle" and ub == "time"):
            return ua
        if ua == "number" and ub == "time":
            return "number"
    raise Problem(
        "E0303",
        f"cannot {_VERBS[op]} {NAMED[ua]} {_PREPOSITIONS[op]} {NAMED[ub]}",
        "divide an angle by 1rad, or a time by 1s, for a bare number",
    )


def _unfit(message: str, a: Any, b: Any, operand: int, shared: bool = True) -> Problem:
    """Two values that an operator does not take; ``shared`` where the odd kind of one is the cause."""
    odd = {describe(a), describe(b)} - {"a number"}
    found = odd.pop() if shared and len(odd) == 1 else ""
    notes = {1 - operand: describe((a, b)[1 - operand])}
    return Problem("E0303", message, operand=operand, notes=notes, found=found)


def binary(op: str, a: Any, b: Any) -> Any:
    """``a op b`` for the arithmetic operators, componentwise on vectors."""
    ca, cb = a.__class__, b.__class__
    if ca in UNITS and cb in UNITS:
        x, ua = unpack(a)
        y, ub = unpack(b)
        return pack(finite(ARITHMETIC[op](x, y)), _unit_of(op, x, ua, y, ub))
    if ca is Vec and cb is Vec:
        if len(a.items) != len(b.items):
            lengths = [f"{len(v.items)} items" for v in (a, b)]
            message = f"vectors of {len(a.items)} and {len(b.items)} items do not combine"
            raise Problem("E0307", message, notes=dict(enumerate(lengths)))
        return Vec(tuple([binary(op, x, y) for x, y in zip(a.items, b.items, strict=True)]))
    if ca is Vec and cb in UNITS:
        return Vec(tuple([binary(op, x, b) for x in a.items]))
    if ca in UNITS and cb is Vec:
        return Vec(tuple([binary(op, a, y) for y in b.items]))
    message = f"cannot {_VERBS[op]} {describe(a)} {_PREPOSITIONS[op]} {describe(b)}"
    raise _unfit(message, a, b, int(ca in UNITS or ca is Vec), op in "+-*")


def negate(value: Any) -> Any:
    """``-value``."""
    cls = value.__class__
    if cls in UNITS:
        x, unit = unpack(value)
        return pack(-x, unit)
    if cls is Vec:
        return Vec(tuple([negate(item) for item in value.items]))
    raise Problem("E0303", f"{describe(value)} has no negative", operand=0)


def plus(value: Any) -> Any:
    """``+value``: the value itself, if it is a quantity."""
    if value.__class__ in UNITS or value.__class__ is Vec:
        return value
    raise Problem("E0303", f"{describe(value)} takes no sign", operand=0)


def compare(op: str, a: Any, b: Any) -> bool:
    """``a op b`` for ``< <= > >=``."""
    if a.__class__ not in UNITS or b.__class__ not in UNITS:
        raise _unfit(f"cannot order {describe(a)} and {describe(b)}", a, b, int(a.__class__ in UNITS))
    x, ua = unpack(a)
    y, ub = unpack(b)
    same_unit(x, ua, y, ub)
    return COMPARE[op](x, y)


def equal(a: Any, b: Any) -> bool:
    """``a == b``; values of different types do not compare, ``none`` compares with all."""
    ca, cb = a.__class__, b.__class__
    if ca in UNITS and cb in UNITS:
        x, ua = unpack(a)
        y, ub = unpack(b)
        same_unit(x, ua, y, ub)
        return x == y
    if a is None or b is None:
        return a is b
    if ca is not cb:
        raise _unfit(f"cannot compare {describe(a)} with {describe(b)}", a, b, 1, shared=False)
    if ca is Vec:
        return len(a.items) == len(b.items) and all(
            equal(x, y) for x, y in zip(a.items, b.items, strict=True)
        )
    if ca is RangeValue:
        return bool(
            (a.start, a.stop, a.exclusive, a.step, a.unit) == (b.start, b.stop, b.exclusive, b.step, b.unit)
        )
    if ca is MaterialValue:
        return bool(a.material == b.material)
    return bool(a == b)
