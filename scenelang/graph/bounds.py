"""Conservative boxes in the world around a leaf, deformations included.

A *level* asks for more than the leaf itself: the box around all points whose world distance is below it,
which is what a later `smooth` can feel. World distance is the leaf's own distance times the smallest
stretch of its affine maps, so a level reaches ``level / stretch`` beyond the leaf in the leaf's own space:
far, for a thin object.

Soundness: a leaf lies within the unit disc and its distance grows no faster than 1, so the points below a
level lie within a disc of radius 1 + level / stretch. An affine map sends a disc into an ellipse; a warp
keeps lengths and turns each point by an angle that is bounded over any sector about the origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, atan2, cos, hypot, inf, pi, tau

from scenelang.graph import affine
from scenelang.graph.chain import composed
from scenelang.graph.nodes import Leaf
from scenelang.graph.outlines import HULLS
from scenelang.graph.steps import IDENTITY, Affine, Rows, Warp
from scenelang.scene.schema import Combine

Box = tuple[float, float, float, float]
"""xmin, ymin, xmax, ymax in the world."""

EVERYWHERE: Box = (-inf, -inf, inf, inf)

BLEND = 0.15
"""The k of `smooth`: it blends where two distances differ by less, and lowers them by at most k/4."""

_ROUNDING = 1e-9
"""Boxes grow by this much, relative, to cover the rounding of float64."""


def leaf_box(leaf: Leaf, level: float, dimension: int) -> Box:
    """A box that contains all points of the world whose distance to ``leaf`` is below ``level``.

    Args:
        leaf: with all its moves into the world.
        level: world distance, at least 0; 0 for the leaf itself.
        dimension: the model's; in 3D nothing is known yet and the box is `EVERYWHERE`.
    """
    if dimension != 2:
        return EVERYWHERE
    if leaf.notes is None:
        return _box(leaf, level)
    box: Box | None = leaf.notes.get(level)
    if box is None:
        box = leaf.notes[level] = _box(leaf, level)
    return box


def _box(leaf: Leaf, level: float) -> Box:
    reach = 0.0
    if level > 0.0:
        stretch = affine.stretches(composed(leaf.moves), 2)[0]
        if stretch == 0.0:
            return EVERYWHERE
        reach = level / stretch
    if any(isinstance(move.step, Warp) for move in leaf.moves):
        box = _warped(leaf, 1.0 + reach)
    else:
        box = _straight(leaf, composed(leaf.moves), reach)
    return _grown(box)


def felt_level(op: Combine, smooths: int) -> float | None:
    """How near a row's leaf has to come for the row to matter, as a level for `leaf_box`.

    Two streams whose distances at a point are equal, or both at a level or above, are after a `smooth`
    equal, or both at that level less k or above; a union, a subtraction or an intersection keeps the level.
    So with n `smooth` rows still to come, a union matters within n k of its leaf and a `smooth` within
    (n + 1) k. A subtraction changes distances inside the picture, which a later `smooth` blends by.

    Args:
        op: the row's operator; for an intersection the level within which anything before it can remain.
        smooths: how many `smooth` rows follow.

    Returns:
        The level, or None where the row may matter anywhere.
    """
    if op == "subtract" and smooths:
        return None
    return BLEND * (smooths + (op == "smooth"))


def overlap(a: Box, b: Box) -> bool:
    """Whether two boxes share a point."""
    return a[0] <= b[2] and b[0] <= a[2] and a[1] <= b[3] and b[1] <= a[3]


def meet(a: Box, b: Box) -> Box | None:
    """The box that two boxes share, None where they are apart."""
    if not overlap(a, b):
        return None
    return max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])


def join(a: Box, b: Box) -> Box:
    """The smallest box around both."""
    return min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])


def _grown(box: Box) -> Box:
    left, bottom, right, top = box
    more = _ROUNDING * (1.0 + max(abs(left), abs(bottom), abs(right), abs(top)))
    grown = (left - more, bottom - more, right + more, top + more)
    # NaN compares false: what overflowed may be anywhere.
    return grown if grown[0] < grown[2] and grown[1] < grown[3] else EVERYWHERE


def _straight(leaf: Leaf, rows: Rows, reach: float) -> Box:
    a, b, x = rows[0], rows[1], rows[3]
    c, d, y = rows[4], rows[5], rows[7]
    wide, high = reach * hypot(a, b), reach * hypot(c, d)
    corners = HULLS.get(leaf.geometry)
    if corners is None:
        wide, high = wide + hypot(a, b), high + hypot(c, d)
        return x - wide, y - high, x + wide, y + high
    across = [a * p + b * q for p, q in corners]
    along = [c * p + d * q for p, q in corners]
    return x + min(across) - wide, y + min(along) - high, x + max(across) + wide, y + max(along) + high


@dataclass(slots=True)
class _Sector:
    """Points about the origin: radii ``near``..``far``, angles ``first``..``last`` (a full turn: all)."""

    near: float
    far: float
    first: float
    last: float

    @property
    def whole(self) -> bool:
        return not self.last - self.first < tau

    def furthest(self, x: float, y: float) -> float:
        """An upper bound of (x, y) . p over the sector."""
        length = hypot(x, y)
        if length == 0.0:
            return 0.0
        if self.whole:
            return length * self.far
        ahead = (atan2(y, x) - self.first) % tau
        if ahead <= self.last - self.first:
            return length * self.far
        c = max(cos(ahead), cos(ahead - (self.last - self.first)))
        return length * c * (self.far if c >= 0.0 else self.near)

    def turned(self, warp: Warp) -> _Sector:
        """A sector around the image of this one: each point turns by ``twirl |p| + bend . p``."""
        if self.whole:
            return self
        twist = sorted((warp.twirl * self.near, warp.twirl * self.far))
        x, y = warp.bend
        most = hypot(x, y) * self.far
        low, high = twist[0] - most, twist[1] + most
        if most > 0.0:
            # `p` is the turned point. Its angle is now known roughly, which bounds the bend better.
            rough = _Sector(self.near, self.far, self.first + low, self.last + high)
            low, high = twist[0] - rough.furthest(-x, -y), twist[1] + rough.furthest(x, y)
        return _Sector(self.near, self.far, self.first + low, self.last + high)

    def mapped(self, rows: Rows) -> _Sector:
        """A sector around the image of this one under an affine map."""
        x, y = rows[3], rows[7]
        smallest, largest = affine.stretches(rows, 2)
        away, radius = hypot(x, y), largest * self.far
        if away == 0.0:
            return _Sector(smallest * self.near, radius, 0.0, tau)
        if not away > radius:
            return _Sector(0.0, away + radius, 0.0, tau)
        middle, half = atan2(y, x), asin(radius / away)
        return _Sector(away - radius, away + radius, middle - half, middle + half)


def _warped(leaf: Leaf, radius: float) -> Box:
    sector = _Sector(0.0, radius, -pi, pi)
    pending = IDENTITY
    for move in leaf.moves:
        if isinstance(move.step, Affine):
            pending = affine.compose(move.step.rows, pending)
            continue
        if pending is not IDENTITY:
            sector, pending = sector.mapped(pending), IDENTITY
        sector = sector.turned(move.step)
    a, b, x = pending[0], pending[1], pending[3]
    c, d, y = pending[4], pending[5], pending[7]
    return (
        x - sector.furthest(-a, -b),
        y - sector.furthest(-c, -d),
        x + sector.furthest(a, b),
        y + sector.furthest(c, d),
    )
