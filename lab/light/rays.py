"""Rays through a field: sphere tracing, a root where they meet a surface, and numbers by chance."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from lab.light.field import MEDIUM, OPAQUE, OUT, Array, Field, World, body_distance, compiled, folded, scratch
from scenelang.drawing.exact.solid import FAR

STEP = 1e-3  # least step of a ray
MOST = 4_000  # steps of a ray, and turns of a path
ENDS, MEETS, HITS, STUCK = range(4)  # of a ray's way: its end, a medium's particle, a surface, in a solid
DIMENSIONS = 32  # numbers of a Sobol' point
GOLDEN, ONE, TWO = (
    np.uint64(0x9E3779B97F4A7C15),
    np.uint64(0xBF58476D1CE4E5B9),
    np.uint64(0x94D049BB133111EB),
)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


class Room(NamedTuple):
    """What one thread writes to: `scratch`, colour and glow (6,), chance (its state, shift and number of the
    path), f cos (3,), light and alpha (4,), a ray (o, d, its way through balls of media, and how likely it
    meets a particle where it does), a direction and how far (4,); and Sobol' points (K, D).
    """

    d: Array
    stack: Array
    spans: Array
    look: Array
    chance: Array
    f: Array
    light: Array
    ray: Array
    aim: Array
    table: Array


def room_of(w: World, table: Array) -> Room:
    return Room(
        *scratch(w),
        np.empty(6),
        np.zeros(3, np.uint64),
        np.empty(3),
        np.empty(4),
        np.zeros(9),
        np.empty(4),
        table,
    )


@compiled
def scrambled(z: Any) -> Any:
    """A hash of 64 bits (SplitMix64: Steele, Lea and Flood 2014)."""
    z = (z ^ (z >> _S30)) * ONE
    z = (z ^ (z >> _S27)) * TWO
    return z ^ (z >> _S31)


@compiled
def draw(room: Room, dimension: int) -> float:
    """A number in [0, 1): of a shifted Sobol' point while it has any left, then at random."""
    if dimension < room.table.shape[1]:
        shift = scrambled(room.chance[1] + np.uint64(dimension) * GOLDEN) >> _S11
        value: float = room.table[int(room.chance[2]), dimension] + shift * 2.0**-53
        return value - 1.0 if value >= 1.0 else value
    room.chance[0] += GOLDEN
    return float((scrambled(room.chance[0]) >> _S11) * 2.0**-53)


@compiled
def probe(field: Field, o: Any, d: Any, t: float, room: Room) -> tuple[float, int, float, float]:
    """Distance, kind, extinction and how far the ray may go from t."""
    x, y, z = o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]
    spans, fastest, most, following = room.spans, 1e-9, FAR, FAR
    for i in range(len(room.d)):
        room.d[i] = FAR
        if spans[0, i] <= t:
            if t <= spans[1, i]:
                room.d[i], rate, reach = body_distance(field.rows, field.back, field.grids, i, x, y, z)
                fastest, most = max(fastest, rate * spans[2, i]), min(most, reach)
        elif spans[0, i] < following:
            following = spans[0, i]
    value, near, who = folded(field.code, field.width, room.d, room.stack)
    way = abs(value)
    if value < 0.0 and field.mixed:
        way = min(way, near)
    way = min(max(min(way / fastest, most), STEP), following - t)
    if value >= 0.0:
        return value, OUT, 0.0, way
    sigma = field.rows[who, 34]
    return value, MEDIUM if sigma > 0.0 else OPAQUE, sigma, way


@compiled
def march(
    field: Field, o: Any, d: Any, end: float, target: float, fine: bool, room: Room
) -> tuple[float, int, float]:
    """Follow a ray to its end, a surface, or an optical depth; how far it came, how it ended, the depth."""
    rows, spans, stop = field.rows, room.spans, -1.0
    for i in range(len(room.d)):
        a, b, c = 0.0, 0.0, -rows[i, 20] * rows[i, 20]
        for row in range(3):
            e, f, g = rows[i, 4 * row], rows[i, 4 * row + 1], rows[i, 4 * row + 2]
            p = e * o[0] + f * o[1] + g * o[2] + rows[i, 4 * row + 3] - rows[i, 17 + row]
            v = e * d[0] + f * d[1] + g * d[2]
            a, b, c = a + v * v, b + p * v, c + p * p
        root = b * b - a * c
        spans[0, i], spans[1, i], spans[2, i] = np.inf, -np.inf, math.sqrt(a)
        if root > 0.0:
            root = math.sqrt(root)
            leave = min((root - b) / a, end)
            if leave > 0.0 and (-b - root) / a < leave:
                spans[0, i], spans[1, i] = (-b - root) / a, leave
                stop = max(stop, leave)
    if stop < 0.0:
        return end, ENDS, 0.0
    t, tau = 0.0, 0.0
    value, kind, sigma, way = probe(field, o, d, t, room)
    if kind == OPAQUE:
        return t, STUCK, tau
    for _ in range(MOST):
        now = min(t + way, stop)
        value1, kind1, sigma1, way = probe(field, o, d, now, room)
        edge = now
        if kind1 != kind:
            edge = edge_of(field, o, d, t, value, kind, now, value1, fine and kind1 == OPAQUE, room)
        if sigma > 0.0:
            if tau + sigma * (edge - t) >= target:
                return t + (target - tau) / sigma, MEETS, target
            tau += sigma * (edge - t)
        if kind1 == OPAQUE:
            return edge, HITS, tau
        if sigma1 > 0.0 and edge < now:
            if tau + sigma1 * (now - edge) >= target:
                return edge + (target - tau) / sigma1, MEETS, target
            tau += sigma1 * (now - edge)
        if now >= stop:
            break
        t, value, kind, sigma = now, value1, kind1, sigma1
    return end, ENDS, tau


@compiled
def edge_of(
    field: Field, o: Any, d: Any, low: float, low_d: float, kind: int, high: float, high_d: float, fine: bool,
    room: Room,
) -> float:  # fmt: skip
    """The place between two points of a ray where kinds change, to about 1e-9 if ``fine``."""
    if low_d < 0.0 and high_d < 0.0:
        for _ in range(16 if fine else 0):
            middle = (low + high) / 2
            if probe(field, o, d, middle, room)[1] == kind:
                low = middle
            else:
                high = middle
        return (low + high) / 2
    side, at = 0, low + (high - low) * low_d / (low_d - high_d)
    for _ in range(8 if fine else 0):  # the Illinois rule
        here = probe(field, o, d, at, room)[0]
        if abs(here) < 1e-9:
            break
        if (here < 0.0) == (high_d < 0.0):
            high, high_d = at, here
            low_d = low_d / 2 if side == 1 else low_d
            side = 1
        else:
            low, low_d = at, here
            high_d = high_d / 2 if side == 2 else high_d
            side = 2
        at = low + (high - low) * low_d / (low_d - high_d)
    return at


@compiled
def end_of(w: World, o: Any, d: Any) -> Any:
    """How far away a ray meets the ground."""
    return (w.ground[0] - o[1]) / d[1] if d[1] < 0.0 and o[1] > w.ground[0] else np.inf
