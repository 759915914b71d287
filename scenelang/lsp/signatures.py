"""The signature of the call at the cursor."""

from __future__ import annotations

import re

from lsprotocol import types

from scenelang.lsp.callees import find_callee
from scenelang.lsp.context import cursor_at
from scenelang.lsp.text import width
from scenelang.lsp.workspace import Document, Workspace


def signature_help(docs: Workspace, document: Document, offset: int) -> types.SignatureHelp | None:
    """How what is being called is called, and which argument the cursor is in."""
    cursor = cursor_at(document.parsed, offset)
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
        about = types.MarkupContent(types.MarkupKind.Markdown, callee.about.get(param, ""))
        label: str | tuple[int, int] = param
        if match is not None:
            # Offsets into a label count UTF-16, whatever positions count.
            label = (
                width(callee.head[: match.start()], "utf-16"),
                width(callee.head[: match.end()], "utf-16"),
            )
            at = match.end()
        parameters.append(types.ParameterInformation(label, about if about.value else None))
    text = types.MarkupContent(types.MarkupKind.Markdown, callee.text) if callee.text else None
    if active is not None and active >= len(parameters):
        active = None
    signature = types.SignatureInformation(callee.head, text, parameters, active)
    return types.SignatureHelp([signature], 0, active)
