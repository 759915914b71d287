"""Walking the tree: what holds a place, and everything below a node."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from functools import cache
from typing import Any

from scenelang.diagnostics.span import Span
from scenelang.syntax.incremental import Parsed

_LEAVES = (Span, str, int, float, bool, type(None))


@cache
def _names(cls: type) -> tuple[str, ...]:
    return tuple(f.name for f in fields(cls) if f.name != "span")


def children(node: Any) -> Iterator[Any]:
    """The nodes right below a node, in no particular order."""
    for name in _names(node.__class__):
        value = getattr(node, name)
        if isinstance(value, tuple):
            for item in value:
                if not isinstance(item, _LEAVES):
                    yield item
        elif not isinstance(value, _LEAVES):
            yield value


def walk(node: Any) -> Iterator[Any]:
    """A node and everything below it."""
    stack = [node]
    while stack:
        at = stack.pop()
        yield at
        stack.extend(children(at))


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
