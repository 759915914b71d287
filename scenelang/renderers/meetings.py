"""Which objects which blocks of pixels meet, in an order that folds them without moving any data.

A pair is an object at a block. Blocks with the most objects are the first columns; then all pairs that come
first at their block, all that come second, and so on: each of these slots is as long as there are columns
with so many objects, and column i is its i-th pair.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

Index = npt.NDArray[np.intp]


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
    open: npt.NDArray[np.bool_]
    far: npt.NDArray[np.bool_]
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
