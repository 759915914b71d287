"""Conservative boxes in the world around leaves, and how near a row of the stream has to come to matter.

A *level* asks for more than the leaf itself: the box around all points whose world distance is below it,
which is what a later `smooth` can feel. World distance is the leaf's own distance times the smallest
stretch of its affine maps, so a level reaches ``level / stretch`` beyond the leaf in the leaf's own space:
far, for a thin object.
"""

from __future__ import annotations

from scenelang.graph.nodes import BLEND, Leaf
from scenelang.graph.space import Box, Space
from scenelang.words import Combine


def leaf_box(leaf: Leaf, level: float, space: Space) -> Box:
    """A box that contains all points of the world whose distance to ``leaf`` is below ``level``.

    Args:
        leaf: with all its moves into the world.
        level: world distance, at least 0; 0 for the leaf itself.
        space: the model's.
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
