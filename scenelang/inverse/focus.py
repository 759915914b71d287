"""Targets out of focus: the scene's pictures are blurred as much before they are compared.

Otherwise sizes and colours make up for the blur, and the nearest picture is not that of the true values.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Final

import numpy as np

from scenelang.evaluate.ranges import Axis
from scenelang.inverse.search import ALIKE, NEAR, STEPS, Found, descend
from scenelang.inverse.several import Together
from scenelang.inverse.space import Point, Space
from scenelang.inverse.target import blurred

WIDEST: Final = 8.0  # standard deviation, pixels
ENOUGH: Final = 1e-6  # share of the error by which a step has to lower it: most of it may be noise


class Lens:
    """The blur of a target, which is found with the values: one more number of a search.

    Args:
        problem: of the last size.
        space: the params.
        until: nothing is begun after this time, as of `time.monotonic`.
    """

    def __init__(self, problem: Together, space: Space, until: float) -> None:
        self.problem, self.space, self.until = problem, space, until
        self.finer = problem.finer()
        self._last: tuple[Found, Found, float] | None = None

    def followed(self, place: Found) -> tuple[Found, float]:
        """Where a place leads to once pictures are blurred, and by how many pixels, 0 if nowhere."""
        if self._last is None or self._last[0] is not place:
            self._last = place, *self._follow(place)
        return self._last[1:]

    def noise(self, place: Found) -> bool:
        """Whether what is left is like noise, once the blur is taken into account."""
        found, sigma = self.followed(place)
        return self.problem.noise(found.point, sigma)

    def ended(self, places: Sequence[Found]) -> tuple[list[Found], float]:
        """Places of a search, best first, once more with the blur of the first, if it has one."""
        first, sigma = self.followed(places[0])
        if not sigma:
            return list(places), 0.0
        others = [self._follow(one)[0] for one in places[1:] if one.cost <= ALIKE * places[0].cost]
        return [first, *sorted(others, key=lambda one: one.cost)], sigma

    def _follow(self, place: Found) -> tuple[Found, float]:
        pictures = None if place.cost <= NEAR else self.problem.pictures(place.point)
        sigma = 0.0 if pictures is None else self.problem.blur(pictures)
        if not sigma or time.monotonic() > self.until:
            return place, 0.0
        wide, start = self.space.beside(Axis("blur", 0.0, WIDEST)), np.append(place.point, sigma / WIDEST)
        found = descend(self._residuals, wide, start, step=STEPS[-1], enough=ENOUGH)
        if found is None or found.cost >= place.cost:
            return place, 0.0
        way = place.way + tuple(u[:-1] for u in found.way)
        return Found(found.point[:-1], found.cost, way), WIDEST * float(found.point[-1])

    def _residuals(self, u: Point) -> Point | None:
        """Residuals of params and, as a share of `WIDEST`, the blur."""
        finer, found = self.finer, self.finer.pictures(u[:-1])
        if found is None:
            return None
        times = finer.canvas[0] // self.problem.canvas[0]
        return self.problem.residuals([blurred(one, WIDEST * float(u[-1]), times) for one in found])
