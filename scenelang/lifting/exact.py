"""Exact lifting: a transformation is a matrix that acts on a geometry vector, and none is learned.

A vector holds the way from the world back to the leaf (`scenelang.lifting.vector`), and each
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
from scenelang.lifting.vector import PLANE_LAYOUT, STRENGTHS, WIDTH, Layout


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
    """The vector (64,) of a leaf without transformations or material."""
    frame = layout.identity
    vector: np.ndarray = layout.pack(1, code=code, one=1.0, frame=frame, middle=frame)[0]
    return vector


def affine_matrix(rows: Rows, slot: slice | None = None, layout: Layout = PLANE_LAYOUT) -> np.ndarray:
    """The matrix (64, 64) of an affine map that acts on one of the two frames, the last one unless said."""
    d = layout.dimension
    right = np.eye(d + 1)
    right[:d] = np.reshape(inverse_frame(rows, d), (d, d + 1))
    matrix, at = np.eye(WIDTH), slot or layout.places.frame
    for row in range(at.start, at.stop, d + 1):
        matrix[row : row + d + 1, row : row + d + 1] = right.T
    return matrix


def warp_matrix(turn: Turn, group: slice, layout: Layout = PLANE_LAYOUT) -> np.ndarray:
    """The matrix (64, 64) of a turn that enters a slot of its own in a group from outside."""
    matrix = np.eye(WIDTH)
    matrix[group, group] = np.eye(group.stop - group.start, k=-STRENGTHS)
    matrix[group.start : group.start + STRENGTHS, layout.places.one] = slots([turn], layout.dimension)[0]
    return matrix


def lift_many(
    levels: Sequence[Levels], codes: Sequence[Sequence[float]], layout: Layout = PLANE_LAYOUT
) -> np.ndarray:
    """Vectors (N, 64) in float64 of ways to leaves: the products of their matrices and the leaf, at once.

    Raises:
        ZeroDivisionError: an affine map is singular.
    """
    out, d = np.zeros((len(levels), WIDTH)), layout.dimension
    for row, level, code in zip(out, levels, codes, strict=True):
        numbers = [*code, 1.0, *inverse_frame(level.affine, d)]
        numbers += _slots(level.outer, layout.outer, d)
        numbers += inverse_frame(level.middle, d)
        numbers += _slots(level.inner, layout.inner, d)
        if d == 3:
            numbers += [level.bulge.amount, level.bulge.frequency]
        row[: len(numbers)] = numbers
    return out


def _slots(turns: tuple[Turn, ...], count: int, dimension: int) -> list[float]:
    numbers = [x for slot in reversed(slots(turns, dimension)) for x in slot]
    return numbers + [0.0] * (STRENGTHS * count - len(numbers))


def lift_colours(
    colours: Sequence[Sequence[float]],
    codes: Sequence[Sequence[float]],
    layout: Layout = PLANE_LAYOUT,
    moved: Sequence[Rows] = (),
) -> np.ndarray:
    """Vectors (N, 64) in float64 of materials.

    Args:
        colours: what multiplies the albedo, (r, g, b) in [0, 1].
        moved: what each one's texture is moved by, as maps of the plane; by default nothing.
    """
    count = len(colours)
    texture = [PLANE_LAYOUT.identity] * count  # textures lie in a plane
    for at, map in enumerate(moved):
        if map is not IDENTITY:
            texture[at] = tuple(inverse_frame(map, 2))
    rgb, material = (np.asarray(each, np.float64).reshape(count, -1) for each in (colours, codes))
    return layout.pack(count, texture=texture, rgb=rgb, material=material)
