"""The paper's reading renderer: every pixel reads the scene several times by itself.

Source: Granskog, Schnabel, Rousselle, Novák, *Neural Scene Graph Rendering*, ACM TOG 40(4), 2021, section 5.
Fourier features after Tancik et al. 2020; gated recurrent unit after Cho et al. 2014.

Letters: B scenes, N objects, P points, D = d_g + d_m numbers of an object, H = `hidden`, L = `octaves`.

A pixel has a state. In a read, a GRU looks at each object from that state; the answers are pooled over the
objects by their maximum, so that a read does not depend on their number or order; a second GRU makes the
next state of the pooled answer. After the last read a linear layer gives the colour. Boolean operators
depend on the order, so each object comes with its token and its place in the stream, which the paper's
unions do not need.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn.functional import one_hot

from scenelang.words import TOKENS


@dataclass(frozen=True, slots=True)
class ReadingConfig:
    """Sizes of the network.

    Args:
        vector: numbers D of an object.
        hidden: entries H of both states.
        reads: how often a pixel reads the scene.
        octaves: frequencies L of the Fourier features, π to 2^(L - 1) π per world unit.
    """

    vector: int = 64
    hidden: int = 128
    reads: int = 8
    octaves: int = 6


def fourier_features(points: Tensor, octaves: int) -> Tensor:
    """Points (…, 2) in world units to (…, 2 + 4 L): themselves, sines and cosines."""
    octave = torch.arange(octaves, dtype=points.dtype, device=points.device)
    angles = points[..., None] * (math.pi * 2.0**octave)  # (…, 2, L)
    return torch.cat([points, angles.sin().flatten(-2), angles.cos().flatten(-2)], -1)


class Reading(nn.Module):
    """Parameters and forward pass of the reading renderer."""

    def __init__(self, config: ReadingConfig) -> None:
        super().__init__()
        self.config = config
        place = 2 + 4 * config.octaves
        self.start = nn.Parameter(torch.zeros(config.hidden))
        # The first GRU's input is linear in position and object, so the two are multiplied apart: a
        # pixel's part once, an object's part once, instead of both for every pair.
        self.look_place = nn.Linear(place, 3 * config.hidden)
        self.look_object = nn.Linear(config.vector + len(TOKENS) + 1, 3 * config.hidden, bias=False)
        self.look_state = nn.Linear(config.hidden, 3 * config.hidden)
        self.next = nn.GRUCell(config.hidden, config.hidden)
        self.head = nn.Linear(config.hidden, 3)

    def forward(self, vectors: Tensor, tokens: Tensor, points: Tensor, count: Tensor | None = None) -> Tensor:
        """Colours (B, P, 3) at points.

        Args:
            vectors: (B, N, D).
            tokens: (B, N), int64.
            points: (B, P, 2), world units.
            count: (B,) objects in use; the others are not pooled.
        """
        b, n, _ = vectors.shape
        order = torch.arange(n, device=vectors.device, dtype=vectors.dtype) / 4
        marks = one_hot(tokens, len(TOKENS)).to(vectors.dtype)
        objects = torch.cat([vectors, marks, order.expand(b, n)[..., None]], -1)  # (B, N, D + 5)
        seen = self.look_object(objects)  # (B, N, 3 H)
        where = self.look_place(fourier_features(points, self.config.octaves))  # (B, P, 3 H)
        unused = None
        if count is not None:
            unused = torch.arange(n, device=vectors.device) >= count[:, None]  # (B, N)
        state = self.start.expand(b, points.shape[1], -1)  # (B, P, H)
        for _ in range(self.config.reads):
            state = self._read(state, where, seen, unused)
        colour: Tensor = self.head(state)
        return colour

    def _read(self, state: Tensor, where: Tensor, seen: Tensor, unused: Tensor | None) -> Tensor:
        """One read: every object from the state, the maximum over objects, the next state."""
        from_state = self.look_state(state)  # (B, P, 3 H)
        pooled = torch.full_like(state, -math.inf)
        rs, zs, ns = from_state.chunk(3, -1)
        for i in range(seen.shape[1]):
            ri, zi, ni = (where + seen[:, i, None]).chunk(3, -1)
            reset, keep = (ri + rs).sigmoid(), (zi + zs).sigmoid()
            answer = torch.lerp((ni + reset * ns).tanh(), state, keep)  # (B, P, H)
            if unused is not None:
                answer = answer.masked_fill(unused[:, i, None, None], -math.inf)
            pooled = torch.maximum(pooled, answer)
        b, p, h = state.shape
        after: Tensor = self.next(pooled.reshape(b * p, h), state.reshape(b * p, h))
        return after.view(b, p, h)
