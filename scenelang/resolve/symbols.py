"""What a walk over names finds: definitions, the scopes that they belong to, and their uses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import Literal

from scenelang.diagnostics.span import Span
from scenelang.records import Record
from scenelang.syntax import nodes

Kind = Literal["let", "param", "fn", "module", "import", "argument", "loop"]
Role = Literal[
    "name",  # of a definition in sight, or of nothing known
    "member",  # of an imported file: `lib.name`
    "argument",  # the name of an argument in a call
    "function",
    "constant",
    "animated",
    "geometry",
    "transform",
    "operation",
    "setting",
    "material",
    "property",  # `v.x`
    "model",
    "path",
]


class Symbol(Record, frozen=False):
    """A definition.

    Args:
        name: its name.
        kind: how it came about.
        span: the name.
        node: its statement or formal parameter.
        scope: the scope that it belongs to.
        since: the offset from which on it is in sight.
        owner: the fn or module that it is a parameter of.
        params: the parameters of a fn or module.
    """

    name: str
    kind: Kind
    span: Span
    node: nodes.Stmt | nodes.Parameter
    scope: Scope
    since: int
    owner: Symbol | None = None
    params: list[Symbol] = field(default_factory=list)

    @property
    def is_exported(self) -> bool:
        """Whether files that import this one see it."""
        return self.scope.parent is None and self.kind in ("let", "param", "fn", "module")


class Scope(Record, frozen=False):
    """A block, a function or a loop: its names, where it reaches, and what is around it."""

    start: int
    end: int
    parent: Scope | None = None
    symbols: dict[str, Symbol] = field(default_factory=dict)

    def outwards(self) -> Iterator[Scope]:
        """This scope, and those around it."""
        scope: Scope | None = self
        while scope is not None:
            yield scope
            scope = scope.parent

    def find(self, name: str) -> Symbol | None:
        """What a name stands for here."""
        return next((scope.symbols[name] for scope in self.outwards() if name in scope.symbols), None)


class Use(Record, frozen=False):
    """A place where a name stands.

    Args:
        start, end: the place.
        text: the name.
        role: what it is there.
        symbol: its definition in this file, or that of the import a member belongs to.
        callee: for an argument, the use of what is called.
        defines: whether this is the definition itself.
    """

    start: int
    end: int
    text: str
    role: Role
    symbol: Symbol | None = None
    callee: Use | None = None
    defines: bool = False
