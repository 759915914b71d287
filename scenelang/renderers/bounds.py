"""Intervals through the cell: what a block of pixels is proved to show, and which objects matter to it.

Everything is float32 on the host. Distances come widened by more than that may be off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.renderers.meetings import Meetings
from scenelang.renderers.network import Cell

Floats = npt.NDArray[np.float32]


class Interval(NamedTuple):
    """Numbers from ``low`` to ``high``."""

    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True)
class Shown:
    """What is proved of blocks.

    Args:
        picture: premultiplied colour and coverage (4, B).
        shut: (P,) objects that change nothing in their block.
        open: (P,) objects behind which nothing matters that came before.
    """

    picture: Interval
    shut: npt.NDArray[np.bool_]
    open: npt.NDArray[np.bool_]


def shown(
    meetings: Meetings, distance: Interval, cell: Cell, colours: Interval, empty: float, slope: float
) -> Shown:
    """Fold intervals, of a network whose state is one number and that knows one feature.

    Args:
        distance: of the pairs (P,), world units.
        cell: of the pairs, which come last: lines (1 + L, 2, P), bias (1 + L, P), candidate and bump (1, P).
        colours: of the pairs (3, P).
        empty: the state before the first object.
        slope: of coverage, per world unit.
    """
    blocks, given = len(meetings.columns), meetings.pairs.open
    low, high = np.full((2, blocks), empty, np.float32)
    colour = Interval(*np.zeros((2, 3, blocks), np.float32))
    shut, wide = np.zeros(len(given), bool), given.copy()
    # ends are never averaged, as a wide interval's middle would swallow the digits of its nearer end
    up, down = np.maximum(cell.lines, 0.0), np.minimum(cell.lines, 0.0)
    # what the objects' own distances bring to the gates
    own = Interval(
        up[:, 0] * distance.low + down[:, 0] * distance.high + cell.bias,
        up[:, 0] * distance.high + down[:, 0] * distance.low + cell.bias,
    )
    own.low[:, given] = own.high[:, given] = np.inf
    bump = cell.bump[0] / 4
    for part in meetings.slots():
        n = part.stop - part.start
        rising, falling = up[:, 1, part], down[:, 1, part]
        past = rising * high[:n] + falling * low[:n]
        least = own.low[:, part] + (rising * low[:n] + falling * high[:n])
        most = own.high[:, part] + past
        paint = Interval(least[1:].max(0).clip(0.0, 1.0), most[1:].max(0).clip(0.0, 1.0))
        keeps, takes = least[0] < 1, most[0] > 0
        shut[part] = ~takes & (paint.high <= 0)
        wide[part] |= ~keeps & (paint.low >= 1)
        # where the gate is not wide open, or not shut, its line bounds one number by the other
        kept = _capped(Interval(low[:n], high[:n]), cell.lines[0, 1, part], 1.0 - own.low[0, part])
        d = Interval(distance.low[part], distance.high[part])
        taken = _capped(d, -cell.lines[0, 0, part], past[0] + cell.bias[0, part])
        taken = Interval(*(np.where(given[part], *pair) for pair in zip(d, taken, strict=True)))
        a, b = taken.low * cell.candidate[0, 0, part], taken.high * cell.candidate[0, 0, part]
        dent = bump[part] * (keeps & takes)
        low[:n] = np.minimum(
            np.where(keeps, kept.low, np.inf), np.where(takes, np.minimum(a, b), np.inf)
        ) - np.maximum(dent, 0.0)
        high[:n] = np.maximum(
            np.where(keeps, kept.high, -np.inf), np.where(takes, np.maximum(a, b), -np.inf)
        ) - np.minimum(dent, 0.0)
        for side, own_colour, choose in zip(colour, colours, (np.minimum, np.maximum), strict=True):
            more = own_colour[:, part] - side[:, :n]
            side[:, :n] += choose(paint.low * more, paint.high * more)
    covered = Interval((0.5 - slope * high).clip(0.0, 1.0), (0.5 - slope * low).clip(0.0, 1.0))
    picture = Interval(*(np.vstack([c * share, share]) for c, share in zip(colour, covered, strict=True)))
    return Shown(picture, shut, wide)


def _capped(x: Interval, factor: Floats, most: Floats) -> Interval:
    """An interval of those x that have ``factor x <= most``, of which there are some."""
    bound = most / factor
    bound = np.minimum(np.maximum(bound, x.low), x.high)
    return Interval(np.where(factor < 0, bound, x.low), np.where(factor > 0, bound, x.high))
