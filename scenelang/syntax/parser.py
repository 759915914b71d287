"""Text to tree: braces, the automaton, and `syntax.recovery` where a token does not fit."""

from __future__ import annotations

from functools import cache
from itertools import accumulate
from typing import TYPE_CHECKING, Any

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.span import SourceFile, Span
from scenelang.syntax import nodes
from scenelang.syntax.automaton import run
from scenelang.syntax.build import Builder
from scenelang.syntax.lexer import Report, Tokens, scan
from scenelang.syntax.tables import tables

if TYPE_CHECKING:
    from scenelang.syntax.recovery.recover import Recovery

MAX_DEPTH = 200
"""No tree is deeper, so no later stage can exhaust the stack."""

_OTHER, _OPERATOR, _OPEN, _BRACE, _CLOSE, _END_BRACE, _COMMA, _SEMICOLON = range(8)


def parse(source: SourceFile, diagnostics: Diagnostics) -> nodes.File:
    """The tree of a whole text; never raises.

    Args:
        source: the text.
        diagnostics: takes every syntax mistake, in the order of the text. Where there are any, the tree
            holds `BadStmt` and `BadExpr` nodes.
    """
    report = Report(source)
    tokens = scan(source, report)
    if _unbalanced(tokens):
        # What only mistakes need is loaded at the first one: most runs start and end without any.
        from scenelang.syntax.recovery.braces import balance

        balance(tokens, report)
    file = parse_tokens(tokens, report)
    report.flush(diagnostics)
    return file


def _unbalanced(tokens: Tokens) -> bool:
    """Whether some brace has no counterpart."""
    steps = {tables().literals["{"]: 1, tables().literals["}"]: -1}
    depths = [0, *accumulate(steps[kind] for kind in tokens.kinds if kind in steps)]
    return depths[-1] != 0 or min(depths) < 0


def parse_tokens(tokens: Tokens, report: Report) -> nodes.File:
    """The tree of tokens whose braces match; recovery edits them and reports to ``report``."""
    limit_nesting(tokens, report)
    recovery: Recovery | None = None
    unfinished: list[Any] = []

    def mend(states: list[int], values: list[Any], at: int) -> int | None:
        nonlocal recovery, unfinished
        if recovery is None:
            from scenelang.syntax.recovery.recover import Recovery

            recovery = Recovery(tokens, report)
        unfinished = values
        return recovery.resume(states, values, at)

    file: nodes.File | None = run(tokens.kinds, Builder(tokens, report).callbacks(), mend)
    return _abandoned(tokens, unfinished) if file is None else file


def _abandoned(tokens: Tokens, values: list[Any]) -> nodes.File:
    """The tree of what came before the mistakes became too many."""
    statements = values[0] if values and isinstance(values[0], list) else []
    end = tokens.ends[-1]
    start = statements[-1].span.end if statements else 0
    rest = nodes.BadStmt(Span(tokens.source, start, end))
    return nodes.File(Span(tokens.source, 0, end), (*statements, rest))


# ---------------------------------------------------------------- nesting


@cache
def _classes() -> tuple[int, ...]:
    """What each kind does to the depth."""
    operators = ("||", "&&", "==", "!=", "<", "<=", ">", ">=", "+", "-", "*", "/", "%", "!", "^", "?", ".")
    classes = dict.fromkeys((*operators, "else"), _OPERATOR)
    classes |= {"(": _OPEN, "[": _OPEN, ")": _CLOSE, "]": _CLOSE, ",": _COMMA, ";": _SEMICOLON}
    classes |= {"{": _BRACE, "}": _END_BRACE}
    return tuple(classes.get(name, _OTHER) for name in tables().kinds)


def limit_nesting(tokens: Tokens, report: Report) -> None:
    """Report what is nested deeper than `MAX_DEPTH`; its statement and all that follows are given up.

    Depth counts everything that makes the tree deeper: open brackets and braces, operators between them,
    and the arms of an `else if` chain. The check runs over tokens, before there is a tree.
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
        if c == _OTHER:
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
    tokens.give_up(first, len(tokens.kinds) - 1, "BAD_STATEMENT", tokens.starts[first], tokens.ends[-1])
