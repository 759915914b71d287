"""Groups of a stream: operands that are folds themselves, in one byte for each row.

A row's token holds in bits 0 and 1 the operator that joins it, in bit 2 whether the row begins a group, which
that operator joins to what stands before it, and in bits 3 to 6 how many groups end behind the row, innermost
first. A renderer keeps a stack of states, one for each open group. The width of a blend lies with the row
that has the operator: that of a group with its first row.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.compiler.graph import MOST_OPEN, Later
from scenelang.language.words import BLEND, COMBINE, TOKENS

UNION, SMOOTH, SUBTRACT, INTERSECT = (TOKENS[word] for word in ("union", "smooth", "subtract", "intersect"))
OPERATOR, BEGINS, ENDS = 3, 4, 3  # mask of the operator, bit of a beginning, shift of the number of ends

Index = npt.NDArray[np.intp]
Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


class Groups(NamedTuple):
    """N rows and G groups, numbered as they begin.

    Args:
        tokens: (N,) operators by which rows join the state of their own group; UNION for the first of one.
        first: (N,) whether the row begins a group.
        path: (N, D) groups that are open at each row, outermost first, -1 behind the last; D is the depth.
        ends: (N,) number of groups that end behind each row.
        joins: (G,) operators by which groups join the state they stand in.
        rows: (G,) their first rows.
    """

    tokens: Index
    first: Mask
    path: Index
    ends: Index
    joins: Index
    rows: Index

    @property
    def deepest(self) -> int:
        """The most groups that are open at once; 0 in a flat stream."""
        return int(self.path.shape[1])


def token_name(token: int) -> str:
    """The operator of a token in words, with brackets for the groups that begin and end with its row."""
    ends = token >> ENDS
    return COMBINE[token & OPERATOR] + " (" * ((token & BEGINS) > 0) + (" " + ")" * ends if ends else "")


def token_fault(tokens: npt.NDArray[np.int8]) -> str | None:
    """Say what is wrong with the tokens (N,) of a stream, None where nothing is."""
    if not len(tokens):
        return None
    wide = tokens.astype(np.intp)
    if (wide < 0).any():
        row = int(np.argmax(wide < 0))
        return f"token {int(wide[row])} of object {row}"
    if wide[0] & (OPERATOR | BEGINS):
        return f"token {int(wide[0])} of the first object, which joins nothing and begins no group"
    begins, ends = (wide & BEGINS) > 0, wide >> ENDS
    open_groups = begins.cumsum() - np.concatenate([[0], ends.cumsum()[:-1]])  # at each row, its own with it
    for bad, what in (
        (open_groups > MOST_OPEN, f"opens a group in {MOST_OPEN} others"),
        (ends > open_groups, "ends more groups than are open"),
    ):
        if bad.any():
            row = int(np.argmax(bad))
            return f"token {int(wide[row])} of object {row} {what}"
    return "a group that does not end" if open_groups[-1] > ends[-1] else None


def read_groups(tokens: npt.NDArray[np.int8]) -> Groups:
    """Read the groups of a stream whose tokens (N,) have no fault."""
    wide = np.asarray(tokens, np.intp)
    count, first, ends = len(wide), (wide & BEGINS) > 0, wide >> ENDS
    rows, operators = np.flatnonzero(first), wide & OPERATOR
    joins, operators = operators[rows], np.where(first, UNION, operators)
    if not len(rows):
        return Groups(operators, first, np.zeros((count, 0), np.intp), 0 * ends, joins, rows)
    path, stack, number = np.full((count, MOST_OPEN), -1, np.intp), list[tuple[int, int]](), 0
    for row in np.flatnonzero(first | (ends > 0)).tolist():
        if first[row]:
            stack.append((number, row))
            number += 1
        for _ in range(int(ends[row])):
            group, begin = stack.pop()
            path[begin : row + 1, len(stack)] = group
    deepest = int((path >= 0).any(0).sum())
    return Groups(operators, first, path[:, :deepest], ends, joins, rows)


def widths_of(operators: Index, blends: npt.NDArray[np.floating]) -> Floats:
    """World widths (N,) of blends, of operators and numbers of vectors (N,), 0 for the usual ones."""
    given = np.asarray(blends, np.float64).clip(0.0)
    usual = np.where(operators == SMOOTH, BLEND, 0.0)
    return np.where((operators != UNION) & (given > 0), given, usual)


class Felt(NamedTuple):
    """Distances beyond leaves at which N rows matter to what is seen, as `scenelang.compiler.graph.Later`.

    Args:
        total, widest, blends: (N,) sum and largest of the widths, world units, and number of the blends that
            see the row, its own and its groups' too.
        everywhere: (N,) whether it matters wherever its leaf is: what it intersects ends outside of it, or
            it is cut out of what a later blend sees.
        inside: (N,) whether a later blend sees how deep inside what it cuts points are.
    """

    total: Floats
    widest: Floats
    blends: Index
    everywhere: Mask
    inside: Mask


def anchored(groups: Groups) -> Mask:
    """Find rows (N,) in a group that is intersected: where none of its rows is met, all is cut away."""
    cuts = np.append(groups.joins == INTERSECT, False)  # of no group, too
    return np.asarray(cuts[groups.path].any(1))


def felt(groups: Groups, widths: Floats) -> Felt:
    """Find how far rows matter, of the widths (N,) of their blends; that of a group is its first row's."""
    if not groups.deepest:
        return _felt_flat(groups.tokens, widths)
    count = len(groups.tokens)
    total, widest = np.zeros((2, count))
    blends, everywhere, inside = np.zeros(count, np.intp), np.zeros(count, bool), np.zeros(count, bool)
    stack, later = list[Later](), Later()
    path = groups.path
    depth = (path >= 0).sum(1)
    for row in range(count - 1, -1, -1):
        for up in range(int(groups.ends[row])):
            group = path[row, depth[row] - int(groups.ends[row]) + up]
            stack.append(later)
            later = later.of(COMBINE[groups.joins[group]], float(widths[groups.rows[group]]))
        first = bool(groups.first[row])
        operator, width = (UNION, 0.0) if first else (int(groups.tokens[row]), float(widths[row]))
        own = later.of(COMBINE[operator], width)
        total[row], widest[row], blends[row] = BLEND * own.total, own.widest, own.count
        inside[row], everywhere[row] = later.inside, own.everywhere or operator == INTERSECT
        later = later.before(COMBINE[operator], width)
        if first:
            operator, width = int(groups.joins[path[row, depth[row] - 1]]), float(widths[row])
            everywhere[row] |= operator == INTERSECT
            later = stack.pop().before(COMBINE[operator], width)
    return Felt(total, widest, blends, everywhere, inside)


def _felt_flat(tokens: Index, widths: Floats) -> Felt:
    cuts = tokens == INTERSECT
    if not widths.any():
        none = np.zeros(len(tokens))
        return Felt(none, none, none.astype(np.intp), cuts, none > 0)
    blends = np.where(tokens == SMOOTH, widths, 0.0)
    later = (widths[::-1] > 0).cumsum()[::-1]  # blends from each row on, of any operator
    own = (tokens == SUBTRACT) & (widths > 0)
    inside = later > (widths > 0)
    return Felt(
        total=blends[::-1].cumsum()[::-1] + np.where(own, widths, 0.0),
        widest=np.maximum(np.maximum.accumulate(blends[::-1])[::-1], np.where(own, widths, 0.0)),
        blends=(blends[::-1] > 0).cumsum()[::-1] + own,
        everywhere=cuts | ((tokens == SUBTRACT) & inside),
        inside=inside,
    )
