"""Steps that carry a leaf into the world, and affine maps of R^3 in plain floats.

Chains of steps are written nearest the leaf first. A world point is carried back through them from the
last to the first: through an `Affine` by its inverse, through a `Warp` by
``p -> R(twirl |p| + bend . p) p`` with ``R(a) p = (cos a p.x + sin a p.y, -sin a p.x + cos a p.y)``.
``twirl(k)`` is ``Warp(k, (0, 0))`` and ``bend(k)`` is ``Warp(0, (k, 0))``. A `Twist` turns (p.x, p.z) in the
same sense. A `Displace`, a `Grow` and a `Shell` leave points alone: they stand first, each at most once, and
change the leaf's own distance, in the order that they are written in.

The compiler's front half does not import numpy: these few closed forms are all it needs.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import cos, hypot, sin

from scenelang.assets.records import Record

Rows = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float
]  # fmt: skip
IDENTITY: Rows = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)


class Affine(Record):
    """An affine map of R^3 as the upper three rows of a 4 x 4 matrix, row by row, column vectors."""

    rows: Rows

    @property
    def idle(self) -> bool:
        """True where the step changes nothing, exactly; so for the other steps."""
        return self.rows == IDENTITY


class Warp(Record):
    """A turn of each point about the z axis by ``twirl |p| + bend . (p.x, p.y)`` radians."""

    twirl: float
    bend: tuple[float, float]

    @property
    def idle(self) -> bool:
        return self.twirl == 0.0 and self.bend == (0.0, 0.0)


class _Measured(Record):
    """A step that changes nothing where a number of it is 0."""

    @property
    def idle(self) -> bool:
        names: tuple[str, ...] = self.__match_args__
        return 0.0 in [getattr(self, name) for name in names]


class Twist(_Measured):
    """A turn of each point about the y axis by ``twist p.y`` radians; see the module for its sense."""

    twist: float


class Displace(_Measured):
    """Adds ``amount sin(f x) sin(f y) sin(f z)`` to the leaf's distance at (x, y, z), f the ``frequency``."""

    amount: float
    frequency: float


class Grow(_Measured):
    """Takes ``r`` off the leaf's distance."""

    r: float


class Shell(_Measured):
    """Makes the leaf's distance d to ``|d| - w / 2``."""

    w: float


Turn = Warp | Twist
Own = Grow | Shell | Displace
"""Steps that change a leaf's own distance."""
Step = Affine | Turn | Own


class Skin(Record):
    """All that a chain does to its leaf's own distance, in leaf units; 0 for what it does not do.

    ``order`` is of two bits: 1 says that the `Grow` stands behind the `Shell`, 2 that the `Displace` does.
    """

    grow: float = 0.0
    shell: float = 0.0
    order: int = 0
    amount: float = 0.0
    frequency: float = 0.0

    @staticmethod
    def of(steps: Sequence[Step]) -> Skin:
        """The skin of a chain."""
        if not steps or not isinstance(steps[0], Own):
            return BARE
        grow = shell = amount = frequency = 0.0
        order = 0
        for step in steps:
            if isinstance(step, Shell):
                shell = step.w
            elif isinstance(step, Grow):
                grow, order = step.r, order | (1 if shell else 0)
            elif isinstance(step, Displace):
                amount, frequency, order = step.amount, step.frequency, order | (2 if shell else 0)
        return Skin(grow, shell, order, amount, frequency)

    @property
    def reach(self) -> float:
        """How much farther out the leaf reaches at most, below 0 where it shrinks."""
        return self.grow + self.shell / 2 + abs(self.amount)

    @property
    def level(self) -> float:
        """The outermost level of the leaf's own distance that is an edge, but for a displacement."""
        return self.grow + self.shell / 2

    @property
    def inner(self) -> float | None:
        """The innermost level that is one, None where the leaf is filled."""
        if not self.shell:
            return None
        return (-1.0 if self.order & 1 else 1.0) * self.grow - self.shell / 2


BARE = Skin()


def compose(outer: Rows, inner: Rows) -> Rows:
    """The map that applies ``inner`` first, then ``outer``."""
    a, b, c, d, e, f, g, h, i, j, k, m = outer
    p, q, r, s, t, u, v, w, x, y, z, o = inner
    return (
        a * p + b * t + c * x, a * q + b * u + c * y, a * r + b * v + c * z, a * s + b * w + c * o + d,
        e * p + f * t + g * x, e * q + f * u + g * y, e * r + f * v + g * z, e * s + f * w + g * o + h,
        i * p + j * t + k * x, i * q + j * u + k * y, i * r + j * v + k * z, i * s + j * w + k * o + m,
    )  # fmt: skip


def composed(steps: Iterable[Step]) -> Rows:
    """All affine maps of a chain composed in order, deformations left out."""
    rows = IDENTITY
    for step in steps:
        if isinstance(step, Affine):
            rows = step.rows if rows is IDENTITY else compose(step.rows, rows)
    return rows


def inverted(rows: Rows) -> Rows:
    """The inverse of a map; raises ZeroDivisionError where there is none."""
    a, b, c, x, d, e, f, y, g, h, i, z = rows
    p, q, r = e * i - f * h, f * g - d * i, d * h - e * g
    det = a * p + b * q + c * r
    p, q, r = p / det, q / det, r / det
    s, t, u = (c * h - b * i) / det, (a * i - c * g) / det, (b * g - a * h) / det
    v, w, o = (b * f - c * e) / det, (c * d - a * f) / det, (a * e - b * d) / det
    return (
        p, s, v, -(p * x + s * y + v * z),
        q, t, w, -(q * x + t * y + w * z),
        r, u, o, -(r * x + u * y + o * z),
    )  # fmt: skip


def translation(x: float, y: float, z: float = 0.0) -> Rows:
    return (1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z)


def scaling(x: float, y: float, z: float = 1.0) -> Rows:
    """Stretches along the three axes."""
    return (x, 0.0, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, 0.0, z, 0.0)


def rotation(angle_rad: float, axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> Rows:
    """A counter-clockwise turn about ``axis`` (any length but 0) seen from its tip; Rodrigues' formula."""
    c, s = cos(angle_rad), sin(angle_rad)
    x, y, z = axis
    if x == 0.0 and y == 0.0:
        s = s if z > 0.0 else -s
        return (c, -s, 0.0, 0.0, s, c, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    n = hypot(x, y, z)
    x, y, z = x / n, y / n, z / n
    v = 1.0 - c
    return (
        c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0.0,
        y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0.0,
        z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0.0,
    )  # fmt: skip


def shearing(axes: str, k: float) -> Rows:
    """``xy``: x += k y, and so on for the other pairs."""
    rows = list(IDENTITY)
    rows["xyz".index(axes[0]) * 4 + "xyz".index(axes[1])] = k
    return tuple(rows)  # type: ignore[return-value]
