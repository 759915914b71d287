"""Trees and diagnostics at other places: the same values with every span moved."""

from __future__ import annotations

from typing import Any, TypeVar

from scenelang.diagnostics.span import SourceFile, Span

T = TypeVar("T")


def move(value: T, delta: int, source: SourceFile) -> T:
    """A tree of `syntax.nodes` or a diagnostic with its spans ``delta`` further on, in ``source``."""
    moved: T = _move(value, delta, source)
    return moved


def _move(value: Any, delta: int, source: SourceFile) -> Any:
    cls = value.__class__
    if cls is Span:
        return Span(source, value.start + delta, value.end + delta)
    if cls is tuple:
        return tuple([_move(item, delta, source) for item in value])
    names = getattr(cls, "__match_args__", ())
    return cls(*[_move(getattr(value, name), delta, source) for name in names]) if names else value
