"""Codes: a few learned numbers for each thing, and one network, shared by all of them, that decodes them.

An auto-decoder (Park et al., *DeepSDF*, CVPR 2019): codes and network are trained together on the things
themselves. The network answers points; it is told their coordinates by sines and cosines of random
frequencies (Tancik et al. 2020) and the code in front of its first layer.
"""

from __future__ import annotations

import math
import time
from itertools import pairwise
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn

WIDTH: Final = 128  # of each of three hidden layers
WAVES: Final = 64  # frequencies
POINTS: Final = 1024  # of a step
BLOCK: Final = 65536  # points that are decoded at a time
RATE: Final = 3e-3  # of Adam at first; a cosine takes it to 0

Array = npt.NDArray[np.float32]


class Decoder(nn.Module):
    """The network and the codes.

    Args:
        things: how many have a code.
        d: numbers of a code.
        axes: of a point.
        channels: of an answer.
        pitch: standard deviation of the frequencies, in waves over [-1, 1].
    """

    def __init__(self, things: int, d: int, axes: int, channels: int, pitch: float) -> None:
        super().__init__()
        self.codes = nn.Parameter(torch.randn(things, d))
        self.register_buffer("waves", math.pi * (pitch * torch.randn(axes, WAVES)).round())
        sizes = (2 * WAVES + d, WIDTH, WIDTH, WIDTH)
        layers = [(nn.Linear(a, b), nn.ReLU()) for a, b in pairwise(sizes)]
        self.layers = nn.Sequential(*(part for pair in layers for part in pair), nn.Linear(WIDTH, channels))

    def forward(self, which: Tensor, at: Tensor) -> Tensor:
        """Answers (M, channels) of things (M,) at points (M, axes)."""
        angle = at @ self.get_buffer("waves")
        found: Tensor = self.layers(torch.cat([angle.sin(), angle.cos(), self.codes[which]], 1))
        return found


def decoded(
    true: Array, d: int, seed: int, seconds: float, *, pitch: float, reach: float = math.inf
) -> tuple[Array, dict[str, Any]]:
    """What codes of d numbers and their decoder give of things, after training on them.

    Args:
        true: (things, *nodes, channels), values at points of [-1, 1]^axes.
        seconds: of processor time.
        pitch: as of `Decoder`.
        reach: half of the points have all values within ± this, which all values are clamped to.

    Returns:
        The like of ``true``, and what it took.
    """
    torch.manual_seed(seed)
    things, nodes, channels = len(true), true.shape[1:-1], true.shape[-1]
    values = torch.from_numpy(true.reshape(things, -1, channels)).clamp(-reach, reach)
    axes = [(torch.arange(n) + 0.5) * (2 / n) - 1 for n in nodes]
    points = torch.stack(torch.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(nodes))
    near = torch.nonzero((values.abs() < reach).all(2))
    decoder = Decoder(things, d, len(nodes), channels, pitch)
    adam = torch.optim.Adam(decoder.parameters(), RATE)
    started, steps = time.process_time(), 0
    while (spent := (time.process_time() - started) / seconds) < 1:
        adam.param_groups[0]["lr"] = RATE * (1 + math.cos(math.pi * spent)) / 2
        which, node = near[torch.randint(len(near), (POINTS,))].T.clone()
        half = POINTS // 2
        which[half:], node[half:] = torch.randint(things, (half,)), torch.randint(len(points), (half,))
        off = decoder(which, points[node]) - values[which, node]
        loss = off.square().mean() if reach == math.inf else off.abs().mean()
        adam.zero_grad()
        loss.backward()
        adam.step()
        steps += 1
    with torch.no_grad():
        blocks = torch.split(points, BLOCK)
        found = [
            torch.cat([decoder(torch.full((len(p),), i), p) for p in blocks]).reshape(*nodes, channels)
            for i in range(things)
        ]
    numbers = sum(p.numel() for p in decoder.layers.parameters())
    said = {"seconds": round(seconds, 1), "steps": steps, "shared": numbers}
    return torch.stack(found).clamp(-reach, reach).numpy(), said
