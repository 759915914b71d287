"""Text to syntax tree: `parse` reads a whole file, reports the mistakes and always returns a tree.

Tokens come as indices into `Tokens`. What recovery invented is an empty token; an expression that rests on
one becomes a `BadExpr`, a statement without its name a `BadStmt`.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import accumulate
from math import isinf
from typing import TYPE_CHECKING, Any, Final

from scenelang.language import tree
from scenelang.language.diagnostics import Diagnostics, SourceFile, Span
from scenelang.language.lexer import Report, Tokens, run, scan
from scenelang.language.tables import tables
from scenelang.language.words import RESERVED

if TYPE_CHECKING:
    from scenelang.language.recovery import Recovery

Arguments = tuple[tuple[tree.Argument, ...], int]
Keyword = tuple[Any, Span]

PLAIN: Final[dict[str, tuple[type, tuple[int, ...]]]] = {
    "model": (tree.ModelStatement, (1,)),
    "let": (tree.Let, (1, 3)),
    "fn": (tree.Fn, (1, 2, 4)),
    "module": (tree.Module, (1, 2, 3)),
    "for_": (tree.For, (2, 4, 6)),
    "for_item": (tree.ForItem, (2, 4, 6)),
    "if_item": (tree.IfItem, (2, 4)),
    "conditional": (tree.Conditional, (0, 2, 4)),
    "index": (tree.Index, (0, 2)),
    "member": (tree.Member, (0, 2)),
    "bad_expression": (tree.BadExpr, ()),
    "bad_block": (tree.BadStmt, ()),
}
"""Rules whose node has some of their parts as they are: its class, and which parts."""

_ESCAPES = {'"': '"', "\\": "\\", "n": "\n", "t": "\t"}
_ESCAPES_ELSEWHERE = "abefrvxuUN'01234567"
"""Letters with a meaning behind a backslash in other languages: nobody meant the backslash itself there."""
_LITERALS = (tree.NumberLiteral, tree.String, tree.Bool, tree.ColorLiteral, tree.NameRef, tree.BadExpr)


class TreeBuilder:
    """Makes the nodes of one file; ``report`` takes what is found in literals."""

    def __init__(self, tokens: Tokens, report: Report, kept: Mapping[int, tree.Stmt] = {}) -> None:
        self.tokens = tokens
        self.report = report
        self.kept = kept  # statements that need not be read again, by where they begin
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
        bad = tree.BadStmt if issubclass(cls, tree.Stmt) else tree.BadExpr

        def make(*parts: Any) -> Any:
            span = self._span(parts[0], parts[-1])
            values = [parts[at] for at in which]
            if any(isinstance(value, tree.Name) and not value.text for value in values):
                return bad(span)
            return cls(span, *[value[0] if isinstance(value, tuple) else value for value in values])

        return make

    def _span(self, first: Any, last: Any) -> Span:
        """From the first of some parts to the last: tokens, nodes, or lists with their end."""
        start = self.starts[first] if isinstance(first, int) else first.span.start
        return Span(self.source, start, self.ends[last] if isinstance(last, int) else last.span.end)

    def sign(self, token: int) -> Any:
        """Sign or word of a literal token; recovery may have read it from other text."""
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

    def name(self, token: int) -> tree.Name:
        start, end = self.starts[token], self.ends[token]
        return tree.Name(Span(self.source, start, end), self.text[start:end])

    def path(self, left: tree.Name, dot: int, right: tree.Name) -> tree.Name:
        text = f"{left.text}.{right.text}" if left.text and right.text else ""
        return tree.Name(left.span.to(right.span), text)

    # ------------------------------------------------------------ expressions

    def argument(self, *parts: Any) -> tree.Argument:
        name, value = (parts[0] if parts[1:] else None), parts[-1]
        return tree.Argument(name.span.to(value.span) if name else value.span, name, value)

    def range(self, start: tree.Expr, dots: int, stop: tree.Expr, *rest: Any) -> tree.Expr:
        step = rest[1] if rest else None
        return tree.Range(self._span(start, step or stop), start, stop, self.sign(dots) == "..<", step)

    def binary(self, left: tree.Expr, op: int, right: tree.Expr) -> tree.Expr:
        span = Span(self.source, left.span.start, right.span.end)
        place = Span(self.source, self.starts[op], self.ends[op])
        if place.start == place.end:  # an operator that recovery put in
            return tree.BadExpr(span)
        return tree.Binary(span, self.sign(op), left, right, place)

    def unary(self, op: int, operand: tree.Expr) -> tree.Expr:
        return tree.Unary(Span(self.source, self.starts[op], operand.span.end), self.sign(op), operand)

    def material(self, word: int, *rest: Any) -> tree.Expr:
        span, body = self._span(word, rest[-1]), _block(rest[-1])
        *shading, name = rest if body is None else rest[:-1]
        return tree.MaterialExpr(span, name, body, *shading) if name.text else tree.BadExpr(span)

    def method(self, value: tree.Expr, dot: int, name: tree.Name, args: Arguments) -> tree.Expr:
        span = Span(self.source, value.span.start, args[1])
        parts = [name]
        at = value
        while isinstance(at, tree.Member):
            parts.append(at.name)
            at = at.value
        if isinstance(at, tree.NameRef):
            parts.append(at.name)
            text = ".".join(part.text for part in reversed(parts))
            return tree.CallExpr(span, tree.Name(at.span.to(name.span), text), args[0])
        if not isinstance(at, tree.BadExpr):
            help = f"write `{name.text}(…)` with the value as an argument"
            self.report.add("E0128", "only a name can be called", value.span.start, name.span.end, help=help)
        return tree.BadExpr(span)

    def call_expr(self, name: tree.Name, args: Arguments) -> tree.Expr:
        span = Span(self.source, name.span.start, args[1])
        return tree.CallExpr(span, name, args[0]) if name.text else tree.BadExpr(span)

    def parenthesised(self, opening: int, value: tree.Expr, closing: int) -> tree.Expr:
        # Literals keep their own place: a fix that glues a unit on belongs inside the parentheses.
        if isinstance(value, _LITERALS):
            return value
        return replace(value, span=self._span(opening, closing))

    def vector(self, opening: int, *rest: Any) -> tree.Expr:
        return tree.Vector(self._span(opening, rest[-1]), _items(rest))

    def name_ref(self, name: tree.Name) -> tree.Expr:
        return tree.NameRef(name.span, name) if name.text else tree.BadExpr(name.span)

    def true(self, token: int) -> tree.Expr:
        return tree.Bool(self._span(token, token), self.sign(token) == "true")

    false = true

    # ------------------------------------------------------------ literals

    def number(self, token: int) -> tree.NumberLiteral | tree.BadExpr:
        start, end = self.starts[token], self.ends[token]
        span = Span(self.source, start, end)
        if start == end or start in self.tokens.reported:
            return tree.BadExpr(span)
        text = self.text[start:end]
        # No digit or exponent ends in one of these letters.
        digits = text.rstrip("adegmnrstu")
        value = float(digits)
        if isinf(value):
            self.report.add("E0125", "number too large", start, end, help="the largest number is 1.8e308")
            return tree.BadExpr(span)
        return tree.NumberLiteral(span, value, text[len(digits) :], digits.isdigit())

    def string(self, token: int) -> tree.String:
        start, end = self.starts[token], self.ends[token]
        text = self.text[start:end]
        span = Span(self.source, start, end)
        closed = text[:1] != '"' or start not in self.tokens.reported
        body = text[1:-1] if closed else text[1:]
        return tree.String(span, self._unescape(body, start + 1) if "\\" in body else body)

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

    def color(self, token: int) -> tree.Expr:
        start, end = self.starts[token], self.ends[token]
        span = Span(self.source, start, end)
        if start == end or start in self.tokens.reported:
            return tree.BadExpr(span)
        digits = self.text[start + 1 : end]
        if len(digits) == 3:
            digits = "".join(digit * 2 for digit in digits)
        red, green, blue = (int(digits[at : at + 2], 16) / 255 for at in (0, 2, 4))
        return tree.ColorLiteral(span, (red, green, blue))

    # ------------------------------------------------------------ statements

    def keyword(self, token: int) -> Keyword:
        return self.sign(token), self._span(token, token)

    def file(self, statements: list[tree.Stmt] | None = None) -> tree.File:
        return tree.File(Span(self.source, 0, len(self.text)), tuple(statements or ()))

    def bad_statement(self, token: int) -> tree.Stmt:
        return self.kept.get(self.starts[token]) or tree.BadStmt(self._span(token, token))

    def version(self, word: int, number: int, semicolon: int) -> tree.Stmt:
        span = self._span(word, semicolon)
        value = self.number(number)
        return tree.Version(span, value) if isinstance(value, tree.NumberLiteral) else tree.BadStmt(span)

    def param(self, word: int, name: tree.Name, equal: int, default: tree.Expr, *rest: Any) -> tree.Stmt:
        span = self._span(word, rest[-1])
        range = rest[1] if rest[1:] else None
        return tree.Param(span, name, default, range) if name.text else tree.BadStmt(span)

    def parameter(self, name: tree.Name, *default: Any) -> tree.Parameter:
        value = default[1] if default else None
        return tree.Parameter(name.span.to((value or name).span), name, value)

    def import_(self, word: int, path: int, as_: int, alias: tree.Name, last: int) -> tree.Stmt:
        span = self._span(word, last)
        possible = alias.text.isascii() and alias.text.isidentifier() and alias.text not in RESERVED
        if not possible or self.starts[path] == self.ends[path]:
            return tree.BadStmt(span)
        return tree.Import(span, self.string(path), alias)

    def if_(
        self, word: int, opening: int, condition: tree.Expr, closing: int, then: tree.Block, *rest: Any
    ) -> tree.Stmt:
        otherwise = rest[1] if rest else None
        return tree.If(self._span(word, otherwise or then), condition, then, otherwise)

    def node(self, kind: Keyword, *rest: Any) -> tree.Stmt:
        args, body = (rest[0][0], rest[1]) if rest[1:] else (None, rest[0])
        return tree.Node(kind[1].to(body.span), kind[0], body, kind[1], args)

    def combined(self, op: Keyword, *rest: Any) -> tree.Stmt:
        args, child = (rest[0][0], rest[1]) if rest[1:] else (None, rest[0])
        return tree.Combined(op[1].to(child.span), op[0], child, op[1], args)

    def material_use(self, word: int, *rest: Any) -> tree.Stmt:
        span = self._span(word, rest[-1])
        *shading, name = rest[:-1]
        return tree.MaterialUse(span, name, _block(rest[-1]), *shading) if name.text else tree.BadStmt(span)

    def call(self, name: tree.Name, *rest: Any) -> tree.Stmt:
        span = self._span(name, rest[-1])
        if not name.text:
            return tree.BadStmt(span)
        return tree.Call(span, name, rest[0][0] if rest[1:] else None, _block(rest[-1]))

    def block(self, opening: int, *rest: Any) -> tree.Block:
        return tree.Block(self._span(opening, rest[-1]), _items(rest))


def _items(rest: tuple[Any, ...]) -> tuple[Any, ...]:
    """Items between an opening bracket and the closing one, which is the last part."""
    return tuple(rest[0]) if rest[1:] else ()


def _block(last: Any) -> tree.Block | None:
    return last if isinstance(last, tree.Block) else None


MAX_DEPTH = 200
"""No tree is deeper, so no later stage can exhaust the stack."""

_OTHER, _LOOP, _OPERATOR, _OPEN, _BRACE, _CLOSE, _END_BRACE, _COMMA, _SEMICOLON = range(9)

_REACH: Final = 240
"""Tokens past a mistake that recovery may look at, with room."""


def fold(tokens: Tokens, known: Sequence[tree.Kept]) -> None:
    """Let one token stand for each known statement, but for those that recovery may look at."""
    columns, spans = (tokens.kinds, tokens.starts, tokens.ends), [stmt.span for stmt in known]
    places = [(bisect_left(tokens.starts, span.start), span) for span in spans]
    found = [(at, bisect_left(tokens.starts, s.end), s) for at, s in places if tokens.starts[at] == s.start]
    nexts = [*(first for first, _, _ in found[1:]), len(tokens.kinds) - 1]
    new: tuple[list[int], ...] = ([], [], [])
    copied = end = 0
    seen = _REACH  # tokens since something that is not known
    for (first, stop, span), following in zip(found, nexts, strict=True):
        seen = seen if first == end else 0
        if seen >= _REACH and following == stop:
            token = (tables().kind("BAD_STATEMENT"), span.start, span.end)
            for target, column, value in zip(new, columns, token, strict=True):
                target += [*column[copied:first], value]
            copied = stop
        seen, end = seen + stop - first, stop
    for target, column in zip(new, columns, strict=True):
        column[:copied] = target


def parse(source: SourceFile, diagnostics: Diagnostics, known: Sequence[tree.Kept] = ()) -> tree.File:
    """The tree of a whole text; never raises. It holds `BadStmt` and `BadExpr` where there are mistakes.

    Args:
        known: sound statements at top level that an edit left as they were, in order; most stand in the tree.
    """
    report = Report(source)
    tokens = scan(source, report)
    if known:
        fold(tokens, known)
    steps = {tables().literals["{"]: 1, tables().literals["}"]: -1}
    depths = [0, *accumulate(steps[kind] for kind in tokens.kinds if kind in steps)]
    odd = depths[-1] or min(depths) < 0  # some brace has no counterpart
    if known and odd:
        return parse(source, diagnostics)
    if odd:
        # What only mistakes need is loaded at the first one: most runs start and end without any.
        from scenelang.language.recovery import balance

        balance(tokens, report)
    limit_nesting(tokens, report)
    recovery: Recovery | None = None
    unfinished: list[Any] = []

    def mend(states: list[int], values: list[Any], at: int) -> int | None:
        nonlocal recovery, unfinished
        if recovery is None:
            from scenelang.language.recovery import Recovery

            recovery = Recovery(tokens, report)
        unfinished = values
        return recovery.resume(states, values, at)

    builder = TreeBuilder(tokens, report, {stmt.span.start: stmt for stmt in known})
    file: tree.File | None = run(tokens.kinds, builder.callbacks(), mend)
    if known and (file is None or any(d.code in ("E0120", "E0121") for d in report.found)):
        return parse(source, diagnostics)
    report.flush(diagnostics)
    if file is not None:
        return file
    # The mistakes became too many: only what came before them is known.
    statements = unfinished[0] if unfinished and isinstance(unfinished[0], list) else []
    end = tokens.ends[-1]
    start = statements[-1].span.end if statements else 0
    rest = tree.BadStmt(Span(tokens.source, start, end))
    return tree.File(Span(tokens.source, 0, end), (*statements, rest))


# ---------------------------------------------------------------- nesting


@cache
def _classes() -> tuple[int, ...]:
    operators = ("||", "&&", "==", "!=", "<", "<=", ">", ">=", "+", "-", "*", "/", "%", "!", "^", "?", ".")
    classes = dict.fromkeys((*operators, "else"), _OPERATOR)
    classes |= {"(": _OPEN, "[": _OPEN, ")": _CLOSE, "]": _CLOSE, ",": _COMMA, ";": _SEMICOLON}
    classes |= {"{": _BRACE, "}": _END_BRACE, "for": _LOOP, "if": _LOOP}
    return tuple(classes.get(name, _OTHER) for name in tables().kinds)


def limit_nesting(tokens: Tokens, report: Report) -> None:
    """Report what is nested deeper than `MAX_DEPTH`; its statement and all that follows are given up.

    Open brackets and braces, operators between them, loops in vectors and the arms of an `else if` chain make
    a tree deeper.
    """
    kinds = tokens.kinds
    classes = _classes()
    else_kind, round_ = tables().literals["else"], tables().literals[")"]
    first = 0  # of the statement at top level
    depth = floor = ground = 0  # now; where this list item began; where this block's statements begin
    brackets: list[int] = []  # the floors outside those open in this block
    blocks: list[tuple[int, int, int, list[int]]] = []  # the state outside each open block
    for at, kind in enumerate(kinds):
        c = classes[kind]
        if c == _OTHER or (c == _LOOP and not brackets):  # a statement's block counts
            continue
        if c <= _BRACE:
            if depth == MAX_DEPTH:
                _give_up(tokens, report, first, at)
                return
            depth += 1
            if c == _OPEN:
                brackets.append(floor)
                floor = depth
            elif c == _BRACE:
                blocks.append((depth - 1, floor, ground, brackets))
                floor = ground = depth
                brackets = []
        elif c == _CLOSE:
            if brackets:
                depth = floor - (kind == round_)  # `v[0]` makes the tree deeper by what it goes on
                floor = brackets.pop()
        elif c == _COMMA:
            depth = floor
        else:
            if c == _END_BRACE and blocks:
                depth, floor, ground, brackets = blocks.pop()
            if c == _SEMICOLON or (not brackets and kinds[at + 1] != else_kind):
                brackets.clear()
                depth = floor = ground
                first = first if blocks else at + 1


def _give_up(tokens: Tokens, report: Report, first: int, at: int) -> None:
    help = "give a part of it a name with `let`, `fn` or `module`; the rest is skipped"
    report.add("E0120", f"nested deeper than {MAX_DEPTH} levels", *tokens.place(at), help=help)
    rest = (tables().kind("BAD_STATEMENT"), tokens.starts[first], tokens.ends[-1])
    tokens.splice(first, len(tokens.kinds) - 1, [rest])
