"""What a frame will take: a sum over what a scene has, scaled to this machine."""

from __future__ import annotations

import statistics
import time
from typing import Final

import numpy as np
import torch

from scenelang.measure.frontier import Cost
from scenelang.program.work import Load

UNITS: Final = (1.0, 1e3, 1e6, 1e6, 1e3)
YARDSTICK_ROUNDS: Final = 15


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
