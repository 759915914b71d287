"""Reporting values of the wrong kind."""

from __future__ import annotations

from scenelang.diagnostics.diagnostic import Label
from scenelang.diagnostics.span import Span
from scenelang.evaluate.report.reporter import Reporter
from scenelang.evaluate.values.value import Problem
from scenelang.scene import library
from scenelang.syntax import nodes


def report_problem(
    report: Reporter, problem: Problem, span: Span, operands: tuple[nodes.Expr | None, ...] = ()
) -> None:
    """Report a `Problem` at the operand it blames, or else at ``span``."""
    at = problem.operand
    operand = operands[at] if at is not None and at < len(operands) else None
    place = operand.span if operand else span
    if (place.source, place) in report.reported:
        return
    help, fix = problem.help, None
    if problem.fix and not library.holds(place.source):
        from scenelang.evaluate.report.advice import problem_advice  # only mistakes need it

        help, fix = problem_advice(problem, operand)
    labels = [
        Label(other.span, words)
        for index, words in problem.notes.items()
        if index < len(operands) and (other := operands[index]) is not None
    ]
    report.error(problem.code, problem.message, place, help=help, fix=fix, labels=tuple(labels))
