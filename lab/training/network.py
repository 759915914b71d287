"""The plane's network in training: where it starts, its loss's trace, and the parameters of its parts.

Letters are those of `scenelang.drawing.neural.network`; P is M here.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from scenelang.drawing.arrays import Array
from scenelang.drawing.neural.load import Framed
from scenelang.drawing.neural.network import EMPTY, TOKENS, FramedConfig


@dataclass(slots=True)
class StreamTrace:
    """Distances, states and colours after each object, from `Trainee.trace`."""

    distance: Tensor  # first feature of each object, world units (B, N, P)
    alone: Tensor  # as a logit against the object alone covering the point
    depth: Tensor  # first entry of the state after each object, world units (B, N, P)
    margin: Tensor  # as a logit against coverage after each object
    colour: Tensor  # register after each object (B, N, P, 3)


class Trainee(Framed):
    """The framed renderer with parameters to begin training with."""

    def __init__(self, config: FramedConfig, geometries: int, materials: int) -> None:
        with torch.random.fork_rng(devices=[]):
            super().__init__(config, geometries, materials)
        c = config
        self.codes = nn.Parameter(torch.randn(geometries, c.code))
        self.material_codes = nn.Parameter(torch.randn(materials, c.material_code))
        # albedo from the material code; one constant value a material
        self.albedo = nn.Parameter(torch.randn(c.material_code + 1, 3) * 0.1)

        sizes = [2, c.decoder_width, c.decoder_width, c.features]
        fan = math.sqrt(c.code + 1)
        # decoder: weight i is codes1 @ decoder_w[i], where codes1 = [code, 1]
        self.decoder_w = nn.ParameterList(
            nn.Parameter(torch.randn(c.code + 1, a, b) * math.sqrt(2 / a) / fan)
            for a, b in itertools.pairwise(sizes)
        )
        self.decoder_b = nn.ParameterList(
            nn.Parameter((torch.rand(c.code + 1, b) * 2 - 1) / fan) for b in sizes[1:]
        )
        self.far = nn.Parameter(torch.ones(c.features))
        self.edge_slope = nn.Parameter(torch.tensor(math.log(50.0)))

        rows = c.state + c.paint_lines
        self.cell_lines = nn.Parameter(torch.randn(TOKENS, c.features + c.state, rows) * 0.3)
        # a logarithm: the gate of a union is a thousand times as steep as what it starts from
        self.cell_gain = nn.Parameter(torch.zeros(TOKENS, rows))
        self.cell_bias = nn.Parameter(torch.full((TOKENS, rows), 0.5))
        self.candidate = nn.Parameter(torch.rand(TOKENS, c.features, c.state) - 0.5)
        self.bump = nn.Parameter(torch.zeros(TOKENS, c.state))
        self.read_slope = nn.Parameter(torch.tensor(math.log(20.0)))

    def parts(self) -> tuple[list[nn.Parameter], list[nn.Parameter]]:
        """Parameters of the decoder (with the geometry codes) and all others, for the optimiser."""
        decoder = [self.codes, self.far, *self.decoder_w, *self.decoder_b]
        known = {id(p) for p in decoder}
        return decoder, [p for p in self.parameters() if id(p) not in known]

    def step(
        self, features: Array, state: Array, colour: Array, object_colour: Array, weights: tuple[Array, ...]
    ) -> tuple[Array, Array]:
        """One object: the LSTM cell on features (…, F, M) and state (…, S, M), and the register (…, R, M)."""
        lines, bias, candidate, bump = weights
        levels = self.xp.dense(self.xp.concat([features, state], -2), lines, bias)  # (…, S + L, M)
        return self.update(levels, candidate @ features, bump, state, colour, object_colour)

    def trace(
        self,
        q: Tensor,
        scale: Tensor,
        code: Tensor,
        colours: Tensor,
        tokens: Tensor,
        given: tuple[Tensor, Tensor] | None = None,
    ) -> StreamTrace:
        """Run streams for training, keeping what the image of every prefix shows.

        Leaf coordinates q are (B, N, d, P), scale and tokens (B, N), codes (B, N, C), colours (B, N, 3). Each
        step starts from ``given`` exact distance (B, N, P) and colour (B, N, P, 3), if any, in place of its
        own answers (teacher forcing, Williams and Zipser 1989).
        """
        b, n, d, p = q.shape
        decoder = self.decoder_weights(code.reshape(b * n, -1))
        q = q.reshape(b * n, d, p)
        features = self.decode(
            q, self.xp.length(q.unbind(1))[:, None], scale.reshape(-1, 1, 1), decoder
        ).view(b, n, -1, p)
        weights = self.cell_weights()
        state = torch.zeros(b, self.config.state, p, dtype=q.dtype, device=q.device)
        state[:, 0] = EMPTY
        colour = torch.zeros(b, 3, p, dtype=q.dtype, device=q.device)
        depth, shown = [], []
        for i in range(n):
            t = tokens[:, i]
            if given is not None and i > 0:
                state = torch.cat([given[0][:, i - 1, None], state[:, 1:]], 1)
                colour = given[1][:, i - 1].mT
            state, colour = self.step(
                features[:, i], state, colour, colours[:, i, :, None], tuple(w[t] for w in weights)
            )
            depth.append(state[:, 0])
            shown.append(colour.mT)
        return StreamTrace(
            distance=features[:, :, 0],
            alone=features[:, :, 0] * self.edge_slope.exp(),
            depth=torch.stack(depth, 1),
            margin=torch.stack(depth, 1) * self.read_slope.exp(),
            colour=torch.stack(shown, 1),
        )
