"""Reporting names that stand for nothing: once a name, and at its definition where that has the slip."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Final

from scenelang.diagnostics.diagnostic import Diagnostic, Edit, Fix, Label
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.diagnostics.suggest import did_you_mean, is_slip, listing, ranked
from scenelang.evaluate.file_context import Unit
from scenelang.evaluate.names import Binding, Scope
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.report.reporter import Advice, Reporter, shown_places
from scenelang.syntax import nodes
from scenelang.words import ANIMATED, CONSTANTS, FUNCTIONS

VALUES: Final = ("let", "param", "argument", "loop")
"""Kinds of bindings that are values."""

_CODES: Final = {"module": "E0204", "fn": "E0207"}


def told_at_definition(
    report: Reporter, text: str, source: SourceFile, defined: Iterable[tuple[str, Span | None, str]]
) -> bool:
    """Report a name that is used several times at the definition that was misspelt, if there is one.

    Args:
        report: where it is reported.
        text: the unknown name.
        source: the file that it is used in.
        defined: names that are defined around it, each with its place and the kind of its binding.
    """
    places = report.uses(source).get(text, [])
    if len(places) < 2 or "." in text or report.effort.spent:
        return False
    spans = {name: (span, kind) for name, span, kind in defined if report.is_unused(name, span)}
    near = ranked(text, spans, max(1, len(text) // 3), report.effort)
    if not near or (near[1:] and near[1][0] - near[0][0] < 0.5):
        return False
    name = near[0][1]
    span, kind = spans[name]
    if span is None or span.source is not source:
        return False
    report.error(
        _CODES.get(kind, "E0201"),
        f"`{name}` is defined here, `{text}` is used",
        span,
        help=f"did you mean to define `{text}`?",
        fix=Fix(f"rename to `{text}`", (Edit(span, text),)) if is_slip(text, name, near[0][0]) else None,
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
    report = unit.session.report
    key = (code, name.text, id(unit.source))
    known, items = report.unknown.get(key), report.diagnostics.items
    if known is not None and known.index < len(items) and items[known.index].code == code:
        report.share(known, name.span)
        return
    if key in report.told or report.follows(code, name.span):
        return
    around = within_effort(report, scope, kinds)
    defined = [(n, b.span, b.kind) for n, b in around]
    if told_at_definition(report, name.text, unit.source, defined):
        report.told.add(key)
        return
    labels: tuple[Label, ...] = ()
    help, fix = advise()
    if help is None:
        unused = [n for n, b in around if report.is_unused(n, b.span)]
        help, _ = did_you_mean(name.text, unused, name.span, slips=1, effort=report.effort)
    suggested = _suggested(help, around)
    if suggested is not None and suggested.span is not None:
        labels = (Label(suggested.span, "defined here"),)
    found = report.error(code, message, name.span, help=help, fix=fix, labels=labels)
    if found is not None:
        report.unknown[key] = found


def within_effort(report: Reporter, scope: Scope, kinds: Sequence[str]) -> list[tuple[str, Binding]]:
    """The names in sight of some kinds; none any more where looking through them has taken too long."""
    if report.effort.spent:
        return []
    seen = list(scope.visible())
    report.effort.left -= 2 * len(seen)
    return [(n, b) for n, b in seen if b.kind in kinds]


def _suggested(help: str | None, around: list[tuple[str, Binding]]) -> Binding | None:
    """The binding whose name a help text suggests."""
    return next((b for n, b in around if help == f"did you mean `{n}`?"), None)


def unknown_member(name: nodes.Name, unit: Unit, exported: Unit) -> None:
    """Report that an imported file has no such name."""
    alias, _, rest = name.text.partition(".")
    if exported.damage and exported.damage.loses(rest):
        return
    last = Span(name.span.source, name.span.end - len(rest), name.span.end)

    def advise() -> Advice:
        known = [n for n, b in exported.scope.names.items() if b.kind != "import"]
        help, fix = did_you_mean(rest, known, last, effort=unit.session.report.effort)
        return help or (f"it has {listing(known)}" if known else "it defines nothing"), fix

    end = nodes.Name(rest, last)
    report_unknown(end, unit, Scope(unit.frame), "E0212", f"`{alias}` has no `{rest}`", advise=advise)


def unknown(name: nodes.Name, unit: Unit, scope: Scope, call: nodes.CallExpr | None = None) -> None:
    """Report a name that stands for nothing in an expression, perhaps the one that is called."""
    text, report = name.text, unit.session.report
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
            f"`{text}` is used before its line",
            f"move the definition of `{text}` above this line",
        )
        labels = (Label(later, "defined here"),)
        report.error("E0203", message, name.span, labels=labels, help=advice)
        return
    kinds = ("fn",) if call else (*VALUES, "import")
    own = FUNCTIONS if call else (*CONSTANTS, *ANIMATED, "true", "false")

    def advise() -> Advice:
        if call and text in foreign_words.FUNCTIONS:
            from scenelang.evaluate.report.habits import call_advice  # only mistakes need it

            return call_advice(text, call)
        if not call and text.lower() in foreign_words.VALUES:
            return foreign_words.VALUES[text.lower()], None
        visible = (n for n, _ in within_effort(report, scope, kinds))
        help, fix = did_you_mean(text, {*visible, *own}, name.span, effort=report.effort)
        here = None if call else foreign_words.NAMES.get(text.lower())
        colour = None if call else foreign_words.COLOURS.get(text.lower())
        if text in foreign_words.LIBRARIES and unit.source.text[name.span.end : name.span.end + 1] == ".":
            prefix = Span(name.span.source, name.span.start, name.span.end + 1)
            help, fix = "functions and constants stand alone", Fix(f"remove `{text}.`", (Edit(prefix, ""),))
        elif here is not None and here.lower() != text.lower():
            help, fix = f"it is called `{here}` here", Fix(f"write `{here}`", (Edit(name.span, here),))
        elif help is None and colour is not None:
            help = f"colours have no names; {text.lower()} is {colour}"
            fix = Fix(f"write `{colour}`", (Edit(name.span, colour),))
        return help, fix

    code, what = ("E0207", "function") if call else ("E0201", "name")
    report_unknown(name, unit, scope, code, f"unknown {what} `{text}`", advise=advise, kinds=kinds)


def tell_bound(report: Reporter, name: nodes.Name, known: Binding | None) -> None:
    """`i = i + 1;` where `i` is bound: that no `let` stands before it is not what is wrong."""
    start, items = name.span.start, report.diagnostics.items
    before = name.span.source.text[max(0, start - 20) : start].rstrip()
    if known is None or known.span is None or before[-1:].isalpha():
        return  # a `let` does stand there
    for index, d in enumerate(items):
        if d.code == "E0126" and d.span is not None and d.span.start == start:
            from scenelang.syntax.foreign import ONCE, ONCE_HELP  # only mistakes need it

            labels = (Label(known.span, "defined here"),)
            items[index] = Diagnostic("E0133", ONCE.replace("<n>", name.text), name.span, labels, ONCE_HELP)
