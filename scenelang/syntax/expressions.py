"""Callbacks of the grammar for names, lists, expressions and literals.

Tokens come as indices into `Tokens`. A node's span runs from its first token to its last. What recovery
invented is an empty token; an expression that rests on one becomes a `BadExpr`.
"""

from __future__ import annotations

from dataclasses import replace
from math import isinf
from typing import Any

from scenelang.diagnostics.span import Span
from scenelang.syntax import nodes
from scenelang.syntax.tables import tables
from scenelang.syntax.tokens import Report, Tokens

Arguments = tuple[tuple[nodes.Argument, ...], int]

_ESCAPES = {'"': '"', "\\": "\\", "n": "\n", "t": "\t"}
_ESCAPES_ELSEWHERE = "abefrvxuUN'01234567"
"""What means something behind a backslash in other languages: there nobody meant the backslash itself."""
_LITERALS = (nodes.Number, nodes.String, nodes.Bool, nodes.Color, nodes.NameRef, nodes.BadExpr)


class ExpressionBuilder:
    """Makes the expressions of one file.

    Args:
        tokens: what was read.
        report: takes what is found in literals.
    """

    def __init__(self, tokens: Tokens, report: Report) -> None:
        self.tokens = tokens
        self.report = report
        self.source = tokens.source
        self.text = tokens.source.text
        self.starts = tokens.starts
        self.ends = tokens.ends
        self.signs = tables().kinds

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

    def following(self, items: list[Any], item: Any) -> list[Any]:
        items.append(item)
        return items

    def listed(self, items: list[Any], comma: int, item: Any) -> list[Any]:
        items.append(item)
        return items

    def enclosed(self, opening: int, *rest: Any) -> tuple[tuple[Any, ...], int]:
        return _items(rest), self.ends[rest[-1]]

    # ------------------------------------------------------------ names

    def name(self, token: int) -> nodes.Name:
        start, end = self.starts[token], self.ends[token]
        return nodes.Name(self.text[start:end], Span(self.source, start, end))

    def path(self, left: nodes.Name, dot: int, right: nodes.Name) -> nodes.Name:
        text = f"{left.text}.{right.text}" if left.text and right.text else ""
        return nodes.Name(text, left.span.to(right.span))

    # ------------------------------------------------------------ expressions

    def argument(self, *parts: Any) -> nodes.Argument:
        name, value = (parts[0] if parts[1:] else None), parts[-1]
        return nodes.Argument(name, value, name.span.to(value.span) if name else value.span)

    def range(self, start: nodes.Expr, dots: int, stop: nodes.Expr, *rest: Any) -> nodes.Expr:
        step = rest[1] if rest else None
        return nodes.Range(start, stop, self.sign(dots) == "..<", step, self._span(start, step or stop))

    def binary(self, left: nodes.Expr, op: int, right: nodes.Expr) -> nodes.Expr:
        span = Span(self.source, left.span.start, right.span.end)
        place = Span(self.source, self.starts[op], self.ends[op])
        if place.start == place.end:  # an operator that recovery put in
            return nodes.BadExpr(span)
        return nodes.Binary(self.sign(op), left, right, place, span)

    def unary(self, op: int, operand: nodes.Expr) -> nodes.Expr:
        return nodes.Unary(self.sign(op), operand, Span(self.source, self.starts[op], operand.span.end))

    def material(self, word: int, name: nodes.Name, *body: nodes.Block) -> nodes.Expr:
        span = self._span(word, body[0] if body else name)
        return nodes.MaterialExpr(name, body[0] if body else None, span) if name.text else nodes.BadExpr(span)

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
            return nodes.CallExpr(nodes.Name(text, at.span.to(name.span)), args[0], span)
        if not isinstance(at, nodes.BadExpr):
            help = f"write `{name.text}(…)` with the value as an argument"
            self.report.add("E0128", "only a name can be called", value.span.start, name.span.end, help=help)
        return nodes.BadExpr(span)

    def call_expr(self, name: nodes.Name, args: Arguments) -> nodes.Expr:
        span = Span(self.source, name.span.start, args[1])
        return nodes.CallExpr(name, args[0], span) if name.text else nodes.BadExpr(span)

    def parenthesised(self, opening: int, value: nodes.Expr, closing: int) -> nodes.Expr:
        # Literals keep their own place: a fix that glues a unit on belongs inside the parentheses.
        if isinstance(value, _LITERALS):
            return value
        return replace(value, span=self._span(opening, closing))

    def vector(self, opening: int, *rest: Any) -> nodes.Expr:
        return nodes.Vector(_items(rest), self._span(opening, rest[-1]))

    def name_ref(self, name: nodes.Name) -> nodes.Expr:
        return nodes.NameRef(name, name.span) if name.text else nodes.BadExpr(name.span)

    def true(self, token: int) -> nodes.Expr:
        return nodes.Bool(True, self._span(token, token))

    def false(self, token: int) -> nodes.Expr:
        return nodes.Bool(False, self._span(token, token))

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
        return nodes.Number(value, text[len(digits) :], span, digits.strip().isdigit())

    def string(self, token: int) -> nodes.String:
        start, end = self.starts[token], self.ends[token]
        text = self.text[start:end]
        span = Span(self.source, start, end)
        closed = text[:1] != '"' or start not in self.tokens.reported
        body = text[1:-1] if closed else text[1:]
        return nodes.String(self._unescape(body, start + 1) if "\\" in body else body, span)

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
        return nodes.Color((red, green, blue), span)


def _items(rest: tuple[Any, ...]) -> tuple[Any, ...]:
    """What stands between an opening bracket and the closing one, which is the last."""
    return tuple(rest[0]) if rest[1:] else ()
