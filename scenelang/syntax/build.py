"""Callbacks of the grammar for statements and blocks; expressions are in `syntax.expressions`.

A node's span runs from its first token to its last, braces and semicolon included. A statement without
its name becomes a `BadStmt`: recovery has reported it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scenelang.diagnostics.span import Span
from scenelang.syntax import nodes
from scenelang.syntax.expressions import Arguments, ExpressionBuilder
from scenelang.syntax.tables import tables

Parameters = tuple[tuple[nodes.Parameter, ...], int]
Keyword = tuple[Any, Span]


class Builder(ExpressionBuilder):
    """Makes all nodes of one file."""

    def callbacks(self) -> list[Callable[..., Any] | None]:
        """The callback of every rule, in the order of `Tables.rules`; None passes the value on."""
        return [getattr(self, name) if name else None for _, _, name in tables().rules]

    def keyword(self, token: int) -> Keyword:
        return self.sign(token), self._span(token, token)

    def file(self, statements: list[nodes.Stmt] | None = None) -> nodes.File:
        return nodes.File(tuple(statements or ()), Span(self.source, 0, len(self.text)))

    def version(self, word: int, number: int, semicolon: int) -> nodes.Stmt:
        span = self._span(word, semicolon)
        value = self.number(number)
        return nodes.Version(value, span) if isinstance(value, nodes.Number) else nodes.BadStmt(span)

    def model(self, word: int, name: nodes.Expr, semicolon: int) -> nodes.Stmt:
        return nodes.Model(name, self._span(word, semicolon))

    def param(self, word: int, name: nodes.Name, equal: int, default: nodes.Expr, *rest: Any) -> nodes.Stmt:
        span = self._span(word, rest[-1])
        range = rest[1] if rest[1:] else None
        return nodes.Param(name, default, range, span) if name.text else nodes.BadStmt(span)

    def let(self, word: int, name: nodes.Name, equal: int, value: nodes.Expr, last: int) -> nodes.Stmt:
        span = self._span(word, last)
        return nodes.Let(name, value, span) if name.text else nodes.BadStmt(span)

    def fn(
        self, word: int, name: nodes.Name, params: Parameters, equal: int, body: nodes.Expr, last: int
    ) -> nodes.Stmt:
        span = self._span(word, last)
        return nodes.Fn(name, params[0], body, span) if name.text else nodes.BadStmt(span)

    def module(self, word: int, name: nodes.Name, params: Parameters, body: nodes.Block) -> nodes.Stmt:
        span = self._to(word, body)
        return nodes.Module(name, params[0], body, span) if name.text else nodes.BadStmt(span)

    def parameter(self, name: nodes.Name, *default: Any) -> nodes.Parameter:
        value = default[1] if default else None
        return nodes.Parameter(name, value, name.span.to((value or name).span))

    def import_(self, word: int, path: int, as_: int, alias: nodes.Name, last: int) -> nodes.Stmt:
        span = self._span(word, last)
        if not alias.text or self.starts[path] == self.ends[path]:
            return nodes.BadStmt(span)
        return nodes.Import(self.string(path), alias, span)

    def for_(
        self,
        word: int,
        opening: int,
        variable: nodes.Name,
        within: int,
        iterable: nodes.Expr,
        closing: int,
        body: nodes.Block,
    ) -> nodes.Stmt:
        span = self._to(word, body)
        return nodes.For(variable, iterable, body, span) if variable.text else nodes.BadStmt(span)

    def if_(
        self, word: int, opening: int, condition: nodes.Expr, closing: int, then: nodes.Block, *rest: Any
    ) -> nodes.Stmt:
        otherwise = rest[1] if rest else None
        return nodes.If(condition, then, otherwise, self._to(word, otherwise or then))

    def node(self, kind: Keyword, body: nodes.Block) -> nodes.Stmt:
        return nodes.Node(kind[0], body, kind[1].to(body.span), kind[1])

    def combined(self, op: Keyword, child: nodes.Stmt) -> nodes.Stmt:
        return nodes.Combined(op[0], child, op[1].to(child.span), op[1])

    def material_use(self, word: int, name: nodes.Name, last: Any) -> nodes.Stmt:
        span = self._to(word, last)
        return nodes.MaterialUse(name, _block(last), span) if name.text else nodes.BadStmt(span)

    def call(self, name: nodes.Name, *rest: Any) -> nodes.Stmt:
        args: Arguments | None = rest[0] if rest[1:] else None
        end = self._to(0, rest[-1]).end
        span = Span(self.source, name.span.start, end)
        if not name.text:
            return nodes.BadStmt(span)
        return nodes.Call(name, args[0] if args else None, _block(rest[-1]), span)

    def bad_statement(self, token: int) -> nodes.Stmt:
        return nodes.BadStmt(self._span(token, token))

    def bad_block(self, head: int, body: nodes.Block) -> nodes.Stmt:
        return nodes.BadStmt(self._to(head, body))

    def block(self, opening: int, *rest: Any) -> nodes.Block:
        return nodes.Block(tuple(rest[0]) if rest[1:] else (), self._span(opening, rest[-1]))


def _block(last: Any) -> nodes.Block | None:
    """The block that a statement ends with, None where that is a `;`."""
    return last if isinstance(last, nodes.Block) else None
