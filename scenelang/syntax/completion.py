"""What a line that breaks off lacks: the tokens that bring a half-written statement to its end, and where."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from scenelang.syntax.automaton import advance, fits, reach
from scenelang.syntax.tables import tables

_LONGEST = 24
_INSIDE = 64  # tokens over which another place for a closing bracket is looked for

# What is tried first ends something; an operand or a name is taken only where nothing else will do.
_NEXT = (")", "]", "in", "=", ":", "BAD_EXPRESSION", "STRING", "NAME", "as", "(")


@cache
def _order() -> tuple[int, ...]:
    return tuple(map(tables().kind, _NEXT))


def completion(stack: Sequence[int], goal: int) -> tuple[int, ...] | None:
    """The tokens after which ``goal`` fits; None where no few do.

    Args:
        stack: states of the parser; they are not changed.
        goal: kind of the token that should follow: a `;` or a brace.

    Returns:
        Kinds of the missing tokens, without the goal; empty where it fits already.
    """
    trial = list(stack)
    missing: list[int] = []
    while not fits(trial, goal):
        following = next((kind for kind in _order() if fits(trial, kind)), None)
        if following is None or len(missing) == _LONGEST:
            return None
        advance(trial, following)
        missing.append(following)
    return tuple(missing)


def closes_earlier(stack: list[int], closing: int, inside: list[int], after: list[int]) -> bool:
    """Whether a bracket that has been opened could as well be closed before some of what is inside.

    ``sin(x * 2;`` may have been meant as ``sin(x) * 2`` and as ``sin(x * 2)``.

    Args:
        stack: the states inside the bracket; changed.
        closing: what closes it.
        inside: what follows up to where it is to be closed.
        after: what follows then, to the end of the statement.
    """
    if len(inside) > _INSIDE:
        return True
    for at, kind in enumerate(inside):
        moved = [closing, *inside[at:], *after]
        if kind != closing and reach(stack.copy(), moved, 0, len(moved)) == len(moved):
            return True
        advance(stack, kind)
    return False
