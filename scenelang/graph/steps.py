"""The two kinds of step that carry a leaf into the world: an affine map and a warp.

Chains of steps are written nearest the leaf first. A world point is carried back through them from the
last to the first: through an `Affine` by its inverse, through a `Warp` by
``p -> R(twirl |p| + bend . p) p`` with ``R(a) p = (cos a p.x + sin a p.y, -sin a p.x + cos a p.y)``.
``twirl(k)`` is ``Warp(k, (0, 0))`` and ``bend(k)`` is ``Warp(0, (k, 0))``.
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
        """Whether it leaves everything as it is, exactly; a warp has the like."""
        return self.rows == IDENTITY


class Warp(Record):
    """A turn of each point about the z axis by ``twirl |p| + bend . (p.x, p.y)`` radians."""

    twirl: float
    bend: tuple[float, float]

    @property
    def idle(self) -> bool:
        return self.twirl == 0.0 and self.bend == (0.0, 0.0)


Step = Affine | Warp
