"""Random scenes of the base set `shapes2d` as tensors, and their exact pictures, made on the training device.

What the renderers that see whole pictures are trained on. The distribution is that of
`lab.sets.plane` (its seeds are others): twirl, bend, scale, rotate, translate, in that order.

Letters: B scenes, N objects, P points, R pixels along a side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from lab.folds import fold
from lab.training.scenes import sectors
from scenelang.compiler.geometries import sector_distance
from scenelang.compiler.lifting import PLANE_LAYOUT, WIDTH
from scenelang.drawing.exact.field import map_back, warp_back


@dataclass(frozen=True, slots=True)
class PictureConfig:
    """The training distribution."""

    objects: int = 4  # most objects N of a scene
    warp: float = 0.8  # largest twirl and bend
    # scales along each axis
    low: float = 0.2
    high: float = 0.55
    shift: float = 0.7  # largest translation along each axis
    unions: float = 0.4  # share of scenes of unions only


@dataclass(slots=True)
class SceneBatch:
    leaf: Tensor  # geometry index (B, N), int64
    # (B, N), nearest the leaf, in that order
    twirl: Tensor
    bend: Tensor
    affine: Tensor  # world-from-leaf maps after them (B, N, 4, 4)
    rgb: Tensor  # colours (B, N, 3)
    tokens: Tensor  # (B, N), int64
    count: Tensor  # (B,) objects in use; the rest is padding

    def pick(self, rows: Tensor) -> SceneBatch:
        """Some of them."""
        return SceneBatch(*(getattr(self, name)[rows] for name in self.__slots__))

    @property
    def used(self) -> Tensor:
        """(B, N) bool: which objects are none of the padding."""
        return torch.arange(self.leaf.shape[1], device=self.leaf.device) < self.count[:, None]


def random_scenes(b: int, config: PictureConfig, g: torch.Generator) -> SceneBatch:
    """Draw B scenes."""
    n, device = config.objects, g.device

    def uniform(low: float, high: float, *shape: int) -> Tensor:
        return torch.rand((b, n, *shape), generator=g, device=device) * (high - low) + low

    angle = uniform(-math.pi, math.pi)
    sx, sy = uniform(config.low, config.high, 2).unbind(-1)
    cos, sin = angle.cos(), angle.sin()
    affine = torch.zeros(b, n, 4, 4, device=device)
    affine[..., 0, 0], affine[..., 0, 1] = cos * sx, -sin * sy
    affine[..., 1, 0], affine[..., 1, 1] = sin * sx, cos * sy
    affine[..., :2, 3] = uniform(-config.shift, config.shift, 2)
    affine[..., 2, 2] = affine[..., 3, 3] = 1.0
    tokens = torch.randint(0, 4, (b, n), generator=g, device=device)
    tokens[torch.rand(b, generator=g, device=device) < config.unions] = 0
    tokens[:, 0] = 0
    return SceneBatch(
        leaf=torch.randint(0, 4, (b, n), generator=g, device=device),
        twirl=uniform(-config.warp, config.warp),
        bend=uniform(-config.warp, config.warp),
        affine=affine,
        rgb=uniform(0.1, 1.0, 3),
        tokens=tokens,
        count=torch.randint(1, n + 1, (b,), generator=g, device=device),
    )


def frames(scenes: SceneBatch) -> Tensor:
    """Rows of the inverses in the plane (B, N, 2, 3) of the affine maps."""
    linear = torch.linalg.inv(scenes.affine[..., :2, :2])
    return torch.cat([linear, -linear @ scenes.affine[..., :2, 3:]], -1)


def local_points(scenes: SceneBatch, x: Tensor, y: Tensor) -> list[Tensor]:
    """Exact leaf coordinates, two of (B, N, P), of world points x, y, each (B or 1, P)."""
    rows = frames(scenes)[..., None].permute(2, 3, 0, 1, 4)
    q = map_back(rows, (x[:, None], y[:, None]))
    return warp_back(scenes.twirl[..., None], [scenes.bend[..., None]], q)


def trace_exactly(scenes: SceneBatch, x: Tensor, y: Tensor) -> tuple[Tensor, list[tuple[Tensor, Tensor]]]:
    """Exact distances (B, N, P) of the objects, and distance (B, P) and colour (B, P, 3) after each."""
    shape = sectors(x.device)[scenes.leaf]  # (B, N, 4)
    d = sector_distance(local_points(scenes, x, y), *(v[..., None] for v in shape.unbind(-1)))
    d = d * stretch(scenes)[..., None]
    return d, list(fold(d.unbind(1), scenes.rgb[:, :, None].unbind(1), scenes.tokens.T[..., None]))


def stretch(scenes: SceneBatch) -> Tensor:
    """World distance per leaf distance (B, N): the smallest singular values in the plane."""
    values: Tensor = torch.linalg.svdvals(scenes.affine[..., :2, :2])[..., 1]
    return values


def shown(scenes: SceneBatch, x: Tensor, y: Tensor) -> Tensor:
    """Exact colours (B, P, 3) over white at world points x, y, each (B or 1, P)."""
    d, steps = trace_exactly(scenes, x, y)
    out = torch.ones(*d.shape[::2], 3, device=x.device)
    for i, (depth, colour) in enumerate(steps):  # the picture is what the last object in use leaves
        last = (scenes.count == i + 1)[:, None]
        out = torch.where((last & (depth < 0))[..., None], colour, out)
    return out


def pixel_centres(r: int, device: torch.device | str = "cpu") -> tuple[Tensor, Tensor]:
    """World coordinates x, y (R R,) of pixel centres, row 0 at the top."""
    at = (torch.arange(r, device=device) + 0.5) * (2 / r) - 1
    return at.repeat(r), -at.repeat_interleave(r)


def pictures(scenes: SceneBatch, r: int) -> Tensor:
    """Exact pictures (B, 3, R, R) over white, four samples a pixel as the language defines."""
    x, y = pixel_centres(r, scenes.leaf.device)
    total = torch.zeros(len(scenes.leaf), r * r, 3, device=x.device)
    for dx in (-0.5 / r, 0.5 / r):  # a quarter of a pixel, which is 2 / R wide
        for dy in (-0.5 / r, 0.5 / r):
            total += shown(scenes, (x + dx)[None], (y + dy)[None])
    return (total / 4).transpose(1, 2).reshape(-1, 3, r, r)


def exact_vectors(scenes: SceneBatch, codes: Tensor, material_codes: Tensor) -> Tensor:
    """Vectors (B, N, 64) as `scenelang.compiler.lifting` makes them, of codes (G, 4) and (K, 12)."""
    b, n = scenes.leaf.shape
    out, at = torch.zeros(b, n, WIDTH, device=codes.device), PLANE_LAYOUT.places
    out[..., at.one] = 1.0
    out[..., at.frame] = frames(scenes).flatten(-2)
    out[..., at.middle] = out[..., at.texture] = torch.tensor(PLANE_LAYOUT.identity, device=codes.device)
    out[..., at.inner.start] = scenes.twirl
    out[..., at.inner.start + 1] = scenes.bend
    out[..., at.rgb] = scenes.rgb
    code = torch.nn.functional.pad(codes[scenes.leaf], (0, WIDTH - at.code.stop))
    return out + code + torch.nn.functional.pad(material_codes[0], (at.material.start, 0))
