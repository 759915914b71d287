"""Names in expressions: variables, and what imported files bring."""

from __future__ import annotations

from typing import Any

from scenelang.evaluate.file_context import FileContext, Place
from scenelang.evaluate.names import UNBOUND, Binding, Env
from scenelang.evaluate.prepare.expressions import POISONED, Code, constant, prepare
from scenelang.evaluate.prepare.operations import member
from scenelang.evaluate.report.undefined import VALUES, unknown, unknown_member
from scenelang.evaluate.values.functions import CONSTANTS, FUNCTIONS
from scenelang.evaluate.values.value import POISON
from scenelang.syntax import nodes
from scenelang.words import ANIMATED


def value_of(name: nodes.Name, binding: Binding, place: Place) -> Code:
    """The value of a variable."""
    slots, slot, report, span = binding.slots, binding.slot, place.report, name.span
    if binding.needs is not None:
        place.session.needs.on.append(binding.needs)
    if binding.kind == "poison" or slots is None:
        return POISONED
    if slots is place.scope.slots:
        if binding.known:
            return constant(binding.value)
        if slots.root is None:
            return Code(lambda env: env[slot])
    root, reach = slots.root, place.scope.reach(slots)

    def run(env: Env) -> Any:
        value = (reach(env) if root is None else root)[slot]
        if value is UNBOUND:
            message = f"`{name.text}` is used before its line has run"
            report.error("E0203", message, span, labels=binding.labels())
            return POISON
        return value

    return Code(run)


def lookup(name: nodes.Name, place: Place) -> Binding | None:
    """The binding of a plain or qualified name; None where it is unknown, unreported."""
    alias, dot, rest = name.text.partition(".")
    binding = place.scope.find(alias)
    if not dot:
        return binding
    if binding is None or binding.kind != "import":
        return None
    if binding.value is None:
        return Binding("poison")
    exported: FileContext = binding.value
    found = exported.scope.names.get(rest)
    return None if found is None or found.kind == "import" else found


def wrong_kind(
    name: nodes.Name, binding: Binding, place: Place, wanted: str, help: str | None = None
) -> None:
    """Report a name that stands for something else than is wanted here."""
    kinds = {"fn": "a function", "module": "a module", "import": "an imported file", "element": "a geometry"}
    message = f"`{name.text}` is {kinds.get(binding.kind, 'a value')}, not {wanted}"
    key = "E0213", message, place.file.source, binding.span
    place.report.error_once(key, "E0213", message, name.span, help=help, labels=binding.labels())


def _as_value(name: nodes.Name, binding: Binding, place: Place) -> Code:
    if binding.kind in VALUES or binding.kind == "poison":
        return value_of(name, binding, place)
    wrong_kind(name, binding, place, "a value", f"call it: {name.text}(…)" if binding.kind == "fn" else None)
    return POISONED


def prepare_name(expr: nodes.NameRef, place: Place) -> Code:
    binding = place.scope.find(expr.name.text)
    return _own_name(expr.name, place) if binding is None else _as_value(expr.name, binding, place)


def _own_name(name: nodes.Name, place: Place) -> Code:
    """A constant of the language or a variable of the animation."""
    text, session = name.text, place.session
    if text in CONSTANTS:
        return constant(CONSTANTS[text])
    if text not in ANIMATED:
        if text in FUNCTIONS:
            message = f"`{text}` is a function, not a value"
            place.report.error("E0213", message, name.span, help=f"call it: {text}(…)")
        else:
            unknown(name, place)
        return POISONED
    if "animate" in place.report.damage(place.file.source).words:
        return POISONED
    index = [*ANIMATED].index(text)
    session.needs.frame |= text != "frames"
    if session.animated[index] is not UNBOUND:
        if text != "frames" and not session.still and not place.file.prefix:
            session.still = True
            help = "make time run: animate(seconds = 2, fps = 24);"
            place.report.warn("W0304", f"`{text}` is 0 in a scene without animate(…)", name.span, help)
        return constant(session.animated[index])

    def run(env: Env) -> Any:
        value = session.animated[index]
        if value is UNBOUND:
            help = "move the line that needs it below animate(…)"
            session.report.error("E0203", f"`{text}` is used before animate(…)", name.span, help=help)
            return POISON
        return value

    return Code(run)


def prepare_member(expr: nodes.Member, place: Place) -> Code:
    value = expr.value
    binding = place.scope.find(value.name.text) if isinstance(value, nodes.NameRef) else None
    if binding is None or binding.kind != "import":
        code = prepare(value, place)
        return POISONED if code.value is POISON else member(code, expr.name, place, value)
    name = nodes.Name(expr.span, f"{value.span.text}.{expr.name.text}")
    found = lookup(name, place)
    if found is not None:
        return _as_value(name, found, place)
    unknown_member(name, place, binding.value)
    return POISONED
