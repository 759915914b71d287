"""Exact lifting: a transformation is a matrix that acts on a geometry vector, and none is learned.

A geometry vector holds the way from the world back to the leaf (`scenelang.lifting.layout`), and each
transformation acts on it linearly: an affine map multiplies its frame by its inverse; a warp shifts the warps
of its group by one place and writes itself in front, times the constant. A product of such matrices is exact
for chains of any length.

Source: the paper's supplement lifts every transformation by a learned MLP; here the part that is known is
not learned (docs/architecture.md says why).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenelang.graph.chain import Levels, slots
from scenelang.graph.steps import IDENTITY, Rows, Turn
from scenelang.lifting.layout import PLANE_LAYOUT, WIDTH, Layout


def inverse_frame(rows: Rows, dimension: int) -> list[float]:
    """The inverse of an affine map as d rows of d + 1 numbers: the coordinates before it.

    Raises:
        ZeroDivisionError: the map is singular.
    """
    if dimension == 2:  # in closed form, as chains of the plane are lifted by the ten thousand
        a, b, _, c, d, e, _, f = rows[:8]
        inverse_det = 1.0 / (a * e - b * d)
        p, q, r, s = e * inverse_det, -b * inverse_det, -d * inverse_det, a * inverse_det
        return [p, q, -(p * c + q * f), r, s, -(r * c + s * f)]
    matrix = np.array([*rows, 0.0, 0.0, 0.0, 1.0]).reshape(4, 4)
    try:
        return list(np.linalg.inv(matrix)[:3].ravel().tolist())
    except np.linalg.LinAlgError:
        raise ZeroDivisionError("a singular map") from None


def leaf_vector(code: Sequence[float], layout: Layout = PLANE_LAYOUT) -> np.ndarray:
    """The vector g of a leaf without transformations."""
    g = np.zeros(layout.geometry)
    g[: layout.code] = code
    g[layout.one] = 1.0
    g[layout.frame] = g[layout.middle] = layout.identity
    return g


def affine_matrix(rows: Rows, slot: slice | None = None, layout: Layout = PLANE_LAYOUT) -> np.ndarray:
    """The matrix of an affine map that acts on one of the two frames, the last one unless said."""
    d = layout.dimension
    right = np.eye(d + 1)
    right[:d] = np.reshape(inverse_frame(rows, d), (d, d + 1))
    matrix = np.eye(layout.geometry)
    start = (slot or layout.frame).start
    for row in range(start, start + layout.frame_size, d + 1):
        matrix[row : row + d + 1, row : row + d + 1] = right.T
    return matrix


def warp_matrix(turn: Turn, group: slice, layout: Layout = PLANE_LAYOUT) -> np.ndarray:
    """The matrix of a turn that enters a slot of its own in a group of the layout from outside."""
    n = layout.strengths
    matrix = np.eye(layout.geometry)
    matrix[group, group] = np.eye(group.stop - group.start, k=-n)
    matrix[group.start : group.start + n, layout.one] = slots([turn], layout.dimension)[0]
    return matrix


def lift_many(
    levels: Sequence[Levels], codes: Sequence[Sequence[float]], layout: Layout = PLANE_LAYOUT
) -> np.ndarray:
    """Geometry vectors (N, layout.geometry) in float64: the products of their matrices and the leaf, at once.

    Raises:
        ZeroDivisionError: an affine map is singular.
    """
    out, d = np.zeros((len(levels), layout.geometry)), layout.dimension
    for row, level, code in zip(out, levels, codes, strict=True):
        numbers = [*code, 1.0, *inverse_frame(level.affine, d)]
        numbers += _slots(level.outer, layout.outer, layout)
        numbers += inverse_frame(level.middle, d)
        numbers += _slots(level.inner, layout.inner, layout)
        if layout.extras:
            numbers += [level.bulge.amount, level.bulge.frequency, 0.0]
        row[:] = numbers
    return out


def _slots(turns: tuple[Turn, ...], count: int, layout: Layout) -> list[float]:
    numbers = [x for slot in reversed(slots(turns, layout.dimension)) for x in slot]
    return numbers + [0.0] * (layout.strengths * count - len(numbers))


def lift_colours(
    colours: Sequence[Sequence[float]],
    codes: Sequence[Sequence[float]],
    layout: Layout = PLANE_LAYOUT,
    moved: Sequence[Rows] = (),
) -> np.ndarray:
    """Material vectors (N, 64 - layout.geometry) in float64.

    Args:
        colours: what multiplies the albedo, (r, g, b) in [0, 1].
        moved: what each one's texture is moved by, as maps of the plane; by default nothing.
    """
    out = np.zeros((len(colours), WIDTH - layout.geometry))
    out[:, :6] = PLANE_LAYOUT.identity  # textures lie in a plane
    for row, map in zip(out, moved, strict=False):
        if map is not IDENTITY:
            row[:6] = inverse_frame(map, 2)
    for channel in range(3):
        out[:, layout.colour.start + 5 * channel] = [c[channel] for c in colours]
    out[:, layout.material_code] = np.asarray(codes, dtype=np.float64).reshape(len(colours), -1)
    return out
