"""Rays through the solid's field: where the kind of what they are in changes.

A ray steps as far as the field says that nothing changes, and at least `STEP`; so what is thinner than that,
along the ray, may be passed over.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.reference.field import Array
from scenelang.reference.solid.field import FAR, MEDIUM, OPAQUE, OUT, Field

STEP = 2e-3
STEPS = 5_000  # of a ray at most

Ints = npt.NDArray[np.int64]
Kinds = npt.NDArray[np.int8]


class Changes(NamedTuple):
    """What M rays meet up to where they end or meet something opaque.

    Args:
        first, last: the kind where each starts and where it ends, (M,).
        ray, t: of each change the ray and the place, (K,), in order along each ray.
        before, after: kinds, (K,).
    """

    first: Kinds
    last: Kinds
    ray: Ints
    t: Array
    before: Kinds
    after: Kinds

    def media(self, end: Array) -> tuple[Ints, Array, Array]:
        """Stretches of rays inside media: ray, where it enters and where it leaves, in order along each ray.

        Args:
            end: where the rays end, (M,).
        """

        def sorted_(edge: Kinds, kinds: Kinds, at: Array) -> tuple[Ints, Array]:
            whole, part = np.nonzero(edge == MEDIUM)[0], kinds == MEDIUM
            ray, t = np.concatenate([self.ray[part], whole]), np.concatenate([self.t[part], at[whole]])
            order = np.lexsort((t, ray))
            return ray[order], t[order]

        ray, enter = sorted_(self.first, self.after, np.zeros_like(end))
        return ray, enter, sorted_(self.last, self.before, end)[1]


def march(field: Field, o: Array, d: Array, end: Array, *, exact: bool = False) -> Changes:
    """Follow rays o + t d, t from 0 to ``end``, until they end or meet something opaque.

    Args:
        field: of the scene.
        o, d: origins and unit directions, (3, M).
        end: (M,), may be infinite.
        exact: places to 1e-9 or so; otherwise to about 1e-6.
    """
    enter, leave, speed = field.spans(o, d)
    leave = np.minimum(leave, end)
    enter = np.where(leave > np.maximum(enter, 0.0), enter, np.inf)
    first, last = np.full(o.shape[1], OUT, np.int8), np.full(o.shape[1], OUT, np.int8)
    ray = np.nonzero((enter < np.inf).any(0))[0]
    enter, leave = enter[:, ray], np.where(enter < np.inf, leave, -np.inf)[:, ray]
    stop, t = leave.max(0, initial=-np.inf), np.maximum(enter.min(0, initial=np.inf), 0.0)
    origin, along, speed = o.take(ray, 1), d.take(ray, 1), speed.take(ray, 1)
    lower: Any = None
    found: list[tuple[Any, ...]] = []
    taken = 0
    while len(ray):
        taken += 1
        if taken > STEPS:
            raise ValueError(f"a ray of the exact picture takes more than {STEPS:,} steps")
        value, kind, way = field.probe(origin + t * along, (enter <= t) & (t <= leave), speed)
        if lower is None:
            first[ray] = np.where(t == 0.0, kind, OUT)
            lower = t, np.full_like(t, FAR), first[ray]
        at = np.nonzero(kind != lower[2])[0]
        if len(at):
            found.append((ray[at], *(v[at] for v in (*lower, t, value, kind))))
        last[ray] = kind
        following = np.where(enter > t, enter, np.inf).min(0)
        lower, t = (t, value, kind), np.minimum(np.minimum(t + np.maximum(way, STEP), following), stop)
        going = np.nonzero((kind != OPAQUE) & (lower[0] < stop))[0]
        if len(going) < len(ray):
            ray, t, stop, lower = ray[going], t[going], stop[going], tuple(v[going] for v in lower)
            origin, along, enter, leave, speed = (
                v.take(going, 1) for v in (origin, along, enter, leave, speed)
            )
    if not found:
        return Changes(first, last, np.zeros(0, int), np.zeros(0), first[:0], first[:0])
    ray, low, low_d, before, high, high_d, after = (np.concatenate(v) for v in zip(*found, strict=True))
    # Where d passes through 0 a straight line finds the place; where the material alone changes, halving.
    surface = (before == OUT) != (after == OUT)
    for at, rounds in ((np.nonzero(surface)[0], 2), (np.nonzero(~surface)[0], 20)):
        for _ in range(rounds if exact and len(at) else 0):
            low_at, high_at = low[at], high[at]
            share = low_d[at] / (low_d[at] - high_d[at]) if rounds == 2 else 0.5
            middle = low_at + share * (high_at - low_at)
            here = field.at(o.take(ray[at], 1) + middle * d.take(ray[at], 1))
            same = here.kind() == before[at]
            low[at], low_d[at] = np.where(same, middle, low_at), np.where(same, here.d, low_d[at])
            high[at], high_d[at] = np.where(same, high_at, middle), np.where(same, high_d[at], here.d)
    line = low + low_d / np.where(surface, low_d - high_d, 1.0) * (high - low)
    return Changes(first, last, ray, np.where(surface, line, high), before, after)
