"""The cost of a frame as a sum, fitted to measured frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from scenelang.drawing.work import Load
from scenelang.output.frontier import UNITS, Cost

ROUNDS = 20  # of weights


def fit_cost(loads: Sequence[Load], ms: Sequence[float], skip: bool, *, fixed: bool = False) -> Cost:
    """The sum nearest to measured frames, by the least sum of (guess - ms)² / (guess ms), reweighted.

    ``skip``: objects meet only pixels in their reach. ``fixed``: only objects count, on one canvas.
    """
    rows = np.array([load.row(skip) for load in loads]) / UNITS
    if fixed:
        rows[:, 2:] = 0.0
    elif len({load.pixels for load in loads}) == 1:
        rows[:, :2] = 0.0
    if not skip:
        rows[:, 4] = 0.0
    times = np.maximum(np.asarray(ms, np.float64), 1e-6)  # a clock may stand still
    guess = times
    for _ in range(ROUNDS):
        weight = 1 / np.sqrt(guess * times)
        result = _at_least_zero(rows * weight[:, None], times * weight)
        guess = np.maximum(rows @ result, 1e-9)
    spread = max(1.0, float(np.percentile(times / guess, 95)))
    frame, objects, pixels, meetings, outline = result.tolist()
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
    result = np.zeros(a.shape[1])
    result[used] = x / size[used]
    return result
