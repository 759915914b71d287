"""Reporting names that stand for nothing: once a name, and at its definition where that has the slip."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Final, Literal

from scenelang.diagnostics.diagnostic import Diagnostic, Edit, Fix, Label
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.diagnostics.suggest import Suggestion, did_you_mean, is_slip, listing, ranked
from scenelang.evaluate.file_context import FileContext, Place
from scenelang.evaluate.names import Binding, Scope
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.report.reporter import Advice, Reporter, Shared, shown_places
from scenelang.scene import library
from scenelang.syntax import nodes
from scenelang.words import ANIMATED, CONSTANTS, FUNCTIONS, GEOMETRIES, MATERIALS, OPERATIONS, TRANSFORMS

VALUES: Final = ("let", "param", "argument", "loop")
"""Kinds of bindings that are values."""

_CODES: Final = {"module": "E0204", "fn": "E0207"}


def reported_at_definition(
    report: Reporter, text: str, source: SourceFile, defined: Iterable[tuple[str, Span | None, str]]
) -> bool:
    """Report a name that is used several times at the definition that was misspelt, if there is one.

    ``defined`` are the names around it, each with its place and the kind of its binding.
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
    place: Place,
    code: str,
    message: str,
    *,
    advise: Callable[[], Advice],
    kinds: tuple[str, ...] = (),
) -> None:
    """Report a name that stands for nothing; again only as a further place of the first report.

    Args:
        advise: makes advice and a safe change; where there is neither an unused name nearby is suggested.
        kinds: kinds of bindings that it could have stood for.
    """
    report, source = place.report, place.file.source
    key = (code, name.text, source)
    known = report.shared.get(key)
    if known is not None:
        report.share(known, name.span)
        return
    if key in report.at_definition or report.follows(code, name.span):
        return
    around = within_effort(place, kinds)
    if reported_at_definition(report, name.text, source, [(n, b.span, b.kind) for n, b in around]):
        report.at_definition.add(key)
        return
    help, fix = advise()
    if help is None:
        unused = [n for n, b in around if report.is_unused(n, b.span)]
        help, _ = did_you_mean(name.text, unused, name.span, slips=1, effort=report.effort)
    meant = help.name if isinstance(help, Suggestion) else None
    suggested = next((b.labels() for n, b in around if n == meant), ())
    owner, found, calls = place.scope.slots.owner, None, []
    if owner is not None and code == "E0201":
        ways = ("E0308", "surplus"), ("E0206", name.text)
        calls = [(*way, owner.source, owner) for way in ways]
        found = next((misfit for call in calls if (misfit := report.shared.get(call)) is not None), None)
    if owner is not None and found is not None and found.code != code:  # calls give what it has lost
        report.diagnostics.items[found.index] = Diagnostic(code, message, name.span)
        found.code, found.own, found.again = code, (), {}
        advise_parameter(report, found, owner)
    else:
        found = report.error(code, message, name.span, help=help, fix=fix, labels=suggested)
    if found is not None:
        report.shared.update(dict.fromkeys([key, *calls], found))


def advise_parameter(report: Reporter, unknown: Shared, owner: Span) -> None:
    """An unknown name in a definition that is called with more than it takes: it has lost a parameter."""
    items, help = report.diagnostics.items, f"add it to the parameters of `{owner.text}`"
    items[unknown.index] = replace(items[unknown.index], help=help, fix=None)


def within_effort(place: Place, kinds: Sequence[str]) -> list[tuple[str, Binding]]:
    """The names in sight of some kinds; none any more where looking through them has taken too long."""
    effort = place.report.effort
    if effort.spent:
        return []
    seen = list(place.scope.visible())
    effort.left -= 2 * len(seen)
    return [(n, b) for n, b in seen if b.kind in kinds]


def unknown_member(
    name: nodes.Name,
    place: Place,
    exported: FileContext | None,
    what: Literal["name", "material"] = "name",
    kinds: Sequence[str] = (),
) -> None:
    """Report that an imported file has no such name; nothing is known of one that cannot be read.

    ``kinds`` are those of bindings that may stand here, if it has any of them.
    """
    alias, _, rest = name.text.partition(".")
    if exported is None or (exported.damage and exported.damage.loses(rest)):
        return
    last = Span(name.span.source, name.span.end - len(rest), name.span.end)
    if what == "material":
        known = [*exported.materials]
    elif rest in exported.materials:
        help = f"write material {name.text}"
        place.report.error("E0213", f"`{name.text}` is the name of a material", name.span, help=help)
        return
    else:
        names = exported.scope.names
        known = [n for n, b in names.items() if b.kind in kinds] or [
            n for n, b in names.items() if b.kind != "import"
        ]
    missing = f"`{alias}` has no {'material ' if what == 'material' else ''}`{rest}`"

    def advise() -> Advice:
        help, fix = did_you_mean(rest, known, last, effort=place.report.effort)
        if help is None and library.holds(exported.source):
            from scenelang.evaluate.report.foreign_words import SHAPES  # only mistakes need it

            shape = SHAPES.get(rest.lower())
            if shape is not None and shape.module in known:
                return f"it is called {alias}.{shape.call} here", Fix(
                    f"write `{shape.module}`", (Edit(last, shape.module),)
                )
        return help or (f"it has {listing(known)}" if known else f"it defines no {what}"), fix

    nowhere = place._replace(scope=Scope(place.file.scope.slots))
    report_unknown(nodes.Name(last, rest), nowhere, "E0212", missing, advise=advise)


def report_early(name: nodes.Name, place: Place) -> bool:
    """Report a name that a later line defines, if one does."""
    scopes = place.scope.outwards()
    later = next((scope.later[name.text] for scope in scopes if name.text in scope.later), None)
    if later is not None:
        message, labels = f"`{name.text}` is used before its line", (Label(later, "defined here"),)
        help = f"move the definition of `{name.text}` above this line"
        place.report.error("E0203", message, name.span, labels=labels, help=help)
    return later is not None


def unknown(name: nodes.Name, place: Place, call: nodes.CallExpr | None = None) -> None:
    """Report a name that stands for nothing in an expression, perhaps the one that is called."""
    text, damage = name.text, place.file.damage
    if damage and damage.loses(text):
        return
    alias, dot, _ = text.partition(".")
    if dot:
        head = Span(name.span.source, name.span.start, name.span.start + len(alias))
        unknown(nodes.Name(head, alias), place)
    elif not report_early(name, place):
        kinds = ("fn",) if call else (*VALUES, "import")
        code, what = ("E0207", "function") if call else ("E0201", "name")
        message = f"unknown {what} `{text}`"
        report_unknown(
            name, place, code, message, advise=lambda: _advice(name, place, call, kinds), kinds=kinds
        )


def _advice(name: nodes.Name, place: Place, call: nodes.CallExpr | None, kinds: tuple[str, ...]) -> Advice:
    """What may have been meant by a name in an expression."""
    text, span, effort = name.text, name.span, place.report.effort
    lower = text.lower()
    if call and text in foreign_words.FUNCTIONS:
        from scenelang.evaluate.report.habits import call_advice  # only mistakes need it

        return call_advice(text, call)
    if call and text in TRANSFORMS:
        return f"transforms are statements of a block: square {{ {call.span.text}; }}", None
    if text in MATERIALS or text in GEOMETRIES:
        if span.source.text[span.end : span.end + 1] == "." and text in GEOMETRIES:
            return f"what moves it stands in its block: {text} {{ translate(0.5, 0); }}", None
        if text in GEOMETRIES:
            return f"objects are not values; one to use again is module part() {{ {text}; }}", None
        colour = call.args[0].value.span.text if call and len(call.args) == 1 else None
        written = f"material {text}" + (f" {{ color({colour or '…'}); }}" if call else "")
        whole = Fix(f"write `{written}`", (Edit(call.span if call else span, written),))
        return f"a material is written {written}", whole if colour or not call else None
    before = span.source.text[max(0, span.start - 20) : span.start].replace(" ", "")
    if text in ("x", "y", "z") and before.endswith("axis="):
        return "the axes are X, Y and Z", Fix(f"write `{text.upper()}`", (Edit(span, text.upper()),))
    if before.strip().endswith("model"):
        return "a model is named by a string", Fix("put quotes around it", (Edit(span, f'"{text}"'),))
    if not call and lower in foreign_words.VALUES:
        return foreign_words.VALUES[lower], None
    own = FUNCTIONS if call else (*CONSTANTS, *ANIMATED, "true", "false")
    visible = (n for n, _ in within_effort(place, kinds))
    help, fix = did_you_mean(text, {*visible, *own}, span, effort=effort)
    here = None if call else foreign_words.NAMES.get(lower)
    colour = None if call else foreign_words.COLOURS.get(lower)
    if text in foreign_words.LIBRARIES and span.source.text[span.end : span.end + 1] == ".":
        prefix = Span(span.source, span.start, span.end + 1)
        return "functions and constants stand alone", Fix(f"remove `{text}.`", (Edit(prefix, ""),))
    if here is not None and here.lower() != lower:
        return f"it is called `{here}` here", Fix(f"write `{here}`", (Edit(span, here),))
    if help is None and colour is not None:
        fix = Fix(f"write `{colour}`", (Edit(span, colour),))
        return f"colours have no names; {lower} is {colour}", fix
    return help, fix


def report_rebound(place: Place, name: nodes.Name, known: Binding | None) -> None:
    """`i = i + 1;` where `i` is bound, `fill = #d33;` in a block: no `let` is missing."""
    start, items = name.span.start, place.report.diagnostics.items
    before = name.span.source.text[max(0, start - 20) : start].rstrip()
    unused = known is None and place.report.is_unused(name.text, name.span)
    help = _set_otherwise(place, name.text.lower()) if unused else None
    if before[-1:].isalpha() or (help is None and (known is None or known.span is None)):
        return  # a `let` does stand there
    for index, d in enumerate(items):
        if d.code == "E0126" and d.span is not None and d.span.start == start:
            from scenelang.syntax.recovery.foreign import ONCE, ONCE_HELP  # only mistakes need it

            message, labels = ONCE.replace("<n>", name.text), known.labels() if known is not None else ()
            if help is not None:
                message = f"`{name.text}` is not set"
            items[index] = Diagnostic("E0133", message, name.span, labels, help or ONCE_HELP)


def _set_otherwise(place: Place, word: str) -> str | None:
    """Statement for a property that other languages set in a block."""
    meant = foreign_words.WORDS.get(word, "")
    if place.kind in ("file", "unknown"):
        return None
    if meant in OPERATIONS.keys() - TRANSFORMS.keys():
        from scenelang.evaluate.report.spaces import material_advice  # only mistakes need it

        return f"write {material_advice(place, meant)}"
    return f"write {meant}(…);" if meant in TRANSFORMS else foreign_words.STATEMENTS.get(word)
