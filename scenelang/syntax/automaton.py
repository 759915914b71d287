"""The LALR automaton: reading tokens to their end, and trying some out without building anything.

Lark's own loop feeds token objects through several layers and cannot resume; this one works on the same
tables, keeps token indices on its stack and hands over at a mistake.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from scenelang.syntax.tables import END, tables

LOOKAHEAD = 8
"""How far past a mistake a repair is followed; further on it tells nothing more."""

# What brings a half-written statement to its end. What is tried first ends something; an operand or a name
# is taken only where nothing else will do.
_NEXT = (")", "]", "in", "=", ":", "BAD_EXPRESSION", "STRING", "NAME", "as", "(")
_LONGEST = 24

Mend = Callable[[list[int], list[Any], int], int | None]
"""Changes states, values and tokens at the index of one that does not fit, and says where reading goes on."""


def run(kinds: list[int], callbacks: Iterable[Callable[..., Any] | None], mend: Mend) -> Any:
    """Read tokens to their end and build what they stand for.

    Args:
        kinds: of each token, the last of them `END`; ``mend`` may change the list.
        callbacks: what builds the value of each rule, in the order of `Tables.rules`, from the values of its
            parts; that of a token is its index. None passes the only value on.
        mend: is asked at a token that does not fit; None gives up.

    Returns:
        What the last rule's callback made, None where ``mend`` gave up.
    """
    language = tables()
    actions, gotos, final = language.actions, language.gotos, language.final
    rules = [(*rule[:2], call) for rule, call in zip(language.rules, callbacks, strict=True)]
    states = [language.start]
    values: list[Any] = []
    state = language.start
    at = 0
    kind = kinds[0]
    while True:
        action = actions[state].get(kind)
        if action is None:
            resumed = mend(states, values, at)
            if resumed is None:
                return None
            at = resumed
            kind = kinds[at]
            state = states[-1]
        elif action >= 0:
            states.append(action)
            values.append(at)
            state = action
            at += 1
            kind = kinds[at]
        else:
            length, origin, call = rules[~action]
            if call is None:
                states.pop()
            elif length == 1:
                states.pop()
                values[-1] = call(values[-1])
            elif length:
                parts = values[-length:]
                del values[-length:], states[-length:]
                values.append(call(*parts))
            else:
                values.append(call())
            state = gotos[states[-1]][origin]
            states.append(state)
            if state == final:
                return values[0]


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


def completion(stack: Sequence[int], goal: int) -> tuple[int, ...] | None:
    """Kinds of the missing tokens, after which ``goal`` fits; None where no few do.

    Args:
        stack: states of the parser; they are not changed.
        goal: kind of the token that should follow: a `;` or a brace.
    """
    kind = tables().kind
    trial = list(stack)
    missing: list[int] = []
    while not fits(trial, goal):
        following = next((k for k in map(kind, _NEXT) if fits(trial, k)), None)
        if following is None or len(missing) == _LONGEST:
            return None
        advance(trial, following)
        missing.append(following)
    return tuple(missing)
