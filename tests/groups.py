"""Random streams with groups, and their fold by recursion: what a stack of states has to show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from scenelang.compiler.groups import BEGINS, ENDS, OPERATOR, SMOOTH
from scenelang.drawing.exact.field import combine

State = tuple[Any, Any] | None
"""Distances and colours of a fold; None where nothing has been met."""


def random_tokens(rng: np.random.Generator, count: int, deepest: int = 3, operators: int = 4) -> list[int]:
    """Tokens of a stream of so many rows, with groups of at least two rows."""
    found, open_rows = list[int](), list[int]()  # rows that the open groups have
    for row in range(count):
        left = count - row  # this row and those behind it
        token = int(rng.integers(operators)) if row else 0
        if row and left > 1 and len(open_rows) < deepest and rng.random() < 0.35:
            token |= BEGINS
            open_rows.append(0)
        open_rows = [held + 1 for held in open_rows]
        ends = 0
        while open_rows and open_rows[-1] > 1 and (left == 1 or rng.random() < 0.4):
            open_rows.pop()
            ends += 1
        found.append(token | ends << ENDS)
    return found if not open_rows else random_tokens(rng, count, deepest, operators)


def folded(
    d: Sequence[Any],
    c: Sequence[Any],
    tokens: Sequence[int],
    widths: Sequence[float],
    kept: Sequence[bool] | None = None,
) -> State:
    """Fold rows of distances and colours, by the formulas of the reference; rows not kept have no effect.

    Args:
        widths: of the blends of rows, or of the groups that they begin; 0 where none is given.
    """

    def joined(state: State, operand: State, operator: int, width: float) -> State:
        if operand is None:
            return state
        if state is None:
            return operand if operator <= SMOOTH else None
        return combine(*state, *operand, operator, width)

    stack: list[tuple[State, int, float]] = [(None, 0, 0.0)]
    for row, token in enumerate(tokens):
        operator, width = token & OPERATOR, widths[row]
        leaf = (d[row], c[row]) if kept is None or kept[row] else None
        if token & BEGINS:
            stack.append((leaf, operator, width))
        else:
            state, outer, around = stack.pop()
            stack.append((joined(state, leaf, operator, width), outer, around))
        for _ in range(token >> ENDS):
            inner, operator, width = stack.pop()
            state, outer, around = stack.pop()
            stack.append((joined(state, inner, operator, width), outer, around))
    ((state, _, _),) = stack
    return state
