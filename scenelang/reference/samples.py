"""Where the exact pictures are sampled."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def sample_points(
    canvas: tuple[int, int], rows: range, per_side: int, columns: range | None = None
) -> npt.NDArray[np.float64]:
    """World coordinates (2, M) of the samples of some pixel rows and columns, row by row of samples."""
    width, height = canvas
    unit = min(width, height) / 2
    columns = columns or range(width)
    x = ((np.arange(columns.start * per_side, columns.stop * per_side) + 0.5) / per_side - width / 2) / unit
    fine = np.arange(rows.start * per_side, rows.stop * per_side)
    y = (height / 2 - (fine + 0.5) / per_side) / unit
    return np.stack([np.tile(x, len(y)), np.repeat(y, len(x))])
