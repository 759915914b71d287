"""Conservative boxes in the world around leaves, how near a row of the stream has to come to matter, and an
index of boxes that answers "does this touch any of them?" in about constant time.

A *level* asks for more than the leaf itself: the box around all points whose world distance is below it,
which is what a later `smooth` can feel. World distance is the leaf's own distance times the smallest
stretch of its affine maps, so a level reaches ``level / stretch`` beyond the leaf in the leaf's own space:
far, for a thin object.
"""

from __future__ import annotations

from collections import defaultdict
from math import floor, frexp, inf

from scenelang.graph.nodes import BLEND, Leaf
from scenelang.graph.space import Box, Space
from scenelang.words import Combine


def leaf_box(leaf: Leaf, level: float, space: Space) -> Box:
    """A box that contains all points of the world whose distance to ``leaf`` is below ``level``.

    Args:
        leaf: with all its moves into the world.
        level: world distance, at least 0; 0 for the leaf itself.
    """
    return leaf.noted(level, lambda leaf: space.box(leaf.geometry, leaf.steps, level))


def felt_level(op: Combine, k: float, smooths: float) -> float | None:
    """How near a row's leaf has to come for the row to matter, as a level for `leaf_box`.

    Two streams whose distances at a point are equal, or both at a level or above, are after a `smooth`
    equal, or both at that level less k or above; a union, a subtraction or an intersection keeps the level.
    So a union matters within the sum of the k of all `smooth` rows still to come, and a `smooth` within its
    own k more. A subtraction changes distances inside the picture, which a later `smooth` blends by.

    Args:
        op: the row's operator; for an intersection the level within which anything before it can remain.
        k: the width of its blend.
        smooths: the sum of the k of all `smooth` rows that follow, as a multiple of `BLEND`.

    Returns:
        The level, or None where the row may matter anywhere.
    """
    if op == "subtract" and smooths:
        return None
    return BLEND * (smooths + (k / BLEND if op == "smooth" else 0.0))


def overlap(a: Box, b: Box) -> bool:
    """Whether two boxes share a point."""
    flat = a[0] <= b[2] and b[0] <= a[2] and a[1] <= b[3] and b[1] <= a[3]
    return flat and a[4] <= b[5] and b[4] <= a[5]


def meet(a: Box, b: Box) -> Box | None:
    """The box that two boxes share, None where they are apart."""
    if not overlap(a, b):
        return None
    near, far = max(a[4], b[4]), min(a[5], b[5])
    return max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3]), near, far


def join(a: Box, b: Box) -> Box:
    """The smallest box around both."""
    near, far = min(a[4], b[4]), max(a[5], b[5])
    return min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3]), near, far


Entry = tuple[Box, Leaf]
Cell = tuple[int, int]

_NOWHERE: Box = (inf, inf, -inf, -inf, inf, -inf)

_TESTS = 4096
"""Boxes compared for one question before the answer is "perhaps", so that no scene takes for ever."""

_LEVELS = 40  # boxes wider than 2^40 or thinner than 2^-40 go to the outermost level


class Grid:
    """Boxes hashed by their size, rounded up to a power of two, and the cells of that size they touch."""

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self.bounds: Box = _NOWHERE
        self._levels: dict[int, tuple[list[Entry], dict[Cell, list[Entry]]]] = {}

    def add(self, box: Box, leaf: Leaf) -> None:
        """Add a box; ``leaf`` is who it belongs to."""
        entry = (box, leaf)
        self.entries.append(entry)
        self.bounds = join(self.bounds, box)
        level = _level(box)
        if level not in self._levels:
            self._levels[level] = [], defaultdict(list)
        listed, cells = self._levels[level]
        listed.append(entry)
        if level < _LEVELS:
            for cell in _cells(box, level):
                cells[cell].append(entry)

    def clip(self, box: Box, leaf: Leaf) -> None:
        """Keep only what lies within ``box``, as one box around it."""
        shared = meet(self.bounds, box) if self.entries else None
        self.entries, self.bounds, self._levels = [], _NOWHERE, {}
        if shared is not None:
            self.add(shared, leaf)

    def touched(self, box: Box) -> Leaf | None:
        """A leaf whose box may share a point with ``box``; None where provably none does."""
        if not self.entries or not overlap(self.bounds, box):
            return None
        tests = 0
        for level, (listed, cells) in self._levels.items():
            among = [listed]
            if level < _LEVELS:
                window = meet(self.bounds, box)
                side = 2.0**level
                if window is not None:
                    across = (window[2] - window[0]) / side + 2.0
                    along = (window[3] - window[1]) / side + 2.0
                    if across * along < min(len(listed), _TESTS):
                        among = [cells[cell] for cell in _cells(window, level) if cell in cells]
            for entries in among:
                for other, leaf in entries:
                    tests += 1
                    if overlap(other, box) or tests > _TESTS:
                        return leaf
        return None

    def meets(self, other: Grid) -> tuple[Leaf, Leaf] | None:
        """A pair of leaves, one of this grid and one of ``other``, that may overlap; None where none does."""
        if not self.entries or not other.entries or not overlap(self.bounds, other.bounds):
            return None
        few, many = (self, other) if len(self.entries) <= len(other.entries) else (other, self)
        for box, leaf in few.entries:
            hit = many.touched(box)
            if hit is not None:
                return (leaf, hit) if few is self else (hit, leaf)
        return None


def _level(box: Box) -> int:
    size = max(box[2] - box[0], box[3] - box[1])
    if not size < 2.0**_LEVELS or not max(map(abs, box)) < 2.0**_LEVELS:
        return _LEVELS
    return max(frexp(size)[1], -_LEVELS)


def _cells(box: Box, level: int) -> list[Cell]:
    side = 2.0**level
    return [
        (x, y)
        for x in range(floor(box[0] / side), floor(box[2] / side) + 1)
        for y in range(floor(box[1] / side), floor(box[3] / side) + 1)
    ]
