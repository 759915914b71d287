"""Trees and diagnostics at other places: the same nodes with every span moved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from operator import attrgetter
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from scenelang.diagnostics.diagnostic import Diagnostic, Edit, Fix, Label
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.syntax import nodes

N = TypeVar("N")


def move_node(node: N, delta: int, source: SourceFile) -> N:
    """A tree of `syntax.nodes` with its spans ``delta`` further on, in ``source``."""
    cls: type = node.__class__
    moved: N = _mover(cls)(node, delta, source)
    return moved


Mover = Callable[[Any, int, SourceFile], Any]


@cache
def _mover(cls: type) -> Mover:
    """How to move nodes of a class: only the fields that hold nodes or spans are looked into."""
    if cls is Span:
        return lambda span, delta, source: Span(source, span.start + delta, span.end + delta)
    hints = get_type_hints(cls, vars(nodes))
    names = [f.name for f in fields(cls)]
    holders = [at for at, name in enumerate(names) if not _is_plain(hints[name])]
    values_of: Callable[[Any], Any] = attrgetter(*names) if names[1:] else lambda node: (node.span,)

    def move(node: Any, delta: int, source: SourceFile) -> Any:
        values = list(values_of(node))
        for at in holders:
            value = values[at]
            kind = value.__class__
            if kind is Span:
                values[at] = Span(source, value.start + delta, value.end + delta)
            elif kind is tuple:
                values[at] = tuple([_mover(item.__class__)(item, delta, source) for item in value])
            elif value is not None:
                values[at] = _mover(kind)(value, delta, source)
        return cls(*values)

    return move


def _is_plain(hint: Any) -> bool:
    """Whether a field holds no place: numbers, words, the components of a colour."""
    return hint in (int, float, str, bool) or get_origin(hint) is Literal or float in get_args(hint)


def move_diagnostic(diagnostic: Diagnostic, delta: int, source: SourceFile) -> Diagnostic:
    """A diagnostic of one file with all its places ``delta`` further on, in ``source``."""

    def moved(span: Span) -> Span:
        return Span(source, span.start + delta, span.end + delta)

    d = diagnostic
    fix = d.fix
    if fix is not None:
        fix = Fix(fix.message, tuple(Edit(moved(e.span), e.replacement) for e in fix.edits))
    span = moved(d.span) if d.span is not None else None
    labels = tuple(Label(moved(label.span), label.message) for label in d.labels)
    return Diagnostic(d.code, d.message, span, labels, d.help, fix)
