"""How much there is to draw in a Program of the plane, counted from its rows and bounds alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenelang.program.program import Program


@dataclass(frozen=True, slots=True)
class Load:
    """What a frame's time depends on.

    Args:
        objects: rows of the Program.
        pixels: of the canvas.
        meetings: pixels within objects' bounds, summed over objects.
        outline: pixels around those bounds, summed likewise.
    """

    objects: int
    pixels: int
    meetings: float
    outline: float

    def row(self, skip: bool) -> tuple[float, float, float, float, float]:
        """The terms of the sum; without skipping every object meets every pixel."""
        meetings = self.meetings if skip else float(self.objects * self.pixels)
        return 1.0, float(self.objects), float(self.pixels), meetings, self.outline


def load_of(program: Program) -> Load:
    """The load of a compiled scene."""
    width, height = program.canvas
    unit = min(width, height) / 2  # pixels of a world unit
    half = np.array([width, height], np.float64) / 2
    corners = np.clip(program.bounds.astype(np.float64).reshape(-1, 2, 2) * unit, -half, half)
    size = corners[:, 1] - corners[:, 0]  # (N, 2)
    outline = np.minimum(2 * size.sum(1), 2 * half.sum())
    return Load(len(program), width * height, float(size.prod(1).sum()), float(outline.sum()))
