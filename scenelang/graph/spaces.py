"""The spaces that models draw in, by their dimension, and the plane with boxes around its leaves.

Soundness of the boxes: a leaf lies within the unit disc and its distance grows no faster than 1, so the
points below a level lie within a disc of radius 1 + level / stretch. An affine map sends a disc into an
ellipse; a warp keeps lengths and turns each point by an angle that is bounded over any sector about the
origin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import asin, atan2, cos, hypot, pi, sqrt, tau
from struct import pack, unpack
from typing import Final

from scenelang.graph import affine
from scenelang.graph.geometries import GEOMETRIES, Corner
from scenelang.graph.solid import Solid
from scenelang.graph.space import EVERYWHERE, Box, Refusal, Space
from scenelang.graph.steps import IDENTITY, Affine, Rows, Step, Turn, Warp
from scenelang.scene import schema

ALIKE = 1e-12  # relative tolerance below which two stretches, or a right angle, count as equal

_ROUNDING = 1e-9  # boxes grow by this much, relative, to cover the rounding of float64


class Plane(Space):
    """The plane z = 0; maps of it leave z alone."""

    dimension = 2
    shown = ((0, 1, 3), (4, 5, 7))
    thinner = "a line or a point"

    def fitted(self, transform: schema.Transform, rows: Rows) -> Rows | Refusal:
        kind = transform.kind
        if isinstance(transform, schema.Rotate) and transform.angle != 0.0 and any(transform.axis[:2]):
            axis = ", ".join(f"{v:g}" for v in transform.axis)
            fact = f"`rotate` about [{axis}] leaves the plane"
            return Refusal("E0505", fact, "a 2D model turns about Z: leave `axis` out")
        if rows[11] != 0.0:
            fact = f"`{kind}` by z = {rows[11]:g} leaves the plane"
            return Refusal("E0505", fact, "a 2D model has no z: leave the third component out")
        if isinstance(transform, schema.Shear) and transform.k != 0.0 and "z" in transform.axes:
            fact = f"`shear({transform.axes})` leaves the plane"
            return Refusal("E0505", fact, "a 2D model shears `xy` or `yx`")
        if isinstance(transform, schema.Matrix) and (rows[2] or rows[6] or rows[8] or rows[9]):
            help = "for a 2D model the third row and column are those of the identity"
            return Refusal("E0505", "`matrix` mixes z with x and y", help)
        return flattened(rows)

    def idle(self, transform: schema.Transform) -> str | None:
        if not isinstance(transform, schema.Scale) or transform.z in (1.0, transform.x):
            return None  # `scale(s)` has the same factor along all axes
        return f"`scale` by {transform.z:g} along z"

    def holds(self, rows: Rows) -> bool:
        return not rows[2] and not rows[6] and rows[8:] == IDENTITY[8:]

    def stretches(self, rows: Rows) -> tuple[float, float]:
        return stretches(rows[0], rows[1], rows[4], rows[5])

    def usable(self, rows: Rows) -> bool:
        """Also whether the inverse, kept in float32, still has one itself: thin and slanted it may not."""
        if not super().usable(rows):
            return False
        a, b, _, _, c, d = rows[:6]
        det = a * d - b * c
        p, q, r, s = unpack("4f", pack("4f", d / det, b / det, c / det, a / det))
        return bool(p * s != q * r)

    def before(self, rows: Rows, turn: Turn) -> Turn | None:
        """Similarities about the origin trade places with warps: `scenelang.graph.chain.normal` proves it."""
        alike = _similarity(rows)
        if alike is None or not isinstance(turn, Warp):
            return None
        scale, sign = alike
        x, y = turn.bend
        bend = (sign * (rows[0] * x + rows[4] * y), sign * (rows[1] * x + rows[5] * y))
        return Warp(sign * scale * turn.twirl, bend)

    def box(self, geometry: str, steps: Sequence[Step], level: float) -> Box:
        rows, reach = affine.composed(steps), 0.0
        if level > 0.0:
            stretch = self.stretches(rows)[0]
            if stretch == 0.0:
                return EVERYWHERE
            reach = level / stretch
        if any(isinstance(step, Warp) for step in steps):
            return _grown(_warped(steps, 1.0 + reach))
        row = GEOMETRIES.get(geometry)
        return _grown(_straight(row.corners if row else (), rows, reach))

    def disc(self, geometry: str, steps: Sequence[Step]) -> tuple[float, Rows] | None:
        """Warps before the first affine map leave a disc about the origin in place."""
        row = GEOMETRIES.get(geometry)
        if row is None or not row.inner or not all(isinstance(step, Affine) for step in steps[-1:]):
            return None
        if any(isinstance(step, Affine) for step in steps[:-1]):
            return None
        return row.inner, affine.inverted(affine.composed(steps))


def flattened(rows: Rows) -> Rows:
    """The same map of the plane with z left alone."""
    return (rows[0], rows[1], 0.0, rows[3], rows[4], rows[5], 0.0, rows[7], 0.0, 0.0, 1.0, 0.0)


def stretches(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """The smallest and largest singular value of the matrix [[a, b], [c, d]]."""
    largest = 0.5 * (hypot(a + d, c - b) + hypot(a - d, c + b))
    # |det| / largest keeps its digits where the difference of the two lengths would lose them.
    return (abs(a * d - b * c) / largest if largest else 0.0), largest


def _similarity(rows: Rows) -> tuple[float, float] | None:
    """``(s, sign)`` where the map of the plane is a similarity about the origin, else None.

    ``s`` is its scale; ``sign`` is 1 for a rotation, -1 for a reflection.
    """
    a, b, c, d = rows[0], rows[1], rows[4], rows[5]
    s = sqrt(abs(a * d - b * c))
    near = ALIKE * s
    if abs(rows[3]) > near or abs(rows[7]) > near:
        return None
    if abs(a - d) <= near and abs(b + c) <= near:
        return s, 1.0
    if abs(a + d) <= near and abs(b - c) <= near:
        return s, -1.0
    return None


def _grown(box: tuple[float, float, float, float]) -> Box:
    left, bottom, right, top = box
    more = _ROUNDING * (1.0 + max(abs(left), abs(bottom), abs(right), abs(top)))
    grown = (left - more, bottom - more, right + more, top + more, 0.0, 0.0)
    # NaN compares false: what overflowed may be anywhere.
    return grown if grown[0] < grown[2] and grown[1] < grown[3] else EVERYWHERE


def _straight(corners: tuple[Corner, ...], rows: Rows, reach: float) -> tuple[float, float, float, float]:
    a, b, x = rows[0], rows[1], rows[3]
    c, d, y = rows[4], rows[5], rows[7]
    wide, high = reach * hypot(a, b), reach * hypot(c, d)
    if not corners:
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
        smallest, largest = stretches(rows[0], rows[1], rows[4], rows[5])
        away, radius = hypot(x, y), largest * self.far
        if away == 0.0:
            return _Sector(smallest * self.near, radius, 0.0, tau)
        if not away > radius:
            return _Sector(0.0, away + radius, 0.0, tau)
        middle, half = atan2(y, x), asin(radius / away)
        return _Sector(away - radius, away + radius, middle - half, middle + half)


def _warped(steps: Sequence[Step], radius: float) -> tuple[float, float, float, float]:
    sector = _Sector(0.0, radius, -pi, pi)
    pending = IDENTITY
    for step in steps:
        if isinstance(step, Affine):
            pending = affine.compose(step.rows, pending)
            continue
        if not isinstance(step, Warp):
            return EVERYWHERE[:4]
        if pending is not IDENTITY:
            sector, pending = sector.mapped(pending), IDENTITY
        sector = sector.turned(step)
    a, b, x = pending[0], pending[1], pending[3]
    c, d, y = pending[4], pending[5], pending[7]
    return (
        x - sector.furthest(-a, -b),
        y - sector.furthest(-c, -d),
        x + sector.furthest(a, b),
        y + sector.furthest(c, d),
    )


PLANE: Final = Plane()
SPACES: Final[dict[int, Space]] = {2: PLANE, 3: Solid()}
