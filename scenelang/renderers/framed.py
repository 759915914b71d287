"""The framed renderer's network: an LSTM per sample that meets each object in the object's own frame.

Letters: B streams, N objects, P points, C = `code`, F = `features`, S = `state`, G = `decoder_width`,
K = `cell_width`. Distances are in world units, leaf coordinates in leaf units.

For a point and an object the frame gives the point's leaf coordinates exactly (`frames.py`). Two learned
parts then draw:

1. The decoder turns leaf coordinates into F distance-like features. Its weights are a linear function of
   the object's code, so that shapes live in codes: swap two codes and the shapes swap. It has rectified
   linear units, which represent straight edges exactly, and its output is multiplied by the object's
   distance scale.
2. The cell is an LSTM (Hochreiter and Schmidhuber 1997) whose gates are clamped lines and whose weights
   are chosen by the boolean token. A part of it is a register that carries the colour under one gate of
   its own, so that colour is kept, not re-learned.

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
SHARPEN = (16.0, 256.0, 4096.0)  # per world unit: slopes at which signs are shown to the cell
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
        cell_width: hidden units in front of the gates.
    """

    code: int = 4
    material_code: int = 12
    features: int = 1
    state: int = 1
    decoder_width: int = 32
    cell_width: int = 16

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


class _Clamp(torch.autograd.Function):
    """clamp(x, 0, 1) whose gradient outside the interval is let through by a tenth, inward only."""

    @staticmethod
    def forward(ctx: Any, x: Tensor) -> Tensor:
        ctx.save_for_backward(x)
        return x.clamp(0.0, 1.0)

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> Tensor:
        x: Tensor = ctx.saved_tensors[0]
        inside = (x >= 0) & (x <= 1)
        inward = ((x < 0) & (grad < 0)) | ((x > 1) & (grad > 0))
        return grad * (inside.to(grad.dtype) + 0.1 * inward.to(grad.dtype))


def gate(x: Tensor) -> Tensor:
    """A saturating gate: clamp(x, 0, 1), trainable from outside the interval."""
    if torch.is_grad_enabled() and x.requires_grad:
        clamped: Tensor = _Clamp.apply(x)  # type: ignore[no-untyped-call]
        return clamped
    return x.clamp(0.0, 1.0)


def sharpen(x: Tensor) -> Tensor:
    """x and its sign at several sharpnesses side by side: (…, n) -> (…, n (1 + len(SHARPEN)))."""
    return torch.cat([x, *((x * s).clamp(-1.0, 1.0) for s in SHARPEN)], -1)


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

        inputs = (c.features + c.state) * (1 + len(SHARPEN))
        self.cell_w1 = nn.Parameter(torch.randn(TOKENS, inputs, c.cell_width) * math.sqrt(2 / inputs))
        self.cell_b1 = nn.Parameter(torch.randn(TOKENS, c.cell_width) * 0.1)
        self.cell_w2 = nn.Parameter(torch.randn(TOKENS, c.cell_width, c.state + 1) / math.sqrt(c.cell_width))
        self.cell_skip = nn.Parameter(torch.zeros(TOKENS, c.features + c.state, c.state + 1))
        self.cell_b2 = nn.Parameter(torch.full((TOKENS, c.state + 1), 0.5))
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
        """Parameters of the cell, each with tokens in front."""
        candidate = self.candidate.clamp(-1.0, 1.0)
        return self.cell_w1, self.cell_b1, self.cell_w2, self.cell_skip, self.cell_b2, candidate, self.bump

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
            weights: w1 (B, F + S, K), b1 (B, K), w2 (B, K, 3 S + 1), b2 (B, 3 S + 1).
        """
        w1, b1, w2, skip, b2, candidate, bump = weights
        seen = sharpen(torch.cat([features, state], -1))
        hidden = torch.relu(torch.baddbmm(b1[:, None], seen, w1))  # (B, P, K)
        lines = torch.baddbmm(b2[:, None], seen[..., : skip.shape[1]], skip)
        gates = gate(torch.baddbmm(lines, hidden, w2))  # (B, P, S + 1)
        take, paint = gates[..., :-1], gates[..., -1:]
        new = torch.bmm(features, candidate)  # (B, P, S)
        state = state + take * (new - state) - bump[:, None] * take * (1 - take)
        return state, colour + paint * (object_colour - colour)

    def trace(self, q: Tensor, scale: Tensor, code: Tensor, colours: Tensor, tokens: Tensor) -> Trace:
        """Run streams for training, keeping what the image of every prefix shows.

        Args:
            q: leaf coordinates (B, N, P, 2).
            scale: (B, N).
            code: (B, N, C).
            colours: (B, N, 3).
            tokens: (B, N), int64.
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
