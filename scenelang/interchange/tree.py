"""A syntax tree as data and as text, for `scenelang dump --after syntax`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

from scenelang.deep import deep_stack
from scenelang.diagnostics.span import Span
from scenelang.syntax import nodes


def tree_data(file: nodes.File) -> dict[str, Any]:
    """The tree as JSON data: each node's kind, its fields and its place (from 1, the end exclusive)."""
    with deep_stack():
        return _data(file)  # type: ignore[no-any-return]


def _data(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_data(item) for item in value]
    if isinstance(value, Span):
        start, end = value.locate()
        return {"start": _position(start), "end": _position(end)}
    if not hasattr(value, "__dataclass_fields__"):
        return value
    return {"node": type(value).__name__, **{f.name: _data(getattr(value, f.name)) for f in fields(value)}}


def _position(place: tuple[int, int]) -> dict[str, int]:
    return {"line": place[0], "column": place[1]}


def tree_text(file: nodes.File) -> str:
    """One line for each node: the field that holds it, its kind, what is not a node in it, its place."""
    with deep_stack():
        return "".join(_lines(file, "", ""))


def _lines(node: Any, margin: str, label: str) -> Iterator[str]:
    words: list[str] = []
    inside: list[tuple[str, Any]] = []
    for field in fields(node):
        value = getattr(node, field.name)
        if isinstance(value, Span) or value in (None, (), False, "") or field.name == "is_integer":
            continue
        if isinstance(value, nodes.Name):
            words.append(value.text if field.name == "name" else f"{field.name}={value.text}")
        elif hasattr(value, "__dataclass_fields__"):
            inside.append((f"{field.name}: ", value))
        elif isinstance(value, tuple) and hasattr(value[0], "__dataclass_fields__"):
            one = len(value) == 1 and field.name not in ("statements", "items")
            inside += [(f"{field.name}: " if one else "", item) for item in value]
        else:
            words.append(
                repr(value) if isinstance(value, str) and field.name == "value" else _word(field.name, value)
            )
    line, column = node.span.locate()[0]
    said = " ".join([f"{label}{type(node).__name__}", *words])
    yield f"{margin}{said}  @{line}:{column}\n"
    for name, child in inside:
        yield from _lines(child, margin + "  ", name)


def _word(name: str, value: Any) -> str:
    if value is True:
        return name
    if isinstance(value, float) and value.is_integer():
        value = int(value) if abs(value) < 1e15 else value
    return str(value) if name in ("value", "op", "unit") else f"{name}={value}"
