"""From geometry vectors of the solid layout to frames: where a world point lies in each object's own space.

The three-dimensional companion of `frames.py`: maps, turns of space and what bounds them, none of it learned.
Points are arrays (3, M).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from scenelang.lifting.vector import SOLID_LAYOUT, Layout
from scenelang.program.program import ProgramError
from scenelang.renderers.arrays import Array, Arrays
from scenelang.renderers.frames import MOST
from scenelang.renderers.solid.network import BLEND


class Turn(NamedTuple):
    """A turn of coordinates (i, j) by an angle ``twirl |p| + rate p[along]``, in the sense of R."""

    i: int
    j: int
    twirl: float
    rate: float
    along: int

    def _carried(self, xp: Arrays, p: Array) -> tuple[Array, Array, Array, Array | None]:
        angle, length = self.rate * p[self.along], None
        if self.twirl:
            length = xp.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
            angle = angle + self.twirl * length
        cos, sin = xp.cos(angle), xp.sin(angle)
        a, b = p[self.i], p[self.j]
        rows = [p[0], p[1], p[2]]
        rows[self.i], rows[self.j] = cos * a + sin * b, cos * b - sin * a
        return xp.stack(rows, 0), cos, sin, length

    def __call__(self, xp: Arrays, p: Array) -> Array:
        """Points turned."""
        return self._carried(xp, p)[0]

    def pulled(self, xp: Arrays, p: Array, g: Array) -> Array:
        """The gradient (3, M) before the turn of what has the gradient g behind it; p lies before it."""
        q, cos, sin, length = self._carried(xp, p)
        a, b = g[self.i], g[self.j]
        swing = a * q[self.j] - b * q[self.i]  # how it changes with the angle
        rows = [g[0], g[1], g[2]]
        rows[self.i], rows[self.j] = cos * a - sin * b, sin * a + cos * b
        rows[self.along] = rows[self.along] + self.rate * swing
        found = xp.stack(rows, 0)
        return found if length is None else found + (self.twirl * swing / length.clip(1e-12)) * p

    def placed(self, xp: Arrays, like: Array) -> Turn:
        """Itself."""
        return self

    def stretch(self, radius: float) -> float:
        """How much longer it makes a small step at most, in the ball of a radius about the origin.

        The turn's derivative is a rotation times ``1 + u v^T``, u the point turned by a right angle in the
        plane of the turn and v the angle's gradient: with m = |u| |v| and c = u . v the larger singular
        value is ``(m + sqrt(m² + 4 + 4 c)) / 2``.
        """
        m = radius * (abs(self.twirl) + abs(self.rate))
        c = radius * abs(self.rate) if self.along in (self.i, self.j) else 0.0
        return float(m + np.sqrt(m * m + 4 + 4 * c)) / 2


class Map(NamedTuple):
    """An affine map: p to linear p + shift."""

    linear: Array  # (3, 3)
    shift: Array  # (3,)

    def __call__(self, xp: Arrays, p: Array) -> Array:
        """Points mapped."""
        return xp.dense(p, self.linear, self.shift)

    def pulled(self, xp: Arrays, p: Array, g: Array) -> Array:
        """As `Turn.pulled`."""
        return self.linear.T @ g

    def placed(self, xp: Arrays, like: Array) -> Map:
        """The same where an array lies."""
        return Map(xp.array(self.linear, like), xp.array(self.shift, like))


@dataclass(frozen=True, slots=True)
class SolidFrame:
    """An object's way back to its leaf, outermost first.

    Args:
        outer: the map into the space in which the object lies in a ball about the origin.
        steps: what follows it.
        scale: world distance per leaf distance, the smallest singular value of the composed map.
        reach, moved: the ball that holds a leaf ball of radius r has the radius reach r + moved.
        amount, frequency: of the displacement.
        blend: width of the blend by which the object joins.
    """

    outer: Map
    steps: tuple[Turn | Map, ...]
    scale: float
    reach: float
    moved: float
    amount: float
    frequency: float
    blend: float

    def ball(self, radius: float) -> float:
        """Radius of the ball behind `outer` outside which leaf coordinates are longer than ``radius``."""
        return self.reach * radius + self.moved

    def growth(self, radius: float) -> float:
        """Leaf units by which the distance changes at most, in a leaf ball, per step of 1 behind `outer`."""
        growth, ball = 1.0 + abs(self.amount * self.frequency), self.ball(radius)
        for step in self.steps:
            if isinstance(step, Map):
                growth *= float(np.linalg.norm(step.linear, 2))
                ball = radius
            else:
                growth *= step.stretch(ball)
        return growth

    def local(self, xp: Arrays, p: Array) -> Array:
        """Leaf coordinates of points behind `outer`, both (3, M)."""
        for step in self.steps:
            p = step(xp, p)
        return p

    def pulled(self, xp: Arrays, p: Array, g: Array) -> Array:
        """Gradient (3, M) at points behind `outer` of what has the gradient g in leaf coordinates."""
        passed = []
        for step in self.steps:
            passed.append((step, p))
            p = step(xp, p)
        for step, at in reversed(passed):
            g = step.pulled(xp, at, g)
        return g

    def placed(self, xp: Arrays, like: Array) -> SolidFrame:
        """The same where an array lies."""
        steps = tuple(step.placed(xp, like) for step in self.steps)
        return replace(self, outer=self.outer.placed(xp, like), steps=steps)


def read_solid_frame(g: np.ndarray, layout: Layout = SOLID_LAYOUT) -> SolidFrame:
    """The frame of one vector (64,).

    Raises:
        ProgramError: it leads from the world to no leaf, which no compiled scene has.
    """
    g = g.astype(np.float64)
    if not np.abs(g[: layout.geometry]).max() < MOST:
        raise ProgramError("a frame beyond float32")
    parts = layout.unpack(g)
    last, middle = _map(parts.frame), _map(parts.middle)
    outer, inner = _turns(parts.outer), _turns(parts.inner)
    whole = Map(middle.linear @ last.linear, middle.linear @ last.shift + middle.shift)
    stretches = np.linalg.svd(whole.linear, compute_uv=False)
    if not (stretches[2] > 1 / MOST and stretches[0] < MOST):
        raise ProgramError("a frame beyond float32")
    (amount, frequency), blend = parts.bulge.tolist(), float(parts.width)
    reach, moved = 1.0, 0.0
    steps: tuple[Turn | Map, ...] = tuple(inner)
    if outer:
        back = inverse_of(middle.linear)
        reach, moved = float(np.linalg.norm(back, 2)), float(np.linalg.norm(back @ middle.shift))
        steps = (*outer, _single(middle), *inner)
    return SolidFrame(
        outer=_single(last if outer else whole),
        steps=steps,
        scale=1 / float(stretches[0]),
        reach=reach,
        moved=moved,
        amount=amount,
        frequency=frequency,
        blend=blend if blend > 0 else BLEND,
    )


def inverse_of(linear: np.ndarray) -> np.ndarray:
    """The inverse of a linear map (3, 3).

    Raises:
        ProgramError: it has none in float32.
    """
    try:
        found: np.ndarray = np.linalg.inv(linear)
    except np.linalg.LinAlgError:
        raise ProgramError("a damaged program: a frame without an inverse") from None
    if not np.abs(found).max() < MOST:
        raise ProgramError("a frame beyond float32")
    return found


def _map(frame: np.ndarray) -> Map:
    rows = frame.reshape(3, 4)
    return Map(rows[:, :3], rows[:, 3])


def _single(found: Map) -> Map:
    return Map(found.linear.astype(np.float32), found.shift.astype(np.float32))


def _turns(slots: np.ndarray) -> list[Turn]:
    """Turns of slots of three strengths: by t |p| + b x about z, then by w y about y."""
    turns = []
    for twirl, bend, twist in slots.reshape(-1, 3).tolist():
        if twirl or bend:
            turns.append(Turn(0, 1, twirl, bend, 0))
        if twist:
            turns.append(Turn(0, 2, 0.0, twist, 1))
    return turns
