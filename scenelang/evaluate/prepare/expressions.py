"""Expressions: each is prepared once into a closure over its slots, then run as often as needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Final, NamedTuple

from scenelang.diagnostics.span import Span
from scenelang.evaluate.costs import GENERAL_STEPS, HALF_STEPS, ITEM_STEPS
from scenelang.evaluate.file_context import Unit
from scenelang.evaluate.limits import MAX_NESTING
from scenelang.evaluate.names import Env, Needs, Scope
from scenelang.evaluate.report.type_errors import report_problem
from scenelang.evaluate.values.value import POISON, Problem, Vec
from scenelang.syntax import nodes

Run = Callable[[Env], Any]


class Varies:
    """Marks an expression whose value is known only when it runs."""

    __slots__ = ()


VARIES: Final = Varies()
_FOLDED_NUMBERS: Final = 64
_ANGLES: Final = {"rotate": "angle", "hue": "angle", "sin": "x", "cos": "x", "tan": "x"}
"""What takes an angle first, and how it calls it."""


class Code(NamedTuple):
    """A prepared expression: how to run it, and its value where that never changes."""

    run: Run
    value: Any = VARIES


def watched(run: Run, span: Span, unit: Unit) -> Run:
    """``run``, showing its values to whoever watches the session."""
    watch = unit.session.watch
    if watch is None:
        return run

    def shown(env: Env) -> Any:
        value = run(env)
        watch(span, value)
        return value

    return shown


def constant(value: Any) -> Code:
    """An expression that always has ``value``."""
    return Code(lambda env: value, value)


POISONED: Final = constant(POISON)


def prepare(expr: nodes.Expr, unit: Unit, scope: Scope) -> Code:
    """Resolve the names of ``expr`` and make it runnable; reports what is wrong in any case."""
    unit.weight += HALF_STEPS.get(expr.__class__, 1)
    unit.nesting += 1
    if unit.nesting > MAX_NESTING:
        unit.nesting -= 1
        message = f"a tree of more than {MAX_NESTING} levels"
        raise unit.session.halt("E0324", message, expr.span)
    try:
        code: Code = unit.session.expressions[expr.__class__](expr, unit, scope)
        return code
    finally:
        unit.nesting -= 1


def prepare_arguments(name: str, args: Iterable[nodes.Argument], unit: Unit, scope: Scope) -> dict[int, Code]:
    """Prepare the arguments of one of the language's own words, by their ids."""
    wanted, codes = _ANGLES.get(name, ""), {}
    for index, arg in enumerate(args):
        is_angle = wanted and (arg.name.text == wanted if arg.name else index == 0)
        codes[id(arg)] = (_prepare_angle if is_angle else prepare)(arg.value, unit, scope)
    return codes


def _prepare_angle(expr: nodes.Expr, unit: Unit, scope: Scope) -> Code:
    """`prepare`, noting a 0 without a unit that may be another number in another frame."""
    session = unit.session
    around, session.needs = session.needs, Needs()
    try:
        code = prepare(expr, unit, scope)
    finally:
        own, session.needs = session.needs, around
        around.on.append(own)
    if code.value is not VARIES or not session.replays:
        return code
    get = code.run

    def run(env: Env) -> Any:
        value = get(env)
        if value.__class__ is float and value == 0.0 and own.varies():
            session.zeros[id(expr.span.source), expr.span.start, expr.span.end] = expr.span
        return value

    return Code(run)


def folded(unit: Unit, codes: list[Code], function: Callable[..., Any], run: Run) -> Code:
    """``run``, or its value where all inputs are constant and nothing is wrong with it."""
    values = [code.value for code in codes]
    if VARIES in values or POISON in values:
        return Code(run)
    if any(value.__class__ is Vec and value.count > _FOLDED_NUMBERS for value in values):
        return Code(run)  # work that counts as evaluation steps
    try:
        return constant(function(*values))
    except Problem:
        return Code(run)  # reported when and if it runs


def guarded(
    unit: Unit,
    function: Callable[..., Any],
    span: Span,
    operands: tuple[nodes.Expr | None, ...],
    item_steps: int = ITEM_STEPS,
) -> Callable[..., Any]:
    """``function`` on values: silent on poison, problems reported, its work counted."""
    session = unit.session

    def run(*values: Any) -> Any:
        session.steps += GENERAL_STEPS  # the next call or pass looks at the limit
        for value in values:
            if value is POISON:
                return POISON
            if value.__class__ is Vec:
                session.tick(item_steps * value.count, span)
        try:
            return function(*values)
        except Problem as problem:
            session.steps += 2 * GENERAL_STEPS
            report_problem(session.report, problem, span, operands)
            return POISON

    return run
