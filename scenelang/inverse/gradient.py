"""How soft pictures change with params: differences of Programs, then reverse passes through the picture.

Differences of pictures cost a compilation and a picture for each number. Here a few compilations and one soft
picture with its derivatives do, however many numbers there are. Elements, textures, media and axes along
which objects come or go are left to differences.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.inverse.rates import Rates, numbers_of
from scenelang.inverse.space import Point, Space
from scenelang.inverse.target import WHITE, Picture
from scenelang.program.program import Program


class Change(NamedTuple):
    """A soft picture and how it changes.

    Args:
        picture: (H, W, 3), sRGB-encoded.
        slopes: (H, W, 3, n), by params, in shares of their ranges.
        known: (n,) of which there are slopes; those of others are 0.
    """

    picture: Picture
    slopes: npt.NDArray[np.float64]
    known: npt.NDArray[np.bool_]


class Changes:
    """Soft pictures of a scene with their derivatives.

    Args:
        program: what draws the scene of a point, None where there is none.
        space: the params.
        under: sRGB-encoded, behind what is transparent.
        exact: whether differences of Programs are central, and all else in float64.
    """

    def __init__(
        self,
        program: Callable[[Point], Program | None],
        space: Space,
        under: tuple[float, float, float] = WHITE,
        exact: bool = False,
    ) -> None:
        self.program, self.under, self.exact = program, under, exact
        self.rates = Rates(program, space)

    def at(self, u: Point) -> Change | None:
        """The change at a point, None where there is no picture, or one with elements, textures or media."""
        import torch

        from scenelang.inverse.plane import SoftPlane
        from scenelang.inverse.solids import SoftSolids

        program = self.program(u)
        if program is None or not softens(program):
            return None
        kind = SoftPlane if program.stage is None else SoftSolids
        soft = kind(program, self.under, torch.float64 if self.exact else torch.float32)
        if not soft.opaque:
            return None
        rates, known = self.rates.at(u, program, self.exact)
        picture, slopes = soft(numbers_of(program), rates)
        return Change(picture.astype(np.float64), slopes.astype(np.float64), known)


def softens(program: Program) -> bool:
    """Whether there are derivatives of a Program's soft picture."""
    return len(program) > 0 and not program.elements and not program.palette and not program.extended
