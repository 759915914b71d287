"""The nesting limit: no tree is deeper than `MAX_DEPTH`, so no later stage can exhaust the stack.

Depth counts everything that makes the tree deeper: open brackets and braces, operators between them, and
the arms of an `else if` chain. The check runs over tokens, before there is a tree.
"""

from __future__ import annotations

from functools import cache

from scenelang.syntax.tables import tables
from scenelang.syntax.tokens import Report, Tokens

MAX_DEPTH = 200

_OTHER, _OPERATOR, _OPEN, _BRACE, _CLOSE, _END_BRACE, _COMMA, _SEMICOLON = range(8)


@cache
def _classes() -> tuple[int, ...]:
    """What each kind does to the depth."""
    operators = ("||", "&&", "==", "!=", "<", "<=", ">", ">=", "+", "-", "*", "/", "%", "!", "^", "?", ".")
    classes = dict.fromkeys((*operators, "else"), _OPERATOR)
    classes |= {"(": _OPEN, "[": _OPEN, ")": _CLOSE, "]": _CLOSE, ",": _COMMA, ";": _SEMICOLON}
    classes |= {"{": _BRACE, "}": _END_BRACE}
    return tuple(classes.get(name, _OTHER) for name in tables().kinds)


def limit_nesting(tokens: Tokens, report: Report) -> None:
    """Report what is nested deeper than `MAX_DEPTH`; its statement and all that follows are given up."""
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
