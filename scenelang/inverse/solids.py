"""Soft pictures of opaque solids in torch, and how they change.

A ray that passes an outline by less than half a pixel, to either side, shows as much of what is there as its
distance says, and so does one from the light. The line where a solid stands in the ground stays sharp.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from scenelang.graph.stage import AMBIENT, FADE, LIFT, NEAREST
from scenelang.inverse.surfaces import SLOTS, Numbers, Surfaces, length, unit
from scenelang.inverse.target import WHITE
from scenelang.lifting.vector import WIDTH
from scenelang.program.program import Program
from scenelang.renderers.solid.network import Wanted


class SoftSolids(Surfaces):
    """What a Program of solids shows; arguments as of `scenelang.inverse.plane.SoftPlane`."""

    def __init__(
        self, program: Program, under: tuple[float, float, float] = WHITE, dtype: torch.dtype = torch.float32
    ) -> None:
        super().__init__(program, dtype)
        assert program.stage is not None
        self.stage, self.canvas = program.stage, program.canvas
        self.under = torch.tensor(under, dtype=dtype)[:, None]

    def __call__(self, base: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The picture (H, W, 3) of numbers (K,), and its derivatives (H, W, 3, n) along rates (K, n)."""
        width, height = self.canvas
        numbers, along = torch.from_numpy(base).to(self.dtype), torch.from_numpy(rates).to(self.dtype)
        self.settle(numbers)
        moves = numbers.new_zeros(rates.shape[1], width * height, requires_grad=True)
        shown = self._picture(Numbers(numbers, along, moves))
        slopes = shown.new_zeros(3, width * height, rates.shape[1])
        for channel in range(3 if rates.any() and shown.requires_grad else 0):
            (one,) = torch.autograd.grad(
                shown[channel].sum(), moves, retain_graph=channel < 2, materialize_grads=True
            )
            slopes[channel] = one.T
        shape = 3, height, width
        return (
            shown.detach().reshape(shape).movedim(0, 2).numpy(),
            slopes.reshape(*shape, -1).movedim(0, 2).numpy(),
        )

    def _picture(self, at: Numbers) -> Tensor:
        """Colours (3, M) of pixels, sRGB-encoded."""
        still = Numbers(at.base, at.rates[:, :0], at.moves[:0].detach())
        stage, first = self.stage, self.count * WIDTH
        eye, aim, fov = at(first, 3), at(first + 3, 3), at(first + 6, 1)
        horizon, zenith = at(first + 18, 3), at(first + 21, 3)
        forward = unit(aim - eye)
        up = torch.tensor([0.0, 1.0, 0.0] if forward[:, 0].detach()[::2].norm() > 1e-9 else [0.0, 0.0, -1.0])
        right = unit(torch.linalg.cross(forward, up.to(self.dtype)[:, None].expand_as(forward), dim=0))
        width, height = self.canvas
        y, x = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
        across, above = (
            ((x + 0.5 - width / 2) * self.px).reshape(-1),
            ((height / 2 - 0.5 - y) * self.px).reshape(-1),
        )
        way = forward / (fov / 2).tan() + right * across.to(self.dtype)
        way = way + torch.linalg.cross(right, forward, dim=0) * above.to(self.dtype)
        ratio = (self.px / length(way)).expand(width * height)
        way, eye = unit(way), eye.expand(3, width * height)
        back, limit, solid = self._behind(at, still, eye, way, ratio, horizon, zenith)
        with torch.no_grad():
            wide = torch.stack([0 * ratio, ratio])
            events = self.trace(still, eye, way, torch.zeros_like(limit), limit, wide)
        seen, clear = torch.zeros_like(back), torch.ones_like(ratio)
        if len(events.ray):
            own, o, w = at.some(events.ray), eye[:, events.ray], way[:, events.ray]
            t = self.met(o, w, events.t, events.hit, own)
            p, wide = o + w * t, ratio[events.ray] * t
            d, gradient, colour = self.slope(p, own, Wanted.ALL)
            size = length(gradient)
            n = gradient / size
            cover = torch.where(events.hit, torch.ones_like(d), (0.5 - d / (size * wide)).clamp(0.0, 1.0))
            light = self._lit(own, still, p - gradient * (d / size.square()), n, colour, wide)
            for slot in range(SLOTS):
                here = (events.slot == slot).nonzero()[:, 0]
                ray = events.ray[here]
                amount = torch.zeros_like(clear).index_put((ray,), cover[here])
                shade = torch.zeros_like(seen).index_put((torch.arange(3)[:, None], ray), light[:, here])
                seen, clear = seen + clear * amount * shade, clear * (1 - amount)
        seen = seen + clear * back
        if not stage.transparent:
            return _encoded(seen)
        alpha = 1 - clear * ~solid
        return _encoded(seen / alpha.clamp(1e-6)) * alpha + (1 - alpha) * self.under

    def _behind(
        self,
        at: Numbers,
        still: Numbers,
        eye: Tensor,
        way: Tensor,
        ratio: Tensor,
        horizon: Tensor,
        zenith: Tensor,
    ) -> tuple[Tensor, Tensor, Tensor]:
        """What rays see behind all solids (3, M), how far that is (M,), and whether it is the ground (M,)."""
        first = self.count * WIDTH + 14
        sky = (horizon + (zenith - horizon) * (2 * way[1]).clamp(0.0, 1.0)) * (not self.stage.transparent)
        limit = torch.full_like(ratio, torch.inf)
        if self.stage.ground is None or self.stage.camera.eye[1] <= self.stage.ground.y:
            return sky, limit, limit < 0
        y, rgb = at(first, 1)[0], at(first + 1, 3)
        down = way[1] < 0
        some = down.nonzero()[:, 0]
        y = y[some] if len(y) > 1 else y
        t = (y - eye[1, some]) / way[1, some]
        p, own = eye[:, some] + way[:, some] * t, at.some(some)
        n = torch.tensor([[0.0], [1.0], [0.0]], dtype=self.dtype).expand_as(p)
        kept = (-(p[0].square() + p[2].square()) / FADE).exp()
        colour = (rgb[:, some] if rgb.shape[1] > 1 else rgb) * kept
        horizon = horizon[:, some] if horizon.shape[1] > 1 else horizon
        light = self._lit(own, still, p, n, colour, ratio[some] * t) + (1 - kept) * horizon
        return (
            sky.expand_as(way).index_put((torch.arange(3)[:, None], some), light),
            limit.index_put((some,), t.detach()),
            down,
        )

    def _lit(self, at: Numbers, still: Numbers, p: Tensor, n: Tensor, colour: Tensor, wide: Tensor) -> Tensor:
        """Light (3, K) from points of surfaces; the shadow's edge is as wide as a pixel is there (K,)."""
        first = self.count * WIDTH + 7
        to, power = at(first, 3) - p, at(first + 3, 1) * at(first + 4, 3)
        r = length(to).clamp(NEAREST)
        facing = ((n * to).sum(0) / r).clamp(0.0)
        start, clear = p + LIFT * n, torch.ones_like(r)
        with torch.no_grad():
            lit = (facing > 0).nonzero()[:, 0]
            width = wide[lit]
            rays = self.trace(
                still, start[:, lit], (to / r)[:, lit], width, r[lit], torch.stack([width, 0 * width])
            )
        if len(rays.ray):
            ray = lit[rays.ray]
            d = self.field(start[:, ray] + to[:, ray] * (rays.t / r[ray]).detach(), at.some(ray))[0]
            free = torch.where(rays.hit, 0 * d, (0.5 + d / wide[ray]).clamp(0.0, 1.0))
            for slot in range(SLOTS):
                here = (rays.slot == slot).nonzero()[:, 0]
                clear = clear * torch.ones_like(clear).index_put((ray[here],), free[here])
        base = colour * (AMBIENT[0] + AMBIENT[1] * n[1])
        return base + colour * power * (facing * clear / r.square())


def _encoded(light: Tensor) -> Tensor:
    """sRGB of linear colours, as `scenelang.image.encoded`."""
    x = light.clamp(0.0, 1.0)
    return torch.where(x <= 0.0031308, 12.92 * x, 1.055 * x.clamp(1e-9).pow(1 / 2.4) - 0.055)
