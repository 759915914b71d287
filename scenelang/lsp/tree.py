"""Walking the tree: what holds a place, everything below a node, and the names in sight of a place."""

from __future__ import annotations

from typing import Any, Final

from scenelang.diagnostics.span import Span
from scenelang.resolve.names import Names
from scenelang.resolve.symbols import Kind, Symbol
from scenelang.syntax import nodes
from scenelang.syntax.incremental import Parsed
from scenelang.syntax.nodes import children


def path_to(parsed: Parsed, offset: int) -> list[Any]:
    """The nodes that hold an offset, outermost first; empty between statements."""
    index = parsed.at(offset)
    if index is None:
        return []
    path: list[Any] = [parsed.statement(index)]
    while True:
        inner = [n for n in children(path[-1]) if n.span.start <= offset <= n.span.end]
        if not inner:
            return path
        # Where two touch at the offset, the one that begins there is meant.
        path.append(max(inner, key=lambda n: (n.span.start, -n.span.end)))


_Defining = nodes.Param | nodes.Let | nodes.Fn | nodes.Module | nodes.Import
_TOP: Final[dict[type, Kind]] = {
    nodes.Param: "param",
    nodes.Let: "let",
    nodes.Fn: "fn",
    nodes.Module: "module",
    nodes.Import: "import",
}


def sight_at(parsed: Parsed, offset: int) -> Names:
    """The names in sight of an offset: those of its statement, and what the others define at top level.

    This is what a keystroke asks for. It takes the other statements' trees where they stand, moved or not,
    so that the nodes of their symbols are good for text and not for places.
    """
    index = parsed.at(offset)
    whole = Span(parsed.source, 0, len(parsed.source.text))
    names = Names(nodes.File(() if index is None else (parsed.statement(index),), whole))
    top = names.top
    for at, stmt in enumerate(parsed.heads()):
        kind = _TOP.get(stmt.__class__)
        if kind is None or at == index or not isinstance(stmt, _Defining):
            continue
        name = stmt.alias if isinstance(stmt, nodes.Import) else stmt.name
        symbol = Symbol(name.text, kind, name.span, stmt, top, parsed.ends[at])
        if isinstance(stmt, nodes.Fn | nodes.Module):
            symbol.since = 0
            symbol.params = [
                Symbol(p.name.text, "argument", p.name.span, p, top, 0, symbol) for p in stmt.params
            ]
        top.symbols.setdefault(symbol.name, symbol)
    return names
