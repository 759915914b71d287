"""Norm units of the plane: decoders that are exact.

They are those of solids (`solid/norms.py`) with one unit more, which is taken away where a leaf is notched:

    d = max_k |max(W_k f, 0)| + min(max_j V_j f, 0) - |max(U f, 0)| - r

Features are the distance from the origin, |x|, |y|, y, and for each of `SECTORS` the coordinates of the point
mirrored into half a sector about +y, along its axis and across.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache, reduce
from itertools import accumulate, pairwise

import numpy as np

from scenelang.drawing.arrays import Array, Arrays
from scenelang.drawing.solid.norms import Norms

SECTORS = 3, 5, 6  # orders of symmetry
RADIAL, UP, FIRST = 0, 3, 4  # places of features; behind them those of sectors, and a column of biases
FEATURES = FIRST + 2 * len(SECTORS) + 1
GROUPS = (0,), (1, 2), (3,), *((FIRST + 2 * i, FIRST + 2 * i + 1) for i in range(len(SECTORS)))
"""Features that together change by no more than a point moves."""


@lru_cache
def mirrors(n: int) -> tuple[tuple[float, float, bool], ...]:
    """Lines by cosine and sine at which half a plane is mirrored into half a sector of n; whether what was
    beyond may then lie on either side of the axis.
    """
    result, most = [], n  # angles lie in [0, most half sectors]
    while most > 1:
        at = -(-most // 3)
        result.append((math.cos(at * math.pi / n), math.sin(at * math.pi / n), 2 * at < most))
        most = at
    return tuple(result)


def sector(xp: Arrays, u: Array, v: Array, n: int) -> tuple[Array, Array]:
    """Points by coordinates along an axis and, of at least 0, across: mirrored into half a sector of n."""
    for cos, sin, beyond in mirrors(n):
        past = xp.above(cos * v - sin * u)
        u, v = u + 2 * sin * past, v - 2 * cos * past
        v = abs(v) if beyond else v
    return u, v


def features(xp: Arrays, q: Array, used: Sequence[int]) -> Array:
    """Some features (F, M) of points (2, M)."""
    x, y = q
    across, known = abs(x), {}
    for feature in used:
        if feature == RADIAL:
            known[feature] = xp.length([x, y])
        elif feature < FIRST:
            known[feature] = (across, abs(y), y)[feature - 1]
        elif feature not in known:
            at = (feature - FIRST) // 2
            pair = sector(xp, y, across, SECTORS[at])
            known |= dict(zip(GROUPS[UP + at], pair, strict=True))
    return xp.stack([known[feature] for feature in used], 0)


class LeafUnits:
    """The decoder of a leaf, of `Norms` whose first unit, if they have a notch, is taken away."""

    def __init__(self, xp: Arrays, layers: Norms) -> None:
        self.xp, self.layers = xp, layers
        w = np.asarray(xp.to_numpy(layers.w), np.float64)
        every = np.zeros((len(w), FEATURES))
        every[:, layers.features] = w
        ends = [*accumulate((layers.notch, *layers.units, layers.inner), initial=0)]
        self.parts = [slice(*pair) for pair in pairwise(ends)]
        """Lines of the notch, of each unit, and inside."""
        parts = [every[:, group] for group in GROUPS]
        # how fast each line changes at most, and the notch and each unit, per leaf unit
        self.steep = sum(np.linalg.norm(part, axis=1) for part in parts)
        self.whole = [float(sum(np.linalg.norm(part[at], 2) for part in parts)) for at in self.parts[:-1]]

    @property
    def steepest(self) -> float:
        """The rate at which the distance changes at most."""
        inside = float(self.steep[self.parts[-1]].max(initial=0.0))
        return self.whole[0] + max(self.whole[1:], default=0.0) + inside

    def distance(self, q: Array) -> Array:
        """Distances (M,) at leaf coordinates (2, M), leaf units."""
        xp, (notch, *units, inner) = self.xp, self.parts
        levels = xp.dense(features(xp, q, self.layers.features), self.layers.w, self.layers.b)
        above = xp.above(levels[: inner.start])
        lengths = [xp.length([*above[part]]) for part in units] or [0 * q[0]]
        d = reduce(xp.maximum, lengths) - self.layers.radius
        if inner.start < inner.stop:
            d = d + xp.largest(levels[inner])[0].clip(None, 0.0)
        return d - xp.length([*above[notch]]) if notch.stop else d
