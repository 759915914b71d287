"""A lifting and a renderer put together, ready to be trained on pictures: any pair of the two.

Letters: B scenes, N objects, P points, R pixels along a side, D = d_g + d_m.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar, Literal

import torch
from torch import Tensor, nn

from scenelang.lab.designs.encoders import Encoders, LiftingConfig
from scenelang.lab.designs.pictures import Scenes, exact_vectors, pixel_centres
from scenelang.lifting.vector import PLANE_LAYOUT, WIDTH
from scenelang.renderers.arrays_torch import TORCH
from scenelang.renderers.framed import Framed, Trace
from scenelang.renderers.frames import Affine, Warp, way_back
from scenelang.renderers.network import FramedConfig
from scenelang.renderers.reading import Reading, ReadingConfig
from scenelang.renderers.streaming import Streaming, StreamingConfig
from scenelang.training.scenes import GEOMETRIES

LiftingName = Literal["exact", "learned"]
RendererName = Literal["framed", "streaming", "reading"]


@dataclass(frozen=True, slots=True)
class StudentConfig:
    """Which lifting and renderer, and their sizes; those of the others are not looked at.

    `variant` names a `framed` renderer that lacks a part (`scenelang.lab.designs.ablations`), or is empty.
    """

    renderer: RendererName
    lifting: LiftingName
    learned: LiftingConfig = field(default_factory=LiftingConfig)
    framed: FramedConfig = field(default_factory=FramedConfig)
    streaming: StreamingConfig = field(default_factory=StreamingConfig)
    reading: ReadingConfig = field(default_factory=ReadingConfig)
    variant: str = ""


class ExactCodes(nn.Module):
    """The learned part of the exact lifting: the codes alone."""

    def __init__(self) -> None:
        super().__init__()
        self.codes = nn.Parameter(torch.randn(len(GEOMETRIES), 4))
        self.material_codes = nn.Parameter(torch.randn(1, 12))

    def lift(self, scenes: Scenes) -> Tensor:
        """Vectors (B, N, 64)."""
        return exact_vectors(scenes, self.codes, self.material_codes)


class LearnedLifting(Encoders):
    """The paper's lifting on scenes as tensors: twirl, bend, then one affine map; one colour."""

    def __init__(self, config: LiftingConfig) -> None:
        super().__init__(config, len(GEOMETRIES), 1)

    def lift(self, scenes: Scenes) -> Tensor:
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
    """A lifting and a renderer.

    Args:
        config: which ones.
    """

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
    def image(self, scenes: Scenes, r: int) -> Tensor:
        """Pictures (B, 3, R, R) over white."""


class StreamingStudent(Student):
    """The streaming renderer."""

    def __init__(self, config: StudentConfig, *, grown: bool = False) -> None:
        super().__init__(config)
        sizes: dict[str, Any] = asdict(config.streaming) | {"vector": self.vector}
        self.renderer = Streaming(StreamingConfig(**sizes), grown=grown)

    def image(self, scenes: Scenes, r: int, blend: float = 1.0) -> Tensor:
        image: Tensor = self.renderer(
            self.lifting.lift(scenes), scenes.tokens, scenes.count, resolution=r, blend=blend
        )
        return image


class PointStudent(Student):
    """One that answers points by themselves, and is trained on them."""

    @abstractmethod
    def points(self, scenes: Scenes, x: Tensor, y: Tensor) -> Tensor:
        """Colours (B, P, 3) over white at world points (B, P)."""

    def image(self, scenes: Scenes, r: int) -> Tensor:
        b = len(scenes.leaf)
        x, y = pixel_centres(r, scenes.leaf.device)
        offsets = [(dx, dy) for dx in (-0.5 / r, 0.5 / r) for dy in (-0.5 / r, 0.5 / r)]
        found = [self.points(scenes, (x + dx).expand(b, -1), (y + dy).expand(b, -1)) for dx, dy in offsets]
        return torch.stack(found).mean(0).transpose(1, 2).reshape(b, 3, r, r)


class ReadingStudent(PointStudent):
    """The reading renderer."""

    def __init__(self, config: StudentConfig) -> None:
        super().__init__(config)
        sizes: dict[str, Any] = asdict(config.reading) | {"vector": self.vector}
        self.renderer = Reading(ReadingConfig(**sizes))

    def points(self, scenes: Scenes, x: Tensor, y: Tensor) -> Tensor:
        colours: Tensor = self.renderer(
            self.lifting.lift(scenes), scenes.tokens, torch.stack([x, y], -1), scenes.count
        )
        return colours


class FramedStudent(PointStudent):
    """The framed renderer, which reads codes and frames out of the vectors whoever lifted them."""

    network: ClassVar[type[Framed]] = Framed
    unasked: ClassVar[frozenset[str]] = frozenset()  # terms of the loss that are left out
    forced: ClassVar[bool] = True  # whether its streams begin with the exact state before every object

    def __init__(self, config: StudentConfig) -> None:
        super().__init__(config)
        if self.vector != WIDTH:
            raise ValueError("the framed renderer reads vectors of 32 + 32 numbers")
        if isinstance(self.lifting, LearnedLifting):
            with torch.no_grad():  # start from frames that are frames, not from noise
                codes = self.lifting.codes
                codes[:, PLANE_LAYOUT.places.code.stop :] = 0.0
                for frame, _ in PLANE_LAYOUT.ways:
                    codes[:, frame] = torch.tensor(PLANE_LAYOUT.identity)
        self.renderer = self.network(config.framed, len(GEOMETRIES), 1)
        # the codes are the lifting's
        self.renderer.codes.requires_grad_(False)
        self.renderer.material_codes.requires_grad_(False)

    @property
    def leaves_first(self) -> bool:
        """Whether its leaves can be learned alone before its streams."""
        return self.config.lifting == "exact"

    @property
    def leaf_codes(self) -> Tensor:
        """Codes (G, C) of the leaves as the decoder takes them."""
        return self.lifting.codes[:, PLANE_LAYOUT.places.code]

    def read(self, g: Tensor, scenes: Scenes, x: Tensor, y: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """What the decoder is shown at world points (B, P) of geometry vectors (B, N, 32).

        Returns:
            Points (B, N, 2, P), distance scales (B, N), codes (B, N, C).
        """
        q, scale = read_points(g, x, y)
        return q, scale, g[..., PLANE_LAYOUT.places.code]

    def trace(
        self, scenes: Scenes, x: Tensor, y: Tensor, given: tuple[Tensor, Tensor] | None = None
    ) -> Trace:
        """What the network answers along the streams at world points (B, P); see `Framed.trace`."""
        vectors = self.lifting.lift(scenes)
        parts = PLANE_LAYOUT.unpack(vectors)
        q, scale, code = self.read(vectors[..., : PLANE_LAYOUT.geometry], scenes, x, y)
        b, n = scenes.leaf.shape
        albedo = self.renderer.object_albedo(parts.material.reshape(b * n, -1)).view(b, n, 3)
        return self.renderer.trace(q, scale, code, parts.rgb * albedo, scenes.tokens, given)

    def points(self, scenes: Scenes, x: Tensor, y: Tensor) -> Tensor:
        trace = self.trace(scenes, x, y)
        last = (scenes.count - 1)[:, None, None]
        depth = trace.depth.gather(1, last.expand(-1, 1, x.shape[1]))[:, 0]  # (B, P)
        colour = trace.colour.gather(1, last[..., None].expand(-1, 1, x.shape[1], 3))[:, 0]
        return torch.where((depth < 0)[..., None], colour, torch.ones_like(colour))


def read_points(g: Tensor, x: Tensor, y: Tensor) -> tuple[Tensor, Tensor]:
    """Leaf coordinates and distance scales out of geometry vectors.

    Args:
        g: (B, N, 32).
        x, y: world points (B, P).

    Returns:
        (B, N, 2, P) and (B, N), differentiable in g.
    """
    steps: list[Affine | Warp] = []
    layout = PLANE_LAYOUT
    for frame, group in layout.ways:
        numbers = g[..., frame, None].unbind(-2)  # each (B, N, 1)
        steps.append(Affine((numbers[:3], numbers[3:])))
        for start in range(group.start, group.stop, 3):
            twirl, *bend = g[..., start : start + 3, None].unbind(-2)
            steps.append(Warp(twirl, tuple(bend)))
    q = torch.stack(list(way_back(TORCH, steps, (x[:, None], y[:, None]))), 2)
    last, middle = (g[..., s].reshape(*g.shape[:-1], 2, 3)[..., :2] for s, _ in layout.ways)
    return q, 1 / largest_stretch(middle @ last).clamp_min(1e-3)


def largest_stretch(m: Tensor) -> Tensor:
    """Largest singular value (…,) of matrices (…, 2, 2), in closed form."""
    a, b, c, d = m[..., 0, 0], m[..., 0, 1], m[..., 1, 0], m[..., 1, 1]
    first = ((a + d).square() + (b - c).square() + 1e-12).sqrt()
    second = ((a - d).square() + (b + c).square() + 1e-12).sqrt()
    return (first + second) / 2
