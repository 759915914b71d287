"""Exact lifting of 2D chains: every transformation is a 32 x 32 matrix, and none of them is learned.

A geometry vector g holds the way from the world back to the leaf as numbers:

    0:4    the leaf's code
    4      the constant 1
    5:11   frame of the last affine map: the rows of its inverse, (a b c), (d e f)
    11:20  up to three outer warps, the outermost first, each (twirl, bend x, bend y)
    20:26  frame of the middle affine map
    26:32  up to two inner warps, the outermost first

Every slot is a function of the scene alone, and each transformation acts on them linearly: an affine map
multiplies its frame by its inverse; a warp shifts the warps of its group by one and writes itself in
front, times the constant. A product of such matrices is exact for chains of any length.

The material vector m holds a texture frame (6 numbers and 2 unused), the colour matrix (3 x 4, applied to
(albedo, 1)) and the material's code (12).

Source: the paper's supplement lifts every transformation by a learned MLP; here the part that is known is
not learned (docs/architecture.md says why).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenelang.graph.levels import Levels
from scenelang.graph.steps import Rows, Warp

D_G = D_M = 32
CODE = slice(0, 4)
ONE = 4
FRAME = slice(5, 11)
OUTER = slice(11, 20)
MIDDLE = slice(20, 26)
INNER = slice(26, 32)
OUTER_WARPS, INNER_WARPS = 3, 2

TEXTURE = slice(0, 6)
COLOUR = slice(8, 20)
MATERIAL_CODE = slice(20, 32)

_IDENTITY_FRAME = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


def inverse_frame(rows: Rows) -> tuple[float, float, float, float, float, float]:
    """The in-plane inverse (a, b, c, d, e, f) of an affine map; its rows give the coordinates before it.

    Raises:
        ZeroDivisionError: the map is singular in the plane.
    """
    a, b, _, c, d, e, _, f = rows[:8]
    inverse_det = 1.0 / (a * e - b * d)
    p, q, r, s = e * inverse_det, -b * inverse_det, -d * inverse_det, a * inverse_det
    return p, q, -(p * c + q * f), r, s, -(r * c + s * f)


def leaf_vector(code: Sequence[float]) -> np.ndarray:
    """The vector g (32,) of a leaf without transformations."""
    g = np.zeros(D_G)
    g[CODE] = code
    g[ONE] = 1.0
    g[FRAME] = g[MIDDLE] = _IDENTITY_FRAME
    return g


def affine_matrix(rows: Rows, slot: slice = FRAME) -> np.ndarray:
    """The matrix (32, 32) of an affine map that acts on one of the two frames."""
    a, b, c, d, e, f = inverse_frame(rows)
    right = np.array([[a, b, c], [d, e, f], [0.0, 0.0, 1.0]]).T
    matrix = np.eye(D_G)
    for row in (slot.start, slot.start + 3):
        matrix[row : row + 3, row : row + 3] = right
    return matrix


def warp_matrix(warp: Warp, group: slice) -> np.ndarray:
    """The matrix (32, 32) of a warp that enters a group of warps (`OUTER` or `INNER`) from outside."""
    matrix = np.eye(D_G)
    matrix[group, group] = np.eye(group.stop - group.start, k=-3)
    matrix[group.start : group.start + 3, ONE] = (warp.twirl, *warp.bend)
    return matrix


def matrices(levels: Levels) -> list[np.ndarray]:
    """The matrices of a chain, nearest the leaf first: g = M_n … M_1 leaf_vector(code)."""
    return [
        *(warp_matrix(w, INNER) for w in levels.inner),
        affine_matrix(levels.middle, MIDDLE),
        *(warp_matrix(w, OUTER) for w in levels.outer),
        affine_matrix(levels.affine, FRAME),
    ]


def lift_many(levels: Sequence[Levels], codes: Sequence[Sequence[float]]) -> np.ndarray:
    """Geometry vectors (N, 32) in float64: what the products of `matrices` are, written down at once.

    Args:
        levels: one chain an object.
        codes: the leaf's code of each object, 4 numbers.

    Raises:
        ZeroDivisionError: an affine map is singular in the plane.
    """
    out = np.zeros((len(levels), D_G))
    for row, level, code in zip(out, levels, codes, strict=True):
        middle = inverse_frame(level.middle)
        numbers = [*code, 1.0, *inverse_frame(level.affine)]
        numbers += _slots(level.outer, OUTER_WARPS)
        numbers += middle
        numbers += _slots(level.inner, INNER_WARPS)
        row[:] = numbers
    return out


def _slots(warps: tuple[Warp, ...], count: int) -> list[float]:
    numbers = [x for w in reversed(warps) for x in (w.twirl, *w.bend)]
    return numbers + [0.0] * (3 * (count - len(warps)))


def lift_colours(colours: Sequence[Sequence[float]], codes: Sequence[Sequence[float]]) -> np.ndarray:
    """Material vectors (N, 32) in float64 of objects whose material is one colour.

    Args:
        colours: what multiplies the albedo, (r, g, b) in [0, 1].
        codes: the material's code of each object, 12 numbers.
    """
    out = np.zeros((len(colours), D_M))
    out[:, TEXTURE] = _IDENTITY_FRAME
    for channel in range(3):
        out[:, COLOUR.start + 5 * channel] = [c[channel] for c in colours]
    out[:, MATERIAL_CODE] = np.asarray(codes, dtype=np.float64).reshape(len(colours), -1)
    return out
