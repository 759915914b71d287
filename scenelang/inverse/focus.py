"""Targets out of focus: the scene's pictures are blurred as much before they are compared.

Otherwise sizes and colours make up for the blur, and the nearest picture is not that of the true values.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np

from scenelang.evaluate.ranges import Axis
from scenelang.inverse.search import ALIKE, NEAR, STEPS, Found, descend
from scenelang.inverse.several import Together
from scenelang.inverse.space import Point, Space
from scenelang.inverse.target import Blur, blurred

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
        self._last: tuple[Found, Found, Blur] | None = None

    def followed(self, place: Found) -> tuple[Found, Blur]:
        """Where a place leads to once pictures are blurred, and how; not at all where that leads nowhere."""
        if self._last is None or self._last[0] is not place:
            self._last = place, *self._follow(place, (True, False))
        return self._last[1:]

    def noise(self, place: Found) -> bool:
        """Whether what is left is like noise, once the blur is taken into account."""
        found, blur = self.followed(place)
        return self.problem.noise(found.point, blur)

    def ended(self, places: Sequence[Found]) -> tuple[list[Found], Blur]:
        """Places of a search, best first, once more with the blur of the first, if it has one."""
        first, blur = self.followed(places[0])
        if not blur.sigma:
            return list(places), blur
        near = (one for one in places[1:] if one.cost <= ALIKE * places[0].cost)
        others = [self._follow(one, (blur.light,))[0] for one in near]
        return [first, *sorted(others, key=lambda one: one.cost)], blur

    def _follow(self, place: Found, ways: Sequence[bool]) -> tuple[Found, Blur]:
        pictures = None if place.cost <= NEAR else self.problem.pictures(place.point)
        sigma = 0.0 if pictures is None else self.problem.blur(pictures)
        best = place, Blur()
        if not sigma:
            return best
        wide, start = self.space.beside(Axis("blur", 0.0, WIDEST)), np.append(place.point, sigma / WIDEST)
        for light in ways:
            if time.monotonic() > self.until:
                break
            residuals = partial(self._residuals, light)
            found = descend(residuals, wide, start, step=STEPS[-1], enough=ENOUGH)
            if found is not None and found.cost < best[0].cost:
                way = place.way + tuple(u[:-1] for u in found.way)
                ended = Found(found.point[:-1], found.cost, way)
                best = ended, Blur(WIDEST * float(found.point[-1]), light)
        return best

    def _residuals(self, light: bool, u: Point) -> Point | None:
        """Residuals of params and, as a share of `WIDEST`, the blur."""
        drawn = self.finer if light else self.problem
        found, blur = drawn.pictures(u[:-1]), Blur(WIDEST * float(u[-1]), light)
        if found is None:
            return None
        times = drawn.canvas[0] // self.problem.canvas[0]
        return self.problem.residuals([blurred(one, blur, times) for one in found])
