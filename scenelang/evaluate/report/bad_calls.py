"""Calls that do not fit what they call: those of one definition that fail alike are told as one.

Whoever changes what a function takes breaks every call of it, and has made one mistake. So calls are
collected while files are prepared, and told about when all of them are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from scenelang.diagnostics.diagnostic import Diagnostic, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.evaluate.report.undefined import shown_places, uses
from scenelang.evaluate.session import Session
from scenelang.syntax import nodes


@dataclass(frozen=True, slots=True)
class Misfit:
    """How a call fails.

    Args:
        code: code of the diagnostic.
        way: what tells it from other ways to fail: calls that share it are told together.
        message: the fact about one call.
        call: the call's name.
        span: where the call shows it.
        everywhere: what is added to the message where all calls fail so.
        here: words for the place of a call where several are told together.
        help: advice.
        fix: a safe change of this call.
        labels: further places.
        blamed: the place in the definition that the call disagrees with; by default its name.
    """

    code: str
    way: tuple[str, ...]
    message: str
    call: Span
    span: Span
    everywhere: str
    here: str
    help: str | None = None
    fix: Fix | None = None
    labels: tuple[Label, ...] = ()
    blamed: Span | None = None


def report_misfit(session: Session, misfit: Misfit, definition: nodes.Fn | nodes.Module | None) -> None:
    """Report a call, or keep it until all calls of its definition are known.

    Args:
        session: where it is reported.
        misfit: how the call fails.
        definition: what is called; None for what the language has.
    """
    if definition is None:
        _error(session, misfit)
    elif not session.follows(misfit.code, misfit.span):
        _, calls = session.misfits.setdefault(id(definition), (definition, {}))
        calls.setdefault(misfit.span, misfit)


def report_misfits(session: Session) -> None:
    """Report the calls that were kept, when everything has been prepared."""
    for definition, found in session.misfits.values():
        calls = list(found.values())
        lost = _lost_parameter(session, definition, calls)
        if lost is not None or _all_fail(session, definition, calls):
            _report_definition(session, definition, calls, lost)
            continue
        ways: dict[tuple[str, ...], list[Misfit]] = {}
        for call in calls:
            ways.setdefault((call.code, *call.way), []).append(call)
        for alike in ways.values():
            again = shown_places([call.span for call in alike[1:]], "also here", "in")
            first = alike[0]
            _error(session, replace(first, labels=(*first.labels, *again), fix=_together(alike)))
    session.misfits.clear()


def _error(session: Session, misfit: Misfit) -> None:
    session.error(
        misfit.code, misfit.message, misfit.span, help=misfit.help, fix=misfit.fix, labels=misfit.labels
    )


def _number_failing(calls: Sequence[Misfit]) -> int:
    return len({(id(call.call.source), call.call.start) for call in calls})


def _all_fail(
    session: Session, definition: nodes.Fn | nodes.Module, calls: Sequence[Misfit], least: int = 2
) -> bool:
    """Whether no call of a definition in its file fits it."""
    name, number = definition.name, _number_failing(calls)
    there = uses(session, name.span.source).get(name.text, ())
    inside = all(call.call.source is name.span.source for call in calls)
    return inside and number >= least and len(there) == number + 1


def _lost_parameter(
    session: Session, definition: nodes.Fn | nodes.Module, calls: Sequence[Misfit]
) -> tuple[int, str] | None:
    """The index of an unknown name that a definition uses and all its calls give, and the name.

    `fn f(a) = a + b;` where all calls give two arguments, or one named `b`, has lost a parameter.
    """
    found = [
        (index, name)
        for (code, name, _), (index, _, _) in session.unknown.items()
        if code == "E0201" and _is_within(session.diagnostics.items[index].span, definition.span)
    ]
    if len(found) != 1 or not _all_fail(session, definition, calls, least=1):
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
    session: Session,
    definition: nodes.Fn | nodes.Module,
    calls: Sequence[Misfit],
    lost: tuple[int, str] | None,
) -> None:
    """Report a definition that no call of it fits."""
    first, name, items = calls[0], definition.name, session.diagnostics.items
    alike = len({(call.code, *call.way) for call in calls}) == 1
    labels = shown_places([call.span for call in calls], [call.here for call in calls], "in")
    message = f"{first.message}, {first.everywhere}" if alike else f"no call of '{name.text}' fits it"
    if lost is None:
        code = first.code if alike else "E0308"
        place = (first.blamed or name.span) if alike else name.span
        session.error(
            code, message, place, help=first.help, fix=_together(calls) if alike else None, labels=labels
        )
        return
    index, missing = lost
    inside = items[index]
    help = f"'{missing}' is used inside: add it to the parameters"
    used = (Label(inside.span, "it is not a parameter"),) if inside.span else ()
    items[index] = Diagnostic("E0308", message, name.span, (*used, *labels), help)


def _together(calls: Sequence[Misfit]) -> Fix | None:
    """The fixes of all calls as one."""
    fixes = [call.fix for call in calls if call.fix is not None]
    if not fixes or len(fixes) < len(calls):
        return None
    return Fix(fixes[0].message, tuple(edit for fix in fixes for edit in fix.edits))
