"""Intervals through the exact fold: what regions of the plane show for certain, whoever draws them.

The formulas are those of `scenelang.reference.field`. The state is monotonic in both distances, so the ends
of its interval come of theirs.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.program.groups import INTERSECT, SMOOTH, SUBTRACT, UNION
from scenelang.renderers.meetings import Index, Mask, Meetings, Nesting, Turn, flat_nesting

Floats = npt.NDArray[np.float64]
NOTHING = 1e200  # world units: the distance before the first object, beyond all blends


class Enclosure(NamedTuple):
    """Numbers from ``low`` to ``high``."""

    low: Floats
    high: Floats


class Enclosed(NamedTuple):
    """What is certain of regions.

    Args:
        shown: channels (K, B).
        left: (P,) objects that may change what is shown.
    """

    shown: Enclosure
    left: Mask


class Joins(NamedTuple):
    """Ways in which P operands join.

    Args:
        tokens: operators.
        widths: of their blends, 0 for sharp edges.
        free: whether no blend follows: what is outside, and how deep inside the rest, is all one.
    """

    tokens: Index
    widths: Floats
    free: Mask

    def some(self, which: slice | Index) -> Joins:
        """Select some of them."""
        return Joins(self.tokens[which], self.widths[which], self.free[which])


def enclosed(
    meetings: Meetings,
    distance: Enclosure,
    colour: Enclosure,
    joins: Joins,
    behind: Floats,
    nest: Nesting | None = None,
    groups: Joins | None = None,
) -> Enclosed:
    """Fold the enclosed distances of the objects that regions meet.

    Args:
        distance: world distances of the pairs (P,), wherever in the region.
        colour: of the pairs (3, P).
        joins: of the pairs.
        behind: (K,) what is shown where nothing is: a background, or four zeros.
        nest: of a stream with groups.
        groups: how these join.
    """
    count, pairs = len(meetings.columns), len(joins.tokens)
    shut, opened = np.empty((2, pairs), bool)
    if nest is None:
        nest = flat_nesting(meetings)
    state = _State.empty(count * nest.levels)

    def pair(turn: Turn, places: Index | slice) -> tuple[Mask, Mask]:
        part = turn.part
        own = Enclosure(*(d[part] for d in distance)), Enclosure(*(c[:, part] for c in colour))
        return state.join(places, *own, joins.some(part), turn.fresh)

    def group(top: Index | slice, below: Index | slice, ended: Index) -> tuple[Mask, Mask]:
        assert groups is not None
        joined = state.join(below, *state.at(top), groups.some(ended), np.zeros(len(ended), bool))
        state.clear(top)
        return joined

    nest.fold(count, shut, opened, pair, group)
    (low, high), (first, last) = (tuple(side[..., :count] for side in pair) for pair in state)
    if len(behind) > 3:
        first, last = (np.vstack([c, np.ones(count)]) for c in (first, last))
    back = behind[:, None]
    shown = Enclosure(
        np.where(high < 0, first, np.where(low < 0, np.minimum(first, back), back)),
        np.where(high < 0, last, np.where(low < 0, np.maximum(last, back), back)),
    )
    return Enclosed(shown, ~shut)


class _State(NamedTuple):
    """Distances (B,) and colours (3, B) of a fold."""

    distance: Enclosure
    colour: Enclosure

    @classmethod
    def empty(cls, count: int) -> _State:
        return cls(Enclosure(*np.full((2, count), NOTHING)), Enclosure(*np.zeros((2, 3, count))))

    def at(self, columns: Index | slice) -> tuple[Enclosure, Enclosure]:
        """Return distances and colours in some columns."""
        return tuple(Enclosure(low[..., columns], high[..., columns]) for low, high in self)  # type: ignore[return-value]

    def clear(self, columns: Index | slice) -> None:
        """Empty it in some columns."""
        for side, colour in zip(self.distance, self.colour, strict=True):
            side[columns], colour[:, columns] = NOTHING, 0.0

    def join(
        self, columns: Index | slice, distance: Enclosure, colour: Enclosure, how: Joins, fresh: Mask
    ) -> tuple[Mask, Mask]:
        """Take in n operands, ``fresh`` ones as they are; which change nothing, which leave nothing else."""
        (d, e), (token, k, free) = distance, how
        a, b = self.distance.low[columns].copy(), self.distance.high[columns].copy()
        union = token == UNION
        # the object's share of the colour; of a union all or none
        some = union & ((e < np.maximum(a, 0.0)) | (free & (a >= 0.0)))
        most = union & (some | ((d < np.maximum(b, 0.0)) & ~(free & (d >= 0.0))))
        shares: tuple[Floats, Floats] = some.astype(float), most.astype(float)
        ends = np.minimum(a, d), np.minimum(b, e)
        closed, wide = d >= np.where(free, 0.0, np.maximum(b, 0.0)), e < np.where(free, 0.0, a)
        if (which := token == SMOOTH).any():
            blend = _blend(a, e, k)[0], _blend(b, d, k)[0]
            shares = _chosen(which, blend, shares)
            ends = _chosen(which, (_blend(a, d, k)[1], _blend(b, e, k)[1]), ends)
            closed, wide = _chosen(which, (blend[1] <= 0, blend[0] >= 1), (closed, wide))
        for operator, (near, far) in ((SUBTRACT, (-e, -d)), (INTERSECT, (d, e))):
            if (which := token == operator).any():
                rounds = which & (k > 0)
                ends = _chosen(which, (np.maximum(a, near), np.maximum(b, far)), ends)
                closed = np.where(which, (far <= a) | (free & (far < 0.0)), closed)
                if rounds.any():  # a smooth union turned inside out
                    blends = -_blend(-a, -near, k)[1], -_blend(-b, -far, k)[1]
                    ends = _chosen(rounds, blends, ends)
                    closed = np.where(rounds, far + k <= a, closed)
                wide &= ~which
        if fresh.any():
            ends, shares = _chosen(fresh, (d, e), ends), _chosen(fresh, (1.0, 1.0), shares)
            closed, wide = closed & ~fresh, wide | fresh
        self.distance.low[columns], self.distance.high[columns] = ends
        for side, choose, own in zip(self.colour, (np.minimum, np.maximum), colour, strict=True):
            now = side[:, columns]
            more = own - now
            side[:, columns] = now + choose(shares[0] * more, shares[1] * more)
        return closed, wide


def _chosen(which: Mask, new: tuple[Any, Any], old: tuple[Any, Any]) -> tuple[Any, Any]:
    return np.where(which, new[0], old[0]), np.where(which, new[1], old[1])


def blended(meetings: Meetings, rounds: Mask) -> Mask:
    """After which pairs (P,) a blend follows in their region."""
    found, seen = np.empty(len(rounds), bool), np.zeros(len(meetings.columns), bool)
    for part in reversed(meetings.slots()):
        n = part.stop - part.start
        found[part] = seen[:n]
        seen[:n] |= rounds[part]
    return found


def _blend(big: Floats, d: Floats, k: Floats) -> tuple[Floats, Floats]:
    """The share of the object's colour, and the state behind a smooth union."""
    k = np.where(k > 0, k, 1.0)  # of others, which do not ask
    with np.errstate(over="ignore"):
        h = np.clip(0.5 + 0.5 * (big - d) / k, 0.0, 1.0)
    return h, big * (1 - h) + d * h - k * h * (1 - h)
