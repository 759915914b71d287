"""Several targets at once: pictures of frames of an animation, whose params are the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from scenelang.inverse.problem import LEVELS, Matrix, Problem
from scenelang.inverse.space import Point
from scenelang.inverse.target import Blur, Picture, blurred
from scenelang.program.program import Program

EDGE: Final = 2 ** (LEVELS - 1)  # of what the last level has means of, pixels
GRAIN: Final = 2.0  # times the variance of means that noise has
BLURS: Final = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)  # pixels
SOFTER: Final = 0.98  # share of the error that is left where a target is out of focus


class Together:
    """How far the pictures of some frames are from their targets.

    Args:
        parts: a frame each, of one size.
    """

    def __init__(self, parts: Sequence[Problem]) -> None:
        self.parts, self.canvas = tuple(parts), parts[0].canvas

    def __call__(self, u: Point) -> Point | None:
        """Residuals (R,), whose squares add up to the mean of what those of the frames add up to."""
        found = self.pictures(u)
        return None if found is None else self.residuals(found, self.parts[0].levels)

    def pixels(self, u: Point) -> Point | None:
        """Residuals of pixels alone."""
        found = self.pictures(u)
        return None if found is None else self.residuals(found)

    def pictures(self, u: Point) -> list[Picture] | None:
        """Of each frame, None where values give no scene."""
        return _known([part.picture(u) for part in self.parts])

    def drawn(self, programs: Sequence[Program | None]) -> list[Picture] | None:
        """The pictures of a Program for each frame."""
        return _known([part.drawn(one) for part, one in zip(self.parts, programs, strict=True)])

    def residuals(self, pictures: Sequence[Picture], levels: int = 1) -> Point:
        """Residuals of pictures, at so many levels of the pyramid."""
        gaps = [part.residuals(one, levels) for part, one in zip(self.parts, pictures, strict=True)]
        return np.asarray(np.concatenate(gaps) / np.sqrt(len(gaps)))

    def slopes(self, u: Point) -> tuple[Matrix, npt.NDArray[np.bool_]] | None:
        """As `Problem.slopes`, of the axes that all frames have them of."""
        found = [part.slopes(u) for part in self.parts]
        known = [one for one in found if one is not None]
        if len(known) < len(found):
            return None
        rows = np.concatenate([slopes for slopes, _ in known]) / np.sqrt(len(known))
        return rows, np.all([axes for _, axes in known], 0)

    def worst(self, pictures: Sequence[Picture]) -> tuple[str, Picture]:
        """Errors (H, W) of the picture that is farthest off, and which frame it is of several."""
        gaps = [
            np.square((one - part.colours) * part.root).sum(2)
            for part, one in zip(self.parts, pictures, strict=True)
        ]
        at = int(np.argmax([gap.sum() for gap in gaps]))
        return f" of frame {self.parts[at].moment.frame}" * (len(gaps) > 1), gaps[at]

    def noise(self, u: Point, blur: Blur = Blur()) -> bool:  # noqa: B008
        """Whether what is left of pictures after a blur is like noise.

        Means over 8 x 8 pixels of that have a 64th of its variance.
        """
        pixels = means = 0.0
        for part, picture in zip(self.parts, self.pictures(u) or (), strict=False):
            left = np.square(part.residuals(blurred(picture, blur), LEVELS))
            pixels += float(left[: picture.size].sum())
            means += float(left[-3 * math.prod(-(-side // EDGE) for side in self.canvas) :].sum())
        return bool(means * EDGE**2 <= GRAIN * pixels)

    def finer(self) -> Together:
        """The same with pictures of which light can be averaged: of the plane twice as large."""
        return Together([part.finer() for part in self.parts])

    def blur(self, pictures: Sequence[Picture]) -> float:
        """By how many pixels (standard deviation) pictures have to be blurred to be nearer; 0 if not."""
        best, found = SOFTER, 0.0
        for sigma in BLURS:
            left = self.residuals([blurred(one, Blur(sigma)) for one in pictures])
            share = float(left @ left) / max(1e-12, float(np.square(self.residuals(pictures)).sum()))
            if share < best:
                best, found = share, sigma
        return found

    @property
    def frames(self) -> int:
        """Pictures that were drawn so far."""
        return sum(part.frames for part in self.parts)


def _known(pictures: Sequence[Picture | None]) -> list[Picture] | None:
    known = [one for one in pictures if one is not None]
    return known if len(known) == len(pictures) else None
