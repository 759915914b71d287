"""What a definition says of itself: its first line, and the comment above it."""

from __future__ import annotations

import re
from typing import Final

from scenelang.resolve.symbols import Symbol
from scenelang.syntax import nodes

_LINE: Final = re.compile(r"^[ \t]*//(.*)$")
_MAX_SHOWN: Final = 200


def describe_symbol(symbol: Symbol) -> tuple[str, str]:
    """A definition's first line, and the comment above it."""
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
    return head, comment_above(symbol)


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
