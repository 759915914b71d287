"""The `framed` renderer without one of its parts at a time, to see what each part buys.

Each network here derives from the shipped one and has one thing taken away. None of them ships, and the
shipped renderer knows nothing of them. `experiments/runs.py` lists the study.

Letters: B streams, N objects, P points, F features, S state, L lines of the paint gate, as in
`renderers/network.py`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import torch
from torch import Tensor, nn

from scenelang.lab.designs.pictures import Scenes, stretch
from scenelang.lab.designs.students import (
    FramedStudent,
    ReadingStudent,
    StreamingStudent,
    Student,
    StudentConfig,
)
from scenelang.lifting.vector import PLANE_LAYOUT
from scenelang.renderers.framed import Framed, Trace
from scenelang.renderers.network import TOKENS, FramedConfig
from scenelang.training.scenes import GEOMETRIES

HIDDEN = 16  # units of the hidden layer that the cell had
MEMORY = 8  # entries of the state that may learn to hold a colour where no register does


class WithoutRegister(Framed):
    """Colour lies in the LSTM's state, by learned candidates and gates, and is read out by a learned map."""

    def __init__(self, config: FramedConfig, geometries: int, materials: int) -> None:
        super().__init__(replace(config, state=config.state + MEMORY), geometries, materials)
        s = self.config.state
        self.from_colour = nn.Parameter(torch.randn(TOKENS, 3, s) / math.sqrt(3))
        self.readout = nn.Parameter(torch.randn(s, 3) / math.sqrt(MEMORY))
        self.readout_b = nn.Parameter(torch.zeros(3))

    def cell_weights(self) -> tuple[Tensor, ...]:
        return (*super().cell_weights(), self.from_colour.mT)

    def step(
        self,
        features: Tensor,
        state: Tensor,
        colour: Tensor,
        object_colour: Tensor,
        weights: tuple[Tensor, ...],
    ) -> tuple[Tensor, Tensor]:
        lines, bias, candidate, bump, from_colour = weights
        levels = self.xp.dense(torch.cat([features, state], 1), lines, bias)
        new = candidate @ features + from_colour @ object_colour
        state, _ = self.update(levels, new, bump, state, colour, object_colour)  # its gate is unused
        return state, self.readout.T @ state + self.readout_b[:, None]


class TokenAsInput(Framed):
    """The cell has one set of weights for all tokens, and the token's one-hot vector as a further input.

    As an input a one-hot vector is a bias for each token. What the token chose elsewhere, the candidate and
    the bump, are outputs of the same lines.
    """

    def __init__(self, config: FramedConfig, geometries: int, materials: int) -> None:
        super().__init__(config, geometries, materials)
        f, s, gates = config.features, config.state, config.state + config.paint_lines
        del self.candidate, self.bump
        lines = torch.zeros(1, f + s, gates + s + s)  # gates, candidate, bump
        lines[..., :gates] = self.cell_lines[:1].detach()
        lines[:, :f, gates : gates + s] = torch.rand(1, f, s) - 0.5
        bias = torch.zeros(TOKENS, gates + s + s)
        bias[:, :gates] = 0.5
        self.cell_lines, self.cell_bias = nn.Parameter(lines), nn.Parameter(bias)
        self.cell_gain = nn.Parameter(torch.zeros(1, gates + s + s))

    def cell_weights(self) -> tuple[Tensor, ...]:
        lines = self.cell_lines * self.cell_gain.exp()[:, None]
        return lines.mT.expand(TOKENS, -1, -1), self.cell_bias

    def step(
        self,
        features: Tensor,
        state: Tensor,
        colour: Tensor,
        object_colour: Tensor,
        weights: tuple[Tensor, ...],
    ) -> tuple[Tensor, Tensor]:
        lines, bias = weights
        outputs = self.xp.dense(torch.cat([features, state], 1), lines, bias)
        s = self.config.state
        return self.update(
            outputs[:, : -2 * s], outputs[:, -2 * s : -s], outputs[:, -s:], state, colour, object_colour
        )


class WithHiddenLayer(Framed):
    """The gates also see a hidden layer of rectified linear units, as those of the first cell did."""

    def __init__(self, config: FramedConfig, geometries: int, materials: int) -> None:
        super().__init__(config, geometries, materials)
        inputs, rows = config.features + config.state, config.state + config.paint_lines
        self.cell_w1 = nn.Parameter(torch.randn(TOKENS, inputs, HIDDEN) * math.sqrt(2 / inputs))
        self.cell_b1 = nn.Parameter(torch.randn(TOKENS, HIDDEN) * 0.1)
        self.cell_w2 = nn.Parameter(torch.randn(TOKENS, HIDDEN, rows) / math.sqrt(HIDDEN))

    def cell_weights(self) -> tuple[Tensor, ...]:
        return (*super().cell_weights(), self.cell_w1.mT, self.cell_b1, self.cell_w2.mT)

    def step(
        self,
        features: Tensor,
        state: Tensor,
        colour: Tensor,
        object_colour: Tensor,
        weights: tuple[Tensor, ...],
    ) -> tuple[Tensor, Tensor]:
        lines, bias, candidate, bump, w1, b1, w2 = weights
        plain = torch.cat([features, state], 1)
        hidden = self.xp.dense(plain, w1, b1).relu()  # (B, HIDDEN, P)
        levels = self.xp.dense(plain, lines, bias) + w2 @ hidden
        return self.update(levels, candidate @ features, bump, state, colour, object_colour)


class NoScale(FramedStudent):
    """The cell gets distances in leaf units: they are not multiplied by the object's distance scale."""

    def read(self, g: Tensor, scenes: Scenes, x: Tensor, y: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        q, scale, code = super().read(g, scenes, x, y)
        return q, torch.ones_like(scale), code

    def trace(
        self, scenes: Scenes, x: Tensor, y: Tensor, given: tuple[Tensor, Tensor] | None = None
    ) -> Trace:
        found = super().trace(scenes, x, y, given)
        found.distance = found.distance * stretch(scenes)[..., None]  # the loss asks for world units
        return found


class NeverForced(FramedStudent):
    """Every step of a stream starts from what the one before answered, from the first batch on."""

    forced = False


class NoFrame(FramedStudent):
    """The decoder meets points of the world, and all 32 numbers of the geometry vector choose its weights.

    Numbers that choose weights can do all that numbers beside the point can, as biases are weights too.
    """

    def __init__(self, config: StudentConfig) -> None:
        super().__init__(replace(config, framed=replace(config.framed, code=PLANE_LAYOUT.geometry)))

    @property
    def leaves_first(self) -> bool:
        return False  # a leaf alone, in its own space, is what this one never sees

    def read(self, g: Tensor, scenes: Scenes, x: Tensor, y: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        b, n = scenes.leaf.shape
        world = torch.stack([x, y], 1)[:, None].expand(b, n, 2, -1)
        return world, torch.ones_like(g[..., 0]), g


class PicturesAlone(FramedStudent):
    """Nothing asks for distances: the loss is of colour and coverage, which pictures show."""

    unasked = frozenset({"shape", "depth"})
    forced = False  # distances are what it would be given


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


def _with(network: type[Framed]) -> type[FramedStudent]:
    """A student whose renderer is another one."""
    return type(network.__name__, (FramedStudent,), {"network": network})


VARIANTS: Mapping[str, type[FramedStudent]] = {
    "no register": _with(WithoutRegister),
    "no distance scale": NoScale,
    "no frame": NoFrame,
    "token as input": _with(TokenAsInput),
    "hidden layer": _with(WithHiddenLayer),
    "never forced": NeverForced,
    "pictures alone": PicturesAlone,
    "code": OtherCodes,
}


def make_student(config: StudentConfig, *, grown: bool = False) -> Student:
    """Build a student with random parameters."""
    if config.renderer == "streaming":
        return StreamingStudent(config, grown=grown)
    if config.renderer == "reading":
        return ReadingStudent(config)
    if config.variant:
        return VARIANTS[config.variant](config)
    return FramedStudent(config)
