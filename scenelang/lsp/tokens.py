"""Semantic tokens: what names are, which a grammar of regular expressions cannot know."""

from __future__ import annotations

import re
from typing import Final

from lsprotocol import types

from scenelang.lsp.text import width
from scenelang.lsp.workspace import Document, Workspace
from scenelang.resolve.symbols import Symbol, Use
from scenelang.syntax.tables import tables

TYPES: Final = (
    *("comment", "keyword", "number", "string", "operator"),
    *("variable", "parameter", "property", "function", "namespace", "class", "method", "macro", "enumMember"),
)
MODIFIERS: Final = ("declaration", "readonly", "defaultLibrary")
LEGEND: Final = types.SemanticTokensLegend(list(TYPES), list(MODIFIERS))
_COMMENTS: Final = re.compile(r"//[^\n]*|/\*[\s\S]*?(?:\*/|\Z)")
_ROLES: Final = {
    "function": ("function", 4),
    "constant": ("variable", 6),
    "animated": ("variable", 4),
    "geometry": ("class", 4),
    "transform": ("method", 4),
    "operation": ("method", 4),
    "setting": ("macro", 4),
    "material": ("enumMember", 4),
    "argument": ("parameter", 0),
    "property": ("property", 0),
    "model": ("string", 0),
    "path": ("string", 0),
}
_KINDS: Final = {
    "let": ("variable", 2),
    "param": ("property", 2),
    "argument": ("parameter", 0),
    "loop": ("variable", 0),
    "fn": ("function", 0),
    "module": ("class", 0),
    "import": ("namespace", 0),
}


def semantic_tokens(docs: Workspace, document: Document, place: types.Range | None = None) -> list[int]:
    """The tokens of a text or of a range, encoded as the protocol wants them."""
    low, high = 0, len(document.text)
    if place is not None:
        low, high = document.lines.offset(place.start), document.lines.offset(place.end)
    found = [item for item in _tokens(docs, document, low, high) if item[1] > low and item[0] < high]
    data: list[int] = []
    line = column = 0
    for start, end, kind, modifiers in sorted(found):
        at = document.lines.position(start)
        length = width(document.text[start:end], document.encoding)
        data += (at.line - line, at.character - column if at.line == line else at.character)
        data += (length, TYPES.index(kind), modifiers)
        line, column = at.line, at.character
    return data


def _tokens(docs: Workspace, document: Document, low: int, high: int) -> list[tuple[int, int, str, int]]:
    text, tokens = document.text, document.parsed.tokens
    names = tables().kinds
    uses = {use.start: use for use in document.names.uses}
    found: list[tuple[int, int, str, int]] = []
    before = 0
    for kind, start, end in zip(tokens.kinds, tokens.starts, tokens.ends, strict=True):
        if before < start and before < high and start > low:
            found += _comments(text, before, start)
        before = end
        if start == end or end <= low or start >= high:
            continue
        use = uses.get(start)
        name = names[kind]
        if use is not None and use.end <= end and use.role not in ("path", "model"):
            found.append((start, end, *_named(docs, document, use)))
        elif name == "NUMBER" or name == "COLOR":
            found.append((start, end, "number", 0))
        elif name == "STRING":
            found.append((start, end, "string", 0))
        elif name[0].isalpha() and name != "NAME":
            found.append((start, end, "keyword", 0))
        elif name not in ("NAME", "(", ")", "[", "]", "{", "}", ",", ";", "."):
            found.append((start, end, "operator", 0))
    return [item for item in found if "\n" not in text[item[0] : item[1]]]


def _comments(text: str, start: int, end: int) -> list[tuple[int, int, str, int]]:
    """Comments between two tokens, line by line, as a token must not span lines."""
    found = []
    for match in _COMMENTS.finditer(text, start, end):
        at = match.start()
        for part in match[0].splitlines(keepends=True):
            bare = part.rstrip("\r\n")
            if bare:
                found.append((at, at + len(bare), "comment", 0))
            at += len(part)
    return found


def _named(docs: Workspace, document: Document, use: Use) -> tuple[str, int]:
    symbol: Symbol | None = use.symbol
    if use.role == "member":
        target = docs.definition(document, use)
        symbol = target[1] if target is not None else None
    if use.role in ("name", "member") and symbol is not None:
        kind, modifiers = _KINDS[symbol.kind]
        return kind, modifiers | int(use.defines)
    return _ROLES.get(use.role, ("variable", 0))
