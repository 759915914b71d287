"""The steps that carry a leaf into the world: affine maps, warps and, of solids, twists and a displacement.

Chains of steps are written nearest the leaf first. A world point is carried back through them from the
last to the first: through an `Affine` by its inverse, through a `Warp` by
``p -> R(twirl |p| + bend . p) p`` with ``R(a) p = (cos a p.x + sin a p.y, -sin a p.x + cos a p.y)``.
``twirl(k)`` is ``Warp(k, (0, 0))`` and ``bend(k)`` is ``Warp(0, (k, 0))``. A `Twist` turns (p.x, p.z) in the
same sense, and a `Displace` leaves points alone: it adds to the leaf's distance.
"""

from __future__ import annotations

from scenelang.records import Record

Rows = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float
]  # fmt: skip
IDENTITY: Rows = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)


class Affine(Record):
    """An affine map of R^3 as the upper three rows of a 4 x 4 matrix, row by row, column vectors."""

    rows: Rows

    @property
    def idle(self) -> bool:
        """Whether it leaves everything as it is, exactly; the other steps have the like."""
        return self.rows == IDENTITY


class Warp(Record):
    """A turn of each point about the z axis by ``twirl |p| + bend . (p.x, p.y)`` radians."""

    twirl: float
    bend: tuple[float, float]

    @property
    def idle(self) -> bool:
        return self.twirl == 0.0 and self.bend == (0.0, 0.0)


class Twist(Record):
    """A turn of each point about the y axis by ``twist p.y`` radians; see the module for its sense."""

    twist: float

    @property
    def idle(self) -> bool:
        return self.twist == 0.0


class Displace(Record):
    """Adds ``amount sin(f x) sin(f y) sin(f z)`` to the leaf's distance, f the ``frequency``.

    It stands first in a chain, and once: (x, y, z) is the leaf's own point.
    """

    amount: float
    frequency: float

    @property
    def idle(self) -> bool:
        return self.amount == 0.0 or self.frequency == 0.0


Turn = Warp | Twist
Step = Affine | Turn | Displace
