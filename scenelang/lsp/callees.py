"""What a call calls: its parameters, whoever defined them, and its signature at the cursor."""

from __future__ import annotations

import re
from typing import Final

from lsprotocol import types

from scenelang.lsp.context import Cursor, cursor_at
from scenelang.lsp.text import width
from scenelang.lsp.workspace import Document, Workspace
from scenelang.resolve.names import Names, Symbol
from scenelang.syntax import nodes
from scenelang.words import Word, word_for_call

_LINE: Final = re.compile(r"^[ \t]*//(.*)$")
_MAX_SHOWN: Final = 200


def find_callee(docs: Workspace, document: Document, cursor: Cursor) -> Word | None:
    """What the call around the cursor calls; None where there is none or it is unknown."""
    call = cursor.call
    if call is None:
        return None
    found = find_symbol(docs, document, document.names, call.name, call.start)
    return word_of(found) if found is not None else word_for_call(call.name, cursor.block.kind == "material")


def find_symbol(docs: Workspace, document: Document, names: Names, name: str, offset: int) -> Symbol | None:
    """The fn or module that a plain or dotted name stands for at an offset; ``names`` are in sight there."""
    alias, _, rest = name.partition(".")
    symbol = names.scope_at(offset).find(alias)
    if symbol is None:
        return None
    if rest and symbol.kind == "import" and isinstance(symbol.node, nodes.Import):
        library = docs.imported(document, symbol.node.path.value)
        symbol = library.names.top.symbols.get(rest) if library is not None else None
        if symbol is None or not symbol.is_exported:
            return None
    return symbol if symbol.kind in ("fn", "module") else None


def signature_help(docs: Workspace, document: Document, offset: int) -> types.SignatureHelp | None:
    """How what is being called is called, and which argument the cursor is in."""
    cursor = cursor_at(document.tokens, offset)
    callee = find_callee(docs, document, cursor)
    if callee is None or cursor.call is None or cursor.inside == "comment":
        return None
    active: int | None = cursor.call.index
    if cursor.call.named is not None:
        named = cursor.call.named
        active = callee.params.index(named) if named in callee.params else None
    elif callee.variadic:
        active = min(cursor.call.index, len(callee.params) - 1)
    parameters = []
    at = callee.head.find("(") + 1
    for param in callee.params:
        match = re.compile(rf"\b{re.escape(param)}\b").search(callee.head, at)
        about = types.MarkupContent(types.MarkupKind.Markdown, callee.notes.get(param, ""))
        label: str | tuple[int, int] = param
        if match is not None:
            # Offsets into a label count UTF-16, whatever positions count.
            start, end = (width(callee.head[:at], "utf-16") for at in match.span())
            label = start, end
            at = match.end()
        parameters.append(types.ParameterInformation(label, about if about.value else None))
    text = types.MarkupContent(types.MarkupKind.Markdown, callee.text) if callee.text else None
    if active is not None and active >= len(parameters):
        active = None
    signature = types.SignatureInformation(callee.head, text, parameters, active)
    return types.SignatureHelp([signature], 0, active)


def word_of(symbol: Symbol) -> Word:
    """A definition as a word: its first line, the comment above it, its parameters."""
    node = symbol.node
    if isinstance(node, nodes.Module):
        head = f"module {_call(symbol)}"
    elif isinstance(node, nodes.Fn):
        head = f"fn {_call(symbol)} = {_short(node.body.span.text)}"
    elif isinstance(node, nodes.For):
        head = f"for ({symbol.name} in {_short(node.iterable.span.text)})"
    elif isinstance(node, nodes.Parameter):
        head = f"(parameter) {_short(node.span.text)}"
    else:
        head = _short(node.span.text)
    return Word(symbol.name, head, comment_above(symbol), tuple(p.name for p in symbol.params))


def _call(symbol: Symbol) -> str:
    params = ", ".join(_short(p.node.span.text) for p in symbol.params)
    return f"{symbol.name}({params})"


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= _MAX_SHOWN else text[: _MAX_SHOWN - 1] + "…"


def comment_above(symbol: Symbol) -> str:
    """The lines of comment right above a definition, or behind it on its line."""
    if isinstance(symbol.node, nodes.Parameter | nodes.For):
        return ""
    # The node's own text: it may be of an older version than the document's.
    span = symbol.node.span
    text = span.source.text
    found: list[str] = []
    start = text.rfind("\n", 0, span.start) + 1
    while start:
        above = text.rfind("\n", 0, start - 1) + 1
        match = _LINE.match(text[above : start - 1].rstrip("\r"))
        if match is None:
            break
        found.insert(0, match[1].strip())
        start = above
    end = text.find("\n", span.end)
    behind = _LINE.match(text[span.end : end if end >= 0 else len(text)].rstrip("\r"))
    if behind and not isinstance(symbol.node, nodes.Module):
        found.append(behind[1].strip())
    return "\n".join(found)
