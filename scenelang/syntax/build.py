"""Callbacks of the grammar for statements and blocks; expressions are in `syntax.expressions`.

A node's span runs from its first token to its last, braces and semicolon included. A statement without
its name becomes a `BadStmt`: recovery has reported it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, get_args

from scenelang.diagnostics.span import Span
from scenelang.syntax import nodes
from scenelang.syntax.expressions import ExpressionBuilder
from scenelang.syntax.tables import tables

PLAIN: Final[dict[str, tuple[type, tuple[int, ...]]]] = {
    "model": (nodes.Model, (1,)),
    "let": (nodes.Let, (1, 3)),
    "fn": (nodes.Fn, (1, 2, 4)),
    "module": (nodes.Module, (1, 2, 3)),
    "for_": (nodes.For, (2, 4, 6)),
    "conditional": (nodes.Conditional, (0, 2, 4)),
    "index": (nodes.Index, (0, 2)),
    "member": (nodes.Member, (0, 2)),
    "bad_expression": (nodes.BadExpr, ()),
    "bad_statement": (nodes.BadStmt, ()),
    "bad_block": (nodes.BadStmt, ()),
}
"""Rules whose node has some of their parts as they are: its class, and which parts."""
Keyword = tuple[Any, Span]


class Builder(ExpressionBuilder):
    """Makes all nodes of one file."""

    def callbacks(self) -> list[Callable[..., Any] | None]:
        """The callback of every rule, in the order of `Tables.rules`; None passes the value on."""
        plain = {name: self._plain(*made) for name, made in PLAIN.items()}
        return [plain.get(name) or getattr(self, name) if name else None for _, _, name in tables().rules]

    def _plain(self, cls: type, which: tuple[int, ...]) -> Callable[..., Any]:
        bad = nodes.BadStmt if issubclass(cls, get_args(nodes.Stmt)) else nodes.BadExpr

        def make(*parts: Any) -> Any:
            span = self._span(parts[0], parts[-1])
            values = [parts[at] for at in which]
            if any(isinstance(value, nodes.Name) and not value.text for value in values):
                return bad(span)
            return cls(*[value[0] if isinstance(value, tuple) else value for value in values], span)

        return make

    def keyword(self, token: int) -> Keyword:
        return self.sign(token), self._span(token, token)

    def file(self, statements: list[nodes.Stmt] | None = None) -> nodes.File:
        return nodes.File(tuple(statements or ()), Span(self.source, 0, len(self.text)))

    def version(self, word: int, number: int, semicolon: int) -> nodes.Stmt:
        span = self._span(word, semicolon)
        value = self.number(number)
        return nodes.Version(value, span) if isinstance(value, nodes.Number) else nodes.BadStmt(span)

    def param(self, word: int, name: nodes.Name, equal: int, default: nodes.Expr, *rest: Any) -> nodes.Stmt:
        span = self._span(word, rest[-1])
        range = rest[1] if rest[1:] else None
        return nodes.Param(name, default, range, span) if name.text else nodes.BadStmt(span)

    def parameter(self, name: nodes.Name, *default: Any) -> nodes.Parameter:
        value = default[1] if default else None
        return nodes.Parameter(name, value, name.span.to((value or name).span))

    def import_(self, word: int, path: int, as_: int, alias: nodes.Name, last: int) -> nodes.Stmt:
        span = self._span(word, last)
        if not alias.text or self.starts[path] == self.ends[path]:
            return nodes.BadStmt(span)
        return nodes.Import(self.string(path), alias, span)

    def if_(
        self, word: int, opening: int, condition: nodes.Expr, closing: int, then: nodes.Block, *rest: Any
    ) -> nodes.Stmt:
        otherwise = rest[1] if rest else None
        return nodes.If(condition, then, otherwise, self._span(word, otherwise or then))

    def node(self, kind: Keyword, *rest: Any) -> nodes.Stmt:
        args, body = (rest[0][0], rest[1]) if rest[1:] else (None, rest[0])
        return nodes.Node(kind[0], body, kind[1].to(body.span), kind[1], args)

    def combined(self, op: Keyword, *rest: Any) -> nodes.Stmt:
        args, child = (rest[0][0], rest[1]) if rest[1:] else (None, rest[0])
        return nodes.Combined(op[0], child, op[1].to(child.span), op[1], args)

    def material_use(self, word: int, name: nodes.Name, last: Any) -> nodes.Stmt:
        span = self._span(word, last)
        return nodes.MaterialUse(name, _block(last), span) if name.text else nodes.BadStmt(span)

    def call(self, name: nodes.Name, *rest: Any) -> nodes.Stmt:
        span = self._span(name, rest[-1])
        if not name.text:
            return nodes.BadStmt(span)
        return nodes.Call(name, rest[0][0] if rest[1:] else None, _block(rest[-1]), span)

    def block(self, opening: int, *rest: Any) -> nodes.Block:
        return nodes.Block(tuple(rest[0]) if rest[1:] else (), self._span(opening, rest[-1]))


def _block(last: Any) -> nodes.Block | None:
    """The block that a statement ends with, None where that is a `;`."""
    return last if isinstance(last, nodes.Block) else None
