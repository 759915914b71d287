"""The framed renderer's network: an LSTM per sample that meets each object in the object's own frame.

Letters: B streams, N objects, P points, C = `code`, F = `features`, S = `state`, G = `decoder_width`,
L = `paint_lines`. Distances are in world units, leaf coordinates in leaf units.

For a point and an object the frame gives the point's leaf coordinates exactly (`frames.py`). Two learned
parts then draw:

1. The decoder turns leaf coordinates into F distance-like features. Its weights are a linear function of
   the object's code, so that shapes live in codes: swap two codes and the shapes swap. It has rectified
   linear units, which represent straight edges exactly, and its output is multiplied by the object's
   distance scale.
2. The cell is an LSTM (Hochreiter and Schmidhuber 1997) whose gates are clamped lines in what it is shown
   and what it remembers, chosen by the boolean token. A part of it is a register that carries the colour
   under one gate of its own, so that colour is kept, not re-learned.

No pixel looks at another and nothing here knows a leaf, an operator or a resolution.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import asdict, dataclass
from typing import Any

import torch
from torch import Tensor, nn

TOKENS = 4
EMPTY = 1.0  # world units: the margin before the first object, out of reach of every blend
RADIUS = 2.0  # leaf units: the decoder sees points in this disc, farther ones at its rim


@dataclass(frozen=True, slots=True)
class FramedConfig:
    """Sizes of the network.

    Args:
        code: entries of the geometry code.
        material_code: entries of the material code.
        features: distance-like features F of an object at a point.
        state: entries S of the LSTM state.
        decoder_width: hidden units of the decoder's two layers.
        paint_lines: lines L of which the highest opens the register's gate.
    """

    code: int = 4
    material_code: int = 12
    features: int = 1
    state: int = 1
    decoder_width: int = 32
    paint_lines: int = 2

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


class Framed(nn.Module):
    """Parameters and step functions of the framed renderer.

    Args:
        config: sizes.
        geometries: number of geometry codes.
        materials: number of material codes.
    """

    def __init__(self, config: FramedConfig, geometries: int, materials: int) -> None:
        super().__init__()
        self.config = c = config
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
        self.far = nn.Parameter(torch.ones(c.features))  # growth of the features beyond the rim
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

    # ------------------------------------------------------------------ weights for objects

    def decoder_weights(self, code: Tensor) -> list[tuple[Tensor, Tensor]]:
        """Decoder layers of objects: [(M, in, out), (M, out)] * 3 from codes (M, C)."""
        one = torch.cat([code, torch.ones_like(code[:, :1])], 1)  # (M, C + 1)
        return [
            (torch.einsum("mc,cab->mab", one, w), one @ b)
            for w, b in zip(self.decoder_w, self.decoder_b, strict=True)
        ]

    def cell_weights(self) -> tuple[Tensor, ...]:
        """Parameters of the cell, each with tokens in front: lines, biases, candidate, bump.

        The steeper a gate, the lower its bump, so that what a blend adds shrinks as it narrows.
        """
        gain = self.cell_gain.exp()
        bump = self.bump / gain[:, : self.config.state]
        return self.cell_lines * gain[:, None], self.cell_bias, self.candidate.clamp(-1.0, 1.0), bump

    def object_albedo(self, material_code: Tensor) -> Tensor:
        """Albedo (M, 3) of material codes (M, material_code)."""
        albedo: Tensor = material_code @ self.albedo[:-1] + self.albedo[-1]
        return albedo

    # ------------------------------------------------------------------ network

    def decode(self, q: Tensor, scale: Tensor, layers: list[tuple[Tensor, Tensor]]) -> Tensor:
        """Features (M, P, F) of leaf coordinates.

        Args:
            q: leaf coordinates (M, P, 2).
            scale: distance scale (M,): world distance per leaf distance.
            layers: from `decoder_weights`.
        """
        radius = torch.linalg.vector_norm(q, dim=-1, keepdim=True)  # (M, P, 1)
        x = q * (RADIUS / radius.clamp_min(RADIUS))
        for i, (w, b) in enumerate(layers):
            x = torch.baddbmm(b[:, None], x, w)  # (M, P, G), last (M, P, F)
            if i < 2:
                x = torch.relu_(x) if not torch.is_grad_enabled() else torch.relu(x)
        x = x + (radius - RADIUS).clamp_min(0.0) * self.far
        features: Tensor = x * scale[:, None, None]
        return features

    def step(
        self,
        features: Tensor,
        state: Tensor,
        colour: Tensor,
        object_colour: Tensor,
        weights: tuple[Tensor, ...],
    ) -> tuple[Tensor, Tensor]:
        """One object: the LSTM cell and the register.

        Args:
            features: (B, P, F).
            state: (B, P, S).
            colour: the register (B, P, 3).
            object_colour: (B, 1, 3).
            weights: lines (B, F + S, S + L), biases (B, S + L), candidate (B, F, S), bump (B, S).
        """
        lines, bias, candidate, bump = weights
        levels = torch.baddbmm(bias[:, None], torch.cat([features, state], -1), lines)  # (B, P, S + L)
        return self.update(levels, features @ candidate, bump, state, colour, object_colour)

    def update(
        self,
        levels: Tensor,
        candidate: Tensor,
        bump: Tensor,
        state: Tensor,
        colour: Tensor,
        object_colour: Tensor,
    ) -> tuple[Tensor, Tensor]:
        """State and register behind the gates.

        Args:
            levels: of the gates before they are clamped (B, P, S + L).
            candidate: what the state becomes where its gate is open (B, P, S).
            bump: by how much a half-open gate lowers the state, times four (B, S), or (B, P, S).
            state, colour, object_colour: as `step` takes them.
        """
        take = levels[..., : self.config.state].clamp(0.0, 1.0)
        paint = levels[..., self.config.state :].amax(-1, keepdim=True).clamp(0.0, 1.0)
        bump = bump[:, None] if bump.dim() < take.dim() else bump
        state = state + take * (candidate - state) - bump * take * (1 - take)
        return state, colour + paint * (object_colour - colour)

    def trace(
        self,
        q: Tensor,
        scale: Tensor,
        code: Tensor,
        colours: Tensor,
        tokens: Tensor,
        given: tuple[Tensor, Tensor] | None = None,
    ) -> Trace:
        """Run streams for training, keeping what the image of every prefix shows.

        Args:
            q: leaf coordinates (B, N, P, 2).
            scale: (B, N).
            code: (B, N, C).
            colours: (B, N, 3).
            tokens: (B, N), int64.
            given: exact distance (B, N, P) and colour (B, N, P, 3) after every object, from which each
                step then starts in place of its own answers (teacher forcing, Williams and Zipser 1989).
        """
        b, n, p, _ = q.shape
        layers = self.decoder_weights(code.reshape(b * n, -1))
        features = self.decode(q.reshape(b * n, p, 2), scale.reshape(-1), layers).view(b, n, p, -1)
        weights = self.cell_weights()
        state = torch.zeros(b, p, self.config.state, dtype=q.dtype, device=q.device)
        state[..., 0] = EMPTY
        colour = torch.zeros(b, p, 3, dtype=q.dtype, device=q.device)
        margins, shown = [], []
        for i in range(n):
            t = tokens[:, i]
            if given is not None and i > 0:
                state = torch.cat([given[0][:, i - 1, :, None], state[..., 1:]], -1)
                colour = given[1][:, i - 1]
            state, colour = self.step(
                features[:, i], state, colour, colours[:, i, None], tuple(w[t] for w in weights)
            )
            margins.append(state[..., 0])
            shown.append(colour)
        return Trace(
            distance=features[..., 0],
            alone=features[..., 0] * self.edge_slope.exp(),
            depth=torch.stack(margins, 1),
            margin=torch.stack(margins, 1) * self.read_slope.exp(),
            colour=torch.stack(shown, 1),
        )


@dataclass(slots=True)
class Trace:
    """What `Framed.trace` returns.

    Args:
        distance: first feature of each object, world units (B, N, P).
        alone: the same as a logit against the object alone covering the point.
        depth: first entry of the state after each object, world units (B, N, P).
        margin: the same as a logit against coverage after each object.
        colour: register after each object (B, N, P, 3).
    """

    distance: Tensor
    alone: Tensor
    depth: Tensor
    margin: Tensor
    colour: Tensor
