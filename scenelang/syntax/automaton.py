"""Trying tokens out on a stack of LALR states, without building anything."""

from __future__ import annotations

from scenelang.syntax.tables import END, tables

LOOKAHEAD = 8
"""How far past a mistake a repair is followed; further on it tells nothing more."""


def advance(stack: list[int], kind: int) -> bool:
    """Take one token, changing the stack; False where it does not fit."""
    language = tables()
    actions, gotos, rules = language.actions, language.gotos, language.rules
    while True:
        action = actions[stack[-1]].get(kind)
        if action is None:
            return False
        if action >= 0:
            stack.append(action)
            return True
        length, origin, _ = rules[~action]
        if length:
            del stack[-length:]
        stack.append(gotos[stack[-1]][origin])
        if stack[-1] == language.final:
            return True


def fits(stack: list[int], kind: int) -> bool:
    """Whether one token can follow."""
    return advance(stack.copy(), kind)


def reach(stack: list[int], kinds: list[int], start: int, stop: int) -> int:
    """Index of the first token from ``start`` on that does not fit, at most ``stop``.

    Changes the stack. A text read to its end counts as ``stop``.
    """
    for at in range(start, min(stop, len(kinds))):
        if not advance(stack, kinds[at]):
            return at
        if kinds[at] == END:
            return stop
    return stop


def statement_depth(stack: list[int]) -> int:
    """Index of the innermost state in which a statement can begin; the last where one has just ended."""
    language = tables()
    bad_statement = language.kind("BAD_STATEMENT")
    at = len(stack) - 1
    if bad_statement in language.actions[stack[at]]:
        return at
    while language.actions[stack[at]].get(bad_statement, -1) < 0:
        at -= 1
    return at
