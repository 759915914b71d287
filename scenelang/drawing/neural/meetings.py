"""Blocks of pixels, the objects that they meet, and intervals of what they show, for proofs of pictures.

A pair is an object at a block. Blocks with the most objects are the first columns; then all pairs that come
first at their block, all that come second, and so on: each of these slots is as long as there are columns
with so many objects, and column i is its i-th pair.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from scenelang.assets.records import Record
from scenelang.compiler.groups import SMOOTH, Groups
from scenelang.drawing.neural.frames import Floats, Frames

Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]


class Pairs(Record):
    """P pairs."""

    block: Index  # (P,)
    object: Index  # (P,)

    def __len__(self) -> int:
        return len(self.block)

    def take(self, index: npt.NDArray[np.generic]) -> Pairs:
        """Some of the pairs, or all in another order."""
        return Pairs(self.block[index], self.object[index])

    @classmethod
    def of(cls, block: Index, objects: Index) -> Pairs:
        """Pairs sorted by block."""
        by = np.argsort(block, kind="stable")
        return cls(block[by], objects[by])

    def split(self, wide: int, parts: int) -> Pairs:
        """The same pairs in blocks smaller in both directions by a factor, of ``wide`` in a row."""
        down, across = np.divmod(self.block, wide)
        at = np.arange(parts)
        first = (down * parts * wide + across) * parts
        block = (first[:, None, None] + at[:, None] * (wide * parts) + at).reshape(-1)
        by = np.argsort(block, kind="stable")
        return replace(self.take(by // parts**2), block=block[by])


class Meetings(Record):
    """Pairs slot by slot."""

    columns: Index  # (B,) blocks
    pairs: Pairs  # slot by slot
    lengths: Index  # of the slots, none longer than the one before

    def slots(self) -> list[slice]:
        """Slices of the pairs of each slot."""
        ends = np.cumsum(self.lengths).tolist()
        return [slice(first, last) for first, last in zip([0, *ends], ends, strict=False)]

    def counts(self) -> Index:
        """Number of objects that each column meets (B,)."""
        drops = np.bincount(self.lengths, minlength=len(self.columns) + 1)
        return np.cumsum(drops[::-1])[::-1][1:]

    def places(self) -> Index:
        """The column of each pair (P,)."""
        return np.concatenate([*map(np.arange, self.lengths.tolist()), self.columns[:0]])

    def some(self, columns: Index) -> tuple[Meetings, Index]:
        """Columns by ascending places, also more than once, and where their pairs come from."""
        lengths = columns.searchsorted(self.lengths)
        parts = [part.start + columns[:n] for part, n in zip(self.slots(), lengths.tolist(), strict=True)]
        index = np.concatenate([*parts, columns[:0]])
        return Meetings(self.columns[columns], self.pairs.take(index), lengths[lengths > 0]), index


def meetings_of(pairs: Pairs) -> tuple[Meetings, Index]:
    """Pairs that are sorted by blocks, and by the order of objects within these; and where each came from."""
    block = pairs.block
    first = np.flatnonzero(np.concatenate([[True], block[1:] != block[:-1]])) if len(block) else block
    counts = np.diff(np.append(first, len(block)))
    by = np.argsort(-counts, kind="stable")
    first, counts = first[by], counts[by]
    lengths = (-counts).searchsorted(-np.arange(counts[0] if len(counts) else 0))
    index = np.concatenate([*(first[:n] + k for k, n in enumerate(lengths.tolist())), block[:0]])
    return Meetings(block[first], pairs.take(index), lengths), index


class NestedSlot(NamedTuple):
    """Pairs of one slot, or groups that end, one in each of some columns; what they join is n states."""

    which: Any  # a slice where the pairs lie, or numbers (n,) of the groups
    columns: slice | Index  # ascending
    at: slice | Index  # states that they join: level l of column i is state ``l * columns + i``
    ending: Index | None  # states of groups that end; None of pairs
    fresh: Mask  # (n,) whether an object begins its state as it is


class Nesting(NamedTuple):
    """Nested meetings."""

    turns: list[NestedSlot]  # in the order in which they join
    states: int  # how many there are; one a column where all pairs join the stream's own

    def fold(self, pairs: int, join: Callable[[NestedSlot], tuple[Mask, Mask]]) -> tuple[Mask, Mask]:
        """Let turns join; which pairs (P,) change nothing or are hidden, and which hide the rest.

        ``join`` takes a turn into its states, empties those of groups that end, and returns of each whether
        it changes nothing, and whether nothing else is left.
        """
        shut, opened = np.empty((2, pairs), bool)
        hidden = np.zeros(self.states, bool)
        came = [join(turn) for turn in self.turns]
        for turn, (closed, wide) in zip(reversed(self.turns), reversed(came), strict=True):
            if turn.ending is None:
                shut[turn.which], opened[turn.which] = closed | hidden[turn.at], wide
            else:
                hidden[turn.ending] = hidden[turn.at] | closed
            hidden[turn.at] |= wide
        return shut, opened


def flat_nesting(meetings: Meetings) -> Nesting:
    """The nesting of a stream without groups: all pairs join the stream's own state."""
    sizes = [(part, slice(part.stop - part.start)) for part in meetings.slots()]
    turns = [NestedSlot(part, own, own, None, np.zeros(own.stop, bool)) for part, own in sizes]
    return Nesting(turns, len(meetings.columns))


def nesting(meetings: Meetings, groups: Groups) -> Nesting:
    """Find which states pairs join: a group that draws goes on in the state around it while that is empty, so
    that only groups that meet something take a state of their own.
    """
    if not groups.deepest:
        return flat_nesting(meetings)
    slots, count = meetings.slots(), len(meetings.columns)
    paths = groups.path[meetings.pairs.object]
    same = np.zeros(paths.shape, bool)  # which groups were open at the pair before, too
    for last, part in pairwise(slots):
        n = part.stop - part.start
        same[part] = (paths[part] == paths[last.start : last.start + n]) & (paths[part] >= 0)
    shared = np.logical_and.accumulate(same, 1).sum(1)
    number = np.arange(groups.deepest)
    begins = (number >= shared[:, None]) & (paths >= 0)
    own = begins & (number == shared[:, None])
    own[: slots[0].stop if slots else 0] = False  # nothing stands before the first pairs
    own |= begins & (groups.joins > SMOOTH)[paths]
    if not own.any():
        return flat_nesting(meetings)
    fresh = own.any(1) & (groups.tokens[meetings.pairs.object] <= SMOOTH)
    last_path = np.full((count, groups.deepest), -1)
    real = np.zeros((count, groups.deepest), bool)  # whether a group that is open has a state of its own
    every = np.arange(count)
    turns, levels = list[NestedSlot](), 1

    def end(columns: Index, kept: Index) -> None:
        """Let the groups of columns (n,) end, but for the outermost ``kept`` (n,) of each."""
        for at in reversed(number.tolist() if len(columns) else ()):
            if len(some := columns[(kept <= at) & real[columns, at]]):
                top = real[some, : at + 1].sum(1) * count + some
                none = np.zeros(len(some), bool)
                turns.append(NestedSlot(last_path[some, at], some, top - count, top, none))

    for at, part in enumerate(slots):
        n = part.stop - part.start
        end(every[:n], shared[part])
        real[:n] = np.where(begins[part], own[part], real[:n] & (number < shared[part, None]))
        last_path[:n] = paths[part]
        level = real[:n].sum(1)
        levels = max(levels, int(level.max(initial=0)) + 1)
        turns.append(NestedSlot(part, slice(n), level * count + every[:n], None, fresh[part]))
        left = slots[at + 1].stop - slots[at + 1].start if at + 1 < len(slots) else 0
        end(every[left:n], np.zeros(n - left, np.intp))
    return Nesting(turns, levels * count)


Floats32 = npt.NDArray[np.float32]


class Interval(NamedTuple):
    """Numbers from ``low`` to ``high``, float32 or float64."""

    low: npt.NDArray[Any]
    high: npt.NDArray[Any]


class State(NamedTuple):
    """Intervals of distances (B,) and colours (R, B): of the states of a fold, or of operands. Four channels
    are premultiplied, with the coverage behind.
    """

    distance: Interval
    colour: Interval

    @classmethod
    def empty(cls, distance: float, count: int, dtype: npt.DTypeLike = np.float32, channels: int = 3) -> Self:
        """States before the first object, whose distance is given."""
        colours = np.zeros((2, channels, count), dtype)
        return cls(Interval(*np.full((2, count), distance, dtype)), Interval(*colours))

    def at(self, columns: Index | slice) -> Self:
        """Select some columns."""
        return type(self)(*(Interval(low[..., columns], high[..., columns]) for low, high in self))

    def operands(self, turn: NestedSlot, pairs: State, empty: float) -> State:
        """Select what joins in a turn, some of the ``pairs``, or states that end; these are emptied."""
        if turn.ending is None:
            return pairs.at(turn.which)
        result = self.at(turn.ending)
        for side, colour in zip(self.distance, self.colour, strict=True):
            side[turn.ending], colour[:, turn.ending] = empty, 0.0
        return result

    def paint(
        self, columns: Index | slice, colour: Interval, share: Interval, through: Interval | None = None
    ) -> None:
        """Move the colours of some columns towards others (R, n), by shares (n,) of the way; through these
        some of what was before is seen, ``through`` (n,).
        """
        for at, choose in enumerate((np.minimum, np.maximum)):
            side, own = self.colour[at], colour[at]
            now = side[:, columns]
            more = own - now if through is None else own + (through[at] - 1.0) * now
            side[:, columns] = now + choose(share.low * more, share.high * more)


ROUNDING = 1e-6  # world units


class Raster(Record):
    """Pixels in rows of blocks, of the largest size in both directions."""

    px: float  # world units
    canvas: tuple[int, int]  # width, and rows of pixels that are wanted
    wide: int  # pixels up to the ends of the last blocks, and rows of them
    high: int
    left: float  # world x of the middle of the first pixel
    top: float  # its world y
    largest: int  # side of the largest blocks, pixels

    def place(self, block: Index, side: int) -> tuple[Index, Index]:
        """Column and row of the first pixels of blocks, numbered from the top row of them down."""
        down, across = np.divmod(block, self.wide // side)
        return across * side, down * side

    def blocks(self, pixels: np.ndarray, side: int) -> np.ndarray:
        """A view (down, row, across, column, .) by blocks of pixels (high, wide, .)."""
        return pixels.reshape(self.high // side, side, self.wide // side, side, -1)

    def inside(self, place: tuple[Index, Index], side: int) -> np.ndarray | None:
        """A mask of pixels (side * side, B) of blocks that are wanted; None if all of the raster's are."""
        if self.canvas == (self.wide, self.high):
            return None
        down, across = np.divmod(np.arange(side * side)[:, None], side)
        result: np.ndarray = (place[0] + across < self.canvas[0]) & (place[1] + down < self.canvas[1])
        return result

    def centres(self, place: tuple[Index, Index], side: int) -> np.ndarray:
        """World coordinates (2, side * side, B) of blocks' pixels row by row, float32 only at the end."""
        result = np.empty((2, side, side, len(place[0])), np.float32)
        steps = self.px * np.arange(side)[:, None]
        result[0] = (self.left + self.px * place[0]) + steps
        result[1] = ((self.top - self.px * place[1]) - steps)[:, None]
        return result.reshape(2, side * side, -1)

    def reached(self, frames: Frames, reach: Floats) -> Pairs:
        """Objects at the largest blocks where they may be within their reach (N,), leaf units."""
        size = self.largest * self.px
        every = np.isinf(reach)
        low, high = frames.boxes(np.where(every, 0.0, reach))
        corner = self.left - self.px / 2, self.top + self.px / 2
        most = np.array([[self.wide], [self.high]]) // self.largest
        first = np.stack([low[0] - corner[0], corner[1] - high[1]]) - ROUNDING
        last = np.stack([high[0] - corner[0], corner[1] - low[1]]) + ROUNDING
        # a box of what are no numbers is everywhere
        first = np.floor(np.fmin(np.fmax(first / size, 0), most)).astype(np.intp)
        last = np.ceil(np.fmax(np.fmin(last / size, most), 0)).astype(np.intp)
        first, last = np.where(every, 0, first), np.where(every, most, last)
        across, down = (last - first).clip(0)
        counts = across * down
        objects = np.repeat(np.arange(len(counts)), counts)
        at = np.arange(len(objects)) - np.repeat(np.cumsum(counts) - counts, counts)
        y, x = np.divmod(at, across[objects])
        return Pairs.of((first[1][objects] + y) * most[0] + first[0][objects] + x, objects)


def raster(canvas: tuple[int, int], rows: range, largest: int) -> Raster:
    """The blocks that hold some rows of a picture."""
    width, height = canvas
    px = 2 / min(width, height)  # world units
    wide, high = (-(-n // largest) * largest for n in (width, len(rows)))
    left, top = (0.5 - width / 2) * px, (height / 2 - 0.5 - rows.start) * px
    return Raster(px, (width, len(rows)), wide, high, left, top, largest)
