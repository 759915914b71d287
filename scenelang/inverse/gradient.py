"""Gradients of soft pictures by params, and how a Program's numbers change with these.

A pixel's four samples see an outline jump from one to the next: a picture of few pixels stays as it is while
a param moves a little. Here one sample tells how much of its pixel is covered: the network's own gates (those
of union, subtraction and intersection, and the one that reads coverage) are made as wide as a pixel. Nothing
else of the network changes.

Two reverse passes tell how all pixels change with numbers of their own: one through the cell, by distances,
colours and widths of blends, and one through decoders and frames, of the few pixels that change with a
distance at all. Params that change different numbers are moved together (Curtis, Powell and Reid 1974).
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from scenelang.compiler.groups import SMOOTH, UNION
from scenelang.compiler.lifting import LAYOUTS, STRENGTHS, WIDTH
from scenelang.compiler.program import Program
from scenelang.drawing.arrays_torch import TORCH
from scenelang.drawing.neural.field import BLEND
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.frames import FrameMap, FrameTurn
from scenelang.drawing.neural.load import Framed, load_model
from scenelang.drawing.neural.network import EMPTY, Cell, FramedArrays
from scenelang.inverse.search import WHITE, Point, SearchBox


@lru_cache(maxsize=64)
def softened(name: str, width: float) -> FramedArrays:
    """A shipped model of the plane with gates that are at least so wide, world units."""
    network = load_arrays(name).network
    assert isinstance(network, FramedArrays)
    soft = copy.copy(network)
    soft.levels = dict
    cell = Cell(*network.cell_weights())
    unit = float(np.linalg.norm(cell.candidate[UNION, 0]))  # growth of the state per world unit
    # coverage rises from 0 to 1 over 4 / exp(slope) of the state: make that at least the width
    soft.read_slope = np.float32(min(float(network.read_slope), math.log(4 / (unit * width))))
    features = network.config.features
    steep = np.linalg.norm(cell.lines[..., :features], axis=-1)  # (TOKENS, S + L), per world unit
    soft.cell_gain = network.cell_gain - np.log(np.maximum(1.0, steep * width)).astype(np.float32)
    return soft


PAIRS: Final = 1 << 18  # of an object and a pixel at a time
_LEAST: Final = 1e-30  # of a square, whose root has no derivative at 0


class _Parts(NamedTuple):
    """Numbers of N objects and of the background, or n rates of these."""

    geometry: Tensor  # geometry vectors, and behind them how far leaves grow and their shells (N, G + 2, n)
    colours: Tensor  # (N, 3, n)
    widths: Tensor  # of the blends by which objects join (N, n)
    clear: Tensor  # 1 - opacities (N, n)
    behind: Tensor  # colour of the background (3, n)


class SoftPlane:
    """Soft picture of a plain Program of the plane by its numbers, over the sRGB-encoded colour ``under``."""

    def __init__(
        self, program: Program, under: tuple[float, float, float] = WHITE, dtype: torch.dtype = torch.float32
    ) -> None:
        (width, height), self.dtype = program.canvas, dtype
        px, count = 2 / min(width, height), len(program)
        self.network = network = _network(program.model, px, dtype)
        self.layout = layout = network.layout
        self.canvas, self.count = program.canvas, count
        tokens = program.tokens.astype(np.int64)
        self.cell = [part[tokens][..., None] for part in network.cell_weights()]
        self.smooth, self.union = (torch.from_numpy(tokens == token) for token in (SMOOTH, UNION))
        parts = layout.unpack(program.vectors)
        self.late = torch.from_numpy(parts.order % 2).to(dtype)[:, None]  # of leaves that grow behind a shell
        self.widest = float(parts.width[tokens == SMOOTH].max(initial=BLEND))
        codes, self.shapes = np.unique(parts.code, axis=0, return_inverse=True)
        self.decoders = network.decoders(torch.from_numpy(codes).to(dtype))
        self.albedo = network.object_albedo(torch.from_numpy(parts.material.copy()).to(dtype))
        self.under = None if program.background else torch.tensor(under, dtype=dtype)[:, None]
        y, x = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
        places = torch.stack([x + 0.5 - width / 2, height / 2 - 0.5 - y]).double() * px
        self.points = places.reshape(2, -1).to(dtype)

    def __call__(self, base: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The picture (H, W, 3) of numbers (K,), and its derivatives (H, W, 3, n) along rates (K, n)."""
        still, moving = (self._read(torch.from_numpy(x).to(self.dtype)) for x in (base[:, None], rates))
        if self.under is not None:
            still, moving = still._replace(behind=self.under), moving._replace(behind=0 * moving.behind)
        self.turning = [
            at
            for _, warps in self.layout.ways
            for at in range(warps.start, warps.stop, STRENGTHS)
            if any(part.geometry[:, at : at + STRENGTHS].any() for part in (still, moving))
        ]
        self.skinned = any(bool(part.geometry[:, -2:].any()) for part in (still, moving))
        self.clear = bool(still.clear.any() or moving.clear.any())
        moving.colours.mul_((still.colours >= 0) & (still.colours <= 1))
        still.colours.clamp_(0.0, 1.0)
        pieces = torch.split(self.points, max(1, PAIRS // self.count), 1)
        result = zip(*(self._changes(p, still, moving) for p in pieces), strict=True)
        pictures, slopes = (torch.cat(part, 1) for part in result)
        shape = 3, self.canvas[1], self.canvas[0]
        return (
            pictures.reshape(shape).movedim(0, 2).numpy(),
            slopes.reshape(*shape, -1).movedim(0, 2).numpy(),
        )

    def _read(self, numbers: Tensor) -> _Parts:
        """Parts of numbers (K, n), or of rates: all are linear in them."""
        vectors, behind = numbers[:-3].reshape(self.count, WIDTH, -1), numbers[-3:]
        colours = vectors[:, self.layout.places.rgb] * self.albedo[:, :, None]
        at = self.layout.places
        geometry = vectors[:, [*range(self.layout.geometry), at.grow, at.shell]]
        return _Parts(geometry, colours, vectors[:, at.width], vectors[:, at.clear], behind)

    def _changes(self, p: Tensor, still: _Parts, moving: _Parts) -> tuple[Tensor, Tensor]:
        """Colours (3, M) of points (2, M), and their derivatives (3, M, n)."""
        count = p.shape[1]
        with torch.no_grad():
            d = self._distances(p, still.geometry)
        shape, each = (3, self.count, count), (d, still.colours.swapaxes(0, 1), still.widths, still.clear)
        leaves = [part.expand(shape).clone().requires_grad_() for part in each]
        leaves.append(still.behind.expand(3, count).clone().requires_grad_())
        shown = self._fold(*leaves)
        found = torch.autograd.grad(shown.sum(), leaves, materialize_grads=True)
        by_distance, by_colour, by_width, by_clear, by_behind = found
        slopes = by_behind[..., None] * moving.behind[:, None]
        slopes += by_colour.swapaxes(1, 2) @ moving.colours.swapaxes(0, 1)
        slopes += by_width.swapaxes(1, 2) @ moving.widths
        slopes += by_clear.swapaxes(1, 2) @ moving.clear
        near = by_distance.any(0).any(0).nonzero()[:, 0]
        own = still.geometry.expand(-1, -1, len(near)).clone().requires_grad_()
        (by_number,) = torch.autograd.grad(self._distances(p[:, near], own).sum(), own)
        along = by_number.swapaxes(1, 2) @ moving.geometry  # (N, near, n)
        slopes[:, near] += torch.einsum("kim,imn->kmn", by_distance[:, :, near], along)
        return shown.detach(), slopes

    def _distances(self, p: Tensor, geometry: Tensor) -> Tensor:
        """World distances (N, M) of objects with numbers (N, G + 2, M or 1) at world points (2, M)."""
        layout = self.layout
        steps: list[FrameMap | FrameTurn] = []
        maps = []
        for frame, warps in layout.ways:
            a, b, u, c, d, v = geometry[:, frame].unbind(1)
            maps.append((a, b, c, d))
            steps.append(FrameMap(((a, b, u), (c, d, v))))
            for at in range(warps.start, warps.stop, STRENGTHS):
                if at in self.turning:
                    twirl, *bend = geometry[:, at : at + STRENGTHS].unbind(1)
                    steps.append(FrameTurn(twirl, tuple(bend)))
        points: Any = [x.expand(self.count, -1) for x in p]
        for step in steps:
            points = step(TORCH, points)
        q = torch.stack(list(points))
        result: list[Any] = [None] * self.count
        for shape, decoder in enumerate(self.decoders):
            which = np.flatnonzero(self.shapes == shape).tolist()
            own = q[:, which].reshape(2, -1)
            decoded = self.network.decode(own, TORCH.length(list(own)), 1.0, decoder)
            for at, row in zip(which, decoded.reshape(len(which), -1), strict=True):
                result[at] = row
        d = torch.stack(result)
        if self.skinned:
            grow, shell = geometry[:, -2], geometry[:, -1]
            d = d - (1 - self.late) * grow
            d = torch.where(shell > 0, d.abs() - shell / 2, d) - self.late * grow
        return d * _scale(*maps)

    def _fold(self, d: Tensor, colours: Tensor, widths: Tensor, clear: Tensor, behind: Tensor) -> Tensor:
        """Channels (3, M) of points by distances, colours, widths, 1 - opacities (3, N, M) and ``behind``."""
        lines, bias, candidate, bump = self.cell
        state = d.new_full((3, 1, d.shape[2]), EMPTY * self.widest / BLEND)
        colour = torch.zeros_like(torch.cat([state] * (1 + self.clear), 1))  # and coverage behind it
        slope = self.network.read_slope.exp() / 4
        for i in range(self.count):
            own, narrow = d[:, i : i + 1], BLEND / widths[:, i : i + 1] if self.smooth[i] else 1.0
            levels = bias[i] + (lines[i, :, 0] * own + lines[i, :, 1] * state) * narrow
            given = colours[:, i : i + 1]
            if self.clear:
                through = clear[:, i : i + 1]
                given = torch.cat([given, torch.ones_like(given)], 1) * (1 - through)
                if self.union[i]:
                    given = given + (0.5 - state * slope).clamp(0.0, 1.0) * through * colour
            wanted, lowered = candidate[i, :, 0] * own, bump[i, 0] / narrow
            state, colour = self.network.update(levels, wanted, lowered, state, colour, given)
        coverage = (0.5 - state * slope).clamp(0.0, 1.0)
        hidden = coverage * colour[:, 1:] if self.clear else coverage
        shown: Tensor = (colour * coverage)[:, 0] + (1 - hidden[:, 0]) * behind
        return shown


def _scale(last: tuple[Tensor, ...], middle: tuple[Tensor, ...]) -> Tensor:
    """World distance per leaf distance (N, M or 1): one over the most by which the maps back stretch."""
    (a, b, c, d), (e, f, g, h) = middle, last
    p, q, r, s = a * e + b * g, a * f + b * h, c * e + d * g, c * f + d * h
    # half the sum of the two roots is the largest singular value of [p q; r s]
    squares = (p + s).square() + (r - q).square(), (p - s).square() + (r + q).square()
    one, other = (square.clamp(_LEAST).sqrt() for square in squares)
    return 2.0 / (one + other)


@lru_cache(maxsize=16)
def _network(name: str, width: float, dtype: torch.dtype) -> Framed:
    """A shipped model of the plane with gates of at least a width, as `softened` has them."""
    network = load_model(name).framed.to(dtype)
    soft = softened(name, width)
    network.cell_gain.copy_(torch.from_numpy(np.asarray(soft.cell_gain)))
    network.read_slope.copy_(torch.from_numpy(np.asarray(soft.read_slope)))
    return network


Floats = npt.NDArray[np.float64]
STEP: Final = 1e-3  # of differences, shares of a range: vectors are rounded to float32


def numbers_of(program: Program) -> Floats:
    """Numbers (K,) of a Program that a picture changes smoothly with: vectors by row, then the background."""
    at = LAYOUTS[2 if program.stage is None else 3].places.width
    vectors = program.vectors.astype(np.float64)
    vectors[:, at] = np.where((program.tokens == SMOOTH) & (vectors[:, at] <= 0), BLEND, vectors[:, at])
    return np.concatenate([vectors.reshape(-1), program.background or (0.0, 0.0, 0.0)])


def alike(a: Program, b: Program) -> bool:
    """Return whether two Programs differ in their numbers alone."""
    alone = ("model", "objects", "elements", "palette", "samples")
    same = all(getattr(a, name) == getattr(b, name) for name in alone)
    tables = all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("tokens", "forms", "worn"))
    return same and tables and (a.background is None) == (b.background is None)


class Rates:
    """Derivatives of a Program's numbers; ``program`` compiles the scene of a point, or gives None."""

    def __init__(self, program: Callable[[Point], Program | None], space: SearchBox) -> None:
        self.program, self.space = program, space
        self._moved: dict[int, npt.NDArray[np.bool_]] = {}  # (K,) which numbers an axis changes

    def at(self, u: Point, here: Program) -> tuple[Floats, npt.NDArray[np.bool_]]:
        """Derivatives (K, n) at a point, in shares of ranges, and of which axes (n,) they are known.

        Those of choices are not, nor those of axes along which objects come or go.
        """
        base = numbers_of(here)
        result, known = np.zeros((len(base), len(u))), np.zeros(len(u), bool)
        if any(len(mask) != len(base) for mask in self._moved.values()):
            self._moved = {}
        groups = self._groups(len(base))
        while groups:
            group = groups.pop()
            change = self._change(u, here, base, group)
            masks = [self._moved.get(axis, np.ones(len(base), bool)) for axis in group]
            if len(group) > 1 and (change is None or change[0][~np.any(masks, 0)].any()):
                groups += [[axis] for axis in group]  # more has changed than did so far
                continue
            for axis, mask in zip(group, masks, strict=True):
                if change is not None:
                    column = change[0] * mask if len(group) > 1 else change[0]
                    result[:, axis], known[axis] = column / change[1][axis], True
                    self._moved[axis] = self._moved.get(axis, False) | (column != 0)
        return result, known

    def _groups(self, count: int) -> list[list[int]]:
        """Continuous axes, those together that are known to change different numbers."""
        groups: list[tuple[list[int], npt.NDArray[np.bool_]]] = []
        for axis in np.flatnonzero(self.space.smooth).tolist():
            mask = self._moved.get(axis, np.ones(count, bool))
            for group, taken in groups:
                if not (taken & mask).any():
                    group.append(axis)
                    taken |= mask
                    break
            else:
                groups.append(([axis], mask.copy()))
        return [group for group, _ in groups]

    def _change(self, u: Point, here: Program, base: Floats, axes: list[int]) -> tuple[Floats, Point] | None:
        """By how much numbers (K,) change as axes move, and by how much these do (n,)."""
        for way in (1.0, -1.0):
            moved = u.copy()
            moved[axes] += way * np.where((u[axes] + way * STEP > 1.0) & ~self.space.wraps[axes], -STEP, STEP)
            end = self.space.inside(moved)
            if (program := self.program(end)) is not None and alike(here, program):
                width = end - self.space.inside(u)
                change = numbers_of(program) - base
                return change, np.where(self.space.wraps, (width + 0.5) % 1.0 - 0.5, width)
        return None
