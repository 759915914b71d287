"""Conservative boxes in the world around leaves, and how near a row of the stream has to come to matter.

A *level* asks for more than the leaf itself: the box around all points whose world distance is below it,
which is what a later `smooth` can feel. World distance is the leaf's own distance times the smallest
stretch of its affine maps, so a level reaches ``level / stretch`` beyond the leaf in the leaf's own space:
far, for a thin object.
"""

from __future__ import annotations

from scenelang.graph.nodes import Leaf
from scenelang.graph.space import Box, Space
from scenelang.records import Record
from scenelang.words import BLEND, Combine


def leaf_box(leaf: Leaf, level: float, space: Space) -> Box:
    """A box that contains all points of the world whose distance to ``leaf`` is below ``level``.

    Args:
        leaf: with all its moves into the world.
        level: world distance, at least 0; 0 for the leaf itself.
    """
    return leaf.noted(level, lambda leaf: space.box(leaf.geometry, leaf.steps, level))


class Later(Record):
    """The blends that see a row from behind it, and so how near its leaf has to come for the row to matter.

    Two folds whose distances at a point are equal, or both at a level or above, are after a `smooth` equal,
    or both at that level less its width or above; a union, a cut and an intersection keep the level. What is
    cut out changes distances inside the picture, which blends see.

    Args:
        total: the sum of their widths, as a multiple of `BLEND`.
        widest: the widest of them, world units; 0 for none.
        count: how many they are.
        inside: whether one of them sees distances inside what it blends.
        everywhere: whether a row matters wherever its leaf is.
    """

    total: float = 0.0
    widest: float = 0.0
    count: int = 0
    inside: bool = False
    everywhere: bool = False

    def of(self, op: Combine, width: float) -> Later:
        """Blends that see the operand of an operator, itself included.

        Of an intersection that is what sees all that stands before it, and with a width how deep inside its
        operand points are. A subtraction with a width changes what lies within that of its operand.
        """
        everywhere = self.everywhere or (op == "subtract" and self.inside)
        if not width or op == "intersect":
            return Later(self.total, self.widest, self.count, self.inside or width > 0, everywhere)
        return self._wider(width, self.inside or op == "smooth", everywhere)

    def before(self, op: Combine, width: float) -> Later:
        """Blends that see all that an operator joins its operand to, itself included."""
        if not width:
            return self
        if op == "smooth":
            return self._wider(width, True, self.everywhere)
        return Later(self.total, self.widest, self.count, True, self.everywhere)

    def _wider(self, width: float, inside: bool, everywhere: bool) -> Later:
        total, widest = self.total + width / BLEND, max(self.widest, width)
        return Later(total, widest, self.count + 1, inside, everywhere)

    @property
    def level(self) -> float | None:
        """The level for `leaf_box` within which a row matters, None where it may anywhere."""
        return None if self.everywhere else BLEND * self.total


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
