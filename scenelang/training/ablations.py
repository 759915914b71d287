"""The `framed` renderer without one of its parts at a time, to see what each part buys.

Each network here derives from the shipped one and has one thing taken away. None of them ships, and the
shipped renderer knows nothing of them. `ablation_runs` lists the study: the same data, budget, rate and
seed for all.

Letters: B streams, N objects, P points, F features, S state, K cell width, as in `renderers/framed.py`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import torch
from torch import Tensor, nn

from scenelang.lifting import exact
from scenelang.renderers.framed import TOKENS, Framed, FramedConfig, Trace, gate, sharpen
from scenelang.training.pictures import Scenes
from scenelang.training.scenes import GEOMETRIES
from scenelang.training.students import FramedStudent, StudentConfig
from scenelang.training.studies import StudyConfig

RATE = 3e-3
MEMORY = 8  # entries of the state that may learn to hold a colour where no register does
SEEDS = 3  # of the whole renderer: differences below their spread mean nothing

SIZES: Mapping[str, tuple[int, ...]] = {
    "decoder_width": (8, 16, 32, 64),
    "code": (1, 2, 4, 8),
    "state": (1, 4),
    "cell_width": (4, 8, 16),
}
"""Values of each field of `FramedConfig` that are tried, the shipped one among them."""

LABELS = {"decoder_width": "decoder", "code": "code size", "state": "state", "cell_width": "cell"}


def _lines(seen: Tensor, plain: Tensor, *weights: Tensor) -> Tensor:
    """Outputs of the cell's two layers before any gate, as in `Framed.step`.

    Args:
        seen: what the hidden layer sees (B, P, inputs).
        plain: what goes to the outputs by lines alone (B, P, F + S).
        weights: w1, b1, w2, skip, b2 of each stream's token, B in front.
    """
    w1, b1, w2, skip, b2 = weights
    hidden = torch.relu(torch.baddbmm(b1[:, None], seen, w1))  # (B, P, K)
    return torch.baddbmm(torch.baddbmm(b2[:, None], plain, skip), hidden, w2)


class WithoutRegister(Framed):
    """Colour lies in the LSTM's state, by learned candidates and gates, and is read out by a learned map."""

    def __init__(self, config: FramedConfig, geometries: int, materials: int) -> None:
        super().__init__(replace(config, state=config.state + MEMORY), geometries, materials)
        s = self.config.state
        self.from_colour = nn.Parameter(torch.randn(TOKENS, 3, s) / math.sqrt(3))
        self.readout = nn.Parameter(torch.randn(s, 3) / math.sqrt(MEMORY))
        self.readout_b = nn.Parameter(torch.zeros(3))

    def cell_weights(self) -> tuple[Tensor, ...]:
        return (*super().cell_weights(), self.from_colour)

    def step(
        self,
        features: Tensor,
        state: Tensor,
        colour: Tensor,
        object_colour: Tensor,
        weights: tuple[Tensor, ...],
    ) -> tuple[Tensor, Tensor]:
        *layers, candidate, bump, from_colour = weights
        plain = torch.cat([features, state], -1)
        take = gate(_lines(sharpen(plain), plain, *layers))[..., :-1]  # (B, P, S); the last gate is unused
        new = torch.bmm(features, candidate) + torch.bmm(object_colour, from_colour)
        state = state + take * (new - state) - bump[:, None] * take * (1 - take)
        return state, state @ self.readout + self.readout_b


class WithoutScale(Framed):
    """The cell gets distances in leaf units: they are not multiplied by the object's distance scale."""

    def decode(self, q: Tensor, scale: Tensor, layers: list[tuple[Tensor, Tensor]]) -> Tensor:
        return super().decode(q, torch.ones_like(scale), layers)

    def trace(self, q: Tensor, scale: Tensor, code: Tensor, colours: Tensor, tokens: Tensor) -> Trace:
        found = super().trace(q, scale, code, colours, tokens)
        found.distance = found.distance * scale[..., None]  # the loss asks for world units
        return found


class TokenAsInput(Framed):
    """The cell has one set of weights for all tokens, and the token's one-hot vector as a further input.

    As an input a one-hot vector is a bias for each token. What the token chose elsewhere, the candidate and
    the bump, are outputs of the same two layers.
    """

    def __init__(self, config: FramedConfig, geometries: int, materials: int) -> None:
        super().__init__(config, geometries, materials)
        f, s, k = config.features, config.state, config.cell_width
        outputs = (s + 1) + s + s  # gates, candidate, bump
        del self.candidate, self.bump
        skip = torch.zeros(1, f + s, outputs)
        skip[:, :f, s + 1 : 2 * s + 1] = torch.rand(1, f, s) - 0.5
        bias = torch.zeros(TOKENS, outputs)
        bias[:, : s + 1] = 0.5
        self.cell_w1 = nn.Parameter(self.cell_w1[:1].detach().clone())
        self.cell_w2 = nn.Parameter(torch.randn(1, k, outputs) / math.sqrt(k))
        self.cell_skip, self.cell_b2 = nn.Parameter(skip), nn.Parameter(bias)

    def cell_weights(self) -> tuple[Tensor, ...]:
        w1, w2, skip = (w.expand(TOKENS, -1, -1) for w in (self.cell_w1, self.cell_w2, self.cell_skip))
        return w1, self.cell_b1, w2, skip, self.cell_b2

    def step(
        self,
        features: Tensor,
        state: Tensor,
        colour: Tensor,
        object_colour: Tensor,
        weights: tuple[Tensor, ...],
    ) -> tuple[Tensor, Tensor]:
        plain = torch.cat([features, state], -1)
        s = self.config.state
        outputs = _lines(sharpen(plain), plain, *weights)  # (B, P, 3 S + 1)
        gates, new, bump = gate(outputs[..., : s + 1]), outputs[..., s + 1 : 2 * s + 1], outputs[..., -s:]
        take, paint = gates[..., :-1], gates[..., -1:]
        state = state + take * (new - state) - bump * take * (1 - take)
        return state, colour + paint * (object_colour - colour)


class WithoutSharpening(Framed):
    """The cell's hidden layer sees features and state as they are, not their signs at several sharpnesses."""

    def __init__(self, config: FramedConfig, geometries: int, materials: int) -> None:
        super().__init__(config, geometries, materials)
        inputs = config.features + config.state
        self.cell_w1 = nn.Parameter(torch.randn(TOKENS, inputs, config.cell_width) * math.sqrt(2 / inputs))

    def step(
        self,
        features: Tensor,
        state: Tensor,
        colour: Tensor,
        object_colour: Tensor,
        weights: tuple[Tensor, ...],
    ) -> tuple[Tensor, Tensor]:
        *layers, candidate, bump = weights
        plain = torch.cat([features, state], -1)
        gates = gate(_lines(plain, plain, *layers))
        take, paint = gates[..., :-1], gates[..., -1:]
        new = torch.bmm(features, candidate)
        state = state + take * (new - state) - bump[:, None] * take * (1 - take)
        return state, colour + paint * (object_colour - colour)


class NoRegister(FramedStudent):
    """See `WithoutRegister`."""

    network = WithoutRegister


class NoScale(FramedStudent):
    """See `WithoutScale`."""

    network = WithoutScale


class SharedCell(FramedStudent):
    """See `TokenAsInput`."""

    network = TokenAsInput


class NoSharpening(FramedStudent):
    """See `WithoutSharpening`."""

    network = WithoutSharpening


class NoFrame(FramedStudent):
    """The decoder meets points of the world, and all 32 numbers of the geometry vector choose its weights.

    Numbers that choose weights can do all that numbers beside the point can, as biases are weights too.
    """

    def __init__(self, config: StudentConfig) -> None:
        super().__init__(replace(config, framed=replace(config.framed, code=exact.D_G)))

    @property
    def leaves_first(self) -> bool:
        return False  # a leaf alone, in its own space, is what this one never sees

    def read(self, g: Tensor, scenes: Scenes, x: Tensor, y: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        b, n = scenes.leaf.shape
        world = torch.stack([x, y], -1)[:, None].expand(b, n, -1, 2)
        return world, torch.ones_like(g[..., 0]), g


class PicturesAlone(FramedStudent):
    """Nothing asks for distances: the loss is of colour and coverage, which pictures show."""

    unasked = frozenset({"shape", "depth"})


class OtherCodes(FramedStudent):
    """Codes of any size, beside the vectors, whose layout holds four numbers."""

    def __init__(self, config: StudentConfig) -> None:
        super().__init__(config)
        self.table = nn.Parameter(torch.randn(len(GEOMETRIES), config.framed.code))

    @property
    def leaf_codes(self) -> Tensor:
        return self.table

    def read(self, g: Tensor, scenes: Scenes, x: Tensor, y: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        q, scale, _ = super().read(g, scenes, x, y)
        return q, scale, self.table[scenes.leaf]


VARIANTS: Mapping[str, type[FramedStudent]] = {
    "no register": NoRegister,
    "no distance scale": NoScale,
    "no frame": NoFrame,
    "token as input": SharedCell,
    "no sharpened inputs": NoSharpening,
    "pictures alone": PicturesAlone,
    "code": OtherCodes,
}


def ablation_runs(budget_s: float, seed: int) -> list[tuple[str, str, StudyConfig]]:
    """The study: (name, group, what is trained) of the whole renderer, of all variants and of all sizes.

    The whole renderer stands for the shipped value of every size.

    Args:
        budget_s: processor seconds of each.
        seed: of parameters and scenes; the whole renderer is trained with the two after it as well.
    """
    whole = StudyConfig(StudentConfig("framed", "exact"), seconds=budget_s, rate=RATE, seed=seed)
    runs = [("framed", "whole", replace(whole, seed=seed + i)) for i in range(SEEDS)]
    runs += [
        (name, "parts", replace(whole, student=replace(whole.student, variant=name)))
        for name in VARIANTS
        if name != "code"
    ]
    shipped = FramedConfig()
    for size, values in SIZES.items():
        for value in values:
            if value == getattr(shipped, size):
                continue
            sizes = FramedConfig(**{**shipped.to_json(), size: value})
            student = replace(whole.student, framed=sizes, variant="code" if size == "code" else "")
            runs.append((f"{LABELS[size]} {value}", size, replace(whole, student=student)))
    return runs
