"""Training samples of leaves in space: lengths of random half rays."""

from __future__ import annotations

import torch
from torch import Tensor

from scenelang.compiler.geometries import GEOMETRIES
from scenelang.drawing.arrays_torch import TORCH
from scenelang.drawing.solid.network import folded
from scenelang.language import words

LEAVES = (*words.LEAVES[3],)


def _directions(count: int, g: torch.Generator) -> Tensor:
    return torch.nn.functional.normalize(torch.randn((count, 3), generator=g))


def half_rays(leaf: str, count: int, g: torch.Generator, cells: int = 128) -> tuple[Tensor, Tensor]:
    """Half rays as `folded` has them (5, 6 count), six each on a line, and lengths (6 count,) of the leaf."""
    p = _directions(count, g) * torch.rand((count, 1), generator=g) ** (1 / 3)
    way = _directions(count, g)
    middle = -(p * way).sum(1, keepdim=True)
    half = (middle.square() - p.square().sum(1, keepdim=True) + 1).clip(0.0).sqrt()
    t = middle + half * torch.linspace(-1, 1, cells + 1)  # (count, cells + 1)
    line = p.T[..., None] + way.T[..., None] * t
    depth = GEOMETRIES[leaf].distance(line.reshape(3, -1)).view_as(t)
    a, b = depth[:, :-1], depth[:, 1:]
    share = torch.where(a < 0, torch.where(b < 0, 1.0, a / (a - b)), torch.where(b < 0, b / (b - a), 0.0))
    rest = (share * 2 * half / cells).flip(1).cumsum(1).flip(1)  # from each point on
    first = torch.randint(0, cells, (count, 6), generator=g)
    first[:, :2] = 0
    q = p.T[..., None] + way.T[..., None] * t.gather(1, first)
    told = folded(TORCH, q.reshape(3, -1), way.T[..., None].expand_as(q).reshape(3, -1))
    return told, rest.gather(1, first).reshape(-1)
