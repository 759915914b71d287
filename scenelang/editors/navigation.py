"""Navigation: definition, references, highlights, rename, links, symbols, folding, growing selections."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any, Final

from lsprotocol import types

from scenelang.editors.context import path_to
from scenelang.editors.workspace import Document, Workspace, uri_of
from scenelang.language import library, tree
from scenelang.language.definitions import Symbol, Use
from scenelang.language.tree import walk
from scenelang.language.words import LANGUAGE, RESERVED, STAGE

_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


class RenameRefused(Exception):
    """Raised where a name cannot be changed, with the reason."""


def definition(docs: Workspace, document: Document, offset: int) -> types.Location | None:
    """The definition of the name at an offset; for an import's path the file."""
    if (use := document.names.at(offset)) is None:
        return None
    if use.role == "path":
        library = docs.imported(document, use.text)
        return types.Location(library.uri, library.lines.range(0, 0)) if library is not None else None
    result = docs.definition(document, use)
    if result is None and use.symbol is not None and use.symbol.kind == "import":
        result = document, use.symbol  # a file of elements
    if result is None:
        return None
    where, symbol = result
    return types.Location(where.uri, where.lines.span(symbol.span))


def references(docs: Workspace, document: Document, offset: int, declaration: bool) -> list[types.Location]:
    """All uses of the definition that the name at an offset means."""
    use = document.names.at(offset)
    result = docs.definition(document, use) if use is not None else None
    return [
        types.Location(where.uri, where.lines.range(use.start, use.end))
        for where, use in (docs.uses(*result) if result is not None else ())
        if declaration or not use.defines
    ]


def highlights(docs: Workspace, document: Document, offset: int) -> list[types.DocumentHighlight]:
    """The uses in this file of the definition that the name at an offset means."""
    if (use := document.names.at(offset)) is None:
        return []
    result = docs.definition(document, use)

    def alike(other: Use) -> bool:
        if result is None:  # a word of the language: the same word elsewhere
            return other.role == use.role
        meant = docs.definition(document, other)
        return meant is not None and meant[1] is result[1]

    same = [other for other in document.names.uses if other.text == use.text and alike(other)]
    read, write = types.DocumentHighlightKind.Read, types.DocumentHighlightKind.Write
    place = document.lines.range
    return [types.DocumentHighlight(place(u.start, u.end), write if u.defines else read) for u in same]


def prepare_rename(docs: Workspace, document: Document, offset: int) -> types.PrepareRenamePlaceholder | None:
    """The name at an offset; raises `RenameRefused` where it belongs to the language or to a model."""
    if (use := document.names.at(offset)) is None:
        return None
    if (result := docs.definition(document, use)) is None:
        raise RenameRefused(f"`{use.text}` is not defined in a scene file")
    _check_owner(result[0], use)
    return types.PrepareRenamePlaceholder(document.lines.range(use.start, use.end), use.text)


def rename(
    docs: Workspace, document: Document, offset: int, new: str, versioned: bool
) -> types.WorkspaceEdit | None:
    """Rename a definition and all its uses, in all files, in versioned edits where the client takes them.

    Raises `RenameRefused` where the new name is not a name, or would mean something else somewhere.
    """
    use = document.names.at(offset)
    result = docs.definition(document, use) if use is not None else None
    if result is None or use is None:
        return None
    where, symbol = result
    _check_owner(where, use)
    if new == symbol.name:
        return None
    if not _NAME.fullmatch(new):
        raise RenameRefused(f"`{new}` is not a name: letters, digits and _, not beginning with a digit")
    if new in RESERVED:
        raise RenameRefused(f"`{new}` is a keyword")
    if symbol.kind == "module" and new in LANGUAGE:
        raise RenameRefused(f"`{new}` is a word of the language and names no module")
    places = list(docs.uses(where, symbol))
    for other, place in places:
        _check_place(other, place, symbol, new)
    _check_captures(docs, where, symbol, new)
    edits: dict[str, list[types.TextEdit]] = {}
    for other, place in places:
        edits.setdefault(other.uri, []).append(types.TextEdit(other.lines.range(place.start, place.end), new))
    if not versioned:
        return types.WorkspaceEdit(changes=edits)
    name, versions = types.OptionalVersionedTextDocumentIdentifier, {d.uri: d.version for d, _ in places}
    changes = [types.TextDocumentEdit(name(uri, versions[uri]), edits[uri]) for uri in edits]
    return types.WorkspaceEdit(document_changes=changes)


def _check_owner(where: Document, use: Use) -> None:
    if where.path is not None and library.owns(where.path):
        raise RenameRefused(f"`{use.text}` belongs to the library that ships")


def _check_place(other: Document, place: Use, symbol: Symbol, new: str) -> None:
    """Raise `RenameRefused` where the new name already means something else at a place to rename."""
    if place.role in ("member", "argument"):
        return
    scope = symbol.scope if place.defines else other.names.scope_at(place.start)
    for inner in scope.outwards():
        if (taken := inner.names.get(new)) is not None:
            line = taken.span.locate()[0][0]
            raise RenameRefused(f"`{new}` is already defined in line {line} of {other.name}")
        if inner is symbol.scope:
            return


def _check_captures(docs: Workspace, where: Document, symbol: Symbol, new: str) -> None:
    """Raise `RenameRefused` where the new name, now of something else, would come to mean the definition."""
    scope = symbol.scope
    if symbol.owner is not None and any(p.name == new for p in symbol.owner.params):
        raise RenameRefused(f"`{symbol.owner.name}` has a parameter `{new}` already")
    for use in where.names.uses:
        if use.text != new or use.role in ("member", "argument", "property", "material", "model", "path"):
            continue
        if not scope.start <= use.start < scope.end:
            continue
        meant = where.names.scope_at(use.start).find(new)
        if meant is None or not (scope.start <= meant.scope.start and meant.scope.end <= scope.end):
            line = where.lines.position(use.start).line + 1
            raise RenameRefused(f"`{new}` in line {line} of {where.name} would mean this")


def links(docs: Workspace, document: Document) -> list[types.DocumentLink]:
    """Links of imports whose files there are."""
    result = []
    for path in (stmt.path for stmt in document.file.statements if isinstance(stmt, tree.Import)):
        if (library := docs.imported(document, path.value)) is not None and library.path is not None:
            place = document.lines.range(path.span.start + 1, max(path.span.end - 1, 0))
            result.append(types.DocumentLink(place, uri_of(library.path), tooltip=str(library.path)))
    return result


Kind = types.SymbolKind
_DEFINES: Final = {
    tree.Param: Kind.Property,
    tree.Let: Kind.Variable,
    tree.Fn: Kind.Function,
    tree.Module: Kind.Module,
}
# Possessive: a string or comment without end is read once, not once for each of its characters.
_COMMENT: Final = re.compile(
    r'"(?:[^"\\\n]|\\[^\n])*+"?|/\*(?:[\s\S]*?\*/|[\s\S]*)|(?:^[ \t]*+//[^\n]*+\n?)++', re.MULTILINE
)


def symbols(document: Document, statements: Iterable[tree.Stmt]) -> Iterator[types.DocumentSymbol]:
    """Definitions and objects among statements, as a tree."""
    for stmt in statements:
        word = ""
        if isinstance(stmt, tree.Combined):
            word, stmt = f"{stmt.op} ", stmt.child
        if (entry := _entry(stmt)) is None:
            continue
        name, kind, selection, inner, detail = entry
        yield types.DocumentSymbol(
            name=word + name,
            kind=kind,
            range=document.lines.span(stmt.span),
            selection_range=document.lines.span(selection),
            detail=detail or None,
            children=list(symbols(document, inner)),
        )


def _entry(stmt: tree.Stmt) -> tuple[str, types.SymbolKind, Any, tuple[tree.Stmt, ...], str] | None:
    match stmt:
        case tree.Param() | tree.Let():
            value = stmt.default if isinstance(stmt, tree.Param) else stmt.value
            shown = " ".join(value.span.text.split())[:60]
            return stmt.name.text, _DEFINES[type(stmt)], stmt.name.span, (), shown
        case tree.Fn() | tree.Module():
            inner = stmt.body.statements if isinstance(stmt, tree.Module) else ()
            params = ", ".join(p.name.text for p in stmt.params)
            return stmt.name.text, _DEFINES[type(stmt)], stmt.name.span, inner, f"({params})"
        case tree.Import():
            return stmt.alias.text, Kind.File, stmt.alias.span, (), stmt.path.value
        case tree.Node():
            detail = f"({', '.join(arg.span.text for arg in stmt.args)})" if stmt.args else ""
            return stmt.kind, Kind.Struct, stmt.keyword, stmt.body.statements, detail
        case tree.Call() if stmt.name.text in STAGE and stmt.args is not None and stmt.body is None:
            detail = f"({', '.join(arg.span.text for arg in stmt.args)})"
            return stmt.name.text, Kind.Field, stmt.name.span, (), detail
        case tree.For():
            return f"for {stmt.variable.text}", Kind.Array, stmt.variable.span, stmt.body.statements, ""
        case tree.If():
            inner = stmt.then.statements
            other = stmt.otherwise
            inner += (other,) if isinstance(other, tree.If) else other.statements if other else ()
            return "if", Kind.Boolean, stmt.condition.span, inner, ""
        case tree.Call() if stmt.body is not None or stmt.args is None:
            within = stmt.body.statements if stmt.body else ()
            nested = tuple(s for s in within if isinstance(s, tree.Let | tree.For | tree.If))
            return stmt.name.text, Kind.Object, stmt.name.span, nested, ""
        case _:
            return None


def workspace_symbols(docs: Workspace, query: str) -> list[types.WorkspaceSymbol]:
    """Definitions at the top of all files whose names have the letters of a query, in order."""
    query, result = query.lower(), []
    for document in docs.known():
        for stmt in document.file.statements:
            if isinstance(stmt, tree.Param | tree.Let | tree.Fn | tree.Module):
                letters = iter(stmt.name.text.lower())
                if not all(letter in letters for letter in query):
                    continue
                place = types.Location(document.uri, document.lines.span(stmt.name.span))
                kind = _DEFINES[type(stmt)]
                result += [types.WorkspaceSymbol(place, stmt.name.text, kind, container_name=document.name)]
                if len(result) >= 500:
                    return result
    return result


def folding(document: Document) -> list[types.FoldingRange]:
    """Blocks, brackets, comments and runs of imports that take more than a line."""
    result: dict[int, types.FoldingRange] = {}
    lines = document.lines

    def add(start: int, end: int, kind: types.FoldingRangeKind | None = None, tail: int = 0) -> None:
        first, last = lines.position(start).line, lines.position(end).line - tail
        if last > first:
            result.setdefault(first, types.FoldingRange(first, last, kind=kind))

    for stmt in document.file.statements:
        for node in walk(stmt):
            if isinstance(node, tree.Block | tree.Vector):
                closes = document.text[node.span.end - 1 : node.span.end] in ("}", "]")
                add(node.span.start, node.span.end, None, int(closes))
    for group, run in groupby(document.file.statements, lambda stmt: isinstance(stmt, tree.Import)):
        if group:
            imports = list(run)
            add(imports[0].span.start, imports[-1].span.end, types.FoldingRangeKind.Imports)
    for match in _COMMENT.finditer(document.text):
        if not match[0].startswith('"'):
            add(match.start(), match.end() - match[0].endswith("\n"), types.FoldingRangeKind.Comment)
    return [result[line] for line in sorted(result)]


def selection(document: Document, offset: int) -> types.SelectionRange:
    """The nodes around an offset, innermost first, each within the next."""
    spans = [(0, len(document.text)), *((n.span.start, n.span.end) for n in path_to(document.file, offset))]
    if (use := document.names.at(offset)) is not None:
        spans.append((use.start, use.end))
    result: types.SelectionRange | None = None
    last = (-1, -1)
    for start, end in spans:
        if (start, end) != last and (last == (-1, -1) or (last[0] <= start and end <= last[1])):
            result = types.SelectionRange(document.lines.range(start, end), result)
            last = (start, end)
    assert result is not None
    return result
