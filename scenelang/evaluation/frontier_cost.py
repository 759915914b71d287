"""What a frame will take: a sum over what a scene has, fitted to measured frames, scaled to this machine."""

from __future__ import annotations

import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
import torch

from scenelang.evaluation.frontier import Cost
from scenelang.program.program import Program

_UNITS: Final = (1.0, 1e3, 1e6, 1e6, 1e3)
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
    return sum(t * v / unit for t, v, unit in zip(terms, load.row(skip), _UNITS, strict=True))


def fit_cost(loads: Sequence[Load], ms: Sequence[float], skip: bool, *, fixed: bool = False) -> Cost:
    """The sum that comes nearest to measured frames, by relative error.

    Args:
        loads: of the frames.
        ms: what they took.
        skip: whether objects meet only the pixels in their reach.
        fixed: the canvas is always the same, so that only objects count. Where it may change but only one
            was measured, everything is taken to grow with its pixels.
    """
    rows = np.array([load.row(skip) for load in loads]) / _UNITS
    if fixed:
        rows[:, 2:] = 0.0
    elif len({load.pixels for load in loads}) == 1:
        rows[:, :2] = 0.0
    if not skip:
        rows[:, 4] = 0.0
    times = np.maximum(np.asarray(ms, np.float64), 1e-6)  # a clock may stand still
    found = _at_least_zero(rows / times[:, None], np.ones(len(times)))
    guess = np.maximum(rows @ found, 1e-9)
    spread = max(1.0, float(np.percentile(times / guess, 95)))
    frame, objects, pixels, meetings, outline = found.tolist()
    return Cost(frame, objects, pixels, meetings, outline, spread)


def _at_least_zero(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Least squares with coefficients of at least 0, by cyclic coordinate descent on scaled columns."""
    size = np.sqrt(np.square(a).sum(0))
    used = size > 0
    scaled = a[:, used] / size[used]
    gram, aim = scaled.T @ scaled, scaled.T @ b
    x = np.zeros(len(aim))
    for _ in range(5000):
        before = x.copy()
        for i in range(len(x)):
            x[i] = max(0.0, x[i] + aim[i] - gram[i] @ x)  # the diagonal of the Gram matrix is 1
        if np.abs(x - before).max(initial=0.0) < 1e-12:
            break
    found = np.zeros(a.shape[1])
    found[used] = x / size[used]
    return found


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
