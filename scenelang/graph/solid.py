"""The space of three dimensions: maps that trade places with turns, and balls around leaves.

Maps and turns. A warp turns (x, y), a twist (x, z); call that plane P, and its axis a. Let M keep P and a
apart and be s times an orthogonal matrix Q on P, with no shift in P, and m times a coordinate, plus c, along
a. As R(w) turns P alone, M^-1 R(w) M is R(+-w), the sign being the determinant of Q. So a point M u, which a
turn by the angle w(M u) carries back to M^-1 R(w(M u)) M u, is one that a turn by +-w(M u) carries back from
u: M trades places with the turn if w(M u) is an angle of the same kind.

- A twist has w = k y. With c = 0 it is k m times y.
- A bend has w = k x, which is k s times the entry of Q^T's first column: it stays a bend along x where Q
  keeps that axis, whatever m and c are; slots of a vector hold no other.
- A twirl has w = k |M u|, which is k s |u| where |m| = s and c = 0.

Balls. A leaf lies in the unit ball and its distance grows no faster than 1, so the points below a level lie
in a ball of radius 1 + level / stretch, and a displacement by at most its amount widens that by as much. A
turn keeps lengths, so that it carries a ball into the one about the origin that encloses it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf, sqrt

from scenelang.graph import affine
from scenelang.graph.geometries import GEOMETRIES
from scenelang.graph.space import EVERYWHERE, Box, Refusal, Space
from scenelang.graph.stage import decoded, encoded
from scenelang.graph.steps import IDENTITY, Affine, Displace, Rows, Step, Turn, Twist
from scenelang.scene import schema

_ALIKE = 1e-12
"""Relative tolerance below which entries of a map count as equal."""

_ROUNDING = 1e-9
"""Balls and boxes grow by this much, relative, to cover the rounding of float64."""


class Solid(Space):
    """The solid world."""

    dimension = 3
    shown = ((0, 1, 2, 3), (4, 5, 6, 7), (8, 9, 10, 11))
    thinner = "a plane, a line or a point"

    def fitted(self, transform: schema.Transform, rows: Rows) -> Rows | Refusal:
        return rows

    def inked(self, op: schema.MaterialOp) -> schema.MaterialOp:
        """Light adds up, so that colours are linear."""
        return op.model_copy(update={"rgb": decoded(op.rgb)}) if isinstance(op, schema.Color) else op

    def written(self, rgb: tuple[float, float, float]) -> tuple[float, float, float]:
        return encoded(rgb)

    def holds(self, rows: Rows) -> bool:
        return True

    def stretches(self, rows: Rows) -> tuple[float, float]:
        a, b, c = rows[0], rows[1], rows[2]
        d, e, f = rows[4], rows[5], rows[6]
        g, h, i = rows[8], rows[9], rows[10]
        # Eigenvalues of the symmetric A^T A by cyclic Jacobi rotations: three sweeps reach float64 accuracy
        # from any start that matters here; eight leave no doubt.
        m = [
            [a * a + d * d + g * g, a * b + d * e + g * h, a * c + d * f + g * i],
            [0.0, b * b + e * e + h * h, b * c + e * f + h * i],
            [0.0, 0.0, c * c + f * f + i * i],
        ]
        m[1][0], m[2][0], m[2][1] = m[0][1], m[0][2], m[1][2]
        for _ in range(8):
            for p, q in ((0, 1), (0, 2), (1, 2)):
                if m[p][q] == 0.0:
                    continue
                theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q])
                t = (1.0 if theta >= 0.0 else -1.0) / (abs(theta) + hypot(theta, 1.0))
                co = 1.0 / hypot(t, 1.0)
                si = t * co
                for r in range(3):
                    m[r][p], m[r][q] = co * m[r][p] - si * m[r][q], si * m[r][p] + co * m[r][q]
                for r in range(3):
                    m[p][r], m[q][r] = co * m[p][r] - si * m[q][r], si * m[p][r] + co * m[q][r]
        values = sorted(max(m[r][r], 0.0) for r in range(3))
        largest, middle = sqrt(values[2]), sqrt(values[1])
        det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
        smallest = abs(det) / (largest * middle) if largest * middle > 0.0 else 0.0
        return min(smallest, middle), largest

    def before(self, rows: Rows, turn: Turn) -> Turn | None:
        """See the module for a proof."""
        j, k = (2, 1) if isinstance(turn, Twist) else (1, 2)  # the plane is that of x and j
        a, b, c, d, along = rows[0], rows[j], rows[4 * j], rows[5 * j], rows[5 * k]
        scale = sqrt(abs(a * d - b * c))
        near = _ALIKE * scale
        sign = 1.0 if a * d > b * c else -1.0
        apart = (rows[3], rows[4 * j + 3], rows[k], rows[4 * k], rows[4 * j + k], rows[4 * k + j])
        if max(abs(a - sign * d), abs(b + sign * c), *map(abs, apart)) > near:
            return None
        shift = abs(rows[4 * k + 3]) > near
        if isinstance(turn, Twist):
            return None if shift else Twist(sign * along * turn.twist)
        if turn.twirl and (shift or abs(abs(along) - scale) > near):
            return None
        bend = turn.bend[0]
        if bend and abs(b) > near:
            return None
        return type(turn)(sign * scale * turn.twirl, (sign * a * bend, 0.0)) if not turn.bend[1] else None

    def box(self, geometry: str, steps: Sequence[Step], level: float) -> Box:
        (x, y, z), radius, rows = self._ball(steps, level)
        sides = []
        for row in (rows[:4], rows[4:8], rows[8:]):
            middle = row[0] * x + row[1] * y + row[2] * z + row[3]
            half = radius * hypot(*row[:3])
            half += _ROUNDING * (1.0 + abs(middle) + half)
            if not half < inf:  # NaN compares false: what overflowed may be anywhere
                return EVERYWHERE
            sides += [middle - half, middle + half]
        xmin, xmax, ymin, ymax, zmin, zmax = sides
        return xmin, ymin, xmax, ymax, zmin, zmax

    def bound(self, geometry: str, steps: Sequence[Step], level: float) -> tuple[float, float, float, float]:
        (x, y, z), radius, rows = self._ball(steps, level)
        x, y, z = _mapped(rows, (x, y, z))
        radius *= self.stretches(rows)[1]
        return x, y, z, radius + _ROUNDING * (1.0 + hypot(x, y, z) + radius)

    def _ball(self, steps: Sequence[Step], level: float) -> tuple[tuple[float, float, float], float, Rows]:
        """Centre and radius of a ball that holds all points below a level, and the map behind it."""
        radius, pending = 1.0, IDENTITY
        if level > 0.0:
            stretch = self.stretches(affine.composed(steps))[0]
            radius += level / stretch if stretch else inf
        centre = 0.0, 0.0, 0.0
        for step in steps:
            if isinstance(step, Displace):
                radius += abs(step.amount)
            elif isinstance(step, Affine):
                pending = affine.compose(step.rows, pending)
            else:
                if pending is not IDENTITY:
                    centre, radius = _mapped(pending, centre), radius * self.stretches(pending)[1]
                    pending = IDENTITY
                centre, radius = (0.0, 0.0, 0.0), radius + hypot(*centre)
        return centre, radius, pending

    def disc(self, geometry: str, steps: Sequence[Step]) -> tuple[float, Rows] | None:
        """Turns before the first affine map leave a ball about the origin in place."""
        maps, row = [isinstance(step, Affine) for step in steps], GEOMETRIES.get(geometry)
        if row is None or any(maps[:-1]) or not all(maps[-1:]):
            return None
        inner = row.inner - sum(abs(step.amount) for step in steps if isinstance(step, Displace))
        return (inner, affine.inverted(affine.composed(steps))) if inner > 0.0 else None


def _mapped(rows: Rows, p: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = p
    a, b, c, u, d, e, f, v, g, h, i, w = rows
    return a * x + b * y + c * z + u, d * x + e * y + f * z + v, g * x + h * y + i * z + w
