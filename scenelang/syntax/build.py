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

    def param(self, word: int, name: nodes.Name, equal: int, default: nodes.Expr, last: int) -> nodes.Stmt:
        span = self._span(word, last)
        return nodes.Param(name, default, None, span) if name.text else nodes.BadStmt(span)

    def param_in(
        self,
        word: int,
        name: nodes.Name,
        equal: int,
        default: nodes.Expr,
        within: int,
        range: nodes.Expr,
        last: int,
    ) -> nodes.Stmt:
        span = self._span(word, last)
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
        span = Span(self.source, self.starts[word], body.span.end)
        return nodes.Module(name, params[0], body, span) if name.text else nodes.BadStmt(span)

    def parameter(self, name: nodes.Name) -> nodes.Parameter:
        return nodes.Parameter(name, None, name.span)

    def parameter_default(self, name: nodes.Name, equal: int, default: nodes.Expr) -> nodes.Parameter:
        return nodes.Parameter(name, default, name.span.to(default.span))

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
        span = Span(self.source, self.starts[word], body.span.end)
        return nodes.For(variable, iterable, body, span) if variable.text else nodes.BadStmt(span)

    def if_then(
        self, word: int, opening: int, condition: nodes.Expr, closing: int, then: nodes.Block
    ) -> nodes.Stmt:
        return nodes.If(condition, then, None, Span(self.source, self.starts[word], then.span.end))

    def if_else(
        self,
        word: int,
        opening: int,
        condition: nodes.Expr,
        closing: int,
        then: nodes.Block,
        else_: int,
        otherwise: nodes.Block | nodes.If,
    ) -> nodes.Stmt:
        return nodes.If(condition, then, otherwise, Span(self.source, self.starts[word], otherwise.span.end))

    def node(self, kind: Keyword, body: nodes.Block) -> nodes.Stmt:
        return nodes.Node(kind[0], body, kind[1].to(body.span), kind[1])

    def combined(self, op: Keyword, child: nodes.Stmt) -> nodes.Stmt:
        return nodes.Combined(op[0], child, op[1].to(child.span), op[1])

    def material_use(self, word: int, name: nodes.Name, last: int) -> nodes.Stmt:
        span = self._span(word, last)
        return nodes.MaterialUse(name, None, span) if name.text else nodes.BadStmt(span)

    def material_use_block(self, word: int, name: nodes.Name, body: nodes.Block) -> nodes.Stmt:
        span = Span(self.source, self.starts[word], body.span.end)
        return nodes.MaterialUse(name, body, span) if name.text else nodes.BadStmt(span)

    def _call(
        self, name: nodes.Name, args: tuple[nodes.Argument, ...] | None, body: nodes.Block | None, end: int
    ) -> nodes.Stmt:
        span = Span(self.source, name.span.start, end)
        return nodes.Call(name, args, body, span) if name.text else nodes.BadStmt(span)

    def call_bare(self, name: nodes.Name, last: int) -> nodes.Stmt:
        return self._call(name, None, None, self.ends[last])

    def call_block(self, name: nodes.Name, body: nodes.Block) -> nodes.Stmt:
        return self._call(name, None, body, body.span.end)

    def call_args(self, name: nodes.Name, args: Arguments, last: int) -> nodes.Stmt:
        return self._call(name, args[0], None, self.ends[last])

    def call_args_block(self, name: nodes.Name, args: Arguments, body: nodes.Block) -> nodes.Stmt:
        return self._call(name, args[0], body, body.span.end)

    def bad_statement(self, token: int) -> nodes.Stmt:
        return nodes.BadStmt(self._span(token, token))

    def bad_block(self, head: int, body: nodes.Block) -> nodes.Stmt:
        return nodes.BadStmt(Span(self.source, self.starts[head], body.span.end))

    def block_empty(self, opening: int, closing: int) -> nodes.Block:
        return nodes.Block((), self._span(opening, closing))

    def block(self, opening: int, statements: list[nodes.Stmt], closing: int) -> nodes.Block:
        return nodes.Block(tuple(statements), self._span(opening, closing))
