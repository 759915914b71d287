"""A bare number where an angle is wanted: what to advise, and a fix where only one unit can be meant."""

from __future__ import annotations

import math
from collections.abc import Container
from typing import Final

from scenelang.diagnostics.diagnostic import Edit, Fix
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.syntax import nodes

_GLUED: Final = "give it a unit: deg, rad or turn"
_RADIANS: Final = "a multiple of PI or TAU is in radians: multiply by 1rad"
_COMPUTED: Final = "multiply by the unit it is in: 1deg, 1rad or 1turn"
_OPENS: Final = ("(", "[", ",", "=", "")
"""What an expression stands behind that may grow by a factor without parentheses."""


def angle_advice(
    expr: nodes.Expr | None, variables: Container[tuple[SourceFile, int]], *, hue: bool = False
) -> tuple[str, Fix | None]:
    """Help and fix for a bare number where an angle is wanted.

    A literal gets the unit that such numbers have elsewhere. A multiple of PI or TAU is in radians. Of other
    computed numbers nobody can tell the unit, so they get no fix.

    Args:
        expr: the number; None where it has no place of its own.
        variables: the names that the file defines, by their file and place.
        hue: the angle shifts a hue, whose fractions are turns, as those of ``hsv`` are.
    """
    inner = expr.operand if isinstance(expr, nodes.Unary) else expr
    if isinstance(inner, nodes.Number):
        unit = _unit(abs(inner.value), hue)
        return _GLUED, Fix(f"add `{unit}`", (Edit(_at(inner, inner.span.end), unit),))
    if expr is None:
        return _GLUED, None
    if _power_of_pi(expr, variables) != 1:
        return _COMPUTED, None
    if expr.span.text.count("(") != expr.span.text.count(")"):
        return _RADIANS, None  # literals keep their place inside their parentheses, and so do sums of them
    loose = isinstance(expr, nodes.Conditional) or (isinstance(expr, nodes.Binary) and expr.op in "+-")
    head, tail = ("(", ") * 1rad") if loose else ("", " * 1rad")
    before = expr.span.source.text[max(0, expr.span.start - 100) : expr.span.start].rstrip()
    if before[-1:] not in _OPENS:
        head, tail = f"({head}", f"{tail})"
    edits = (Edit(_at(expr, expr.span.start), head),) if head else ()
    return _RADIANS, Fix("multiply by `1rad`", (*edits, Edit(_at(expr, expr.span.end), tail)))


def _unit(size: float, hue: bool) -> str:
    """The unit that a literal most likely has."""
    if size > math.tau or float(size).is_integer():
        return "deg"
    return "turn" if hue and size < 1 else "rad"


def _at(expr: nodes.Expr, place: int) -> Span:
    return Span(expr.span.source, place, place)


def _power_of_pi(expr: nodes.Expr, variables: Container[tuple[SourceFile, int]]) -> int:
    """To which power PI or TAU is a factor of a number: 1 where it is in radians, -1 in ``180 / PI``."""
    match expr:
        case nodes.NameRef(name=name):
            own = (name.span.source, name.span.start) not in variables
            return int(own and name.text in ("PI", "TAU"))
        case nodes.Unary():
            return _power_of_pi(expr.operand, variables)
        case nodes.Binary(op="*" | "/" | "+" | "-" | "%" as op):
            left, right = _power_of_pi(expr.left, variables), _power_of_pi(expr.right, variables)
            if op in "*/":
                return left + right if op == "*" else left - right
            return left if op == "%" else max(left, right)
        case nodes.Conditional():
            return max(_power_of_pi(expr.then, variables), _power_of_pi(expr.otherwise, variables))
        case _:
            return 0
