"""Whole pictures or windows of them, of every prefix of a stream: exact ones, and what `streaming` draws.

A window is exactly the part of the whole picture that it shows, but for what the cell of the ConvLSTM sees
beyond its edges, where there is nothing, as beyond a canvas.

Letters: B scenes, N objects, M = B N, R pixels along a side, W of a window, F filters.
"""

from __future__ import annotations

import math
from typing import Any

import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d, one_hot, pad

from lab.designs.pictures import SceneBatch, trace_exactly
from lab.designs.students import StreamingStudent
from scenelang.language.words import TOKENS

NEAR = 0.4  # world units: how far from an object's middle a window's middle may lie


def windows(scenes: SceneBatch, side: int, window: int, g: torch.Generator) -> Tensor:
    """Upper left corners (B, 2), row and column, multiples of 4: three of four near an object."""
    b, n = scenes.leaf.shape
    which = torch.randint(0, n, (b,), generator=g)
    middle = scenes.affine[torch.arange(b), which, :2, 3]  # x, y
    middle = middle + (torch.rand((b, 2), generator=g) * 2 - 1) * NEAR
    middle = torch.stack([-middle[:, 1], middle[:, 0]], 1) / 2 + 0.5  # down, across, in shares of the canvas
    anywhere = torch.rand((b, 2), generator=g)
    middle = torch.where(torch.rand((b, 1), generator=g) < 0.25, anywhere, middle)
    return ((middle * side - window / 2) / 4).round().clamp(0, (side - window) // 4).long() * 4


def grid(b: int, side: int, corner: Tensor | None = None, window: int = 0) -> tuple[Tensor, Tensor]:
    """World coordinates x, y (B, 4 W W) of the samples of windows, two by two a pixel, row by row."""
    w = 2 * (window or side)
    at = (torch.arange(w) + 0.5) / side - 1  # samples lie half a pixel apart
    down = across = at.expand(b, w)
    if corner is not None:
        down, across = (at + 2 / side * corner[:, k, None] for k in (0, 1))
    x = across[:, None, :].expand(b, w, w).reshape(b, -1)
    return x, -down[:, :, None].expand(b, w, w).reshape(b, -1)


@torch.no_grad()
def prefixes(scenes: SceneBatch, x: Tensor, y: Tensor, w: int) -> Tensor:
    """Exact pictures (B, N, 3, W, W) over white of all prefixes, of samples as `grid` gives them."""
    steps = trace_exactly(scenes, x, y)[1]
    shown = [torch.where((d < 0)[..., None], c.expand(*d.shape, 3), 1.0) for d, c in steps]
    b, n = scenes.leaf.shape
    colours = torch.stack(shown, 1).view(b * n, 2 * w, 2 * w, 3).permute(0, 3, 1, 2)
    return avg_pool2d(colours, 2).view(b, n, 3, w, w)


def maps(
    student: StreamingStudent, scenes: SceneBatch, side: int, corner: Tensor | None, window: int
) -> Tensor:
    """Feature maps (B, N, F, W, W) of the objects, in windows or whole."""
    vectors = student.lifting.lift(scenes)
    x = vectors.reshape(-1, vectors.shape[2], 1, 1)
    steps = int(math.log2(side))
    corners = None if corner is None else corner.repeat_interleave(vectors.shape[1], 0)
    for k, layer in enumerate(student.renderer.deconvolutions[:steps]):
        if corners is not None and k == steps - 2:  # what two layers make a window of
            x = cut(x, corners // 4 - 1, window // 4 + 2)
        x = torch.relu(layer(x))
        if corners is not None and k == steps - 2:
            x = x[..., 1:-1, 1:-1]
            x = x * inside(corners // 2 - 1, x.shape[-1], side // 2)[:, None]
    if corners is not None:
        x = x[..., 2:-2, 2:-2]
    return x.reshape(*vectors.shape[:2], *x.shape[1:])


def draw(student: StreamingStudent, scenes: SceneBatch, side: int, found: Tensor) -> Tensor:
    """Pictures of all prefixes (B, N, 3, W, W) by the student, from the result of `maps`."""
    level: Any = student.renderer.stages[str(side)]
    marks = one_hot(scenes.tokens, len(TOKENS)).float()
    stacked = torch.stack(level.states(found, marks), 1).flatten(0, 1)
    image: Tensor = level.pixels(stacked.contiguous(memory_format=torch.channels_last))
    return image.view(*found.shape[:2], *image.shape[1:])


def cut(maps: Tensor, corner: Tensor, window: int) -> Tensor:
    """Windows (M, F, W, W) of maps (M, F, R, R); up to a pixel outside, where there are zeros."""
    wide = pad(maps, (1, 1, 1, 1)).permute(0, 2, 3, 1)
    span = torch.arange(window) + 1
    rows, columns = corner[:, 0, None] + span, corner[:, 1, None] + span
    at = torch.arange(len(maps))[:, None, None]
    return wide[at, rows[:, :, None], columns[:, None, :]].permute(0, 3, 1, 2)


def inside(corner: Tensor, window: int, side: int) -> Tensor:
    """Mask (M, W, W) of the windows' pixels that lie on a canvas."""
    at = corner[..., None] + torch.arange(window)  # (M, 2, W)
    on = (at >= 0) & (at < side)
    return on[:, 0, :, None] & on[:, 1, None, :]
