"""The syntax tree: frozen, with a span on every node. Names are as written, nothing is resolved.

Spans cover the node's own text. Where recovery had to invent something, a `Bad…` node stands there and
a diagnostic has been given; later stages skip such nodes silently.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

from scenelang.diagnostics.span import Span
from scenelang.records import Record
from scenelang.words import Combine


class Name(Record):
    """An identifier with its place; dotted for imported ones (``lib.name``)."""

    text: str
    span: Span


# ---------------------------------------------------------------- expressions


class Number(Record):
    """A literal number with its unit glued on: '', 'deg', 'rad', 'turn', 's', 'ms'."""

    value: float
    unit: str
    span: Span
    is_integer: bool = False


class String(Record):
    value: str
    span: Span


class Bool(Record):
    value: bool
    span: Span


class Color(Record):
    """A ``#rgb`` or ``#rrggbb`` literal, as three numbers in [0, 1]."""

    rgb: tuple[float, float, float]
    span: Span


class Vector(Record):
    items: tuple[Expr, ...]
    span: Span


class Range(Record):
    """``a..b`` (inclusive), ``a..<b`` (exclusive), with an optional step."""

    start: Expr
    stop: Expr
    exclusive: bool
    step: Expr | None
    span: Span


class NameRef(Record):
    name: Name
    span: Span


class Unary(Record):
    op: Literal["-", "+", "!"]
    operand: Expr
    span: Span


class Binary(Record):
    op: str  # + - * / % ^ < <= > >= == != && ||
    left: Expr
    right: Expr
    op_span: Span
    span: Span


class Conditional(Record):
    condition: Expr
    then: Expr
    otherwise: Expr
    span: Span


class Argument(Record):
    """A call's argument; ``name`` is None for a positional one."""

    name: Name | None
    value: Expr
    span: Span


class CallExpr(Record):
    """A function call inside an expression."""

    name: Name
    args: tuple[Argument, ...]
    span: Span


class Member(Record):
    """``v.x``; on a module alias ``lib.name`` it is a qualified name (the evaluator decides)."""

    value: Expr
    name: Name
    span: Span


class Index(Record):
    value: Expr
    index: Expr
    span: Span


class MaterialExpr(Record):
    """``material NAME`` or ``material NAME { … }`` used as a value."""

    name: Name
    body: Block | None
    span: Span


class BadExpr(Record):
    """What recovery could not read as an expression."""

    span: Span


Expr = (
    Number
    | String
    | Bool
    | Color
    | Vector
    | Range
    | NameRef
    | Unary
    | Binary
    | Conditional
    | CallExpr
    | Member
    | Index
    | MaterialExpr
    | BadExpr
)

# ---------------------------------------------------------------- statements


class Block(Record):
    """``{ … }``; the span includes the braces."""

    statements: tuple[Stmt, ...]
    span: Span


class Parameter(Record):
    """A formal parameter of a fn or module."""

    name: Name
    default: Expr | None
    span: Span


class Version(Record):
    """``nsg 1;``"""

    number: Number
    span: Span


class Model(Record):
    """``model "name";``"""

    name: Expr
    span: Span


class Param(Record):
    name: Name
    default: Expr
    range: Expr | None
    span: Span


class Let(Record):
    name: Name
    value: Expr
    span: Span


class Fn(Record):
    name: Name
    params: tuple[Parameter, ...]
    body: Expr
    span: Span


class Module(Record):
    name: Name
    params: tuple[Parameter, ...]
    body: Block
    span: Span


class Import(Record):
    path: String
    alias: Name
    span: Span


class For(Record):
    variable: Name
    iterable: Expr
    body: Block
    span: Span


class If(Record):
    condition: Expr
    then: Block
    otherwise: Block | If | None
    span: Span


class Call(Record):
    """Any statement headed by a name, with arguments, a block, both, or neither.

    Geometries (``square { … }``), transforms (``scale(2);``), settings (``canvas(w, h);``,
    ``background(c);``, ``animate(…);``), texture operations, module calls (``dot(1) { … }``) and uses of
    material values (``mist;``, ``mist { … }``) look alike; the evaluator tells them apart by name.
    ``args`` is None where there are no parentheses, ``body`` None where there is no block.
    """

    name: Name
    args: tuple[Argument, ...] | None
    body: Block | None
    span: Span


class Node(Record):
    """``group``, ``union``, ``smooth``, ``subtract``, ``intersect`` or ``chain`` with its block.

    Only ``smooth`` may have arguments, here and as the word of a chain's child.
    """

    kind: Literal["group", "union", "smooth", "subtract", "intersect", "chain"]
    body: Block
    span: Span
    keyword: Span
    args: tuple[Argument, ...] | None = None


class Combined(Record):
    """A chain child with its word: ``subtract star { … }``, ``smooth dot(1);``."""

    op: Combine
    child: Stmt
    span: Span
    keyword: Span
    args: tuple[Argument, ...] | None = None


class MaterialUse(Record):
    """``material NAME;`` or ``material NAME { … }`` as a statement."""

    name: Name
    body: Block | None
    span: Span


class BadStmt(Record):
    """What recovery could not read as a statement."""

    span: Span


Stmt = (
    Version
    | Model
    | Param
    | Let
    | Fn
    | Module
    | Import
    | For
    | If
    | Call
    | Node
    | Combined
    | MaterialUse
    | BadStmt
)


class File(Record):
    """A whole file."""

    statements: tuple[Stmt, ...]
    span: Span


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
