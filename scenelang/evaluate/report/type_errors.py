"""Values of the wrong kind: uses of one variable or function that have the same odd kind are one report."""

from __future__ import annotations

from typing import Final

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import Span
from scenelang.evaluate.report.reporter import Reporter
from scenelang.evaluate.values.value import Problem
from scenelang.scene import library
from scenelang.syntax import nodes

_KINDS: Final = frozenset(("E0301", "E0302", "E0303", "E0307"))


def report_problem(
    report: Reporter, problem: Problem, span: Span, operands: tuple[nodes.Expr | None, ...] = ()
) -> None:
    """Report a `Problem` at the operand it blames, or else at ``span``."""
    operand = None
    if problem.operand is not None and problem.operand < len(operands):
        operand = operands[problem.operand]
    place = operand.span if operand else span
    if (place.source, place) in report.reported:
        return
    if library.holds(place.source):
        report.error(problem.code, problem.message, place, help=problem.help)
        return
    blamed = operand or (operands[0] if operands else None)
    odd = problem.code in _KINDS and problem.found not in ("", "a number")
    origin = _origin(report, blamed) if odd else None
    key = None if origin is None else (problem.code, problem.found, origin.source, origin)
    shared = report.shared.get(key)
    if shared is not None and not report.follows(problem.code, place):
        report.share(shared, place, "in")
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
    if isinstance(operand, nodes.NameRef) and (defined := _origin(report, operand)) is not None:
        labels.append(Label(defined, f"`{operand.name.text}` is defined here"))
    found = report.error(problem.code, problem.message, place, help=help, fix=fix, labels=tuple(labels))
    if found is not None and key is not None:
        report.shared[key] = found


def _origin(report: Reporter, operand: nodes.Expr | None) -> Span | None:
    """The definition of the variable that an operand is, or is a part of, or of the function it calls."""
    while isinstance(operand, nodes.Member | nodes.Index):
        operand = operand.value
    if not isinstance(operand, nodes.NameRef | nodes.CallExpr):
        return None
    return report.defined.get((operand.span.source, operand.span.start))
