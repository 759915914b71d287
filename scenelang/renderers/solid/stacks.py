"""Groups of a stream along the objects that points meet: which states these go into, and when groups end.

Points meet a part of the objects, so of groups too; what is not met has no effect. A group that begins where
nothing has been met of what it stands in, and that what it is joined by would show, goes on in that state.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scenelang.program.groups import SUBTRACT, Groups
from scenelang.renderers.arrays import Array, Arrays


class Closing(NamedTuple):
    """States of groups that end, k of them.

    Args:
        inner: their entries (k,): the point's number and, for each state below it, the number of points.
        outer: those of the states that take them in.
        which: their numbers behind those of the objects.
    """

    inner: Array
    outer: Array
    which: Array


class Stacks:
    """The groups that are open at each object, as bits: the outermost is 1, one in that 2, and so on."""

    def __init__(self, xp: Arrays, groups: Groups, like: Array) -> None:
        def placed(values: np.ndarray) -> Array:
            return xp.array(np.ascontiguousarray(values), like)

        self._xp, self._groups, self._count = xp, groups.deepest, len(groups.tokens)
        bits = 1 << np.arange(groups.deepest)
        there = groups.path >= 0
        self._path = placed(groups.path.T)  # (D, N)
        self._open = placed(there @ bits)
        self._cuts = placed((there & (groups.joins[groups.path] >= SUBTRACT)) @ bits)
        self._ways = placed(np.unique(groups.path, axis=0, return_inverse=True)[1].reshape(-1))
        self._states = placed(np.array([bin(i).count("1") for i in range(2 << groups.deepest)]))

    def followed(
        self, places: list[Array | None], rays: Array, objects: Array, every: Array
    ) -> tuple[list[Array | None], list[list[Closing]], int]:
        """Follow points through their objects.

        Args:
            places: as of `Pairs`, without states.
            rays: numbers of their points (P,), place by place.
            objects: numbers (P,).
            every: numbers of all points (M,).

        Returns:
            Places with states, groups that end before each and behind the last, and how many states points
            have at most.
        """
        xp, count = self._xp, len(every)
        ways, begun = xp.take(self._ways, objects), 0 * every
        met = count if places[0] is None else len(places[0])
        xp.put(begun, rays[:met], ways[:met])
        if (ways == xp.take(begun, rays)).all() and not xp.take(self._cuts, objects).any():
            return places, [[]] * (len(places) + 1), 1  # each point meets one group alone
        found: list[Array | None] = []
        closings: list[list[Closing]] = []
        stacks, paths = 0 * every, xp.take(self._path, 0 * every)
        start, deepest = 0, 1
        for place in places:
            points = every if place is None else place
            which = objects[start : start + len(points)]
            stack, path, last = xp.take(stacks, points), xp.take(self._path, which), xp.take(paths, points)
            opened = xp.take(self._open, which)
            common, same = 0 * stack, points == points
            for depth in range(self._groups):
                same = same & (path[depth] == last[depth]) & (path[depth] >= 0)
                common = common + same * (1 << depth)
            # what begins in what is not empty, or cuts it, has a state of its own
            begun = opened & ~common & (xp.take(self._cuts, which) | (common + 1) * (start > 0))
            closing, stack = self._closed(points, stack, common, last, count)
            stack = stack | begun
            states = xp.take(self._states, stack)
            deepest = max(deepest, 1 + int(states.max())) if len(points) else deepest
            closings.append(closing)
            found.append(place if place is None and not start else points + count * states)
            xp.put(stacks, points, stack)
            xp.put(paths, points, path)
            start += len(points)
        closings.append(self._closed(every, stacks, 0 * every, paths, count)[0])
        if deepest > 1 and found[0] is None:
            found[0] = every
        return found, closings, deepest

    def _closed(
        self, points: Array, stack: Array, common: Array, path: Array, count: int
    ) -> tuple[list[Closing], Array]:
        """End the groups of stacks (k,) but for what they have in common with what follows."""
        xp, found = self._xp, list[Closing]()
        ending = stack & ~common
        for depth in reversed(range(self._groups)):
            bit = 1 << depth
            some = xp.where((ending & bit) > 0)
            if len(some):
                inner = xp.take(points, some) + count * xp.take(self._states, xp.take(stack, some))
                found.append(Closing(inner, inner - count, self._count + xp.take(path[depth], some)))
                stack = stack - (ending & bit)
        return found, stack
