"""Programs drawn by the paper's renderers, which paint over white and know no outlines.

`streaming` draws the whole canvas at once, at the one size it was trained for. `reading` answers samples,
four a pixel as the language defines.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor

from scenelang.image import from_samples
from scenelang.program.groups import OPERATOR
from scenelang.program.program import Program, ProgramError
from scenelang.renderers.draw import Drawing
from scenelang.renderers.reading import Reading
from scenelang.renderers.streaming import Streaming

TILE = 1 << 13  # samples that `reading` answers at a time


@torch.no_grad()
def draw_whole(
    network: Streaming | Reading, program: Program, *, progress: Callable[[float], None] | None = None
) -> Drawing:
    """Draw a Program's objects in stream order.

    Raises:
        ProgramError: the canvas or the background is one that the network was not trained for.
    """
    if program.background is None or min(program.background) < 1.0:
        raise ProgramError("this model draws on white only")
    if (program.tokens > OPERATOR).any():
        raise ProgramError("this model draws no groups")
    width, height = program.canvas
    if not len(program):
        return Drawing(from_samples(np.ones((height, width, 3), np.float32), None), 0, 0, 0)
    device = next(network.parameters()).device
    v = torch.from_numpy(program.vectors.copy())[None].to(device)
    t = torch.from_numpy(program.tokens.astype(np.int64))[None].to(device)
    if isinstance(network, Streaming):
        side = network.config.resolution
        if program.canvas != (side, side):
            raise ProgramError(f"this model draws {side} x {side} pixels, not {width} x {height}")
        found = network(v, t)[0].permute(1, 2, 0)
        pairs = len(program) * side * side
    else:
        found = _sampled(network, v, t, width, height, progress)
        pairs = len(program) * 4 * width * height
    if progress is not None:
        progress(1.0)
    picture = found.clamp(0.0, 1.0).cpu().numpy()
    return Drawing(from_samples(np.ascontiguousarray(picture), None), pairs, 0, width * height)


def _sampled(
    network: Reading, v: Tensor, t: Tensor, width: int, height: int, progress: Callable[[float], None] | None
) -> Tensor:
    """Means (H, W, 3) of the four samples of every pixel."""
    px = 2 / min(width, height)  # world units
    quarter = torch.tensor([-0.25, 0.25], dtype=torch.float64)
    x = ((torch.arange(width, dtype=torch.float64)[:, None] + 0.5 + quarter - width / 2) * px).to(v)
    y = ((height / 2 - 0.5 - torch.arange(height, dtype=torch.float64)[:, None] + quarter) * px).to(v)
    rows = max(1, TILE // (4 * width))
    parts = []
    for top in range(0, height, rows):
        band = y[top : top + rows]  # (rows, 2)
        across, down = x[None, :, None, :], band[:, None, :, None]
        grid = torch.stack([across + 0 * down, down + 0 * across], -1)  # (rows, W, 2, 2, 2)
        shape = grid.shape[:2]
        colours = network(v, t, grid.reshape(1, -1, 2))[0]
        parts.append(colours.view(*shape, 4, 3).mean(2))
        if progress is not None:
            progress(min(1.0, (top + rows) / height))
    return torch.cat(parts)
