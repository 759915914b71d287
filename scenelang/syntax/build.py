"""Callbacks of the grammar that make the tree.

Tokens come as indices into `Tokens`. A node's span runs from its first token to its last, braces and
semicolon included. What recovery invented is an empty token; an expression that rests on one becomes a
`BadExpr`, a statement without its name a `BadStmt`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import isinf
from typing import Any, Final

from scenelang.diagnostics.span import Span
from scenelang.syntax import nodes
from scenelang.syntax.lexer import Report, Tokens
from scenelang.syntax.tables import tables
from scenelang.words import RESERVED

Arguments = tuple[tuple[nodes.Argument, ...], int]
Keyword = tuple[Any, Span]

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

_ESCAPES = {'"': '"', "\\": "\\", "n": "\n", "t": "\t"}
_ESCAPES_ELSEWHERE = "abefrvxuUN'01234567"
"""What means something behind a backslash in other languages: there nobody meant the backslash itself."""
_LITERALS = (nodes.Number, nodes.String, nodes.Bool, nodes.Color, nodes.NameRef, nodes.BadExpr)


class Builder:
    """Makes the nodes of one file; ``report`` takes what is found in literals."""

    def __init__(self, tokens: Tokens, report: Report) -> None:
        self.tokens = tokens
        self.report = report
        self.source = tokens.source
        self.text = tokens.source.text
        self.starts = tokens.starts
        self.ends = tokens.ends
        self.signs = tables().kinds

    def callbacks(self) -> list[Callable[..., Any] | None]:
        """The callback of every rule, in the order of `Tables.rules`; None passes the value on."""
        plain = {name: self._plain(*made) for name, made in PLAIN.items()}
        return [plain.get(name) or getattr(self, name) if name else None for _, _, name in tables().rules]

    def _plain(self, cls: type, which: tuple[int, ...]) -> Callable[..., Any]:
        bad = nodes.BadStmt if issubclass(cls, nodes.Stmt) else nodes.BadExpr

        def make(*parts: Any) -> Any:
            span = self._span(parts[0], parts[-1])
            values = [parts[at] for at in which]
            if any(isinstance(value, nodes.Name) and not value.text for value in values):
                return bad(span)
            return cls(span, *[value[0] if isinstance(value, tuple) else value for value in values])

        return make

    def _span(self, first: Any, last: Any) -> Span:
        """From the first of some parts to the last: tokens, nodes, or lists with their end."""
        start = self.starts[first] if isinstance(first, int) else first.span.start
        return Span(self.source, start, self.ends[last] if isinstance(last, int) else last.span.end)

    def sign(self, token: int) -> Any:
        """What a literal token stands for; recovery may have read it from other text."""
        return self.signs[self.tokens.kinds[token]]

    # ------------------------------------------------------------ lists

    def first(self, item: Any) -> list[Any]:
        return [item]

    def following(self, items: list[Any], *rest: Any) -> list[Any]:
        items.append(rest[-1])  # behind a comma, or not
        return items

    listed = following

    def enclosed(self, opening: int, *rest: Any) -> tuple[tuple[Any, ...], int]:
        return _items(rest), self.ends[rest[-1]]

    # ------------------------------------------------------------ names

    def name(self, token: int) -> nodes.Name:
        start, end = self.starts[token], self.ends[token]
        return nodes.Name(Span(self.source, start, end), self.text[start:end])

    def path(self, left: nodes.Name, dot: int, right: nodes.Name) -> nodes.Name:
        text = f"{left.text}.{right.text}" if left.text and right.text else ""
        return nodes.Name(left.span.to(right.span), text)

    # ------------------------------------------------------------ expressions

    def argument(self, *parts: Any) -> nodes.Argument:
        name, value = (parts[0] if parts[1:] else None), parts[-1]
        return nodes.Argument(name.span.to(value.span) if name else value.span, name, value)

    def range(self, start: nodes.Expr, dots: int, stop: nodes.Expr, *rest: Any) -> nodes.Expr:
        step = rest[1] if rest else None
        return nodes.Range(self._span(start, step or stop), start, stop, self.sign(dots) == "..<", step)

    def binary(self, left: nodes.Expr, op: int, right: nodes.Expr) -> nodes.Expr:
        span = Span(self.source, left.span.start, right.span.end)
        place = Span(self.source, self.starts[op], self.ends[op])
        if place.start == place.end:  # an operator that recovery put in
            return nodes.BadExpr(span)
        return nodes.Binary(span, self.sign(op), left, right, place)

    def unary(self, op: int, operand: nodes.Expr) -> nodes.Expr:
        return nodes.Unary(Span(self.source, self.starts[op], operand.span.end), self.sign(op), operand)

    def material(self, word: int, *rest: Any) -> nodes.Expr:
        span, body = self._span(word, rest[-1]), _block(rest[-1])
        *shading, name = rest if body is None else rest[:-1]
        return nodes.MaterialExpr(span, name, body, *shading) if name.text else nodes.BadExpr(span)

    def method(self, value: nodes.Expr, dot: int, name: nodes.Name, args: Arguments) -> nodes.Expr:
        span = Span(self.source, value.span.start, args[1])
        parts = [name]
        at = value
        while isinstance(at, nodes.Member):
            parts.append(at.name)
            at = at.value
        if isinstance(at, nodes.NameRef):
            parts.append(at.name)
            text = ".".join(part.text for part in reversed(parts))
            return nodes.CallExpr(span, nodes.Name(at.span.to(name.span), text), args[0])
        if not isinstance(at, nodes.BadExpr):
            help = f"write `{name.text}(…)` with the value as an argument"
            self.report.add("E0128", "only a name can be called", value.span.start, name.span.end, help=help)
        return nodes.BadExpr(span)

    def call_expr(self, name: nodes.Name, args: Arguments) -> nodes.Expr:
        span = Span(self.source, name.span.start, args[1])
        return nodes.CallExpr(span, name, args[0]) if name.text else nodes.BadExpr(span)

    def parenthesised(self, opening: int, value: nodes.Expr, closing: int) -> nodes.Expr:
        # Literals keep their own place: a fix that glues a unit on belongs inside the parentheses.
        if isinstance(value, _LITERALS):
            return value
        return replace(value, span=self._span(opening, closing))

    def vector(self, opening: int, *rest: Any) -> nodes.Expr:
        return nodes.Vector(self._span(opening, rest[-1]), _items(rest))

    def name_ref(self, name: nodes.Name) -> nodes.Expr:
        return nodes.NameRef(name.span, name) if name.text else nodes.BadExpr(name.span)

    def true(self, token: int) -> nodes.Expr:
        return nodes.Bool(self._span(token, token), self.sign(token) == "true")

    false = true

    # ------------------------------------------------------------ literals

    def number(self, token: int) -> nodes.Number | nodes.BadExpr:
        start, end = self.starts[token], self.ends[token]
        span = Span(self.source, start, end)
        if start == end or start in self.tokens.reported:
            return nodes.BadExpr(span)
        text = self.text[start:end]
        # No digit or exponent ends in one of these letters; spaces stand before a unit that was not glued.
        digits = text.rstrip("adegmnrstu")
        value = float(digits)
        if isinf(value):
            self.report.add("E0125", "number too large", start, end, help="the largest number is 1.8e308")
            return nodes.BadExpr(span)
        return nodes.Number(span, value, text[len(digits) :], digits.strip().isdigit())

    def string(self, token: int) -> nodes.String:
        start, end = self.starts[token], self.ends[token]
        text = self.text[start:end]
        span = Span(self.source, start, end)
        closed = text[:1] != '"' or start not in self.tokens.reported
        body = text[1:-1] if closed else text[1:]
        return nodes.String(span, self._unescape(body, start + 1) if "\\" in body else body)

    def _unescape(self, body: str, start: int) -> str:
        parts = []
        at = 0
        while (slash := body.find("\\", at)) != -1:
            parts.append(body[at:slash])
            letter = body[slash + 1 : slash + 2]
            at = slash + 2
            if letter in _ESCAPES:
                parts.append(_ESCAPES[letter])
                continue
            parts.append(body[slash:at])
            place = start + slash
            help = 'the escapes are `\\"`, `\\\\`, `\\n` and `\\t`'
            double = None if letter in _ESCAPES_ELSEWHERE else self.report.change(place, place + 1, "\\\\")
            message = f"unknown escape `\\{letter}`"
            self.report.add("E0119", message, place, start + at, help=help, fix=double)
        parts.append(body[at:])
        return "".join(parts)

    def color(self, token: int) -> nodes.Expr:
        start, end = self.starts[token], self.ends[token]
        span = Span(self.source, start, end)
        if start == end or start in self.tokens.reported:
            return nodes.BadExpr(span)
        digits = self.text[start + 1 : end]
        if len(digits) == 3:
            digits = "".join(digit * 2 for digit in digits)
        red, green, blue = (int(digits[at : at + 2], 16) / 255 for at in (0, 2, 4))
        return nodes.Color(span, (red, green, blue))

    # ------------------------------------------------------------ statements

    def keyword(self, token: int) -> Keyword:
        return self.sign(token), self._span(token, token)

    def file(self, statements: list[nodes.Stmt] | None = None) -> nodes.File:
        return nodes.File(Span(self.source, 0, len(self.text)), tuple(statements or ()))

    def version(self, word: int, number: int, semicolon: int) -> nodes.Stmt:
        span = self._span(word, semicolon)
        value = self.number(number)
        return nodes.Version(span, value) if isinstance(value, nodes.Number) else nodes.BadStmt(span)

    def param(self, word: int, name: nodes.Name, equal: int, default: nodes.Expr, *rest: Any) -> nodes.Stmt:
        span = self._span(word, rest[-1])
        range = rest[1] if rest[1:] else None
        return nodes.Param(span, name, default, range) if name.text else nodes.BadStmt(span)

    def parameter(self, name: nodes.Name, *default: Any) -> nodes.Parameter:
        value = default[1] if default else None
        return nodes.Parameter(name.span.to((value or name).span), name, value)

    def import_(self, word: int, path: int, as_: int, alias: nodes.Name, last: int) -> nodes.Stmt:
        span = self._span(word, last)
        possible = alias.text.isascii() and alias.text.isidentifier() and alias.text not in RESERVED
        if not possible or self.starts[path] == self.ends[path]:
            return nodes.BadStmt(span)
        return nodes.Import(span, self.string(path), alias)

    def if_(
        self, word: int, opening: int, condition: nodes.Expr, closing: int, then: nodes.Block, *rest: Any
    ) -> nodes.Stmt:
        otherwise = rest[1] if rest else None
        return nodes.If(self._span(word, otherwise or then), condition, then, otherwise)

    def node(self, kind: Keyword, *rest: Any) -> nodes.Stmt:
        args, body = (rest[0][0], rest[1]) if rest[1:] else (None, rest[0])
        return nodes.Node(kind[1].to(body.span), kind[0], body, kind[1], args)

    def combined(self, op: Keyword, *rest: Any) -> nodes.Stmt:
        args, child = (rest[0][0], rest[1]) if rest[1:] else (None, rest[0])
        return nodes.Combined(op[1].to(child.span), op[0], child, op[1], args)

    def material_use(self, word: int, *rest: Any) -> nodes.Stmt:
        span = self._span(word, rest[-1])
        *shading, name = rest[:-1]
        return nodes.MaterialUse(span, name, _block(rest[-1]), *shading) if name.text else nodes.BadStmt(span)

    def call(self, name: nodes.Name, *rest: Any) -> nodes.Stmt:
        span = self._span(name, rest[-1])
        if not name.text:
            return nodes.BadStmt(span)
        return nodes.Call(span, name, rest[0][0] if rest[1:] else None, _block(rest[-1]))

    def block(self, opening: int, *rest: Any) -> nodes.Block:
        return nodes.Block(self._span(opening, rest[-1]), _items(rest))


def _items(rest: tuple[Any, ...]) -> tuple[Any, ...]:
    """What stands between an opening bracket and the closing one, which is the last."""
    return tuple(rest[0]) if rest[1:] else ()


def _block(last: Any) -> nodes.Block | None:
    """The block that a statement ends with, None where that is a `;`."""
    return last if isinstance(last, nodes.Block) else None
