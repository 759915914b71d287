"""The spaces that models draw in, by their dimension; the solid one is here."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt
from typing import Final

from scenelang.graph.plane import Plane
from scenelang.graph.space import EVERYWHERE, Box, Refusal, Space
from scenelang.graph.steps import Rows, Step, Warp
from scenelang.scene import schema


class Solid(Space):
    """The solid world. Bounds are not known yet: every leaf may be everywhere, so nothing is left out."""

    dimension = 3
    shown = ((0, 1, 2, 3), (4, 5, 6, 7), (8, 9, 10, 11))
    thinner = "a plane, a line or a point"

    def fitted(self, transform: schema.Transform, rows: Rows) -> Rows | Refusal:
        return rows

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

    def before(self, rows: Rows, warp: Warp) -> Warp | None:
        return None

    def box(self, geometry: str, steps: Sequence[Step], level: float) -> Box:
        return EVERYWHERE

    def disc(self, geometry: str, steps: Sequence[Step]) -> tuple[float, Rows] | None:
        return None


PLANE: Final = Plane()
SPACES: Final[dict[int, Space]] = {2: PLANE, 3: Solid()}
