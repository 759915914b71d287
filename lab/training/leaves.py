"""Training samples of leaves in space: distances of random points, lengths of random half rays."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from scenelang.compiler.geometries import GEOMETRIES
from scenelang.drawing.arrays_torch import TORCH
from scenelang.drawing.solid.network import RADIUS, folded
from scenelang.language import words

LEAVES = (*words.LEAVES[3],)


@dataclass(frozen=True, slots=True)
class Points:
    """Points on and around a leaf."""

    q: Tensor  # (P, 3)
    distance: Tensor  # exact (P,)
    gradient: Tensor  # of it (P, 3)
    weight: Tensor  # of the errors of distance and gradient (P, 4)


def leaf_points(leaf: str, count: int, g: torch.Generator, kind: torch.dtype) -> Points:
    """Half of the points near the surface at all scales, a quarter in its ball, a quarter farther out."""
    row = GEOMETRIES[leaf]
    assert row.surface is not None
    near = torch.stack(row.surface(torch.rand((2, count // 2), generator=g)), 1)
    near = near + torch.randn(near.shape, generator=g) * 10 ** (
        2.5 * torch.rand((len(near), 1), generator=g) - 3.5
    )
    far = _directions(count - len(near), g) * torch.rand((count - len(near), 1), generator=g) ** (1 / 3)
    far[::2] *= 1.3
    far[1::2] *= RADIUS
    q = torch.cat([near, far]).to(kind).requires_grad_()
    with torch.enable_grad():
        distance = row.distance(q.T)
        (gradient,) = torch.autograd.grad(distance.sum(), q)
    distance = distance.detach()
    by_value = torch.where(distance < -0.15, 0.2, 1.0) / (distance.abs() + 0.02)
    by_gradient = 0.003 / (distance.square() + 0.01)
    # next to a centre there is no gradient
    bent = gradient.isnan().any(1) | (distance < -0.45 * row.thickness)
    by_gradient = torch.where(bent, 0.0, by_gradient)
    weight = torch.cat([by_value[:, None], by_gradient[:, None].expand(-1, 3)], 1)
    return Points(q.detach(), distance, gradient.nan_to_num(), weight)


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
