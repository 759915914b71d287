"""Surfaces of opaque solids in torch: where rays come near them, and how these places change.

Rays are followed without derivatives. Only where they end, or pass an outline by less than a pixel, is the
field asked with derivatives: the way to a surface moves as the implicit function theorem has it, and a place
of closest approach as where the distance falls no more.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import torch
from torch import Tensor

from scenelang.lifting.vector import STRENGTHS, WIDTH
from scenelang.models.load import load_model
from scenelang.program.groups import SMOOTH
from scenelang.program.program import Program
from scenelang.renderers.field import BLEND
from scenelang.renderers.solid.network import EMPTY, RADIUS, Cell, Wanted
from scenelang.renderers.solid.parameters import Solids

STEPS: Final = 128  # of a ray at most
SLOTS: Final = 3  # outlines and surfaces that a ray shows at most
_HALVINGS: Final = 5  # of the way between steps, before those of Newton's
_SETTLED: Final = 3


class Numbers:
    """A Program's numbers at each of M pixels, where they may move apart.

    Args:
        base: (K,), as `scenelang.inverse.rates.numbers_of` has them.
        rates: (K, n), how they change with each move.
        moves: (n, M), 0, of each pixel.
    """

    def __init__(self, base: Tensor, rates: Tensor, moves: Tensor) -> None:
        self.base, self.rates, self.moves = base, rates, moves
        self._kept: dict[tuple[int, int], Tensor] = {}

    def __call__(self, first: int, count: int) -> Tensor:
        """Some of them (count, M), or (count, 1) where nothing moves them."""
        found = self._kept.get((first, count))
        if found is None:
            found, rates = self.base[first : first + count, None], self.rates[first : first + count]
            found = self._kept[first, count] = found + rates @ self.moves if rates.any() else found
        return found

    def some(self, pixels: Tensor) -> Numbers:
        """Those of some of the pixels."""
        return Numbers(self.base, self.rates, self.moves[:, pixels])


class Events(NamedTuple):
    """Places (K,) where rays come near something, in their order along each ray.

    Args:
        ray: which.
        t: how far along it.
        hit: whether the ray ends there in a surface, rather than passes by.
        slot: how many it has passed before.
    """

    ray: Tensor
    t: Tensor
    hit: Tensor
    slot: Tensor


class Surfaces:
    """Surfaces of a Program of solids, whose gates are as wide as a pixel.

    Args:
        program: of which the tokens and the shapes count here, and about where objects and camera are.
        dtype: of all that is computed.

    Attributes:
        opaque: whether no object is a medium.
    """

    def __init__(self, program: Program, dtype: torch.dtype = torch.float32) -> None:
        assert program.stage is not None
        self.network = network = _network(program.model, dtype)
        self.layout = layout = network.layout
        self.count, self.tokens, self.dtype = len(program), program.tokens.tolist(), dtype
        vectors = torch.from_numpy(program.vectors.copy()).to(dtype)
        parts = layout.unpack(vectors)
        self.decoders = [network.decoder(code) for code in parts.code]
        self.looks = network.look(parts.material)
        self.opaque = bool((self.looks[:, 3] < 0.5).all())
        self.balls = torch.from_numpy(program.bounds.copy()).to(dtype)
        camera, self.px = program.stage.camera, 2 / min(program.canvas)
        far = float(np.linalg.norm(np.subtract(camera.eye, camera.target)))
        self.width = far * self.px * float(np.tan(camera.fov_rad / 2))  # of a pixel there, world units
        self.most: list[tuple[Tensor, Tensor]] = []
        cells = {token: network.cell(token, BLEND) for token in set(self.tokens)}
        self.cells = {
            token: cell if token == SMOOTH else tuple(self._soft(one, 1.0) for one in cell)
            for token, cell in cells.items()
        }

    def settle(self, numbers: Tensor) -> None:
        """Note along which directions maps to leaves stretch most."""
        self.most = []
        for i in range(self.count):
            frames = (numbers[i * WIDTH :][s].reshape(3, 4) for s, _ in self.layout.ways)
            last, middle = (rows[:, :3] for rows in frames)
            u, _, v = torch.linalg.svd(middle @ last)
            self.most.append((u[:, 0], v[0]))

    def _distance(self, i: int, p: Tensor, at: Numbers) -> Tensor:
        """World distances (K,) of an object at points (3, K)."""
        layout, row = self.layout, i * WIDTH
        maps = [at(row + frame.start, 12).reshape(3, 4, -1) for frame, _ in layout.ways]
        q = p
        for rows, (_, warps) in zip(maps, layout.ways, strict=True):
            q = (rows[:, :3] * q).sum(1) + rows[:, 3]
            for first in range(warps.start, warps.stop, STRENGTHS):
                q = _turned(q, at(row + first, STRENGTHS))
        u, v = self.most[i]
        last, middle = (rows[:, :3] for rows in maps)
        stretch = u @ (middle * (last * v[:, None]).sum(1)).sum(1)
        far = length(q)
        d = self.network.field(q * (RADIUS / far.clamp(RADIUS)), self.decoders[i], False)[0]
        amount, frequency = at(row + layout.places.bulge.start, 2)
        if amount.any() or amount.requires_grad:
            d = d + amount * (frequency * q).sin().prod(0)
        found: Tensor = (d + (far - RADIUS).clamp(0.0)) / stretch
        return found

    def field(self, p: Tensor, at: Numbers, wanted: Wanted = Wanted.DISTANCE) -> Tensor:
        """Distances behind all objects at points (3, K), and behind them the register: (1 or 5, K)."""
        layout, count = self.layout, p.shape[1]
        memory = torch.cat([p.new_full((1, count), EMPTY), p.new_zeros(4 if wanted else 0, count)])
        for i, token in enumerate(self.tokens):
            look = memory
            if wanted:
                rgb = at(i * WIDTH + layout.places.rgb.start, 12)[::5]
                colour = (rgb * self.looks[i, :3, None]).clamp(0.0, 1.0)
                look = torch.cat([colour.expand(3, count), p.new_zeros(1, count)])
            cell = self.cells[token][wanted]
            if token == SMOOTH:
                cell = self._soft(cell, BLEND / at(i * WIDTH + layout.places.width, 1))
            memory = self.network.join(self._distance(i, p, at), memory, look, cell, wanted)[0]
        return memory

    def _soft(self, cell: Cell, scale: Tensor | float) -> Cell:
        """A cell whose lines are so much steeper (1, K or 1), but have gates that are as wide as a pixel."""
        own, past = cell.own * scale, cell.past * scale
        steep = ((own.square() + past.square()).sqrt() * self.width).clamp(1.0)
        return Cell(own / steep, past / steep, cell.bias, cell.candidate, cell.bump / scale * steep[:1])

    def slope(
        self, p: Tensor, at: Numbers, wanted: Wanted = Wanted.DISTANCE
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Distances (K,), gradients (3, K) of these, which have derivatives too, and colours (3, K)."""
        with torch.enable_grad():
            p = p if p.requires_grad else p.requires_grad_()
            d, *colour = self.field(p, at, wanted)
            (gradient,) = torch.autograd.grad(d.sum(), p, create_graph=True)
        return d, gradient, torch.stack(colour[:3]) if wanted else gradient

    def trace(self, still: Numbers, o: Tensor, w: Tensor, begin: Tensor, end: Tensor, wide: Tensor) -> Events:
        """What rays from o (3, M) in unit directions w (3, M) come near between two places.

        Args:
            wide: how wide a pixel is at their begin, and how much wider it becomes on a way of 1 (2, M).
        """
        rel = o[:, None] - self.balls.T[:3, :, None]
        along = -(rel * w[:, None]).sum(0)  # (N, M)
        reach = self.balls[:, 3:] + wide[0] + wide[1] * along.clamp(0.0)
        half = reach.square() - rel.square().sum(0) + along.square()
        ways = half.clamp(0.0).sqrt()
        begin = torch.maximum(begin, torch.where(half > 0, along - ways, torch.inf).amin(0))
        end = torch.minimum(end, torch.where(half > 0, along + ways, -torch.inf).amax(0))
        ray = (begin < end).nonzero()[:, 0]
        t, last = begin[ray], begin.new_full((len(ray),), -torch.inf)
        passed, falling = torch.zeros(o.shape[1], dtype=torch.long), last > 0
        before = over = one = t
        found: list[tuple[Tensor, ...]] = []
        for _ in range(STEPS):
            d = self.field(o[:, ray] + w[:, ray] * t, still)[0]
            width = wide[0, ray] + wide[1, ray] * t
            deep = d < -0.5 * width
            near = falling & (d > last) & (last < width) & ~deep & (passed[ray] < SLOTS - 1)
            for mask, low in ((near, before), (deep, over)):
                if mask.any():
                    hits = ray[mask]
                    found.append((hits, low[mask], t[mask], mask[mask] & deep[mask], passed[hits]))
                    passed[hits] += 1
            going = (~deep & (t < end[ray])).nonzero()[:, 0]
            if not len(going):
                break
            falling, over, before = d < last, torch.where(d > 0, t, over), one
            one, last, t = t, d, t + torch.maximum(0.95 * d.abs(), 0.3 * width)
            ray, t, last, falling, over, before, one = (
                part[going] for part in (ray, t, last, falling, over, before, one)
            )
        if not found:
            none = torch.zeros(0, dtype=torch.long)
            return Events(none, o.new_zeros(0), none > 0, none)
        ray, low, high, hit, slot = (torch.cat(parts) for parts in zip(*found, strict=True))
        start, way = o[:, ray], w[:, ray]
        for _ in range(5):  # where it is 0, or falls no more
            t = (low + high) / 2
            step = 0.01 * (high - low)
            d, after = self.field(torch.cat([start + way * t, start + way * (t + step)], 1), still)[0].chunk(
                2
            )
            ahead = torch.where(hit, d > 0, after < d)
            low, high = torch.where(ahead, t, low), torch.where(ahead, high, t)
        for _ in range(_SETTLED):
            t = torch.minimum(torch.maximum(self.met(start, way, t, hit, still).detach(), low), high)
        return Events(ray, t, hit, slot)

    def met(self, o: Tensor, w: Tensor, t: Tensor, hit: Tensor, at: Numbers) -> Tensor:
        """Where rays meet surfaces, or come nearest to them, by a step of Newton's from t (K,)."""

        def fall_at(t: Tensor) -> tuple[Tensor, Tensor]:
            d, gradient, _ = self.slope(o + w * t, at)
            return d, (gradient * w).sum(0)

        step = 0.02 * self.width
        d, fall = fall_at(t)
        bend = ((fall_at(t + step)[1] - fall_at(t - step)[1]) / (2 * step)).detach()
        value, rate = torch.where(hit, d, fall), torch.where(hit, fall.detach(), bend)
        sure = torch.where(hit, rate < -1e-3, rate > 1e-3)
        return t - torch.where(sure, value / torch.where(sure, rate, torch.ones_like(rate)), 0 * value)


def _turned(q: Tensor, strengths: Tensor) -> Tensor:
    """Points (3, K) behind turns by t |q| + b x about z, then by w y about y."""
    if not (strengths.requires_grad or strengths.any()):
        return q
    twirl, bend, twist = strengths
    x, y, z = q
    angle = twirl * length(q) + bend * x
    x, y = angle.cos() * x + angle.sin() * y, angle.cos() * y - angle.sin() * x
    angle = twist * y
    x, z = angle.cos() * x + angle.sin() * z, angle.cos() * z - angle.sin() * x
    return torch.stack([x, y, z])


def length(v: Tensor) -> Tensor:
    """Of vectors (3, K), (K,); its derivative at 0 is 0."""
    return v.square().sum(0).clamp(1e-24).sqrt()


def unit(v: Tensor) -> Tensor:
    """Vectors (3, K) of length 1."""
    return v / length(v)


@lru_cache(maxsize=4)
def _network(name: str, dtype: torch.dtype) -> Solids:
    network = load_model(name).network
    assert isinstance(network, Solids)
    return network.to(dtype)
