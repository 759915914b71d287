"""Which objects which blocks of pixels meet, in an order that folds them without moving any data.

A pair is an object at a block. Blocks with the most objects are the first columns; then all pairs that come
first at their block, all that come second, and so on: each of these slots is as long as there are columns
with so many objects, and column i is its i-th pair.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.program.groups import SMOOTH, Groups

Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Pairs:
    """P pairs.

    Args:
        block, object: (P,).
        open: (P,) whether what the block met before is proved not to matter.
        far: (P,) whether points of the block may be seen at the rim of what the decoder knows.
        rate: (P,) how many leaf units two points of the block may be apart, per world unit.
    """

    block: Index
    object: Index
    open: Mask
    far: Mask
    rate: npt.NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.block)

    def take(self, index: npt.NDArray[np.generic]) -> Pairs:
        """Some of the pairs, or all in another order."""
        return Pairs(
            self.block[index], self.object[index], self.open[index], self.far[index], self.rate[index]
        )

    @classmethod
    def of(cls, block: Index, objects: Index) -> Pairs:
        """Pairs of which nothing else is known, sorted by block."""
        by = np.argsort(block, kind="stable")
        none = np.zeros(len(by), bool)
        return cls(block[by], objects[by], none, none, np.full(len(by), np.inf))

    def split(self, wide: int, parts: int) -> Pairs:
        """The same pairs of blocks that are smaller in both directions by a factor.

        Args:
            wide: larger blocks in a row.
        """
        down, across = np.divmod(self.block, wide)
        at = np.arange(parts)
        first = (down * parts * wide + across) * parts
        block = (first[:, None, None] + at[:, None] * (wide * parts) + at).reshape(-1)
        by = np.argsort(block, kind="stable")
        return replace(self.take(by // parts**2), block=block[by])


@dataclass(frozen=True, slots=True)
class Meetings:
    """Pairs slot by slot.

    Args:
        columns: (B,) blocks.
        pairs: slot by slot.
        lengths: of the slots, none longer than the one before.
    """

    columns: Index
    pairs: Pairs
    lengths: Index

    def slots(self) -> list[slice]:
        """Where the pairs of each slot lie."""
        ends = np.cumsum(self.lengths).tolist()
        return [slice(first, last) for first, last in zip([0, *ends], ends, strict=False)]

    def counts(self) -> Index:
        """How many objects each column meets (B,)."""
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


class Closing(NamedTuple):
    """Groups that end, one in each of some columns.

    Args:
        columns: (n,) in ascending order.
        groups: (n,) their numbers.
        level: (n,) of the states that go into the ones below them.
    """

    columns: Index
    groups: Index
    level: Index


class Turn(NamedTuple):
    """A slot of nested meetings.

    Args:
        part: where its pairs lie.
        level: (n,) of the states that its pairs join; 0 is the stream's own.
        fresh: (n,) whether an object begins its state as it is.
        before, after: groups that end before the slot, and behind it where columns end, in rounds.
    """

    part: slice
    level: Index
    fresh: Mask
    before: list[Closing]
    after: list[Closing]


class Nesting(NamedTuple):
    """Meetings of a stream with groups.

    Args:
        turns: slot by slot.
        levels: how many states are needed.
    """

    turns: list[Turn]
    levels: int

    def fold(
        self,
        blocks: int,
        shut: Mask,
        opened: Mask,
        pair: Callable[[Turn, Index | slice], tuple[Mask, Mask]],
        group: Callable[[Index | slice, Index | slice, Index], tuple[Mask, Mask]],
    ) -> None:
        """Fold pairs and groups; fill in which pairs change nothing or are hidden, and which hide the rest.

        Args:
            blocks: columns of the meetings; level l of column i is state ``l * blocks + i``.
            shut, opened: (P,) of the pairs, filled in.
            pair: takes a turn's pairs into states (n,); returns whether each changes nothing, and whether
                nothing else is left.
            group: takes states (n,) into others, as groups of these numbers end, and empties them; returns
                the same.
        """
        done = []  # of groups that ended, round by round: where they join, and what came of it
        every = np.arange(blocks)

        def places(columns: Index, level: Index) -> Index | slice:
            first, last = (columns[0], columns[-1]) if len(columns) else (0, -1)
            if last - first + 1 == len(columns) and (level == level[:1]).all():  # numpy is faster with slices
                start = int(first + blocks * level[0]) if len(level) else 0
                return slice(start, start + len(columns))
            return level * blocks + columns

        def close(closings: list[Closing]) -> None:
            for columns, ended, level in closings:
                top, below = places(columns, level), places(columns, level - 1)
                done.append((top, below, group(top, below, ended)))

        for turn in self.turns:
            close(turn.before)
            shut[turn.part], opened[turn.part] = pair(turn, places(every[: len(turn.level)], turn.level))
            close(turn.after)
        hidden = np.zeros(self.levels * blocks, bool)

        def reopen(closings: list[Closing]) -> None:
            for _ in closings:
                top, below, (closed, wide) = done.pop()
                hidden[top] = hidden[below] | closed
                hidden[below] |= wide

        for part, level, _, before, after in reversed(self.turns):
            reopen(after)
            at = places(every[: len(level)], level)
            shut[part] |= hidden[at]
            hidden[at] |= opened[part]
            reopen(before)


def flat_nesting(meetings: Meetings) -> Nesting:
    """Return the nesting of a stream without groups: all pairs join the stream's own state."""
    sizes = [(part, part.stop - part.start) for part in meetings.slots()]
    return Nesting([Turn(p, np.zeros(n, np.intp), np.zeros(n, bool), [], []) for p, n in sizes], 1)


def nesting(meetings: Meetings, groups: Groups) -> Nesting | None:
    """Find which states the pairs of each column join, None where all join the stream's own.

    Of a group's rows a column may meet some or none. A group that draws goes on in the state around it where
    that is still empty, so that only those that meet something take a state of their own.
    """
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
        return None
    fresh = own.any(1) & (groups.tokens[meetings.pairs.object] <= SMOOTH)
    last_path = np.full((count, groups.deepest), -1)
    real = np.zeros((count, groups.deepest), bool)  # whether a group that is open has a state of its own
    every = np.arange(count)
    turns, levels = list[Turn](), 1
    for at, part in enumerate(slots):
        n = part.stop - part.start
        before = _closings(every[:n], last_path, real, shared[part])
        real[:n] = np.where(begins[part], own[part], real[:n] & (number < shared[part, None]))
        last_path[:n] = paths[part]
        level = real[:n].sum(1)
        levels = max(levels, int(level.max(initial=0)) + 1)
        left = slots[at + 1].stop - slots[at + 1].start if at + 1 < len(slots) else 0
        after = _closings(every[left:n], last_path, real, np.zeros(n - left, np.intp))
        turns.append(Turn(part, level, fresh[part], before, after))
    return Nesting(turns, levels)


def _closings(columns: Index, open_groups: Index, real: Mask, kept: Index) -> list[Closing]:
    """Rounds in which the groups (B, D) of columns (n,) end, but for the outermost ``kept`` (n,) of each."""
    found = list[Closing]()
    if not len(columns):
        return found
    for at in range(open_groups.shape[1] - 1, -1, -1):
        some = columns[(kept <= at) & real[columns, at]]
        if len(some):
            found.append(Closing(some, open_groups[some, at], real[some, : at + 1].sum(1)))
    return found
