"""How a Program's numbers change with params: differences of evaluation and compilation, without a picture.

Params that change different numbers are moved together, so that a scene of many params is compiled about as
often as one object has params (Curtis, Powell and Reid 1974).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from scenelang.inverse.space import Point, Space
from scenelang.lifting.vector import LAYOUTS
from scenelang.program.groups import SMOOTH
from scenelang.program.program import Program
from scenelang.renderers.field import BLEND

Floats = npt.NDArray[np.float64]
STEP: Final = 1e-3  # of differences, shares of a range: vectors are rounded to float32


def numbers_of(program: Program) -> Floats:
    """Numbers (K,) of a Program that a picture changes smoothly with: vectors by row, then the background."""
    at = LAYOUTS[2 if program.stage is None else 3].places.width
    vectors = program.vectors.astype(np.float64)
    vectors[:, at] = np.where((program.tokens == SMOOTH) & (vectors[:, at] <= 0), BLEND, vectors[:, at])
    return np.concatenate([vectors.reshape(-1), program.background or (0.0, 0.0, 0.0)])


def alike(a: Program, b: Program) -> bool:
    """Whether two Programs differ in their numbers alone."""
    tables = all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("tokens", "forms", "worn"))
    plain = (a.background is None) == (b.background is None)
    named = (a.model, a.objects, a.elements, a.palette) == (b.model, b.objects, b.elements, b.palette)
    return tables and plain and named


class Rates:
    """Derivatives of a Program's numbers.

    Args:
        program: what draws the scene of a point, None where there is none.
        space: the params.
    """

    def __init__(self, program: Callable[[Point], Program | None], space: Space) -> None:
        self.program, self.space = program, space
        self._moved: dict[int, npt.NDArray[np.bool_]] = {}  # (K,) which numbers an axis changes

    def at(self, u: Point, here: Program) -> tuple[Floats, npt.NDArray[np.bool_]]:
        """Derivatives (K, n) at a point, in shares of ranges, and of which axes (n,) they are known.

        Those of choices are not, nor those of axes along which objects come or go.

        Args:
            here: the point's Program.
        """
        base = numbers_of(here)
        found, known = np.zeros((len(base), len(u))), np.zeros(len(u), bool)
        if any(len(mask) != len(base) for mask in self._moved.values()):
            self._moved = {}
        groups = self._groups(len(base))
        while groups:
            group = groups.pop()
            change = self._change(u, here, base, group)
            masks = [self._moved.get(axis, np.ones(len(base), bool)) for axis in group]
            if len(group) > 1 and (change is None or change[0][~np.any(masks, 0)].any()):
                groups += [[axis] for axis in group]  # more has changed than did so far
                continue
            for axis, mask in zip(group, masks, strict=True):
                if change is not None:
                    column = change[0] * mask if len(group) > 1 else change[0]
                    found[:, axis], known[axis] = column / change[1][axis], True
                    self._moved[axis] = self._moved.get(axis, False) | (column != 0)
        return found, known

    def _groups(self, count: int) -> list[list[int]]:
        """Continuous axes, those together that are known to change different numbers."""
        groups: list[tuple[list[int], npt.NDArray[np.bool_]]] = []
        for axis in np.flatnonzero(self.space.smooth).tolist():
            mask = self._moved.get(axis, np.ones(count, bool))
            for group, taken in groups:
                if not (taken & mask).any():
                    group.append(axis)
                    taken |= mask
                    break
            else:
                groups.append(([axis], mask.copy()))
        return [group for group, _ in groups]

    def _change(self, u: Point, here: Program, base: Floats, axes: list[int]) -> tuple[Floats, Point] | None:
        """By how much numbers (K,) change as axes move, and by how much these do (n,)."""
        for way in (1.0, -1.0):
            moved = u.copy()
            moved[axes] += way * np.where((u[axes] + way * STEP > 1.0) & ~self.space.wraps[axes], -STEP, STEP)
            end = self.space.inside(moved)
            program = self.program(end)
            if program is not None and alike(here, program):
                width = end - self.space.inside(u)
                change = numbers_of(program) - base
                return change, np.where(self.space.wraps, (width + 0.5) % 1.0 - 0.5, width)
        return None
