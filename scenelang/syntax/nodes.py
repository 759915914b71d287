"""The syntax tree: frozen, with a span on every node. Names are as written, nothing is resolved.

Spans cover the node's own text. Where recovery had to invent something, a `Bad…` node stands there and
a diagnostic has been given; later stages skip such nodes silently.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from scenelang.diagnostics.span import Span


@dataclass(frozen=True, slots=True)
class Name:
    """An identifier with its place; dotted for imported ones (``lib.name``)."""

    text: str
    span: Span


# ---------------------------------------------------------------- expressions


@dataclass(frozen=True, slots=True)
class Number:
    """A literal number with its unit glued on: '', 'deg', 'rad', 'turn', 's', 'ms'."""

    value: float
    unit: str
    span: Span
    is_integer: bool = False


@dataclass(frozen=True, slots=True)
class String:
    value: str
    span: Span


@dataclass(frozen=True, slots=True)
class Bool:
    value: bool
    span: Span


@dataclass(frozen=True, slots=True)
class Color:
    """A ``#rgb`` or ``#rrggbb`` literal, as three numbers in [0, 1]."""

    rgb: tuple[float, float, float]
    span: Span


@dataclass(frozen=True, slots=True)
class Vector:
    items: tuple[Expr, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Range:
    """``a..b`` (inclusive), ``a..<b`` (exclusive), with an optional step."""

    start: Expr
    stop: Expr
    exclusive: bool
    step: Expr | None
    span: Span


@dataclass(frozen=True, slots=True)
class NameRef:
    name: Name
    span: Span


@dataclass(frozen=True, slots=True)
class Unary:
    op: Literal["-", "+", "!"]
    operand: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class Binary:
    op: str  # + - * / % ^ < <= > >= == != && ||
    left: Expr
    right: Expr
    op_span: Span
    span: Span


@dataclass(frozen=True, slots=True)
class Conditional:
    condition: Expr
    then: Expr
    otherwise: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class Argument:
    """A call's argument; ``name`` is None for a positional one."""

    name: Name | None
    value: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class CallExpr:
    """A function call inside an expression."""

    name: Name
    args: tuple[Argument, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Member:
    """``v.x``; on a module alias ``lib.name`` it is a qualified name (the evaluator decides)."""

    value: Expr
    name: Name
    span: Span


@dataclass(frozen=True, slots=True)
class Index:
    value: Expr
    index: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class MaterialExpr:
    """``material NAME`` or ``material NAME { … }`` used as a value."""

    name: Name
    body: Block | None
    span: Span


@dataclass(frozen=True, slots=True)
class BadExpr:
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


@dataclass(frozen=True, slots=True)
class Block:
    """``{ … }``; the span includes the braces."""

    statements: tuple[Stmt, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Parameter:
    """A formal parameter of a fn or module."""

    name: Name
    default: Expr | None
    span: Span


@dataclass(frozen=True, slots=True)
class Version:
    """``nsg 1;``"""

    number: Number
    span: Span


@dataclass(frozen=True, slots=True)
class Model:
    """``model "name";``"""

    name: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class Param:
    name: Name
    default: Expr
    range: Expr | None
    span: Span


@dataclass(frozen=True, slots=True)
class Let:
    name: Name
    value: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class Fn:
    name: Name
    params: tuple[Parameter, ...]
    body: Expr
    span: Span


@dataclass(frozen=True, slots=True)
class Module:
    name: Name
    params: tuple[Parameter, ...]
    body: Block
    span: Span


@dataclass(frozen=True, slots=True)
class Import:
    path: String
    alias: Name
    span: Span


@dataclass(frozen=True, slots=True)
class For:
    variable: Name
    iterable: Expr
    body: Block
    span: Span


@dataclass(frozen=True, slots=True)
class If:
    condition: Expr
    then: Block
    otherwise: Block | If | None
    span: Span


Combine = Literal["union", "smooth", "subtract", "intersect"]


@dataclass(frozen=True, slots=True)
class Call:
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


@dataclass(frozen=True, slots=True)
class Node:
    """``group``, ``union``, ``smooth``, ``subtract``, ``intersect`` or ``chain`` with its block."""

    kind: Literal["group", "union", "smooth", "subtract", "intersect", "chain"]
    body: Block
    span: Span
    keyword: Span


@dataclass(frozen=True, slots=True)
class Combined:
    """A chain child with its word: ``subtract star { … }``, ``smooth dot(1);``."""

    op: Combine
    child: Stmt
    span: Span
    keyword: Span


@dataclass(frozen=True, slots=True)
class MaterialUse:
    """``material NAME;`` or ``material NAME { … }`` as a statement."""

    name: Name
    body: Block | None
    span: Span


@dataclass(frozen=True, slots=True)
class BadStmt:
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


@dataclass(frozen=True, slots=True)
class File:
    """A whole file."""

    statements: tuple[Stmt, ...]
    span: Span
