"""Random streams of 2D objects and points on them, made on the training device.

The exact reference defines what a point shows. Points are drawn where pictures are hard: near the
boundary of an object at all scales, within reach of its blend, and evenly over the canvas.

Letters: B streams, N objects, P points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from lab.folds import fold
from scenelang.compiler.geometries import SECTORS, sector_distance
from scenelang.drawing.exact.field import map_back, warp_back

GEOMETRIES = ("square", "triangle", "star", "pentagon")
FAR = 1e3  # translation of the objects that pad a stream: off every point


@dataclass(frozen=True, slots=True)
class SceneConfig:
    points: int = 256  # points P of a stream
    # shares of streams of unions only and of unions and smooth unions only; the others draw each token
    # evenly
    union: float = 0.25
    smooth: float = 0.3
    edge: float = 0.5  # share of points on the edge of one object
    # world units; other points are drawn with a weight of 1 / (|D| + blend_focus)
    blend_focus: float = 0.01
    # shares of objects of 0.02 to 0.12 and of 0.8 to 1.8 world units
    tiny: float = 0.15
    large: float = 0.1
    extent: float = 1.3  # points and objects lie in [-extent, extent]
    warp: float = 1.2  # largest twirl and bend


@dataclass(slots=True)
class Batch:
    """Streams at points, with what the exact picture shows after every object."""

    q: Tensor  # leaf coordinates (B, N, 2, P)
    scale: Tensor  # distance scale (B, N)
    leaf: Tensor  # geometry index (B, N)
    rgb: Tensor  # colours (B, N, 3)
    tokens: Tensor  # (B, N) int64
    count: Tensor  # (B,) objects in use; the rest is padding far off every point
    distance: Tensor  # signed distance of each object alone, world units (B, N, P); inside it is negative
    depth: Tensor  # distance D of the stream up to the object, world units (B, N, P)
    colour: Tensor  # exact colour after the object (B, N, P, 3)


def _rand(shape: tuple[int, ...], g: torch.Generator) -> Tensor:
    return torch.rand(shape, generator=g, device=g.device)


def _uniform(shape: tuple[int, ...], low: float, high: float, g: torch.Generator) -> Tensor:
    return _rand(shape, g) * (high - low) + low


def _affine(shape: tuple[int, ...], config: SceneConfig, g: torch.Generator) -> Tensor:
    """World-from-leaf maps (…, 2, 3): any rotation, scale per axis, shear, translation."""
    kind = _rand(shape, g)
    size = torch.exp(_uniform(shape, math.log(0.15), math.log(0.8), g))
    tiny = torch.exp(_uniform(shape, math.log(0.02), math.log(0.12), g))
    size = torch.where(kind < config.tiny, tiny, size)
    size = torch.where(kind > 1 - config.large, _uniform(shape, 0.8, 1.8, g), size)
    ratio = torch.exp(
        _uniform(shape, 0.0, math.log(3.0), g) * torch.randint(0, 2, shape, generator=g, device=g.device)
    )
    a, b = _uniform(shape, -math.pi, math.pi, g), _uniform(shape, -math.pi, math.pi, g)
    ca, sa, cb, sb = a.cos(), a.sin(), b.cos(), b.sin()
    u, v = size, size / ratio
    # R(a) diag(u, v) R(b), mirrored half of the time through the sign of v
    v = torch.where(_rand(shape, g) < 0.25, -v, v)
    linear = torch.stack(
        [
            torch.stack([ca * u * cb - sa * v * sb, -ca * u * sb - sa * v * cb], -1),
            torch.stack([sa * u * cb + ca * v * sb, -sa * u * sb + ca * v * cb], -1),
        ],
        -2,
    )
    return torch.cat([linear, _uniform((*shape, 2, 1), -0.9, 0.9, g)], -1)


def _inverse(m: Tensor) -> Tensor:
    """Inverse (…, 2, 3) of affine maps (…, 2, 3)."""
    linear = torch.linalg.inv(m[..., :2])
    return torch.cat([linear, -linear @ m[..., 2:]], -1)


def _boundary(leaf: Tensor, g: torch.Generator) -> Tensor:
    """Points (B, P, 2) on the boundaries of leaves (B, P)."""
    n, phase, outer, inner = sectors(g.device)[leaf].unbind(-1)
    half = math.pi / n
    t = _rand(leaf.shape, g)
    side = torch.where(_rand(leaf.shape, g) < 0.5, 1.0, -1.0)
    turn = phase + 2 * half * torch.floor(_rand(leaf.shape, g) * n)
    u, v = outer + t * (inner * half.cos() - outer), side * t * inner * half.sin()
    return torch.stack([turn.cos() * u - turn.sin() * v, turn.sin() * u + turn.cos() * v], -1)


def _forward_warp(q: Tensor, twirl: Tensor, bend: Tensor) -> Tensor:
    """The point that a warp carries back to q, by Newton steps on the angle (approximate)."""
    radius = torch.linalg.vector_norm(q, dim=-1)
    angle = twirl * radius
    for _ in range(5):
        c, s = angle.cos(), angle.sin()
        x, y = c * q[..., 0] - s * q[..., 1], s * q[..., 0] + c * q[..., 1]
        value = angle - twirl * radius - bend * x
        slope = 1 + bend * y
        angle = angle - (value / torch.where(slope.abs() < 0.2, 0.2, slope)).clamp(-0.5, 0.5)
    c, s = angle.cos(), angle.sin()
    return torch.stack([c * q[..., 0] - s * q[..., 1], s * q[..., 0] + c * q[..., 1]], -1)


def sectors(device: torch.device) -> Tensor:
    """Symmetry (G, 4) of all leaves: order, direction of a vertex, outer and inner radius."""
    return torch.tensor([SECTORS[name] for name in GEOMETRIES], device=device)


def points_of(
    world: Tensor,
    leaf: Tensor,
    count: Tensor,
    twirl: Tensor,
    bend: Tensor,
    singular: Tensor,
    config: SceneConfig,
    g: torch.Generator,
) -> Tensor:
    """World points (B, pool, 2): first those on edges, then a pool around objects and over the canvas.

    Of maps ``world`` (B, N, 2, 3), their smallest singular values, ``leaf`` and warps (B, N), count (B,).
    """
    b, edges = leaf.shape[0], int(config.points * config.edge)
    pool = edges + 3 * (config.points - edges)
    pick = (_rand((b, pool), g) * count[:, None]).long()
    edge = _boundary(leaf.gather(1, pick[:, :edges]), g)
    offset = 10 ** _uniform((b, edges, 1), -3.7, -0.3, g)
    edge = edge + torch.randn((b, edges, 2), generator=g, device=g.device) * offset
    reach = 1 + 0.25 / singular.gather(1, pick[:, edges:])[..., None]
    around = torch.randn((b, pool - edges, 2), generator=g, device=g.device)
    around = around / torch.linalg.vector_norm(around, dim=-1, keepdim=True) * reach
    around = around * _rand((b, pool - edges, 1), g).sqrt()
    local = torch.cat([edge, around], 1)
    local = _forward_warp(local, twirl.gather(1, pick), bend.gather(1, pick))
    place = world[torch.arange(b, device=g.device)[:, None], pick]  # (B, pool, 2, 3)
    points = (place[..., :2] @ local[..., None])[..., 0] + place[..., 2]
    even = _uniform((b, pool, 2), -config.extent, config.extent, g)
    chosen = _rand((b, pool, 1), g) < 0.3
    chosen[:, :edges] = False
    return torch.where(chosen, even, points)


@dataclass(slots=True)
class LeafBatch:
    """Points in the spaces of all leaves G."""

    q: Tensor  # leaf coordinates (G, 2, P)
    distance: Tensor  # signed distance, leaf units (G, P)


def leaf_batch(p: int, g: torch.Generator) -> LeafBatch:
    """Draw P points for every leaf: half near its outline at all scales, half over twice its disc."""
    leaf = torch.arange(len(GEOMETRIES), device=g.device)[:, None].expand(-1, p)
    near = _boundary(leaf, g)
    near = near + torch.randn(near.shape, generator=g, device=g.device) * 10 ** _uniform(
        (*leaf.shape, 1), -3.5, 0.0, g
    )
    angle, radius = _uniform(leaf.shape, 0.0, math.tau, g), 2.0 * _uniform(leaf.shape, 0.0, 1.0, g) ** 0.7
    even = torch.stack([radius * angle.cos(), radius * angle.sin()], -1)
    q = torch.where((torch.arange(p, device=g.device) % 2 == 0)[:, None], near, even)
    shape = (v[:, None] for v in sectors(g.device).unbind(-1))
    return LeafBatch(q.mT, sector_distance(q.unbind(-1), *shape))


def random_batch(b: int, n: int, config: SceneConfig, g: torch.Generator) -> Batch:
    """Draw B streams of 1 to N objects with P points each."""
    p = config.points
    device = g.device
    leaf = torch.randint(0, 4, (b, n), generator=g, device=device)
    count = torch.randint(1, n + 1, (b,), generator=g, device=device)
    tokens = torch.randint(0, 4, (b, n), generator=g, device=device)
    style = _rand((b,), g)
    tokens = torch.where((style > 1 - config.smooth)[:, None], tokens % 2, tokens)
    tokens[style < config.union] = 0
    tokens[:, 0] = 0
    rgb = _rand((b, n, 3), g)
    world = _affine((b, n), config, g)
    gather = _rand((b, 1), g) < 0.3  # some streams stand close together
    size = world[..., :2].flatten(-2).abs().amax(-1, keepdim=True)
    near = world[:, :1, :, 2] + _uniform((b, n, 2), -1.0, 1.0, g) * size
    world[..., 2] = torch.where(gather[..., None], near, world[..., 2])
    used = torch.arange(n, device=device) < count[:, None]
    world[..., 2] = torch.where(used[..., None], world[..., 2], torch.full_like(world[..., 2], FAR))
    twirl, bend = _uniform((2, b, n), -config.warp, config.warp, g) * torch.randint(
        0, 2, (2, b, n), generator=g, device=device
    )
    frame = _inverse(world)
    singular = torch.linalg.svdvals(world[..., :2])[..., 1]

    points = points_of(world, leaf, count, twirl, bend, singular, config, g)
    q = map_back(frame[..., None].permute(2, 3, 0, 1, 4), points[:, None].unbind(-1))  # two of (B, N, pool)
    q = warp_back(twirl[..., None], [bend[..., None]], q)
    shape = sectors(device)[leaf]
    d = sector_distance(q, *(v[..., None] for v in shape.unbind(-1))) * singular[..., None]
    steps = list(fold(d.unbind(1), rgb[:, :, None].unbind(1), tokens.T[..., None]))
    # of the points that are not on an edge keep those near the boundary of the whole stream
    gumbel = -torch.log(-torch.log(_rand(steps[-1][0].shape, g).clamp(1e-9, 1 - 1e-7)))
    order = gumbel - torch.log(steps[-1][0].abs() + config.blend_focus)
    order[:, : int(config.points * config.edge)] = math.inf
    keep = order.topk(p, dim=1).indices  # (B, P)
    keep_n = keep[:, None].expand(b, n, p)
    chosen = torch.stack(q, 2).gather(3, keep_n[:, :, None].expand(b, n, 2, p))
    colour = torch.stack([c.expand(*big_d.shape, 3) for big_d, c in steps], 1)
    depth = torch.stack([big_d for big_d, _ in steps], 1)
    return Batch(
        q=chosen,
        scale=singular,
        leaf=leaf,
        rgb=rgb,
        tokens=tokens,
        count=count,
        distance=d.gather(2, keep_n),
        depth=depth.gather(2, keep_n),
        colour=colour.gather(2, keep_n[..., None].expand(b, n, p, 3)),
    )
