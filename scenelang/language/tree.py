"""The syntax tree: frozen, with a span on every node. Names are as written, nothing is resolved.

Where recovery had to invent something, a `Bad…` node stands there and a diagnostic has been given; later
stages skip such nodes silently.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, cast

from scenelang.assets.records import Record
from scenelang.language.diagnostics import Span
from scenelang.language.words import Combine


class Spanned(Record):
    span: Span


class Expr(Spanned):
    """An expression."""


class Stmt(Spanned):
    """A statement."""


class Name(Spanned):
    """An identifier with its place; dotted for imported ones (``lib.name``)."""

    text: str


# ---------------------------------------------------------------- expressions


class NumberLiteral(Expr):
    """A literal number with its unit glued on: '', 'deg', 'rad', 'turn', 's', 'ms'."""

    value: float
    unit: str
    is_integer: bool = False


class String(Expr):
    value: str

    def character(self, at: int) -> Span:
        """Place of a character of the value, of one that is escaped with its backslash."""
        start = self.span.start + 1
        for _ in range(at):
            start += self._length(start)
        return Span(self.span.source, start, start + self._length(start))

    def _length(self, start: int) -> int:
        text = self.span.source.text
        return 2 if text[start] == "\\" and text[start + 1] in '"\\nt' else 1


class Bool(Expr):
    value: bool


class ColorLiteral(Expr):
    """A ``#rgb`` or ``#rrggbb`` literal, as three numbers in [0, 1]."""

    rgb: tuple[float, float, float]


class Vector(Expr):
    items: tuple[Expr, ...]


class ForItem(Expr):
    """``for (i in …) item`` in a vector: the item's values, once for each turn."""

    variable: Name
    iterable: Expr
    body: Expr


class IfItem(Expr):
    """``if (…) item`` in a vector: the item's values, or none."""

    condition: Expr
    body: Expr


class Range(Expr):
    """``a..b`` (inclusive), ``a..<b`` (exclusive), with an optional step."""

    start: Expr
    stop: Expr
    exclusive: bool
    step: Expr | None


class NameRef(Expr):
    name: Name


class Unary(Expr):
    op: Literal["-", "+", "!"]
    operand: Expr


class Binary(Expr):
    op: str  # + - * / % ^ < <= > >= == != && ||
    left: Expr
    right: Expr
    op_span: Span


class Conditional(Expr):
    condition: Expr
    then: Expr
    otherwise: Expr


class Argument(Spanned):
    """A call's argument; ``name`` is None for a positional one."""

    name: Name | None
    value: Expr


class CallExpr(Expr):
    name: Name
    args: tuple[Argument, ...]


class Member(Expr):
    """``v.x``; on a module alias ``lib.name`` it is a qualified name (the evaluator decides)."""

    value: Expr
    name: Name


class Index(Expr):
    value: Expr
    index: Expr


class MaterialExpr(Expr):
    """``material NAME`` or ``material NAME { … }`` used as a value; as in `MaterialUse`."""

    name: Name
    body: Block | None
    shading: Name | None = None


class BadExpr(Expr):
    """Text that recovery could not read as an expression."""


# ---------------------------------------------------------------- statements


class Block(Spanned):
    """``{ … }``; the span includes the braces."""

    statements: tuple[Stmt, ...]


class Parameter(Spanned):
    """A formal parameter of a fn or module."""

    name: Name
    default: Expr | None


class Version(Stmt):
    number: NumberLiteral


class ModelStatement(Stmt):
    name: Expr


class Param(Stmt):
    name: Name
    default: Expr
    range: Expr | None


class Let(Stmt):
    name: Name
    value: Expr


class Fn(Stmt):
    name: Name
    params: tuple[Parameter, ...]
    body: Expr


class Module(Stmt):
    name: Name
    params: tuple[Parameter, ...]
    body: Block


class Import(Stmt):
    path: String
    alias: Name


class For(Stmt):
    variable: Name
    iterable: Expr
    body: Block


class If(Stmt):
    condition: Expr
    then: Block
    otherwise: Block | If | None


class Call(Stmt):
    """Any statement headed by a name, with arguments, a block, both, or neither (None).

    Geometries, transforms, settings, texture operations, calls of modules and uses of material values look
    alike; the evaluator tells them apart by name.
    """

    name: Name
    args: tuple[Argument, ...] | None
    body: Block | None


class Node(Stmt):
    """``group``, ``union``, ``smooth``, ``subtract``, ``intersect`` or ``chain`` with its block."""

    kind: Literal["group", "union", "smooth", "subtract", "intersect", "chain"]
    body: Block
    keyword: Span
    args: tuple[Argument, ...] | None = None


class Combined(Stmt):
    """A chain child with its word: ``subtract star { … }``, ``smooth dot(1);``."""

    op: Combine
    child: Stmt
    keyword: Span
    args: tuple[Argument, ...] | None = None


class MaterialUse(Stmt):
    """``material NAME;`` or with a block; ``shading`` is the first of two names (``volumetric zoo.bark``)."""

    name: Name
    body: Block | None
    shading: Name | None = None


class BadStmt(Stmt):
    """Text that recovery could not read as a statement."""


class Kept(Stmt):
    """A statement of an earlier text, as it was read there; the span is its place in this text."""

    stmt: Stmt

    def moved(self, deep: bool = True) -> Stmt:
        """The statement at its place in this text, or that and its name alone."""
        source, delta = self.span.source, self.span.start - self.stmt.span.start

        def move(value: Any) -> Any:
            cls = value.__class__
            if cls is Span:
                return Span(source, value.start + delta, value.end + delta)
            if cls is tuple:
                return tuple([move(item) for item in value])
            if isinstance(value, Record) and (deep or cls is Name or value is self.stmt):
                return cls(*[move(getattr(value, name)) for name in cls.__match_args__])
            return value

        return cast(Stmt, move(self.stmt))


class File(Spanned):
    statements: tuple[Stmt, ...]


# ---------------------------------------------------------------- walking


def children(node: Any) -> Iterator[Any]:
    """The nodes right below a node, names included, in the order of its fields."""
    for field in node.__match_args__:
        value = getattr(node, field)
        for item in value if value.__class__ is tuple else (value,):
            if isinstance(item, Record) and item.__class__ is not Span:
                yield item


def walk(node: Any) -> Iterator[Any]:
    """A node and everything below it."""
    stack = [node]
    while stack:
        at = stack.pop()
        yield at
        stack.extend(children(at))
