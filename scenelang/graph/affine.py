"""Affine maps of R^3 as the upper three rows of a 4 x 4 matrix, in plain floats.

The compiler's front half does not import numpy: these few closed forms are all it needs.
"""

from __future__ import annotations

from math import cos, hypot, sin, sqrt

from scenelang.graph.steps import IDENTITY, Rows

ALIKE = 1e-12
"""Relative tolerance below which two stretches, or a right angle, count as equal."""

SINGULAR = 1e-12
"""Smallest to largest stretch at which a map counts as singular.

The determinant of a 2 x 2 block carries a rounding error of about 1e-16 of the squared largest stretch,
so that ratio is still known to four digits here, while nothing that thin can be seen at 8192 pixels.
"""

REACH = 1e30
"""Stretches outside ``1/REACH .. REACH`` leave the range of float32 when inverted, as do far offsets."""


def compose(outer: Rows, inner: Rows) -> Rows:
    """The map that applies ``inner`` first, then ``outer``."""
    a, b, c, d, e, f, g, h, i, j, k, m = outer
    p, q, r, s, t, u, v, w, x, y, z, o = inner
    return (
        a * p + b * t + c * x, a * q + b * u + c * y, a * r + b * v + c * z, a * s + b * w + c * o + d,
        e * p + f * t + g * x, e * q + f * u + g * y, e * r + f * v + g * z, e * s + f * w + g * o + h,
        i * p + j * t + k * x, i * q + j * u + k * y, i * r + j * v + k * z, i * s + j * w + k * o + m,
    )  # fmt: skip


def translation(x: float, y: float, z: float = 0.0) -> Rows:
    """A shift by (x, y, z)."""
    return (1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z)


def scaling(x: float, y: float, z: float = 1.0) -> Rows:
    """Stretches along the three axes."""
    return (x, 0.0, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, 0.0, z, 0.0)


def rotation(angle_rad: float, axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> Rows:
    """A counter-clockwise turn about ``axis`` (any length but 0), seen from its tip.

    Source: Rodrigues' rotation formula.
    """
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
    return (
        rows[0], rows[1], rows[2], rows[3], rows[4], rows[5],
        rows[6], rows[7], rows[8], rows[9], rows[10], rows[11],
    )  # fmt: skip


def flattened(rows: Rows) -> Rows:
    """The same map of the plane with z left alone."""
    return (rows[0], rows[1], 0.0, rows[3], rows[4], rows[5], 0.0, rows[7], 0.0, 0.0, 1.0, 0.0)


def stretches(rows: Rows, dimension: int) -> tuple[float, float]:
    """The smallest and largest singular value of the linear block, 2 x 2 or 3 x 3 by ``dimension``."""
    if dimension == 3:
        return _stretches3(rows)
    a, b, c, d = rows[0], rows[1], rows[4], rows[5]
    largest = 0.5 * (hypot(a + d, c - b) + hypot(a - d, c + b))
    # |det| / largest keeps its digits where the difference of the two lengths would lose them.
    return (abs(a * d - b * c) / largest if largest else 0.0), largest


def _stretches3(rows: Rows) -> tuple[float, float]:
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


def usable(rows: Rows, dimension: int) -> bool:
    """Whether the map can be inverted in float64 and its inverse kept in float32."""
    smallest, largest = stretches(rows, dimension)
    offset = max(abs(rows[3]), abs(rows[7]), abs(rows[11]), 1.0)
    # Written so that NaN and infinity fail.
    return smallest > SINGULAR * largest and offset < REACH * smallest and largest < REACH


def similarity(rows: Rows) -> tuple[float, float] | None:
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


def inverted(rows: Rows) -> Rows:
    """The inverse of a map of the plane; raises ZeroDivisionError for a singular one."""
    a, b, x = rows[0], rows[1], rows[3]
    c, d, y = rows[4], rows[5], rows[7]
    det = a * d - b * c
    p, q, r, s = d / det, -b / det, -c / det, a / det
    return (p, q, 0.0, -(p * x + q * y), r, s, 0.0, -(r * x + s * y), 0.0, 0.0, 1.0, 0.0)
