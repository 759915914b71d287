"""Calls that do not fit what they call: those of one definition that fail alike are told as one.

Whoever changes what a function takes breaks every call of it, and has made one mistake. So calls are
collected while files are prepared, and told about when all of them are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from scenelang.diagnostics.diagnostic import Diagnostic, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.evaluate.report.mismatch import Misfit
from scenelang.evaluate.report.reporter import Reporter, shown_places
from scenelang.syntax import nodes


def report_misfit(report: Reporter, misfit: Misfit, definition: nodes.Fn | nodes.Module | None) -> None:
    """Report a call, or keep it until all calls of its definition are known.

    Args:
        report: where it is reported.
        misfit: how the call fails.
        definition: what is called; None for what the language has.
    """
    if definition is None:
        _error(report, misfit)
    elif not report.follows(misfit.code, misfit.span):
        _, calls = report.misfits.setdefault(id(definition), (definition, {}))
        calls.setdefault(misfit.span, misfit)


def report_misfits(report: Reporter) -> None:
    """Report the calls that were kept, when everything has been prepared."""
    for definition, found in report.misfits.values():
        calls = list(found.values())
        lost = _lost_parameter(report, definition, calls)
        if lost is not None or _all_fail(report, definition, calls):
            _report_definition(report, definition, calls, lost)
            continue
        ways: dict[tuple[str, ...], list[Misfit]] = {}
        for call in calls:
            ways.setdefault((call.code, *call.way), []).append(call)
        for alike in ways.values():
            again = shown_places([call.span for call in alike[1:]], "also here", "in")
            first = alike[0]
            _error(report, replace(first, labels=(*first.labels, *again), fix=_together(alike)))
    report.misfits.clear()


def _error(report: Reporter, misfit: Misfit) -> None:
    report.error(
        misfit.code, misfit.message, misfit.span, help=misfit.help, fix=misfit.fix, labels=misfit.labels
    )


def _number_failing(calls: Sequence[Misfit]) -> int:
    return len({(id(call.call.source), call.call.start) for call in calls})


def _all_fail(
    report: Reporter, definition: nodes.Fn | nodes.Module, calls: Sequence[Misfit], least: int = 2
) -> bool:
    """Whether no call of a definition in its file fits it."""
    name, number = definition.name, _number_failing(calls)
    there = report.uses(name.span.source).get(name.text, ())
    inside = all(call.call.source is name.span.source for call in calls)
    return inside and number >= least and len(there) == number + 1


def _lost_parameter(
    report: Reporter, definition: nodes.Fn | nodes.Module, calls: Sequence[Misfit]
) -> tuple[int, str] | None:
    """The index of an unknown name that a definition uses and all its calls give, and the name.

    `fn f(a) = a + b;` where all calls give two arguments, or one named `b`, has lost a parameter.
    """
    found = [
        (known.index, name)
        for (code, name, _), known in report.unknown.items()
        if code == "E0201" and _is_within(report.diagnostics.items[known.index].span, definition.span)
    ]
    if len(found) != 1 or not _all_fail(report, definition, calls, least=1):
        return None
    ways = {call.way for call in calls}
    return found[0] if ways <= {("surplus",), ("foreign", found[0][1])} else None


def _is_within(span: Span | None, outer: Span) -> bool:
    return (
        span is not None
        and span.source is outer.source
        and outer.start <= span.start
        and span.end <= outer.end
    )


def _report_definition(
    report: Reporter,
    definition: nodes.Fn | nodes.Module,
    calls: Sequence[Misfit],
    lost: tuple[int, str] | None,
) -> None:
    """Report a definition that no call of it fits."""
    first, name, items = calls[0], definition.name, report.diagnostics.items
    alike = len({(call.code, *call.way) for call in calls}) == 1
    labels = shown_places([call.span for call in calls], [call.here for call in calls], "in")
    message = f"{first.message}, {first.everywhere}" if alike else f"no call of `{name.text}` fits it"
    if lost is None:
        code = first.code if alike else "E0308"
        place = (first.blamed or name.span) if alike else name.span
        report.error(
            code, message, place, help=first.help, fix=_together(calls) if alike else None, labels=labels
        )
        return
    index, missing = lost
    inside = items[index]
    help = f"`{missing}` is used inside: add it to the parameters"
    used = (Label(inside.span, "it is not a parameter"),) if inside.span else ()
    items[index] = Diagnostic("E0308", message, name.span, (*used, *labels), help)


def _together(calls: Sequence[Misfit]) -> Fix | None:
    """The fixes of all calls as one."""
    fixes = [call.fix for call in calls if call.fix is not None]
    if not fixes or len(fixes) < len(calls):
        return None
    return Fix(fixes[0].message, tuple(edit for fix in fixes for edit in fix.edits))
