"""The shape of a file: symbols, folding, growing selections."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any, Final

from lsprotocol import types

from scenelang.lsp.context import path_to
from scenelang.lsp.workspace import Document, Workspace
from scenelang.syntax import nodes
from scenelang.syntax.nodes import walk

Kind = types.SymbolKind
_DEFINES: Final = {
    nodes.Param: Kind.Property,
    nodes.Let: Kind.Variable,
    nodes.Fn: Kind.Function,
    nodes.Module: Kind.Module,
}
# Possessive: a string or comment without end is read once, not once for each of its characters.
_COMMENT: Final = re.compile(
    r'"(?:[^"\\\n]|\\[^\n])*+"?|/\*(?:[\s\S]*?\*/|[\s\S]*)|(?:^[ \t]*+//[^\n]*+\n?)++', re.MULTILINE
)


def document_symbols(document: Document) -> list[types.DocumentSymbol]:
    """The file's definitions and objects as a tree."""
    return list(_symbols(document.file.statements, document))


def _symbols(statements: Iterable[nodes.Stmt], document: Document) -> Iterator[types.DocumentSymbol]:
    for stmt in statements:
        word = ""
        if isinstance(stmt, nodes.Combined):
            word, stmt = f"{stmt.op} ", stmt.child
        entry = _entry(stmt)
        if entry is None:
            continue
        name, kind, selection, inner, detail = entry
        yield types.DocumentSymbol(
            name=word + name,
            kind=kind,
            range=document.lines.span(stmt.span),
            selection_range=document.lines.span(selection),
            detail=detail or None,
            children=list(_symbols(inner, document)),
        )


def _entry(stmt: nodes.Stmt) -> tuple[str, types.SymbolKind, Any, tuple[nodes.Stmt, ...], str] | None:
    match stmt:
        case nodes.Param() | nodes.Let():
            value = stmt.default if isinstance(stmt, nodes.Param) else stmt.value
            shown = " ".join(value.span.text.split())[:60]
            return stmt.name.text, _DEFINES[type(stmt)], stmt.name.span, (), shown
        case nodes.Fn() | nodes.Module():
            inner = stmt.body.statements if isinstance(stmt, nodes.Module) else ()
            params = ", ".join(p.name.text for p in stmt.params)
            return stmt.name.text, _DEFINES[type(stmt)], stmt.name.span, inner, f"({params})"
        case nodes.Import():
            return stmt.alias.text, Kind.File, stmt.alias.span, (), stmt.path.value
        case nodes.Node():
            return stmt.kind, Kind.Struct, stmt.keyword, stmt.body.statements, ""
        case nodes.For():
            return f"for {stmt.variable.text}", Kind.Array, stmt.variable.span, stmt.body.statements, ""
        case nodes.If():
            inner = stmt.then.statements
            other = stmt.otherwise
            inner += (other,) if isinstance(other, nodes.If) else other.statements if other else ()
            return "if", Kind.Boolean, stmt.condition.span, inner, ""
        case nodes.Call() if stmt.body is not None or stmt.args is None:
            within = stmt.body.statements if stmt.body else ()
            nested = tuple(s for s in within if isinstance(s, nodes.Let | nodes.For | nodes.If))
            return stmt.name.text, Kind.Object, stmt.name.span, nested, ""
        case _:
            return None


def workspace_symbols(docs: Workspace, query: str) -> list[types.WorkspaceSymbol]:
    """Definitions at the top of all files whose names have the letters of a query, in order."""
    query, found = query.lower(), []
    for document in docs.known():
        for stmt in document.parsed.file.statements:
            if isinstance(stmt, nodes.Param | nodes.Let | nodes.Fn | nodes.Module):
                letters = iter(stmt.name.text.lower())
                if not all(letter in letters for letter in query):
                    continue
                place = types.Location(document.uri, document.lines.span(stmt.name.span))
                kind = _DEFINES[type(stmt)]
                found.append(types.WorkspaceSymbol(place, stmt.name.text, kind, container_name=document.name))
                if len(found) >= 500:
                    return found
    return found


# ---------------------------------------------------------------- folding


def folding(document: Document) -> list[types.FoldingRange]:
    """Blocks, brackets, comments and runs of imports that take more than a line."""
    found: dict[int, types.FoldingRange] = {}
    lines = document.lines

    def add(start: int, end: int, kind: types.FoldingRangeKind | None = None, tail: int = 0) -> None:
        first, last = lines.position(start).line, lines.position(end).line - tail
        if last > first:
            found.setdefault(first, types.FoldingRange(first, last, kind=kind))

    for stmt in document.file.statements:
        for node in walk(stmt):
            if isinstance(node, nodes.Block | nodes.Vector):
                closes = document.text[node.span.end - 1 : node.span.end] in ("}", "]")
                add(node.span.start, node.span.end, None, int(closes))
    for group, run in groupby(document.file.statements, lambda stmt: isinstance(stmt, nodes.Import)):
        if group:
            imports = list(run)
            add(imports[0].span.start, imports[-1].span.end, types.FoldingRangeKind.Imports)
    for match in _COMMENT.finditer(document.text):
        if not match[0].startswith('"'):
            add(match.start(), match.end() - match[0].endswith("\n"), types.FoldingRangeKind.Comment)
    return [found[line] for line in sorted(found)]


def selection(document: Document, offset: int) -> types.SelectionRange:
    """The nodes around an offset, innermost first, each within the next."""
    spans = [(0, len(document.text)), *((n.span.start, n.span.end) for n in path_to(document.parsed, offset))]
    use = document.names.at(offset)
    if use is not None:
        spans.append((use.start, use.end))
    found: types.SelectionRange | None = None
    last = (-1, -1)
    for start, end in spans:
        if (start, end) != last and (last == (-1, -1) or (last[0] <= start and end <= last[1])):
            found = types.SelectionRange(document.lines.range(start, end), found)
            last = (start, end)
    assert found is not None
    return found
