"""What a line that breaks off lacks: the tokens that bring a half-written statement to its end."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from scenelang.syntax.automaton import advance, fits
from scenelang.syntax.tables import tables

_LONGEST = 24

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
