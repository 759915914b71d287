"""Reporting names that stand for nothing: once a name, with the one that was most likely meant."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, Literal

from scenelang.diagnostics.diagnostic import Edit, Fix, Label
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import did_you_mean, listing
from scenelang.evaluate.file_context import FileContext, Place
from scenelang.evaluate.names import Scope
from scenelang.evaluate.report import foreign_words
from scenelang.evaluate.report.reporter import Advice
from scenelang.scene import library
from scenelang.syntax import nodes
from scenelang.words import ANIMATED, CONSTANTS, FUNCTIONS, GEOMETRIES, MATERIALS, TRANSFORMS

VALUES: Final = ("let", "param", "argument", "loop")
"""Kinds of bindings that are values."""


def report_unknown(
    name: nodes.Name, place: Place, code: str, message: str, advise: Callable[[], Advice]
) -> None:
    """Report a name that stands for nothing; again only as a further place of the first report."""
    report, key = place.report, (code, name.text, name.span.source)
    known = key in report.shared or report.follows(code, name.span)
    help, fix = (None, None) if known else advise()
    report.error_once(key, code, message, name.span, help=help, fix=fix)


def visible(place: Place, kinds: Sequence[str]) -> set[str]:
    """The names in sight of some kinds; none any more where looking through them has taken too long."""
    effort = place.report.effort
    if effort.spent:
        return set()
    seen = list(place.scope.visible())
    effort.left -= 2 * len(seen)
    return {name for name, binding in seen if binding.kind in kinds}


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
    if exported is None or place.report.damage(exported.source).explains("E0212", _last(name)):
        return
    last = _last(name)
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
        shape = foreign_words.SHAPES.get(rest.lower()) if library.holds(exported.source) else None
        if help is None and shape is not None:
            return f"it is called {alias}.{shape} here", None
        return help or (f"it has {listing(known)}" if known else f"it defines no {what}"), fix

    nowhere = place._replace(scope=Scope(place.file.scope.slots))
    report_unknown(nodes.Name(last, rest), nowhere, "E0212", missing, advise)


def _last(name: nodes.Name) -> Span:
    """The place of what stands behind the first dot of a name."""
    rest = name.text.partition(".")[2]
    return Span(name.span.source, name.span.end - len(rest), name.span.end)


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
    alias, dot, _ = name.text.partition(".")
    if dot:
        head = Span(name.span.source, name.span.start, name.span.start + len(alias))
        unknown(nodes.Name(head, alias), place)
    elif not report_early(name, place):
        code, what = ("E0207", "function") if call else ("E0201", "name")
        report_unknown(name, place, code, f"unknown {what} `{name.text}`", lambda: _advice(name, place, call))


def _advice(name: nodes.Name, place: Place, call: nodes.CallExpr | None) -> Advice:
    """What may have been meant by a name in an expression."""
    text, span = name.text, name.span
    lower, source = text.lower(), span.source.text
    dotted = source[span.end : span.end + 1] == "."
    if call and text in foreign_words.FUNCTIONS:
        return foreign_words.FUNCTIONS[text], None
    if call and text in TRANSFORMS:
        return f"transforms are statements of a block: square {{ {call.span.text}; }}", None
    if text in MATERIALS:
        return f"a material is written material {text}" + " { color(…); }" * bool(call), None
    if text in GEOMETRIES:
        moved = f"what moves it stands in its block: {text} {{ translate(0.5, 0); }}"
        return moved if dotted else f"objects are not values; write module part() {{ {text}; }}", None
    if text in foreign_words.LIBRARIES and dotted:
        prefix = Span(span.source, span.start, span.end + 1)
        return "functions and constants stand alone", Fix(f"remove `{text}.`", (Edit(prefix, ""),))
    before = source[max(0, span.start - 20) : span.start].rstrip()
    if before.endswith("model") and place.scope.find(text) is None:
        return "a model is named by a string", Fix("put quotes around it", (Edit(span, f'"{text}"'),))
    if text in ("x", "y", "z") and before.replace(" ", "").endswith("axis="):
        return "the axes are X, Y and Z", Fix(f"write `{text.upper()}`", (Edit(span, text.upper()),))
    own = {*FUNCTIONS} if call else {*CONSTANTS, *ANIMATED, "true", "false"}
    kinds = ("fn",) if call else (*VALUES, "import")
    if not call and lower in foreign_words.VALUES:
        return foreign_words.VALUES[lower], None
    here = None if call else foreign_words.NAMES.get(lower)
    if here is not None and here.lower() != lower:
        return f"it is called `{here}` here", Fix(f"write `{here}`", (Edit(span, here),))
    help, fix = did_you_mean(text, visible(place, kinds) | own, span, effort=place.report.effort)
    colour = None if call else foreign_words.COLOURS.get(lower)
    if help is None and colour is not None:
        fix = Fix(f"write `{colour}`", (Edit(span, colour),))
        return f"colours have no names; {lower} is {colour}", fix
    return help, fix
