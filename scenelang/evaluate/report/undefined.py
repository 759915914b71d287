"""Reporting names that stand for nothing: once a name, and at its definition where that has the slip."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from itertools import islice
from typing import Final

from scenelang.diagnostics.diagnostic import Diagnostic, Edit, Fix, Label
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.diagnostics.suggest import did_you_mean, is_slip, listing, ranked
from scenelang.evaluate.file_context import Unit
from scenelang.evaluate.names import Binding, Scope
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.session import Session
from scenelang.evaluate.values.functions import ANIMATED, CONSTANTS, FUNCTIONS
from scenelang.syntax import nodes
from scenelang.syntax.lexer import scan
from scenelang.syntax.tables import tables
from scenelang.syntax.tokens import Report

VALUES: Final = ("let", "param", "argument", "loop")
"""Kinds of bindings that are values."""

Advice = tuple[str | None, Fix | None]

_SHOWN: Final = 3  # places of one report
_CODES: Final = {"module": "E0204", "fn": "E0207"}


def uses(session: Session, source: SourceFile) -> dict[str, list[Span]]:
    """Where each name stands in a text, its definition included; made once, at the first unknown name."""
    known = session.names_in.get(id(source))
    if known is None:
        known = session.names_in[id(source)] = {}
        tokens = scan(source, Report(source))
        kinds = {tables().kind(name) for name in ("NAME", "step", "as")}
        for index, kind in enumerate(tokens.kinds):
            if kind in kinds:
                span = Span(source, tokens.starts[index], tokens.ends[index])
                known.setdefault(span.text, []).append(span)
    return known


def is_unused(session: Session, name: str, span: Span | None) -> bool:
    """Whether nothing in a text bears a name but its definition at ``span``."""
    return span is not None and len(uses(session, span.source).get(name, ())) == 1


def shown_places(places: Collection[Span], words: str | Sequence[str], rest: str = "") -> tuple[Label, ...]:
    """Labels for the places that share one report: the first few, and how many there are beyond.

    Args:
        places: in the order in which they were met.
        words: what is said at each place, or at all.
        rest: how the number of the others is put: "in" for "and in 2 more".
    """
    each = [words] * _SHOWN if isinstance(words, str) else words
    labels = [Label(place, text) for place, text in zip(islice(places, _SHOWN), each, strict=False)]
    if len(places) > _SHOWN:
        more = f"{rest} {len(places) - _SHOWN} more".strip()
        labels[-1] = replace(labels[-1], message=f"{labels[-1].message}, and {more}")
    return tuple(labels)


def report_shared(
    session: Session,
    key: tuple[str | int, ...],
    code: str,
    message: str,
    span: Span,
    help: str | None = None,
    labels: tuple[Label, ...] = (),
    fix: Fix | None = None,
) -> None:
    """Report a mistake, or show its place at the report of the same one with the same key.

    A fix is for one place: where there are several it is left out.
    """
    items = session.diagnostics.items
    known = session.shared.get(key)
    if known is not None:
        index, again = known
        if span != items[index].span and span not in again and not session.follows(code, span):
            again[span] = None
            labels = (*labels, *shown_places(again, "also here"))
            items[index] = replace(items[index], labels=labels, fix=None)
        return
    before = len(items)
    session.error(code, message, span, help=help, labels=labels, fix=fix)
    if len(items) > before:
        session.shared[key] = before, {}


def tell_bound(session: Session, name: nodes.Name, known: Binding | None) -> None:
    """`i = i + 1;` where `i` is bound: that no `let` stands before it is not what is wrong."""
    start, items = name.span.start, session.diagnostics.items
    before = name.span.source.text[max(0, start - 20) : start].rstrip()
    if known is None or known.span is None or before[-1:].isalpha():
        return  # a `let` does stand there
    for index, d in enumerate(items):
        if d.code == "E0126" and d.span is not None and d.span.start == start:
            from scenelang.syntax.foreign import ONCE, ONCE_HELP  # only mistakes need it

            labels = (Label(known.span, "defined here"),)
            items[index] = Diagnostic("E0133", ONCE.replace("<n>", name.text), name.span, labels, ONCE_HELP)


def told_at_definition(
    session: Session, text: str, source: SourceFile, defined: Iterable[tuple[str, Span | None, str]]
) -> bool:
    """Report a name that is used several times at the definition that was misspelt, if there is one.

    Args:
        session: where it is reported.
        text: the unknown name.
        source: the file that it is used in.
        defined: names that are defined around it, each with its place and the kind of its binding.
    """
    places = uses(session, source).get(text, [])
    if len(places) < 2 or "." in text or session.effort.spent:
        return False
    spans = {name: (span, kind) for name, span, kind in defined if is_unused(session, name, span)}
    near = ranked(text, spans, max(1, len(text) // 3), session.effort)
    if not near or (near[1:] and near[1][0] - near[0][0] < 0.5):
        return False
    name = near[0][1]
    span, kind = spans[name]
    if span is None or span.source is not source:
        return False
    session.error(
        _CODES.get(kind, "E0201"),
        f"'{name}' is defined here, '{text}' is used",
        span,
        help=f"did you mean to define '{text}'?",
        fix=Fix(f"rename to '{text}'", (Edit(span, text),)) if is_slip(text, name, near[0][0]) else None,
        labels=shown_places(places, "used here"),
    )
    return True


def report_unknown(
    name: nodes.Name,
    unit: Unit,
    scope: Scope,
    code: str,
    message: str,
    *,
    advise: Callable[[], Advice],
    kinds: tuple[str, ...] = (),
) -> None:
    """Report a name that stands for nothing; again only as a further place of the first report.

    Args:
        name: the name.
        unit: its file.
        scope: where it is used.
        code: code of the diagnostic.
        message: the fact.
        advise: makes advice and a safe change; where there is neither an unused name nearby is suggested.
        kinds: kinds of bindings that it could have stood for.
    """
    session = unit.session
    key = (code, name.text, id(unit.source))
    known = session.unknown.get(key)
    items = session.diagnostics.items
    if known is not None and known[0] < len(items) and items[known[0]].code == code:
        first, own, again = known
        if name.span != items[first].span and name.span not in again:
            again[name.span] = None
            items[first] = replace(items[first], labels=(*own, *shown_places(again, "also here")))
        return
    if key in session.told or session.follows(code, name.span):
        return
    around = within_effort(session, scope, kinds)
    defined = [(n, b.span, b.kind) for n, b in around]
    if told_at_definition(session, name.text, unit.source, defined):
        session.told.add(key)
        return
    labels: tuple[Label, ...] = ()
    help, fix = advise()
    if help is None:
        unused = [n for n, b in around if is_unused(session, n, b.span)]
        help, _ = did_you_mean(name.text, unused, name.span, slips=1, effort=session.effort)
    suggested = _suggested(help, around)
    if suggested is not None and suggested.span is not None:
        labels = (Label(suggested.span, "defined here"),)
    before = len(items)
    session.error(code, message, name.span, help=help, fix=fix, labels=labels)
    if len(items) > before:
        session.unknown[key] = before, items[before].labels, {}


def within_effort(session: Session, scope: Scope, kinds: Sequence[str]) -> list[tuple[str, Binding]]:
    """The names in sight of some kinds; none any more where looking through them has taken too long."""
    if session.effort.spent:
        return []
    seen = list(scope.visible())
    session.effort.left -= 2 * len(seen)
    return [(n, b) for n, b in seen if b.kind in kinds]


def _suggested(help: str | None, around: list[tuple[str, Binding]]) -> Binding | None:
    """The binding whose name a help text suggests."""
    return next((b for n, b in around if help == f"did you mean '{n}'?"), None)


def unknown_member(name: nodes.Name, unit: Unit, exported: Unit) -> None:
    """Report that an imported file has no such name."""
    alias, _, rest = name.text.partition(".")
    if exported.damage and exported.damage.loses(rest):
        return
    last = Span(name.span.source, name.span.end - len(rest), name.span.end)

    def advise() -> Advice:
        known = [n for n, b in exported.scope.names.items() if b.kind != "import"]
        help, fix = did_you_mean(rest, known, last, effort=unit.session.effort)
        return help or (f"it has {listing(known)}" if known else "it defines nothing"), fix

    end = nodes.Name(rest, last)
    report_unknown(end, unit, Scope(unit.frame), "E0212", f"'{alias}' has no '{rest}'", advise=advise)


def unknown(name: nodes.Name, unit: Unit, scope: Scope, call: nodes.CallExpr | None = None) -> None:
    """Report a name that stands for nothing in an expression, perhaps the one that is called."""
    text, session = name.text, unit.session
    if unit.damage and unit.damage.loses(text):
        return
    alias, dot, _ = text.partition(".")
    if dot:
        head = Span(name.span.source, name.span.start, name.span.start + len(alias))
        unknown(nodes.Name(alias, head), unit, scope)
        return
    later = scope.defined_later(text)
    if later is not None:
        message, advice = (
            f"'{text}' is used before its line",
            f"move the definition of '{text}' above this line",
        )
        labels = (Label(later, "defined here"),)
        session.error("E0203", message, name.span, labels=labels, help=advice)
        return
    kinds = ("fn",) if call else (*VALUES, "import")
    own = FUNCTIONS if call else (*CONSTANTS, *ANIMATED, "true", "false")

    def advise() -> Advice:
        if call and text in foreign_words.FUNCTIONS:
            from scenelang.evaluate.report.habits import call_advice  # only mistakes need it

            return call_advice(text, call)
        if not call and text.lower() in foreign_words.VALUES:
            return foreign_words.VALUES[text.lower()], None
        visible = (n for n, _ in within_effort(session, scope, kinds))
        help, fix = did_you_mean(text, {*visible, *own}, name.span, effort=session.effort)
        here = None if call else foreign_words.NAMES.get(text.lower())
        colour = None if call else foreign_words.COLOURS.get(text.lower())
        if text in foreign_words.LIBRARIES and unit.source.text[name.span.end : name.span.end + 1] == ".":
            prefix = Span(name.span.source, name.span.start, name.span.end + 1)
            help, fix = "functions and constants stand alone", Fix(f"remove '{text}.'", (Edit(prefix, ""),))
        elif here is not None and here.lower() != text.lower():
            help, fix = f"it is called '{here}' here", Fix(f"write '{here}'", (Edit(name.span, here),))
        elif help is None and colour is not None:
            help = f"colours have no names; {text.lower()} is {colour}"
            fix = Fix(f"write '{colour}'", (Edit(name.span, colour),))
        return help, fix

    code, what = ("E0207", "function") if call else ("E0201", "name")
    report_unknown(name, unit, scope, code, f"unknown {what} '{text}'", advise=advise, kinds=kinds)
