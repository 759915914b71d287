"""The context of a place: nodes around it, and the call and block that it is in, by tokens alone."""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from typing import Any, Final, Literal

from lsprotocol import types

from scenelang.assets.records import Record
from scenelang.editors.workspace import Document, Workspace, width
from scenelang.language import tree
from scenelang.language.definitions import Symbol
from scenelang.language.lexer import Tokens
from scenelang.language.tree import children
from scenelang.language.words import COMBINE, LETTERS, NODES, Word, word_for_call


def path_to(file: tree.File, offset: int) -> list[Any]:
    """The nodes that hold an offset, outermost first; empty between statements."""
    index = bisect_right(file.statements, offset, key=lambda stmt: stmt.span.start) - 1
    if index < 0 or offset > file.statements[index].span.end:
        return []
    path: list[Any] = [file.statements[index]]
    while True:
        inner = [n for n in children(path[-1]) if n.span.start <= offset <= n.span.end]
        if not inner:
            return path
        # Of two that touch at the offset, the one that begins there counts.
        path.append(max(inner, key=lambda n: (n.span.start, -n.span.end)))


BlockKind = Literal["file", "group", "chain", "object", "material"]
_HOLDERS: Final = {*NODES, "module"}
_COMMENTS: Final = re.compile(r"//[^\n]*+\n?|/\*(?:[\s\S]*?\*/|[\s\S]*)")


class OpenCall(Record):
    """A call whose parentheses the cursor is in."""

    name: str  # of the callee, perhaps dotted
    start: int  # offset of the name
    index: int  # of the positional argument that the cursor is in
    named: str | None  # name of that argument, if it has one
    given: frozenset[str]  # names of the other arguments so far


class OpenBlock(Record):
    """A block around the cursor."""

    kind: BlockKind  # the statements that it may hold
    head: str  # first word of its statement
    nested: bool = False  # whether a `for` or `if` lies between it and the cursor


class Cursor(Record):
    """The tokens around an offset, and the call and the block that it is in."""

    offset: int
    start: int  # of the word that the cursor is in or behind; `offset` where there is none
    end: int
    inside: Literal["comment", "string", "number", "colour", "code"]
    before: tuple[str, ...]  # tokens of the statement before that word
    call: OpenCall | None
    block: OpenBlock


def cursor_at(tokens: Tokens, offset: int, values: frozenset[str] = frozenset()) -> Cursor:
    """The cursor at an offset; ``values`` are visible names that may be materials."""
    count = len(tokens.kinds) - 1
    index = min(bisect_left(tokens.starts, offset), count)  # tokens before this one begin before the cursor
    start = end = offset
    inside: Literal["comment", "string", "number", "colour", "code"] = "code"
    if index and tokens.end_before(index) >= offset:
        token = index - 1
        kind, text = tokens.name(token), tokens.text(token)
        if kind == "STRING":
            closed = len(text) > 1 and text.endswith('"') and tokens.ends[token] == offset
            inside = "code" if closed else "string"
        elif kind == "NUMBER":
            inside = "number"
        elif kind == "COLOR":
            inside = "colour"
        if inside != "code" or text[:1].isalpha() or text[:1] == "_":
            (start, end), index = tokens.place(token), token
    else:
        gap = tokens.source.text[tokens.end_before(index) : offset]
        *_, last = [None, *_COMMENTS.finditer(gap)]
        closes = "\n" if last is not None and last[0][1] == "/" else "*/"
        if last is not None and last.end() == len(gap) and not last[0][2:].endswith(closes):
            inside = "comment"
    head = tokens.head(index)
    before = tuple(tokens.text(at) for at in range(head, index))
    block = _block(tokens, index, values)
    return Cursor(offset, start, end, inside, before, _call(tokens, head, index), block)


def _call(tokens: Tokens, head: int, index: int) -> OpenCall | None:
    """The innermost call whose parentheses are open before a token."""
    depth = commas = 0
    given: set[str] = set()
    named: str | None = None
    fresh = True  # still in the argument that the cursor is in
    for at in range(index - 1, head - 1, -1):
        kind = tokens.name(at)
        if kind in (")", "]"):
            depth += 1
        elif kind in ("(", "["):
            if depth:
                depth -= 1
                continue
            if kind == "[":
                commas, fresh, named = 0, True, None
                given.clear()
                continue
            name, start = _callee(tokens, head, at)
            return OpenCall(name, start, commas, named, frozenset(given)) if name else None
        elif depth == 0 and kind == ",":
            commas += 1
            fresh = False
        elif depth == 0 and kind == "=" and at > head and tokens.name(at - 1) in ("NAME", "step", "as"):
            if fresh:
                named = tokens.text(at - 1)
            else:
                given.add(tokens.text(at - 1))
    return None


def _callee(tokens: Tokens, head: int, opening: int) -> tuple[str, int]:
    """The name before a `(`, and where it begins; empty for a parenthesis of another kind."""
    at = opening - 1
    if at < head or tokens.name(at) not in ("NAME", "step", "as", "smooth", "subtract", "intersect"):
        return "", 0
    if at > head and tokens.name(at - 1) in ("fn", "module"):
        return "", 0
    name, start = tokens.text(at), tokens.starts[at]
    while at - 2 >= head and tokens.name(at - 1) == "." and tokens.name(at - 2) == "NAME":
        at -= 2
        name, start = f"{tokens.text(at)}.{name}", tokens.starts[at]
    return name, start


def _block(tokens: Tokens, index: int, values: frozenset[str]) -> OpenBlock:
    nested = False
    for brace in reversed(tokens.unmatched(index)[0]):
        words = [tokens.text(at) for at in range(tokens.head(brace), brace)]
        while words[1:] and words[0] in COMBINE:
            rest = words[1:]
            if rest[0] == "(" and ")" in rest:  # the width of a blend
                rest = rest[rest.index(")") + 1 :]
            words = rest or words[:1]
        first = words[0] if words else ""
        if first in ("for", "if", "else"):
            nested = True
            continue
        if first in _HOLDERS:
            kind: BlockKind = "chain" if first == "chain" else "group"
            return OpenBlock(kind, first, nested)
        if "material" in words[-2:] or "material" in words[-4:-1] or (first in values and len(words) == 1):
            return OpenBlock("material", first, nested)
        return OpenBlock("object", first, nested)
    return OpenBlock("file", "", nested)


_LINE: Final = re.compile(r"^[ \t]*//(.*)$")
_MAX_SHOWN: Final = 200


def find_callee(docs: Workspace, document: Document, cursor: Cursor) -> Word | None:
    """The callee of the call around the cursor; None where there is none or it is unknown."""
    if (call := cursor.call) is None:
        return None
    result = find_symbol(docs, document, call.name, call.start)
    alias, _, rest = call.name.partition(".")
    outer = document.names.scope_at(call.start).find(alias) if rest in LETTERS else None
    if outer is not None and isinstance(outer.node, tree.Import):
        zoo = docs.zoo(document, outer.node)
        return LETTERS[rest] if zoo is not None and zoo.font is not None else None
    return word_of(result) if result else word_for_call(call.name, cursor.block.kind == "material")


def find_symbol(docs: Workspace, document: Document, name: str, offset: int) -> Symbol | None:
    """The fn or module of a plain or dotted name at an offset."""
    alias, _, rest = name.partition(".")
    symbol = document.names_at(offset).scope_at(offset).find(alias)
    if rest and symbol is not None and isinstance(symbol.node, tree.Import):
        library = docs.imported(document, symbol.node.path.value)
        symbol = library.names.top.names.get(rest) if library is not None else None
        if symbol is None or not symbol.is_exported:
            return None
    return symbol if symbol is not None and symbol.kind in ("fn", "module") else None


def signature_help(docs: Workspace, document: Document, offset: int) -> types.SignatureHelp | None:
    """The signature of the call around an offset, with the argument that the offset is in."""
    cursor = cursor_at(document.tokens_to(offset), offset)
    callee = find_callee(docs, document, cursor)
    if callee is None or cursor.call is None or cursor.inside == "comment":
        return None
    active: int | None = cursor.call.index
    if (named := cursor.call.named) is not None:
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
    called = f"{symbol.name}({', '.join(_short(p.node.span.text) for p in symbol.params)})"
    if isinstance(node, tree.Module):
        head = f"module {called}"
    elif isinstance(node, tree.Fn):
        head = f"fn {called} = {_short(node.body.span.text)}"
    elif isinstance(node, tree.For | tree.ForItem):
        head = f"for ({symbol.name} in {_short(node.iterable.span.text)})"
    elif isinstance(node, tree.Parameter):
        head = f"(parameter) {_short(node.span.text)}"
    else:
        head = _short(node.span.text)
    return Word(symbol.name, head, comment_above(symbol), tuple(p.name for p in symbol.params))


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= _MAX_SHOWN else text[: _MAX_SHOWN - 1] + "…"


def comment_above(symbol: Symbol) -> str:
    """The lines of comment right above a definition, or behind it on its line."""
    if isinstance(symbol.node, tree.Parameter | tree.For | tree.ForItem):
        return ""
    # The node's own text: it may be of an older version than the document's.
    span = symbol.node.span
    text = span.source.text
    result: list[str] = []
    start = text.rfind("\n", 0, span.start) + 1
    while start:
        above = text.rfind("\n", 0, start - 1) + 1
        if (match := _LINE.match(text[above : start - 1].rstrip("\r"))) is None:
            break
        result.insert(0, match[1].strip())
        start = above
    end = text.find("\n", span.end)
    behind = _LINE.match(text[span.end : end if end >= 0 else len(text)].rstrip("\r"))
    if behind and not isinstance(symbol.node, tree.Module):
        result.append(behind[1].strip())
    return "\n".join(result)
