"""What drawing a Program takes: a few numbers that a frame's time is a sum of."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from scenelang.models.framed import load_arrays
from scenelang.program.program import Program
from scenelang.renderers.draw import draw_objects

PROBE: Final = 16
"""Pixels along a side of a picture of as many pixels that solids are drawn in, to count evaluations."""


@dataclass(frozen=True, slots=True)
class Load:
    """What a frame's time depends on.

    Args:
        objects: rows of the Program.
        pixels: of the canvas.
        meetings: pixels within objects' bounds, summed over objects; of solids, evaluations of the network.
        outline: pixels around those bounds, summed likewise; of solids, evaluations for a pixel times pixels
            of the canvas's shorter side, as outlines and shadows grow with both.
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
    """The load of a compiled scene: in the plane from its bounds, of solids from a very small picture.

    How far rays go near solids, and how many of them meet the light, bounds do not tell.

    Raises:
        ModelError: the weights of a model of solids are missing.
    """
    width, height = program.canvas
    if program.stage is not None:
        scale = PROBE / (width * height) ** 0.5
        small = replace(program, canvas=(max(1, round(width * scale)), max(1, round(height * scale))))
        drawn = draw_objects(load_arrays(program.model, program.weights).network, small, samples="one")
        each = drawn.pairs / drawn.met  # of a pixel
        return Load(len(program), width * height, each * width * height, each * min(width, height))
    unit = min(width, height) / 2  # pixels of a world unit
    half = np.array([width, height], np.float64) / 2
    corners = np.clip(program.bounds.astype(np.float64).reshape(-1, 2, 2) * unit, -half, half)
    size = corners[:, 1] - corners[:, 0]  # (N, 2)
    outline = np.minimum(2 * size.sum(1), 2 * half.sum())
    return Load(len(program), width * height, float(size.prod(1).sum()), float(outline.sum()))
