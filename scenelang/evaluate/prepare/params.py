"""Params: typed, ranged inputs, and the values that come from outside for them."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Real
from typing import Any

from scenelang.diagnostics.diagnostic import Diagnostics, Edit, Fix, Label
from scenelang.diagnostics.span import SourceFile
from scenelang.evaluate.builder import Builder
from scenelang.evaluate.file_context import Action, FileContext, Place
from scenelang.evaluate.names import Binding, Env
from scenelang.evaluate.prepare.blocks import define
from scenelang.evaluate.prepare.expressions import VARIES, prepare
from scenelang.evaluate.prepare.settings import at_top_level
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.report.reporter import Reporter
from scenelang.evaluate.report.type_errors import report_problem
from scenelang.evaluate.session import Defines, Session
from scenelang.evaluate.values.operators import equal, same_unit
from scenelang.evaluate.values.value import (
    POISON,
    UNITS,
    Angle,
    Problem,
    RangeValue,
    Time,
    Vec,
    describe,
    unpack,
)
from scenelang.syntax import nodes, parse


def prepare_param(stmt: nodes.Param, place: Place) -> Action | None:
    file, name, session, slots = place.file, stmt.name, place.session, place.scope.slots
    default = prepare(stmt.default, place)
    bounds = prepare(stmt.range, place) if stmt.range is not None else None
    slot = slots.add()
    if not at_top_level(place, name.span, "a param"):
        define(name, Binding("poison", name.span), place)
        return None
    if not define(name, Binding("param", name.span, slots, slot, needs=session.needs), place):
        return None
    full = file.prefix + name.text
    file.has_params = True
    file.defines.known[full] = name.span

    def action(env: Env, out: Builder) -> None:
        given = file.defines.values.get(full, VARIES)  # which another run may change
        value = default.run(env)
        allowed = bounds.run(env) if bounds is not None else None
        if value is not POISON:
            value = _checked_default(value, allowed, stmt, session)
        if given is not VARIES:
            value = _from_outside(full, given, value, allowed, stmt, file)
        env[slot] = value
        if session.watch is not None:
            session.watch(name.span, value)

    return action


def _checked_default(value: Any, allowed: Any, stmt: nodes.Param, session: Session) -> Any:
    """The default, or poison where it has no type for a param; reports one outside the range."""
    if value.__class__ not in (*UNITS, bool, str, Vec):
        message = f"{describe(value)} as the value of a param"
        help = "params are numbers, angles, times, booleans, strings and vectors"
        session.report.error("E0301", message, stmt.default.span, help=help)
        return POISON
    if stmt.range is None or allowed is POISON:
        return value
    if allowed.__class__ is not RangeValue and allowed.__class__ is not Vec:
        message = f"expected a range or a vector of choices, found {describe(allowed)}"
        session.report.error("E0301", message, stmt.range.span, help="write in 0..1")
        return value
    try:
        if not within(value, allowed):
            labels = (Label(stmt.range.span, "the range"),)
            message = f"default of `{stmt.name.text}` is outside {stmt.range.span.text}"
            advice, fix = _range_meant(value, allowed, stmt.range)
            session.report.error("E0309", message, stmt.default.span, labels=labels, help=advice, fix=fix)
    except Problem as problem:
        report_problem(session.report, problem, stmt.range.span, (stmt.default,))
    return value


def _range_meant(value: Any, allowed: Any, range: nodes.Expr) -> tuple[str | None, Fix | None]:
    """Help and fix for `in [3, 9]` where the default lies between the two."""
    ends = allowed.items if allowed.__class__ is Vec else ()
    if len(ends) != 2 or not all(one.__class__ is value.__class__ and one.__class__ in UNITS for one in ends):
        return None, None
    low, at, high = (unpack(one)[0] for one in (ends[0], value, ends[1]))
    if not low < at < high:
        return None, None
    help = "a vector has the choices there are; a range is written 3..9"
    if not isinstance(range, nodes.Vector):
        return help, None
    text = "..".join(item.span.text for item in range.items)
    return help, Fix(f"write `{text}`", (Edit(range.span, text),))


def within(value: Any, allowed: Any) -> bool:
    """Whether a value, or each number of a vector, is in a range or among choices.

    Raises:
        Problem: a value and a range that do not compare.
    """
    if allowed.__class__ is Vec:
        return any(equal(value, choice) for choice in allowed.items)
    if value.__class__ is Vec:
        return all(within(item, allowed) for item in value.items)
    if value.__class__ not in UNITS:
        raise Problem("E0301", f"{describe(value)} with a range of {allowed.unit}s")
    x, kind = unpack(value)
    same_unit(x, kind, allowed.start or allowed.stop, allowed.unit)
    return bool(allowed.contains(x))


def _from_outside(
    full: str, given: Any, default: Any, allowed: Any, stmt: nodes.Param, file: FileContext
) -> Any:
    """The value from outside, of the default's type and in range; poison after a report."""
    span, report = stmt.name.span, file.session.report
    text = given if isinstance(given, str) else repr(given)
    shown = f"{full}={text}" if len(text) <= 60 else f"{full}={text[:57]}…"
    value = given
    if default.__class__ is not str or not isinstance(given, str):
        value = literal(given, file) if isinstance(given, str) else from_python(given)
    help: str | None
    if value is None:
        colour = foreign_words.COLOURS.get(given.lower()) if isinstance(given, str) else None
        help = "write a number with its unit, a colour, a vector, true or false"
        help = f"colours have no names; {given} is {colour}" if colour else help
        labels = (Label(stmt.default.span, "its default"),)
        report.error("E0310", f"{shown} is not a literal", span, help=help, labels=labels)
        return POISON
    if default is POISON:
        return value
    if value.__class__ is float and default.__class__ is Time:
        value = Time(value)  # a bare number is seconds
    elif value.__class__ is float and default.__class__ is Angle and value == 0.0:
        value = Angle(0.0)
    if value.__class__ is not default.__class__:
        help = "give it a unit, as in 30deg" if default.__class__ is Angle else None
        message = f"{shown} is {describe(value)}, expected {describe(default)}"
        labels = (Label(stmt.default.span, f"its default is {describe(default)}"),)
        report.error("E0310", message, span, help=help, labels=labels)
        return POISON
    if stmt.range is not None and (allowed.__class__ is RangeValue or allowed.__class__ is Vec):
        try:
            inside = within(value, allowed)
        except Problem:
            return value  # the default has met and reported it
        if not inside:
            labels = (Label(stmt.range.span, "the range"),)
            report.error("E0309", f"{shown} is outside {stmt.range.span.text}", span, labels=labels)
            return POISON
    return value


def from_python(value: Any) -> Any:
    """A Python value as one of the language, which one of the language is; None where there is none."""
    if isinstance(value, bool | str | Angle | Time | Vec):
        return value
    if isinstance(value, Real):
        try:
            number = float(value)
        except OverflowError:
            return None
        return number if number - number == 0.0 else None
    if isinstance(value, Sequence) or hasattr(value, "tolist"):
        try:
            items = [from_python(item) for item in (value.tolist() if hasattr(value, "tolist") else value)]
            return None if None in items else Vec(tuple(items))
        except (Problem, RecursionError, TypeError):
            return None
    return None


def literal(text: str, file: FileContext) -> Any:
    """The value of a literal; None where ``text`` is not a literal."""
    diagnostics, around = Diagnostics(), file.session
    tree = parse(SourceFile("", f"let value = {text};"), diagnostics)
    stmt = tree.statements[0] if len(tree.statements) == 1 else None
    if diagnostics.errors or not isinstance(stmt, nodes.Let) or not _is_literal(stmt.value):
        return None
    session = Session(Reporter(diagnostics), around.expressions, around.statements)
    alone = FileContext(SourceFile("", text), session, file.loader, Defines({}))
    value = prepare(stmt.value, Place(alone, alone.scope, "file")).run([])
    return None if value is POISON or diagnostics.errors else value


def _is_literal(expr: nodes.Expr) -> bool:
    """Whether an expression names nothing and computes nothing but a sign."""
    match expr:
        case nodes.Number() | nodes.Bool() | nodes.Color() | nodes.String():
            return True
        case nodes.Unary(op="-" | "+", operand=nodes.Number()):
            return True
        case nodes.Vector():
            return all(_is_literal(item) for item in expr.items)
        case nodes.CallExpr():
            return expr.name.text in ("rgb", "hsv") and all(_is_literal(a.value) for a in expr.args)
        case _:
            return False
