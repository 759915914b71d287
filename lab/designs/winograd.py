"""Convolutions of 5 x 5 by fewer multiplications, which halve a step's time on a processor.

Source: Lavin, Gray, *Fast Algorithms for Convolutional Neural Networks*, CVPR 2016. A tile of 4 x 4 results
is had from 8 x 8 inputs by polynomial products (Toom, Cook): both factors are evaluated at seven points and
at infinity along each axis, and multiplied there.

Letters: M pictures, R pixels along a side, n = R / 4 tiles, C channels in and K out.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import pad

POINTS = (0.0, 1.0, -1.0, 2.0, -2.0, 0.5, -0.5)
TILES = 128  # transformed at a time, which stay in the cache


def _transforms() -> tuple[Tensor, Tensor, Tensor]:
    """Matrices of inputs (64, 64), of a kernel (64, 25) and of results (16, 64), over both axes."""

    def values(degree: int) -> Any:
        powers = np.vander(POINTS, degree, increasing=True)
        return np.vstack([powers, np.eye(degree)[-1:]])

    inputs = np.linalg.inv(values(8)).T
    size = np.abs(inputs).max(1, keepdims=True)  # the same magnitude everywhere, for single precision
    parts = inputs / size, values(5) * size, values(4).T
    whole = [torch.from_numpy(np.kron(m, m)).float() for m in parts]
    return whole[0], whole[1], whole[2]


INPUTS, KERNEL, RESULTS = _transforms()


class _Convolve(torch.autograd.Function):
    """Pictures (M, R, R, C) and kernel (K, C, 5, 5) to (16, M, n, n, K), a tile's pixels first."""

    @staticmethod
    def forward(ctx: Any, x: Tensor, kernel: Tensor) -> Tensor:
        m, r, _, c = x.shape
        n, k = r // 4, len(kernel)
        factor = (KERNEL @ kernel.permute(2, 3, 1, 0).reshape(25, -1)).view(64, c, k)
        wide = pad(x, (0, 0, 2, 2, 2, 2)).contiguous()
        across = wide.stride()
        tiles = wide.as_strided(
            (8, 8, m, n, n, c), (across[1], across[2], across[0], 4 * across[1], 4 * across[2], 1)
        )
        seen, result = x.new_empty(64, m, n * n, c), x.new_empty(16, m, n, n, k)
        for at in _parts(m, n):
            part = (INPUTS @ tiles[:, :, at].reshape(64, -1)).view(64, -1, c)
            seen[:, at] = part.view(64, -1, n * n, c)
            result[:, at] = (RESULTS @ torch.bmm(part, factor).view(64, -1)).view(16, -1, n, n, k)
        ctx.save_for_backward(seen, factor)
        return result

    @staticmethod
    def backward(ctx: Any, g: Tensor) -> tuple[Tensor, Tensor]:
        seen, factor = ctx.saved_tensors
        (m, n), (_, c, k) = g.shape[1:3], factor.shape
        back, of_factor = factor.transpose(1, 2).contiguous(), torch.zeros_like(factor)
        wide = g.new_zeros(m, n + 1, 4, n + 1, 4, c)
        tiles = wide.permute(2, 4, 0, 1, 3, 5)
        for at in _parts(m, n):
            part = (RESULTS.T @ g[:, at].reshape(16, -1)).view(64, -1, k)
            of_factor.baddbmm_(seen[:, at].reshape(64, -1, c).transpose(1, 2), part)
            of_tiles = (INPUTS.T @ torch.bmm(part, back).view(64, -1)).view(2, 4, 2, 4, -1, n, n, c)
            for a in (0, 1):
                for b in (0, 1):
                    tiles[:, :, at, a : a + n, b : b + n] += of_tiles[a, :, b]
        of_x = wide.view(m, 4 * n + 4, 4 * n + 4, c)[:, 2:-2, 2:-2]
        return of_x, (KERNEL.T @ of_factor.view(64, -1)).view(5, 5, c, k).permute(3, 2, 0, 1)


def _parts(m: int, n: int) -> list[slice]:
    step = max(1, TILES // n**2)
    return [slice(first, first + step) for first in range(0, m, step)]


class Winograd(nn.Conv2d):
    """The convolution of 5 x 5 that it is told to be, for pictures whose sides are multiples of four."""

    def __init__(self, like: nn.Conv2d) -> None:
        super().__init__(like.in_channels, like.out_channels, 5, padding=2)
        self.weight, self.bias = like.weight, like.bias

    def forward(self, x: Tensor) -> Tensor:
        m, _, r, _ = x.shape
        assert self.bias is not None
        tiles: Tensor = _Convolve.apply(x.permute(0, 2, 3, 1), self.weight)  # type: ignore[no-untyped-call]
        whole = tiles.view(4, 4, m, r // 4, r // 4, -1).permute(2, 3, 0, 4, 1, 5).reshape(m, r, r, -1)
        return (whole + self.bias).permute(0, 3, 1, 2)
