"""Intervals through the cell: what a block of pixels is proved to show, and which objects matter to it.

Everything is float32 on the host. Distances come widened by more than that may be off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.renderers.meetings import Mask, Meetings, Nesting, Turn
from scenelang.renderers.network import Cell

Floats = npt.NDArray[np.float32]
Columns = npt.NDArray[np.intp]


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
    shut: Mask
    open: Mask


def shown(
    meetings: Meetings,
    distance: Interval,
    cell: Cell,
    colours: Interval,
    empty: float,
    slope: float,
    nest: Nesting | None = None,
    joins: Cell | None = None,
) -> Shown:
    """Fold intervals, of a network whose state is one number and that knows one feature.

    Args:
        distance: of the pairs (P,), world units.
        cell: of the pairs, which come last: lines (1 + L, 2, P), bias (1 + L, P), candidate and bump (1, P).
        colours: of the pairs (3, P).
        empty: the state before the first object.
        slope: of coverage, per world unit.
        nest: of a stream with groups.
        joins: cells of these groups, which come last.
    """
    blocks, given = len(meetings.columns), meetings.pairs.open
    state = _State.empty(empty, blocks * (1 if nest is None else nest.levels))
    shut, wide = np.zeros((2, len(given)), bool)
    if nest is None or joins is None:
        gates = _Gates.of(cell, distance, given)
        for part in meetings.slots():
            own = _Operand(
                Interval(distance.low[part], distance.high[part]),
                Interval(colours.low[:, part], colours.high[:, part]),
            )
            shut[part], wide[part] = state.join(slice(part.stop - part.start), own, gates.some(part))
        wide |= given
    else:
        fresh = np.concatenate([turn.fresh for turn in nest.turns])
        gates = _Gates.of(cell, distance, given | fresh)

        def pair(turn: Turn, places: Columns | slice) -> tuple[Mask, Mask]:
            part = turn.part
            own = _Operand(*(Interval(x.low[..., part], x.high[..., part]) for x in (distance, colours)))
            keeps, hides = state.join(places, own, gates.some(part))
            return keeps, hides | given[part]

        def group(top: Columns | slice, below: Columns | slice, ended: Columns) -> tuple[Mask, Mask]:
            operand, cells = state.at(top), Cell(*(x[..., ended] for x in joins))
            joined = state.join(
                below, operand, _Gates.of(cells, operand.distance, np.zeros(len(ended), bool))
            )
            state.clear(top, empty)
            return joined

        nest.fold(blocks, shut, wide, pair, group)
    low, high = (side[:blocks] for side in state.distance)
    covered = Interval((0.5 - slope * high).clip(0.0, 1.0), (0.5 - slope * low).clip(0.0, 1.0))
    sides = zip(state.colour, covered, strict=True)
    picture = Interval(*(np.vstack([c[:, :blocks] * share, share]) for c, share in sides))
    return Shown(picture, shut, wide)


class _Gates(NamedTuple):
    """Gates of n operands: their cells, levels by their own distances, and slopes by the state's.

    Those that are given as open have levels of infinity.
    """

    cell: Cell
    own: Interval
    up: Floats
    down: Floats
    given: Mask

    @classmethod
    def of(cls, cell: Cell, d: Interval, given: Mask) -> _Gates:
        # ends are never averaged, as a wide interval's middle would swallow the digits of its nearer end
        up, down = np.maximum(cell.lines, 0.0), np.minimum(cell.lines, 0.0)
        own = Interval(
            up[:, 0] * d.low + down[:, 0] * d.high + cell.bias,
            up[:, 0] * d.high + down[:, 0] * d.low + cell.bias,
        )
        own.low[:, given] = own.high[:, given] = np.inf
        return cls(cell, own, up[:, 1], down[:, 1], given)

    def some(self, which: slice | Columns) -> _Gates:
        """Select some of the operands."""
        lines, bias, candidate, bump = self.cell
        return _Gates(
            Cell(lines[..., which], bias[:, which], candidate[..., which], bump[:, which]),
            Interval(self.own.low[:, which], self.own.high[:, which]),
            self.up[:, which],
            self.down[:, which],
            self.given[which],
        )


class _Operand(NamedTuple):
    """Operand of a state in n columns: its distance (n,) and colour (3, n)."""

    distance: Interval
    colour: Interval


class _State(NamedTuple):
    """Distances (B,) and colours (3, B) of a fold."""

    distance: Interval
    colour: Interval

    @classmethod
    def empty(cls, distance: float, count: int) -> _State:
        return cls(
            Interval(*np.full((2, count), distance, np.float32)),
            Interval(*np.zeros((2, 3, count), np.float32)),
        )

    def at(self, columns: Columns | slice) -> _Operand:
        """Return its distances and colours in some columns, as an operand."""
        parts = ((low[..., columns], high[..., columns]) for low, high in self)
        return _Operand(*(Interval(*part) for part in parts))

    def clear(self, columns: Columns | slice, distance: float) -> None:
        """Empty it in some columns."""
        for side, colour in zip(self.distance, self.colour, strict=True):
            side[columns], colour[:, columns] = distance, 0.0

    def join(self, columns: Columns | slice, operand: _Operand, gates: _Gates) -> tuple[Mask, Mask]:
        """Take in an operand; whether it changes nothing (n,), and whether nothing else is left (n,)."""
        d, own_colour = operand
        low, high = self.distance.low[columns], self.distance.high[columns]
        cell, own, up, down, given = gates
        past = up * high + down * low
        least, most = own.low + (up * low + down * high), own.high + past
        paint = Interval(least[1:].max(0).clip(0.0, 1.0), most[1:].max(0).clip(0.0, 1.0))
        keeps, takes = least[0] < 1, most[0] > 0
        # where the gate is not wide open, or not shut, its line bounds one number by the other
        kept = _capped(Interval(low, high), cell.lines[0, 1], 1.0 - own.low[0])
        taken = _capped(d, -cell.lines[0, 0], past[0] + cell.bias[0])
        taken = Interval(*(np.where(given, *pair) for pair in zip(d, taken, strict=True)))
        a, b = taken.low * cell.candidate[0, 0], taken.high * cell.candidate[0, 0]
        dent = cell.bump[0] / 4 * (keeps & takes)
        self.distance.low[columns] = np.minimum(
            np.where(keeps, kept.low, np.inf), np.where(takes, np.minimum(a, b), np.inf)
        ) - np.maximum(dent, 0.0)
        self.distance.high[columns] = np.maximum(
            np.where(keeps, kept.high, -np.inf), np.where(takes, np.maximum(a, b), -np.inf)
        ) - np.minimum(dent, 0.0)
        for side, c, choose in zip(self.colour, own_colour, (np.minimum, np.maximum), strict=True):
            now = side[:, columns]
            more = c - now
            side[:, columns] = now + choose(paint.low * more, paint.high * more)
        return ~takes & (paint.high <= 0), ~keeps & (paint.low >= 1)


def _capped(x: Interval, factor: Floats, most: Floats) -> Interval:
    """An interval of those x that have ``factor x <= most``, of which there are some."""
    bound = most / factor
    bound = np.minimum(np.maximum(bound, x.low), x.high)
    return Interval(np.where(factor < 0, bound, x.low), np.where(factor > 0, bound, x.high))
