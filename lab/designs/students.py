"""The paper's lifting and renderers put together, ready to be trained on pictures: any pair of the two.

Source: Granskog, Schnabel, Rousselle, Novák, *Neural Scene Graph Rendering*, ACM TOG 40(4), 2021, section 3:
an element is a learned vector, a transformation a matrix from an encoder of its own, and a chain the product
of its matrices: g = T_n … T_1 g_0, m likewise. One encoder takes all affine maps (16 numbers of a 4 x 4
matrix), one each twirl and bend, one each the colour operations; textures' affine maps have their own.
`scenelang.compiler.lifting` applies the same networks without torch.

Letters: B scenes, N objects, P points, R pixels along a side, D = d_g + d_m, M transformations, d the size of
the vector that a matrix acts on, W = `width`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import torch
from torch import Tensor, nn

from lab.designs.pictures import SceneBatch, exact_vectors, pixel_centres
from lab.training.scenes import GEOMETRIES
from scenelang.compiler.lifting import GEOMETRY_INPUTS, MATERIAL_INPUTS, PLANE_LAYOUT, WIDTH
from scenelang.drawing.neural.paper import Reading, ReadingConfig, Streaming, StreamingConfig


@dataclass(frozen=True, slots=True)
class LiftingConfig:
    """Sizes of the lifting."""

    geometry: int = 32  # numbers d_g of a geometry vector, 1 to 64
    material: int = 32  # numbers d_m of a material vector, 1 to 64
    width: int = 64  # hidden units W of each encoder's two layers


class Encoder(nn.Module):
    """A transformation's numbers to the matrix it acts by: the identity plus what a network adds.

    Two hidden layers of rectified linear units; the last layer starts small, so that long chains neither
    vanish nor grow before anything is learned.
    """

    def __init__(self, inputs: int, width: int, size: int) -> None:
        super().__init__()
        self.size = size
        self.layers = nn.ModuleList(
            [nn.Linear(inputs, width), nn.Linear(width, width), nn.Linear(width, size * size)]
        )
        last = self.layers[-1]
        assert isinstance(last, nn.Linear)
        nn.init.normal_(last.weight, std=0.3 / (width * size) ** 0.5)
        nn.init.zeros_(last.bias)

    def forward(self, numbers: Tensor) -> Tensor:
        """Matrices (M, d, d) of transformations (M, inputs)."""
        first, second, last = self.layers
        hidden = torch.relu(second(torch.relu(first(numbers))))
        change: Tensor = last(hidden).view(-1, self.size, self.size)
        return change + torch.eye(self.size, dtype=change.dtype, device=change.device)


class Encoders(nn.Module):
    """Learned vectors of the elements and encoders of the transformations."""

    def __init__(self, config: LiftingConfig, geometries: int, materials: int) -> None:
        super().__init__()
        self.config = config
        self.codes = nn.Parameter(torch.randn(geometries, config.geometry))
        self.material_codes = nn.Parameter(torch.randn(materials, config.material))
        self.geometry = nn.ModuleDict(  # of geometry transformations (M, inputs)
            {kind: Encoder(n, config.width, config.geometry) for kind, n in GEOMETRY_INPUTS.items()}
        )
        self.material = nn.ModuleDict(  # of colour operations (M, inputs)
            {kind: Encoder(n, config.width, config.material) for kind, n in MATERIAL_INPUTS.items()}
        )


LiftingName = Literal["exact", "learned"]
RendererName = Literal["streaming", "reading"]


@dataclass(frozen=True, slots=True)
class StudentConfig:
    """Names and sizes of the lifting and the renderer; sizes of others are ignored."""

    renderer: RendererName
    lifting: LiftingName
    learned: LiftingConfig = field(default_factory=LiftingConfig)
    streaming: StreamingConfig = field(default_factory=StreamingConfig)
    reading: ReadingConfig = field(default_factory=ReadingConfig)


class ExactCodes(nn.Module):
    """The learned part of the exact lifting: the codes alone."""

    def __init__(self) -> None:
        super().__init__()
        self.codes = nn.Parameter(torch.randn(len(GEOMETRIES), 4))
        self.material_codes = nn.Parameter(torch.randn(1, 12))

    def lift(self, scenes: SceneBatch) -> Tensor:
        """Vectors (B, N, 64)."""
        return exact_vectors(scenes, self.codes, self.material_codes)


class LearnedLifting(Encoders):
    """The paper's lifting on scenes as tensors: twirl, bend, then one affine map; one colour."""

    def __init__(self, config: LiftingConfig) -> None:
        super().__init__(config, len(GEOMETRIES), 1)

    def lift(self, scenes: SceneBatch) -> Tensor:
        """Vectors (B, N, D)."""
        b, n = scenes.leaf.shape
        g = self.codes[scenes.leaf].view(b * n, -1, 1)  # (B N, d_g, 1)
        for kind, numbers in (
            ("twirl", scenes.twirl.view(-1, 1)),
            ("bend", scenes.bend.view(-1, 1)),
            ("affine", scenes.affine.view(-1, 16)),
        ):
            g = self.geometry[kind](numbers) @ g
        m = self.material["color"](scenes.rgb.view(-1, 3)) @ self.material_codes[0]
        return torch.cat([g[..., 0], m], 1).view(b, n, -1)


class Student(nn.Module, ABC):
    """A lifting and a renderer."""

    def __init__(self, config: StudentConfig) -> None:
        super().__init__()
        self.config = config
        self.lifting = ExactCodes() if config.lifting == "exact" else LearnedLifting(config.learned)

    @property
    def vector(self) -> int:
        """Numbers D of an object."""
        if isinstance(self.lifting, LearnedLifting):
            return self.lifting.config.geometry + self.lifting.config.material
        return WIDTH

    @abstractmethod
    def image(self, scenes: SceneBatch, r: int) -> Tensor:
        """Pictures (B, 3, R, R) over white."""


class StreamingStudent(Student):
    def __init__(self, config: StudentConfig, *, grown: bool = False) -> None:
        super().__init__(config)
        sizes: dict[str, Any] = asdict(config.streaming) | {"vector": self.vector}
        self.renderer = Streaming(StreamingConfig(**sizes), grown=grown)

    def image(self, scenes: SceneBatch, r: int) -> Tensor:
        image: Tensor = self.renderer(self.lifting.lift(scenes), scenes.tokens, scenes.count, resolution=r)
        return image


class ReadingStudent(Student):
    """The reading renderer, which answers points by themselves and is trained on them."""

    def __init__(self, config: StudentConfig) -> None:
        super().__init__(config)
        sizes: dict[str, Any] = asdict(config.reading) | {"vector": self.vector}
        self.renderer = Reading(ReadingConfig(**sizes))

    def points(self, scenes: SceneBatch, x: Tensor, y: Tensor) -> Tensor:
        """Colours (B, P, 3) over white at world points (B, P)."""
        colours: Tensor = self.renderer(
            self.lifting.lift(scenes), scenes.tokens, torch.stack([x, y], -1), scenes.count
        )
        return colours

    def image(self, scenes: SceneBatch, r: int) -> Tensor:
        b = len(scenes.leaf)
        x, y = pixel_centres(r, scenes.leaf.device)
        offsets = [(dx, dy) for dx in (-0.5 / r, 0.5 / r) for dy in (-0.5 / r, 0.5 / r)]
        result = [self.points(scenes, (x + dx).expand(b, -1), (y + dy).expand(b, -1)) for dx, dy in offsets]
        return torch.stack(result).mean(0).transpose(1, 2).reshape(b, 3, r, r)


def make_student(config: StudentConfig, *, grown: bool = False) -> Student:
    """The pair that a configuration describes; `streaming` with all levels of growing if ``grown``."""
    if config.renderer == "streaming":
        return StreamingStudent(config, grown=grown)
    return ReadingStudent(config)


# A beginning for the streaming renderer's deconvolutions where frames are exact: leaf coordinates as maps.
#
# An exact vector holds the inverse frame (a b s; c d t) of its object, so the leaf coordinates of a pixel
# at x, y, (a x + b y + s, c x + d y + t), are linear in it. A deconvolution of stride 2 can carry them down
# to the next resolution without error: a child's coordinates are its parent's, and a quarter of the
# parent's width times a, b, c and d. Rectified linear units let a coordinate pass as two channels, its
# positive and its negative part, and all else with a constant added. What a random beginning has to find
# through six layers is thereby there at the start and free to change; shapes, booleans and colours are
# learned. Layers and their shapes stay those of the paper.

AT = PLANE_LAYOUT.places
SLOPE, WARP = 5.5, 0.9  # constants that keep entries of frames and strengths of warps positive
CARRIED = 18  # channels: 4 of coordinates, 4 slopes, 2 warps, 4 of the code, 3 colours and a one


@torch.no_grad()
def carry_leaves(network: Reading) -> None:
    """Let the first coordinates of a pixel in an object be those in its leaf, before it is warped."""
    network.frames.weight[:6] = torch.eye(WIDTH)[AT.frame]
    network.frames.bias[:6] = 0.0


@torch.no_grad()
def carry_frames(network: Streaming) -> None:
    """Let deconvolutions carry frames, warps, codes and colours in their first `CARRIED` channels."""
    for level, layer in enumerate(network.deconvolutions):
        assert isinstance(layer, nn.ConvTranspose2d)
        assert layer.bias is not None
        if layer.out_channels < CARRIED:
            raise ValueError(f"{layer.out_channels} filters cannot carry {CARRIED} numbers")
        nn.init.normal_(layer.weight, std=0.7 * math.sqrt(0.5 / layer.in_channels))
        nn.init.zeros_(layer.bias)
        _carry(layer, 0.5**level, first=level == 0)


def _carry(layer: nn.ConvTranspose2d, half: float, *, first: bool) -> None:
    """Weights that hand the carried channels on from pixels whose half width is ``half`` world units."""
    w, bias = layer.weight, layer.bias
    assert bias is not None
    w[:, :CARRIED] = 0.0
    bias[:CARRIED] = 0.0
    bias[CARRIED - 1] = 1.0
    if first:
        bias[4:8], bias[8:10] = SLOPE, WARP
    for row in (0, 1):  # taps 1 and 2 of a kernel: the parent's upper or left child, its lower or right child
        for column in (0, 1):
            tap = w[:, :, 1 + row, 1 + column]
            x, y = (column - 0.5) * half, (0.5 - row) * half
            if first:
                _from_vector(tap, x, y)
            else:
                _from_parent(tap, x, y)


def _from_vector(tap: torch.Tensor, x: float, y: float) -> None:
    every = torch.arange(WIDTH)
    a, b, s, c, d, t = every[AT.frame].tolist()
    for channel, entries in ((0, (a, b, s)), (2, (c, d, t))):
        for entry, times in zip(entries, (x, y, 1.0), strict=True):
            tap[entry, channel], tap[entry, channel + 1] = times, -times
    warp = AT.inner.start
    carried = (a, b, c, d, warp, warp + 1, *every[AT.code].tolist(), *every[AT.rgb].tolist())
    for channel, entry in enumerate(carried, 4):
        tap[entry, channel] = 1.0


def _from_parent(tap: torch.Tensor, x: float, y: float) -> None:
    for channel, slopes in ((0, 4), (2, 6)):
        for own, sign in ((channel, 1.0), (channel + 1, -1.0)):
            tap[channel, own], tap[channel + 1, own] = sign, -sign
            tap[slopes, own], tap[slopes + 1, own] = sign * x, sign * y
            tap[CARRIED - 1, own] = -sign * SLOPE * (x + y)
    for channel in range(4, CARRIED - 1):
        tap[channel, channel] = 1.0
