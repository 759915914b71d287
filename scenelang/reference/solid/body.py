"""One leaf of the solid world, made ready for points: distances, their stretch, gradients, a ball around it.

A world point goes back through maps and turns. A turn is a warp or a twist: ``p -> R(a) p`` in the plane of x
and another axis, with ``a = twirl |p| + slope . p``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from scenelang.graph.geometries import GEOMETRIES
from scenelang.graph.nodes import Leaf
from scenelang.graph.steps import Affine, Displace, Step, Twist, Warp
from scenelang.reference.field import Array, Brought, carry_back, distance_scale, leaf_distance
from scenelang.reference.textures import colour_at

_REACH = 0.15
_TINY = 1e-300  # added to lengths that something is divided by


def length(p: Array) -> Array:
    """Lengths (M,) of vectors (3, M)."""
    x, y, z = p
    return np.sqrt(x * x + y * y + z * z)


class Map(NamedTuple):
    """``p -> inverse p + shift``, (3, 3) and (3, 1), and the largest stretch of the inverse."""

    inverse: Array
    shift: Array
    grows: float

    @staticmethod
    def back(matrix: Array) -> Map:
        """The way back through a 4 x 4 matrix."""
        inverse: Array = np.linalg.inv(matrix[:3, :3])
        return Map(inverse, -inverse @ matrix[:3, 3:], float(np.linalg.norm(inverse, 2)))

    def __call__(self, p: Array) -> Array:
        return self.inverse @ p + self.shift

    def stretch(self, most: Array | float) -> float:
        """The largest stretch; it is the same everywhere."""
        return self.grows

    def pull(self, p: Array, g: Array) -> Array:
        """A gradient after the map as the one before it, at p."""
        return self.inverse.T @ g


class Turn(NamedTuple):
    """See the module; ``other`` is the index of the other axis."""

    other: int
    twirl: float
    slope: tuple[float, float, float]

    def trig(self, p: Array) -> tuple[Array, Array]:
        """Cosine and sine of the angle at points."""
        a = self.twirl * length(p) if self.twirl else 0.0
        for factor, c in zip(self.slope, p, strict=True):
            if factor:
                a = a + factor * c
        return np.cos(a), np.sin(a)

    def __call__(self, p: Array) -> Array:
        cos, sin = self.trig(p)
        q = p.copy()
        q[0] = cos * p[0] + sin * p[self.other]
        q[self.other] = cos * p[self.other] - sin * p[0]
        return q

    def stretch(self, most: Array | float) -> Array:
        """The largest stretch over all points no longer than ``most``.

        With u = dR/da p and v = grad a it is ``(m + sqrt(m² + 4 + 4 u.v)) / 2``, m = |u| |v|: the larger
        singular value of 1 + u v^T. u is no longer than p, and at a right angle to it.
        """
        m = most * (abs(self.twirl) + np.linalg.norm(self.slope))
        across = most * np.hypot(self.slope[0], self.slope[self.other])
        return (m + np.sqrt(m * m + 4.0 + 4.0 * across)) / 2.0

    def pull(self, p: Array, g: Array) -> Array:
        """A gradient after the turn as the one before it, at p."""
        cos, sin = self.trig(p)
        x, y = cos * p[0] + sin * p[self.other], cos * p[self.other] - sin * p[0]
        along = g[0] * y - g[self.other] * x  # the gradient times dR/da p
        out = g + along * np.reshape(self.slope, (3, 1))
        out[0] += (cos - 1.0) * g[0] - sin * g[self.other]
        out[self.other] += (cos - 1.0) * g[self.other] + sin * g[0]
        if self.twirl:
            out += along * self.twirl / (length(p) + _TINY) * p
        return out


def way_back(steps: Sequence[Step]) -> Any:
    """Maps and turns, the world's first, which is a map; neighbouring affine maps are one."""
    back: list[Map | Turn] = []
    pending = np.eye(4)
    for step in reversed(steps):
        if isinstance(step, Affine):
            pending = pending @ np.vstack([np.reshape(step.rows, (3, 4)), (0, 0, 0, 1)])
        elif not isinstance(step, Displace):
            if not back or (pending != np.eye(4)).any():
                back.append(Map.back(pending))
                pending = np.eye(4)
            slope = (0.0, step.twist, 0.0) if isinstance(step, Twist) else (*step.bend, 0.0)
            back.append(Turn(1, step.twirl, slope) if isinstance(step, Warp) else Turn(2, 0.0, slope))
    return back if back and (pending == np.eye(4)).all() else [*back, Map.back(pending)]


class Body:
    """A leaf with all steps into the world.

    Args:
        leaf: its own look and geometry; colours are linear.
        steps: nearest the leaf first.
        margin: the ball holds every point whose distance is below it, in world units.
        brought: shapes of elements.
    """

    def __init__(
        self, leaf: Leaf, steps: Sequence[Step], margin: float, brought: Brought | None = None
    ) -> None:
        self.geometry, self.brought = leaf.geometry, brought or {}
        self.look, self.rgb = leaf.look, np.reshape(leaf.look.colour(), (3, 1))
        self.medium = leaf.look.material == "volumetric"
        first = steps[0] if steps else None
        self.displace = first if isinstance(first, Displace) and not first.idle else None
        self.first, *self.back = way_back(steps)
        self.scale = distance_scale(steps, 3)
        self.rate, self.deep = self.scale, self.scale  # deep: no point is further inside
        radius = 1.0 + margin / self.scale
        if self.displace:
            self.rate *= 1.0 + abs(self.displace.amount * self.displace.frequency)
            self.deep *= 1.0 + abs(self.displace.amount)
            radius += abs(self.displace.amount)
        # How far around a point the rate that `distance` tells holds: without turns anywhere.
        self.reach = _REACH * self.scale if self.back else np.inf
        centre = np.zeros((3, 1))
        for step in reversed(self.back):
            if isinstance(step, Map):
                matrix = np.linalg.inv(step.inverse)
                centre, radius = matrix @ (centre - step.shift), radius * float(np.linalg.norm(matrix, 2))
            else:  # it keeps lengths
                centre, radius = np.zeros((3, 1)), radius + float(np.linalg.norm(centre))
        self.centre, self.radius = centre, radius

    def span(self, o: Array, d: Array) -> tuple[Array, Array, Array]:
        """Where rays o + t d enter and leave the ball, an ellipsoid of the world, and how fast they go there.

        Rays that miss it enter at inf and leave at -inf. The speed is that behind the first map.
        """
        o, d = self.first(o) - self.centre, self.first.inverse @ d
        a, b, c = (d * d).sum(0), (o * d).sum(0), (o * o).sum(0) - self.radius**2
        root = b * b - a * c
        hit = root > 0.0
        root = np.sqrt(np.where(hit, root, 0.0))
        return np.where(hit, (-b - root) / a, np.inf), np.where(hit, (root - b) / a, -np.inf), np.sqrt(a)

    def distance(self, p: Array) -> tuple[Array, Any]:
        """World distances, and how fast they may change within `reach` of the points, by a ray's speed."""
        p, far, rate = self.first(p), self.reach * self.first.grows, self.rate
        for step in self.back:
            stretch = step.stretch(length(p) + far)
            rate, far, p = rate * stretch, far * stretch, step(p)
        d = leaf_distance(self.geometry, p, self.brought)
        if self.displace:
            x, y, z = np.sin(self.displace.frequency * p)
            d = d + self.displace.amount * x * y * z
        return d * self.scale, rate

    def colour(self, p: Array) -> Array:
        """Linear colours (3, M) or, of one everywhere, (3, 1)."""
        if self.look.element is None:
            return self.rgb
        for step in (self.first, *self.back):
            p = step(p)
        own = carry_back(self.look.texture, p[: self.look.element.dimension])
        return colour_at(self.look, own, light=True).T

    def gradient(self, p: Array) -> Array:
        """Gradients (3, M) of the world distance."""
        back = [self.first, *self.back]
        points = [p]
        for step in back:
            points.append(step(points[-1]))
        q = points[-1]
        if self.geometry in self.brought:
            g = self.brought[self.geometry].slopes(q.T).T
        else:
            slopes = GEOMETRIES[self.geometry].slopes
            assert slopes is not None
            g = np.stack(slopes(q)[1:])
        if self.displace:
            f = self.displace.frequency
            (sx, sy, sz), (cx, cy, cz) = np.sin(f * q), np.cos(f * q)
            g = g + self.displace.amount * f * np.stack([cx * sy * sz, sx * cy * sz, sx * sy * cz])
        for step, at in zip(reversed(back), reversed(points[:-1]), strict=True):
            g = step.pull(at, g)
        return g * self.scale
