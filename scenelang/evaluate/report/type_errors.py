"""Values of the wrong kind, traced to where they come from: what one definition causes is told as one.

A `let` that has become a vector is wrong in one place and shows it in many. Uses that complain in the same
words and share a variable or function, directly or by way of others, are places of one report.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import Span
from scenelang.evaluate.report.reporter import Reporter, Shared
from scenelang.evaluate.values.value import Problem
from scenelang.scene import library
from scenelang.syntax import nodes

_KINDS: Final = frozenset(("E0301", "E0302", "E0303", "E0307"))
_COMPARISONS: Final = frozenset(("<", "<=", ">", ">=", "==", "!=", "&&", "||"))
_MOST_ORIGINS: Final = 64  # definitions that one value is traced through
_MOST_CALLS: Final = 16  # calls that give a parameter its value
_OFTEN: Final = 3  # so many places of one report make its origin the culprit, whatever others say

Origin = tuple[int, int]
"""A definition: its file and where its name starts."""


_OUTSIDE: Final = "outside"


def report_problem(
    report: Reporter, problem: Problem, span: Span, operands: tuple[nodes.Expr | None, ...] = ()
) -> None:
    """Report a `Problem` at the operand it blames, or else at ``span``."""
    operand = None
    if problem.operand is not None and problem.operand < len(operands):
        operand = operands[problem.operand]
    place = operand.span if operand else span
    if (id(place.source), place.start, place.end) in report.reported:
        return
    if library.holds(place.source):
        report.error(problem.code, problem.message, place, help=problem.help)
        return
    alone = operand is not None and problem.code == "E0301"
    blamed = tuple([one for one in ((operand,) if alone else operands) if one is not None])
    if not report.follows(problem.code, place) and joined(report, problem, blamed, place):
        return
    help, fix = problem.help, None
    if problem.fix:
        from scenelang.evaluate.report.habits import advice  # only mistakes need it

        help, fix = advice(problem, operand, report.defined)
    labels = [
        Label(other.span, words)
        for index, words in problem.notes.items()
        if index < len(operands) and (other := operands[index]) is not None
    ]
    if isinstance(operand, nodes.NameRef):
        defined = report.defined.get((id(operand.span.source), operand.span.start))
        if defined is not None:
            labels.append(Label(defined, f"`{operand.name.text}` is defined here"))
    found = report.error(problem.code, problem.message, place, help=help, fix=fix, labels=tuple(labels))
    if found is not None:
        remember(report, found, problem, blamed)


def joined(report: Reporter, problem: Problem, operands: tuple[nodes.Expr, ...], place: Span) -> bool:
    """Whether a problem is one more place of an earlier report, which then shows it.

    Args:
        report: has the reports.
        problem: the problem.
        operands: what may be to blame.
        place: where it shows.
    """
    if problem.code not in _KINDS:
        return False
    for origin, definition in origins(report, operands).items():
        for words in (problem.found or problem.message, ""):
            shared = report.blamed.get((*origin, words))
            if shared is not None:
                _add(report, shared, definition, place)
                return True
    direct = _direct(report, operands[0]) if len(operands) == 1 and problem.code == "E0301" else None
    shared = report.blamed.get((*direct, problem.code)) if direct else None
    if shared is None or direct is None:
        return False
    _add(report, shared, report.defined[id(operands[0].span.source), operands[0].span.start], place)
    return True


def remember(report: Reporter, shared: Shared, problem: Problem, operands: tuple[nodes.Expr, ...]) -> None:
    """Note the origins of a problem that was reported."""
    if problem.code not in _KINDS:
        return
    complaint = problem.found or problem.message
    direct = _direct(report, operands[0]) if operands else None
    if complaint == _OUTSIDE:
        # One wrong index is one; of a second on, it is the vector that is too short.
        if direct is not None and report.blamed.setdefault((*direct, problem.code), shared) is not shared:
            report.blamed.setdefault((*direct, complaint), shared)
        return
    for origin in origins(report, operands):
        report.blamed.setdefault((*origin, complaint), shared)
    if direct is not None and problem.code == "E0301" and len(operands) == 1:
        report.blamed.setdefault((*direct, problem.code), shared)


def origins(report: Reporter, operands: tuple[nodes.Expr, ...]) -> dict[Origin, Span]:
    """The definitions that may give values their kind, nearest first."""
    found: dict[Origin, Span] = {}
    stack = list(reversed(operands))
    while stack and len(found) < _MOST_ORIGINS:
        for name in _carriers(stack.pop()):
            definition = report.defined.get((id(name.source), name.start))
            if definition is None:
                continue
            origin = id(definition.source), definition.start
            value = report.origins.get(origin)
            if origin in found or (isinstance(value, nodes.Number) and not value.unit):
                continue  # a bare number makes nothing of another kind
            found[origin] = definition
            if value is not None:
                stack.append(value)
            elif origin in report.parameters:
                node, index = report.parameters[origin]
                given = [bound[index] for bound in report.given.get(node, ())[:_MOST_CALLS]]
                stack.extend(argument.value for argument in given if argument is not None)
    return found


def _add(report: Reporter, shared: Shared, definition: Span, place: Span) -> None:
    """Show a further place of a report, and what it has in common with the others."""
    if all(label.span != definition for label in shared.own):
        shared.own = (*shared.own, Label(definition, f"`{definition.text}` is defined here"))
    report.share(shared, place, "in")
    if len(shared.again) + 1 >= _OFTEN:
        report.blamed.setdefault((id(definition.source), definition.start, ""), shared)


def _direct(report: Reporter, operand: nodes.Expr) -> Origin | None:
    """The variable that an operand is, or is a part of."""
    while isinstance(operand, nodes.Member | nodes.Index):
        operand = operand.value
    if not isinstance(operand, nodes.NameRef):
        return None
    definition = report.defined.get((id(operand.span.source), operand.span.start))
    return None if definition is None else (id(definition.source), definition.start)


def _carriers(expr: nodes.Expr) -> Iterator[Span]:
    """The names in an expression whose kind of value can make its own."""
    stack: list[tuple[nodes.Expr, bool]] = [(expr, False)]  # and whether only an item of it counts
    while stack:
        at, item = stack.pop()
        match at:
            case nodes.NameRef():
                yield at.span
            case nodes.CallExpr():
                yield at.name.span
                stack.extend((arg.value, item) for arg in reversed(at.args))
            case nodes.Unary() if at.op != "!":
                stack.append((at.operand, item))
            case nodes.Binary() if at.op not in _COMPARISONS:
                stack += (at.right, item), (at.left, item)
            case nodes.Conditional():
                stack += (at.otherwise, item), (at.then, item)
            case nodes.Member() | nodes.Index():
                stack.append((at.value, True))
            case nodes.Vector() if item:
                stack.extend((one, False) for one in reversed(at.items))
            case _:
                pass
