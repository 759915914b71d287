"""Norm units: a decoder whose edges are sharp, whose faces are flat and whose distances go on far away.

A unit is the length of what lies above a few lines in a point's features, as the length of a vector is of its
coordinates (a norm instead of a sum, as in Gulcehre et al. 2014). The answer is the highest unit, with the
highest of further lines where all of them are below zero, less a radius:

    d = max_k |max(W_k f, 0)| + min(max_j V_j f, 0) - r

Features are what mirrors leave alone, and turns about y or swaps of axes: |x|, |y|, |z|, the distance from
the axis y, y itself, the largest and the least of the first three, and 1. Lines that are nowhere above zero,
and features that no line has, are left out when an object's decoder is made.

Letters: M points, F features that are left, L lines that are left, K units.
"""

from __future__ import annotations

from functools import reduce
from itertools import accumulate
from typing import Any, ClassVar, NamedTuple

import numpy as np

from scenelang.drawing.arrays import Array, Arrays

FEATURES = 8
LINES = 3  # of a unit; and those inside
ACROSS, UP, MOST, LEAST = 3, 4, 5, 6  # places of features behind the first three
_NONE = 1e-5  # of a feature, in all lines together


class Norms(NamedTuple):
    """Lines of one decoder: those of the units, then those inside."""

    w: Array  # (L, F)
    b: Array  # (L,)
    radius: Array  # ()
    features: tuple[int, ...]
    units: tuple[int, ...]  # (K,) lines of each
    inner: int  # lines inside
    notch: int = 0  # lines of a unit that is taken away, before the others

    @property
    def products(self) -> int:
        """How many products an answer takes."""
        return len(self.b) * (len(self.features) + 1)


def norms(
    xp: Arrays, lines: Array, radius: Array, far: float, up: int = UP, *, notched: bool = False
) -> Norms:
    """The decoder of lines (3 K + 3, features) and a radius (), of points within ``far`` of the origin; the
    feature ``up`` may be below zero. If ``notched``, the first unit is taken away.
    """
    w = np.asarray(xp.to_numpy(lines), np.float64)
    signs = w.copy()
    signs[:, up] = abs(w[:, up])
    highest = w[:, -1] + far * signs[:, :-1].clip(0.0).sum(1)
    signs[:, up] = -abs(w[:, up])
    lowest = w[:, -1] + far * signs[:, :-1].clip(None, 0.0).sum(1)
    alive = highest > 0
    alive[-LINES:] = (lowest[-LINES:] < 0).all()  # above zero anywhere, the lines inside say nothing
    if alive[-1]:
        alive[-LINES:] = highest[-LINES:] > lowest[-LINES:].max()
    counts = alive.reshape(-1, LINES).sum(1).tolist()
    used = np.flatnonzero(abs(w[alive, :-1]).sum(0) > _NONE)
    kept = xp.packed(lines[np.flatnonzero(alive)])
    units, notch = tuple(filter(None, counts[notched:-1])), counts[0] if notched else 0
    return Norms(
        xp.packed(kept[:, used]), kept[:, -1], radius, tuple(used.tolist()), units, counts[-1], notch
    )


class Lifted:
    """A network whose weights are linear in a code, hidden units of it, and 1."""

    config: Any  # sizes
    xp: ClassVar[Arrays]
    lift_w: Any  # (C, H), or none
    lift_b: Any  # (H,), or none
    lines: Any  # (C + H + 1, lines, features), or none
    radius: Any  # (C + H + 1,), or none

    def lifted(self, code: Array) -> Array:
        """A code (C,), its hidden units, and 1, in which weights are linear."""
        parts = [code, self.xp.full((1,), 1.0, code)]
        if self.config.hidden:
            parts.insert(1, (code @ self.lift_w + self.lift_b).clip(0.0))
        return self.xp.concat(parts, 0)

    def norms(self, code: Array, far: float, up: int = UP, *, notched: bool = False) -> Norms:
        """The norm units of a code (C,), as of `norms`."""
        one, lines = self.lifted(code), self.lines
        own = (one @ lines.reshape(len(lines), -1)).reshape(lines.shape[1:])
        return norms(self.xp, own, one @ self.radius, far, up, notched=notched)


def answers(xp: Arrays, q: Array, layers: Norms, gradient: bool) -> Array:
    """Distances (1, M) of points (3, M), or with their gradients (4, M)."""
    sides, used, units = abs(q), layers.features, layers.units
    across = xp.sqrt(q[0] * q[0] + q[2] * q[2]) if ACROSS in used else None
    most, least = (
        which(which(sides[0], sides[1]), sides[2]) if feature in used else None
        for which, feature in ((xp.maximum, MOST), (xp.minimum, LEAST))
    )
    known = (*sides, across, q[1], most, least)
    levels = xp.dense(xp.stack([known[i] for i in used], 0), layers.w, layers.b)
    inside = levels[sum(units) :]
    above = xp.above(levels[: sum(units)])
    squares, ends = above * above, accumulate(units)
    parts = [slice(end - size, end) for size, end in zip(units, ends, strict=True)]
    sums = [xp.total(squares[part]) for part in parts] or [0 * q[0]]
    length = xp.sqrt(reduce(xp.maximum, sums))
    d = length - layers.radius
    depth = xp.largest(inside)[0] if layers.inner else None
    if depth is not None:
        d = d + xp.minimum(depth, 0 * depth)
    if not gradient:
        return d[None]
    far = 1 / length.clip(1e-30)
    highest = reduce(xp.maximum, sums)
    rates, left = [], highest == highest
    for part, own in zip(parts, sums, strict=False):  # of units that tell the same one counts
        rates.append(above[part] * (far * (left & (own == highest))))
        left = left & (own != highest)
    if depth is not None:
        within = (depth < 0) | (length == 0)  # on a face, rounding may say neither
        rates.append(((inside == depth) & within) * (0 * depth + 1))
    by = dict(zip(used, layers.w.T @ xp.concat(rates, 0), strict=True))
    return xp.concat([d[None], _spread(xp, q, sides, by, across, most, least)], 0)


def _spread(
    xp: Arrays, q: Array, sides: Array, by: dict[int, Array], across: Array, most: Array, least: Array
) -> Array:
    """Gradients (3, M) at points q by the derivatives (M,) by the features there."""
    zero = 0 * q[0]
    result = xp.stack([by.get(axis, zero) for axis in range(3)], 0)
    for feature, value in ((MOST, most), (LEAST, least)):
        if value is not None:
            result = result + by[feature] * (sides == value)
    result = xp.select(q < 0, -result, result)
    if across is not None:
        rate = by[ACROSS] / across.clip(1e-30)
        result = result + xp.stack([rate * q[0], zero, rate * q[2]], 0)
    if UP in by:
        result[1] += by[UP]
    return result
