"""What a frame will take: a sum over what a scene has, scaled to this machine."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass
from typing import Final

import numpy as np
import torch

from scenelang.measure.frontier import Cost
from scenelang.program.program import Program

UNITS: Final = (1.0, 1e3, 1e6, 1e6, 1e3)
YARDSTICK_ROUNDS: Final = 15


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


def predicted_ms(cost: Cost, load: Load, skip: bool) -> float:
    """Milliseconds of a frame on the machine that was measured, most likely; times `Cost.spread` at most."""
    terms = (cost.frame, cost.thousand_objects, cost.megapixel, cost.megameeting, cost.outline)
    return sum(t * v / unit for t, v, unit in zip(terms, load.row(skip), UNITS, strict=True))


@torch.no_grad()
def yardstick() -> float:
    """Milliseconds of a fixed piece of work like that of a frame, on one core: small products, cosines, sums.

    The ratio of two machines' yardsticks is what times are scaled by. Takes about 50 ms.
    """
    g = torch.Generator().manual_seed(1)
    x, w = torch.randn(32, 4096, generator=g), torch.randn(32, 32, generator=g) / 6
    b = torch.zeros(32, 1)
    plain = np.linspace(-1, 1, 1 << 15)
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    times = []
    try:
        for _ in range(YARDSTICK_ROUNDS):
            started = time.thread_time()
            y = x
            for _ in range(4):
                y = torch.addmm(b, w, y).relu_()
            _ = y[:8].cos().mul_(y[8:16]).sum()
            _ = np.cos(np.hypot(plain, 0.5)) * plain
            times.append(1000 * (time.thread_time() - started))
    finally:
        torch.set_num_threads(before)
    return statistics.median(times[YARDSTICK_ROUNDS // 3 :])
