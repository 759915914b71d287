"""A stream under construction, with what bounds can prove about it.

The *picture* of a stream is where its distance D is negative and its colour there. Two proofs are made
here, both from boxes alone.

**Following.** S followed by X = x0 op1 x1 …, with x0 joined by union, has the picture of S union X if X holds
no `intersect`, no subtracted leaf of X reaches S, and, when X holds `smooth` whose k add up to m, no point is
both closer than m to S and closer than m to a leaf that X joins. Take a point at m or more from all such
leaves: each `smooth` of X then finds D at most m - k (h = 0, nothing changes) or leaves D at m - k or
more, which is not negative. Take a point with D_S at least m: D of the stream equals that of X alone until
both are at m or more, and each `smooth` from then on makes them equal (h = 1 in both) or leaves both above a
threshold that sinks by k; after all of them it is still not negative. Without `smooth` only signs matter.

**Swapping.** X then S instead of S then X: where neither holds `smooth` and they do not overlap, no point
lies in both, so the order of drawing does not matter; it is then a following with the parts exchanged.

Both leave the distance away from the picture as it comes, so neither may happen where an outer `smooth`
still looks at it.
"""

from __future__ import annotations

from collections import deque
from dataclasses import field

from scenelang.graph.bounds import Grid, leaf_box
from scenelang.graph.nodes import BLEND, Leaf
from scenelang.graph.space import Space
from scenelang.records import Record
from scenelang.words import Combine

Row = tuple[Combine, Leaf, float]
"""An operator, its leaf, and the width of its blend."""

_MOST_CUTS = 64  # a stream that subtracts more often than this is not moved behind another one


class Stream(Record, frozen=False):
    """Rows in order; the first one is a union.

    Args:
        space: the model's.
        smooths: the sum of the k of all `smooth` rows, as a multiple of `BLEND`.
        slack: how far D may be below the smallest distance of a joined leaf. Each `smooth` lowers D by at
            most k/4, and none lowers a D that is k below the leaf it joins.
    """

    space: Space
    rows: deque[Row] = field(default_factory=deque)
    cuts: list[Leaf] = field(default_factory=list)
    smooths: float = 0.0
    slack: float = 0.0
    clipped: bool = False
    _grids: dict[float, Grid] = field(default_factory=dict)

    def push(self, op: Combine, leaf: Leaf, k: float) -> None:
        """Append one row."""
        if not self.rows:
            op = "union"
        self.rows.append((op, leaf, k))
        if op == "subtract":
            self.cuts.append(leaf)
        elif op == "smooth":
            self.smooths += k / BLEND
            self.slack = max(self.slack, k)
        elif op == "intersect":
            self.clipped = True
        for level, grid in self._grids.items():
            self._index(grid, level, op, leaf)

    def grid(self, level: float) -> Grid:
        """Boxes around all points where a joined leaf is nearer than ``level``."""
        grid = self._grids.get(level)
        if grid is None:
            grid = self._grids[level] = Grid()
            for op, leaf, _ in self.rows:
                self._index(grid, level, op, leaf)
        return grid

    def _index(self, grid: Grid, level: float, op: Combine, leaf: Leaf) -> None:
        if op == "intersect":
            grid.clip(leaf_box(leaf, level, self.space), leaf)
        elif op != "subtract":
            grid.add(leaf_box(leaf, level, self.space), leaf)

    def attach(self, other: Stream) -> tuple[Leaf, Leaf] | None:
        """Join a composite by union, after this stream or before it, or leave both as they are.

        Then it gives the pair of leaves that stands in the way, one of this stream and one of ``other``.
        """
        if not self.rows:
            self.append(other)
            return None
        apart = self.grid(self.slack).meets(other.grid(0.0))
        if apart is not None:
            return apart
        if len(self.rows) == 1 and self._swaps(other):
            self.append(other, before=True)
            return None
        reached = self._followed(other)
        if reached is None:
            self.append(other)
        elif self._swaps(other):
            self.append(other, before=True)
        else:
            return reached
        return None

    def _followed(self, other: Stream) -> tuple[Leaf, Leaf] | None:
        """None where ``other`` provably may follow, else who is in the way."""
        if other.clipped:
            return self.rows[0][1], next(leaf for op, leaf, _ in other.rows if op == "intersect")
        near = self.grid(self.slack)
        for leaf in other.cuts:
            hit = near.touched(leaf_box(leaf, 0.0, self.space))
            if hit is not None:
                return hit, leaf
        if other.smooths:
            margin = BLEND
            while margin < other.smooths * BLEND:
                margin *= 2.0  # few different levels, so that their grids are shared
            return self.grid(margin + self.slack).meets(other.grid(margin))
        return None

    def _swaps(self, other: Stream) -> bool:
        """Whether ``other`` may go before this stream; they do not overlap."""
        if self.smooths or other.smooths or self.clipped or len(self.cuts) > _MOST_CUTS:
            return False
        solid = other.grid(0.0)
        return all(solid.touched(leaf_box(leaf, 0.0, self.space)) is None for leaf in self.cuts)

    def append(self, other: Stream, before: bool = False) -> None:
        """Join a composite by union after this stream, or before it, unproved."""
        for level, grid in self._grids.items():
            for box, leaf in other.grid(level).entries:
                grid.add(box, leaf)
        few, many = sorted((self.rows, other.rows), key=len)
        if (many is self.rows) is before:
            many.extendleft(reversed(few))
        else:
            many.extend(few)
        self.rows = many
        self.cuts.extend(other.cuts)
        self.smooths += other.smooths
        self.slack = max(self.slack, other.slack)
        self.clipped = self.clipped or other.clipped
