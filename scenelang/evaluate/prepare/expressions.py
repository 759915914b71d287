"""Expressions: each is prepared once into a closure over its slots, then run as often as needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, NamedTuple

from scenelang.diagnostics.span import Span
from scenelang.evaluate.costs import GENERAL_STEPS, HALF_STEPS, ITEM_STEPS
from scenelang.evaluate.file_context import Place
from scenelang.evaluate.limits import MAX_NESTING
from scenelang.evaluate.names import Env, Needs
from scenelang.evaluate.report.type_errors import report_problem
from scenelang.evaluate.values.value import POISON, Problem, Vec
from scenelang.syntax import nodes

Run = Callable[[Env], Any]

VARIES: Final = object()
"""Marks an expression whose value is known only when it runs."""
_FOLDED_NUMBERS: Final = 64
_ANGLES: Final = {"rotate": "angle", "hue": "angle", "sin": "x", "cos": "x", "tan": "x"}
"""What takes an angle first, and how it calls it."""


class Code(NamedTuple):
    """A prepared expression: how to run it, and its value where that never changes."""

    run: Run
    value: Any = VARIES


class Given(NamedTuple):
    """An argument of a call, and its prepared value."""

    arg: nodes.Argument
    code: Code


def constant(value: Any) -> Code:
    """An expression that always has ``value``."""
    return Code(lambda env: value, value)


POISONED: Final = constant(POISON)


def prepare(expr: nodes.Expr, place: Place) -> Code:
    """Resolve the names of ``expr`` and make it runnable; reports what is wrong in any case."""
    file = place.file
    file.weight += HALF_STEPS.get(expr.__class__, 1)
    file.nesting += 1
    try:
        if file.nesting > MAX_NESTING:
            raise file.session.halt("E0324", f"a tree of more than {MAX_NESTING} levels", expr.span)
        code: Code = file.session.expressions[expr.__class__](expr, place)
        return code
    finally:
        file.nesting -= 1


def prepare_arguments(args: Iterable[nodes.Argument] | None, place: Place, name: str = "") -> list[Given]:
    """Prepare the arguments of a call; ``name`` is that of one of the language's own words."""
    angle, given = _ANGLES.get(name, ""), []
    for index, arg in enumerate(args or ()):
        is_angle = angle and (arg.name.text == angle if arg.name else index == 0)
        given.append(Given(arg, (_prepare_angle if is_angle else prepare)(arg.value, place)))
    return given


def _prepare_angle(expr: nodes.Expr, place: Place) -> Code:
    """`prepare`, noting a 0 without a unit that may be another number in another frame."""
    session = place.session
    around, session.needs = session.needs, Needs()
    try:
        code = prepare(expr, place)
    finally:
        own, session.needs = session.needs, around
        around.on.append(own)
    if code.value is not VARIES or not session.replays:
        return code
    get = code.run

    def run(env: Env) -> Any:
        value = get(env)
        if value.__class__ is float and value == 0.0 and own.varies():
            session.zeros[expr.span.source, expr.span] = expr.span
        return value

    return Code(run)


def folded(codes: Iterable[Code], function: Callable[..., Any], run: Run) -> Code:
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
    place: Place,
    function: Callable[..., Any],
    span: Span,
    operands: tuple[nodes.Expr | None, ...],
    item_steps: int = ITEM_STEPS,
) -> Callable[..., Any]:
    """``function`` on values: silent on poison, problems reported, its work counted."""
    session = place.session

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


def computed(
    place: Place,
    function: Callable[..., Any],
    span: Span,
    exprs: Sequence[nodes.Expr],
    codes: Sequence[Code] | None = None,
    item_steps: int = ITEM_STEPS,
) -> Code:
    """``function`` of expressions, guarded and folded; they are prepared unless they come as ``codes``."""
    codes = [prepare(expr, place) for expr in exprs] if codes is None else codes
    getters = tuple([code.run for code in codes])
    slow = guarded(place, function, span, tuple(exprs), item_steps)
    if len(getters) == 1:
        get = getters[0]
        return folded(codes, function, lambda env: slow(get(env)))
    return folded(codes, function, lambda env: slow(*[get(env) for get in getters]))
