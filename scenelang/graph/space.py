"""A space: what the compiler has to know of the plane or the solid world, and all that differs between them.

A model's manifest states its dimension; `SPACES` has the space, which is handed down from there. Nothing
else in the compiler asks whether a scene is flat.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from math import inf
from typing import ClassVar, Final, NamedTuple

from scenelang.graph.affine import inverted
from scenelang.graph.steps import Rows, Step, Turn
from scenelang.scene import schema

Box = tuple[float, float, float, float, float, float]
"""xmin, ymin, xmax, ymax, zmin, zmax in the world; what lies in the plane has z = 0."""

EVERYWHERE: Final[Box] = (-inf, -inf, inf, inf, -inf, inf)

SINGULAR: Final = 1e-12
"""Smallest to largest stretch at which a map counts as singular.

The determinant of a 2 x 2 block carries a rounding error of about 1e-16 of the squared largest stretch,
so that ratio is still known to four digits here, while nothing that thin can be seen at 8192 pixels.
"""

REACH: Final = 1e30
"""Stretches outside ``1/REACH .. REACH`` leave the range of float32 when inverted, as do far offsets."""


class Refusal(NamedTuple):
    """Why a transform has no step: a code, the fact and advice."""

    code: str
    message: str
    help: str


class Space(ABC):
    """The geometry of one dimension."""

    dimension: ClassVar[int]
    shown: ClassVar[tuple[tuple[int, ...], ...]]
    """Entries of `Rows` that say all of a map of this space, row by row."""
    thinner: ClassVar[str]
    """What a singular map flattens everything to."""

    @abstractmethod
    def fitted(self, transform: schema.Transform, rows: Rows) -> Rows | Refusal:
        """The map as this space has it, or why the transform leaves the space."""

    def idle(self, transform: schema.Transform) -> str | None:
        """The part of a transform that was asked for and has no effect here, if there is one."""
        return None

    def inked(self, op: schema.MaterialOp) -> schema.MaterialOp:
        """An operation of a material in the space that colours are averaged in."""
        return op

    def written(self, rgb: tuple[float, float, float]) -> tuple[float, float, float]:
        """A colour of that space as it is written."""
        return rgb

    @abstractmethod
    def holds(self, rows: Rows) -> bool:
        """Whether a map is one that `fitted` gives."""

    @abstractmethod
    def stretches(self, rows: Rows) -> tuple[float, float]:
        """The smallest and largest singular value of the linear block."""

    @abstractmethod
    def before(self, rows: Rows, turn: Turn) -> Turn | None:
        """The turn that does before the map ``rows`` what ``turn`` does after it; None where none does."""

    def after(self, rows: Rows, turn: Turn) -> Turn | None:
        """The turn that does after the map ``rows`` what ``turn`` does before it; None where none does."""
        return self.before(inverted(rows), turn)

    @abstractmethod
    def box(self, geometry: str, steps: Sequence[Step], level: float) -> Box:
        """A box around all points of the world whose distance to a leaf is below ``level``.

        Args:
            geometry: name of the leaf.
            steps: all its steps into the world, nearest the leaf first.
            level: world distance, at least 0; 0 for the leaf itself.
        """

    def bound(self, geometry: str, steps: Sequence[Step], level: float) -> tuple[float, float, float, float]:
        """The same as Programs keep it: the flat box, in space a ball, as centre and radius."""
        return self.box(geometry, steps, level)[:4]

    @abstractmethod
    def disc(self, geometry: str, steps: Sequence[Step]) -> tuple[float, Rows] | None:
        """A disc, or ball, about a leaf's own origin that it certainly fills, where one is known.

        It is given by its radius and the map from the world to there.
        """

    def usable(self, rows: Rows) -> bool:
        """Whether the map can be inverted in float64 and its inverse kept in float32."""
        smallest, largest = self.stretches(rows)
        offset = max(abs(rows[3]), abs(rows[7]), abs(rows[11]), 1.0)
        # Written so that NaN and infinity fail.
        return smallest > SINGULAR * largest and offset < REACH * smallest and largest < REACH
