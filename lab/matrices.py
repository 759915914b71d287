"""The matrices by which transformations act on vectors of the exact lifting, one by one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenelang.compiler.chain import slots
from scenelang.compiler.lifting import PLANE_LAYOUT, STRENGTHS, WIDTH, Layout, inverse_frame
from scenelang.compiler.steps import Rows, Turn


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
    """The matrix (64, 64) of a turn that is written to the first slot of a group, before the others."""
    matrix = np.eye(WIDTH)
    matrix[group, group] = np.eye(group.stop - group.start, k=-STRENGTHS)
    matrix[group.start : group.start + STRENGTHS, layout.places.one] = slots([turn], layout.dimension)[0]
    return matrix
