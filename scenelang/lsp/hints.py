"""Inlay hints: what lets came to, and which parameter an argument is for."""

from __future__ import annotations

from typing import Final

from lsprotocol import types

from scenelang.lsp import values
from scenelang.lsp.callees import find_symbol, word_of
from scenelang.lsp.hover import seen_at
from scenelang.lsp.server import Settings
from scenelang.lsp.workspace import Document, Workspace
from scenelang.syntax import nodes
from scenelang.syntax.nodes import walk
from scenelang.words import word_for_call

_LONGEST: Final = 28
_PLAIN: Final = (nodes.Number, nodes.String, nodes.Bool, nodes.Color)
_CLEAR: Final = frozenset(
    {"translate", "rotate", "scale", "canvas", "color", "min", "max", "rgb", "hsv", "animate"}
)


def inlay_hints(
    docs: Workspace, document: Document, place: types.Range, settings: Settings
) -> list[types.InlayHint]:
    """The hints of a range."""
    low, high = document.lines.offset(place.start), document.lines.offset(place.end)
    found: list[types.InlayHint] = []
    parsed = document.parsed
    for index, (start, end) in enumerate(zip(parsed.starts, parsed.ends, strict=True)):
        if end < low or start > high:
            continue
        for node in walk(parsed.statement(index)):
            if node.span.end < low or node.span.start > high:
                continue
            if isinstance(node, nodes.Let) and settings.value_hints:
                hint = _value(document, node)
                if hint is not None:
                    found.append(hint)
            elif isinstance(node, nodes.Call | nodes.CallExpr) and settings.argument_hints:
                found += _arguments(docs, document, node)
    found.sort(key=lambda hint: (hint.position.line, hint.position.character))
    return found


def _value(document: Document, let: nodes.Let) -> types.InlayHint | None:
    """What a let came to, unless it is written there or differs from pass to pass."""
    if _is_plain(let.value):
        return None
    seen = seen_at(document, document, let.name.span.start, let.name.span.end)
    if seen is None or not seen.values:
        return None
    shown = {values.show_value(value) for value in seen.values}
    text = shown.pop()
    if shown or text is None or len(text) > _LONGEST or text == let.value.span.text:
        return None
    return types.InlayHint(
        document.lines.position(let.value.span.end),
        f" = {text}",
        padding_left=False,
        tooltip="the value that this scene gives it",
    )


def _is_plain(expr: nodes.Expr) -> bool:
    if isinstance(expr, nodes.Unary):
        return _is_plain(expr.operand)
    if isinstance(expr, nodes.Vector):
        return all(_is_plain(item) for item in expr.items)
    return isinstance(expr, _PLAIN)


def _arguments(
    docs: Workspace, document: Document, call: nodes.Call | nodes.CallExpr
) -> list[types.InlayHint]:
    name = call.name.text
    args = call.args or ()
    if name in _CLEAR or not args:
        return []
    found = find_symbol(docs, document, document.names, name, call.name.span.start)
    callee = word_of(found[1]) if found is not None else word_for_call(name, False)
    if callee is None or callee.variadic or len(callee.params) < 2:
        return []
    hints = []
    for arg, param in zip(args, callee.params, strict=False):
        value = arg.value
        alike = isinstance(value, nodes.NameRef) and value.name.text == param
        if arg.name is not None or alike or isinstance(value, nodes.BadExpr):
            continue
        if found is None and len(param) == 1:
            continue  # x, y, t: shorter than any help
        place = document.lines.position(arg.span.start)
        hints.append(types.InlayHint(place, f"{param}:", types.InlayHintKind.Parameter, padding_right=True))
    return hints
