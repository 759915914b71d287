"""Streaming objects through the framed network at any set of points.

Channels lie in front of points, (channels, M), so that every step of the arithmetic runs over contiguous
numbers, and only points that an object can reach meet it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import linear

from scenelang.lifting import exact
from scenelang.renderers.framed import EMPTY, RADIUS, Framed
from scenelang.renderers.frames import BLEND_REACH, FAR, ObjectFrame, local_points, read_frame

UNION, SMOOTH, SUBTRACT, INTERSECT = range(4)
CHUNK = 4096  # points that go through the network at once; their activations stay in the L2 cache
_ROUNDING = 1e-6  # world units
SLACK = 0.02  # leaf units by which a learned outline may leave the unit disc


@dataclass(frozen=True, slots=True)
class _Row:
    """One object, ready to draw: weights (out, in) and biases (out,)."""

    frame: ObjectFrame
    token: int
    colour: Tensor  # (3, 1)
    layers: tuple[tuple[Tensor, Tensor], ...]
    reach: float  # leaf units; inf where the object concerns every point
    touch: bool  # whether points in reach count as drawn on


@dataclass(frozen=True, slots=True)
class _Cell:
    lines: Tensor  # (S + L, F + S)
    bias: Tensor
    candidate: Tensor
    bump: Tensor


@dataclass(slots=True)
class Shade:
    """What `Stream.shade` gives at M points.

    Args:
        colour: (3, M), not multiplied by coverage.
        coverage: (M,) in [0, 1].
        edge: (M,) world distance to the nearest outline, as the network sees it, at most.
        evaluated: number of (object, point) pairs that went through the network.
        met: (M,) which points went through it at all; the others show the background.
    """

    colour: Tensor
    coverage: Tensor
    edge: Tensor
    evaluated: int
    met: Tensor

    def premultiplied(self) -> Tensor:
        """Colour times coverage, and coverage (4, M)."""
        return torch.cat([self.colour * self.coverage, self.coverage[None]])


@dataclass(frozen=True, slots=True)
class PixelRows:
    """Points in pixel order: from the top row down, ``group`` points a pixel.

    Args:
        down: (pixels,) minus the world y of the pixels' centres, which never falls.
        group: points a pixel.
        spread: how far up or down from its centre a pixel's points may lie, world units.
    """

    down: np.ndarray
    group: int = 1
    spread: float = 0.0

    def between(self, ymin: float, ymax: float) -> tuple[int, int]:
        """Range of points outside which none has a y in [ymin, ymax]."""
        first = int(self.down.searchsorted(-(ymax + self.spread)))
        last = int(self.down.searchsorted(-(ymin - self.spread), "right"))
        return self.group * first, self.group * last


def _frames(g: np.ndarray, known: Mapping[bytes, ObjectFrame]) -> Iterator[tuple[bytes, ObjectFrame]]:
    """The frame of each geometry vector (N, 32), by its bytes; most of the work of a stream of many."""
    for vector in g:
        key = vector.tobytes()
        yield key, known.get(key) or read_frame(vector)


def _where(mask: Tensor) -> Tensor:
    """Indices (k,) of the true entries of a mask (M,)."""
    if mask.device.type == "cpu":
        return torch.from_numpy(np.flatnonzero(mask.numpy()))  # several times as fast as torch's
    return mask.nonzero()[:, 0]


class Stream:
    """A program's objects with their weights, ready to be met by points.

    Args:
        network: trained parameters, on any device.
        vectors: (N, 64) float32, geometry and material vectors.
        tokens: (N,) boolean tokens 0 to 3.
        skip: leave out the points that an object cannot reach.
        frames: of geometry vectors that were read before, by their bytes.

    Raises:
        ProgramError: an object's vector holds no way from the world to a leaf.
    """

    @torch.no_grad()
    def __init__(
        self,
        network: Framed,
        vectors: np.ndarray,
        tokens: np.ndarray,
        *,
        skip: bool = True,
        frames: Mapping[bytes, ObjectFrame] | None = None,
    ) -> None:
        self.network = network
        self.skip = skip
        self.device = network.codes.device
        self.cells = [
            _Cell(lines.T.contiguous(), bias[:, None], c.T.contiguous(), bump[:, None])
            for lines, bias, c, bump in zip(*network.cell_weights(), strict=True)
        ]
        self.slope = float(network.read_slope.exp()) / 4
        self.unit = float(self.cells[UNION].candidate[0].norm())  # growth of the margin per world unit
        self.far = network.far[:, None]
        self.vectors = vectors
        self.codes = np.unique(vectors[:, exact.CODE], axis=0)  # of the leaves in use
        self.frames = dict(_frames(vectors[:, : exact.D_G], frames or {}))
        self.rows = self._rows(vectors, tokens)
        self._reach = np.array(
            [(r.frame.centre[1], *r.frame.half[1], r.reach, r.frame.growth) for r in self.rows], np.float64
        ).reshape(-1, 5)

    def _rows(self, vectors: np.ndarray, tokens: np.ndarray) -> list[_Row]:
        if not len(vectors):
            return []
        g, m = vectors[:, : exact.D_G], vectors[:, exact.D_G :]
        codes, index = np.unique(g[:, exact.CODE], axis=0, return_inverse=True)
        made = self.network.decoder_weights(torch.from_numpy(codes).to(self.device))
        shapes = [tuple((w[i].T.contiguous(), b[i]) for w, b in made) for i in range(len(codes))]
        codes_m = torch.from_numpy(m[:, exact.MATERIAL_CODE].copy()).to(self.device)
        albedo = torch.cat([self.network.object_albedo(codes_m), torch.ones_like(codes_m[:, :1])], 1)
        matrix = torch.from_numpy(m[:, exact.COLOUR].reshape(-1, 3, 4).copy()).to(self.device)
        colours = (matrix @ albedo[:, :, None]).clamp(0.0, 1.0)  # (N, 3, 1)
        blends_after = np.cumsum((tokens == SMOOTH)[::-1])[::-1]  # smooth unions from this row on
        rows = []
        for i, token in enumerate(tokens.tolist()):
            frame = self.frames[g[i].tobytes()]
            if not self.skip or token == INTERSECT or (token == SUBTRACT and blends_after[i]):
                reach = float("inf")
            else:
                reach = 1.0 + SLACK + (BLEND_REACH / frame.scale if blends_after[i] else 0.0)
            rows.append(
                _Row(frame, token, colours[i], shapes[int(index.flat[i])], reach, token in (UNION, SMOOTH))
            )
        return rows

    @torch.no_grad()
    def shade(self, x: Tensor, y: Tensor, pad: float = 0.0, rows: PixelRows | None = None) -> Shade:
        """Draw at world points.

        Args:
            x, y: (M,).
            pad: objects that come within so many world units of a point meet it.
            rows: how the points lie in rows; saves an object the look at points above and below it.
        """
        count = x.numel()
        s = self.network.config.state
        memory = torch.zeros(s + 3, count, device=x.device)  # state and register of each point
        memory[0] = EMPTY
        edge = torch.full((count,), torch.inf, device=x.device)
        touched = torch.zeros(count, dtype=torch.bool, device=x.device)
        evaluated = 0
        for row in self.rows if rows is None else self._near(rows, pad):
            index, qx, qy, radius = self._meet(row, x, y, touched, pad, rows)
            evaluated += qx.numel()
            for start in range(0, qx.numel(), CHUNK):
                at = slice(start, start + CHUNK)
                features = self._decode(qx[at], qy[at], radius[at], row)  # (F, m)
                near = features[0].abs() / row.frame.stretch
                if index is None:
                    memory[:, at] = self._step(features, memory[:, at], row, s)
                    torch.minimum(edge[at], near, out=edge[at])
                    continue
                part = index[at]  # selecting and copying by one index is many times as fast as subscripts
                new = self._step(features, memory.index_select(1, part), row, s)
                memory.index_copy_(1, part, new)
                edge.index_copy_(0, part, torch.minimum(edge.index_select(0, part), near))
        edge = torch.minimum(edge, memory[0].abs() / self.unit)
        met = touched if self.skip else torch.full_like(touched, bool(self.rows))
        return Shade(memory[s:], (0.5 - memory[0] * self.slope).clamp_(0.0, 1.0), edge, evaluated, met)

    def _near(self, rows: PixelRows, pad: float) -> list[_Row]:
        """The objects that may meet points in some rows; `_meet` finds none for the others."""
        if not len(rows.down):
            return []
        y, slope, more, reach, growth = self._reach.T
        high = slope * (reach + pad * growth) + more + rows.spread + _ROUNDING
        near = ((y + high >= -rows.down[-1]) & (y - high <= -rows.down[0])) | np.isinf(reach)
        return [self.rows[i] for i in np.flatnonzero(near).tolist()]

    def _meet(
        self, row: _Row, x: Tensor, y: Tensor, touched: Tensor, pad: float, rows: PixelRows | None
    ) -> tuple[Tensor | None, Tensor, Tensor, Tensor]:
        """Which points an object meets (None: all), their leaf coordinates and their lengths.

        Marks the points on which a union draws. What nothing was drawn on stays empty whatever follows.
        """
        if row.reach == float("inf"):
            index = _where(touched) if self.skip else None
        else:
            reach = row.reach + pad * row.frame.growth
            xmin, ymin, xmax, ymax = row.frame.box(reach)
            first, last = 0, x.numel()
            if rows is not None:
                first, last = rows.between(ymin, ymax)
            if first >= last:
                return touched.new_empty(0, dtype=torch.int64), x[:0], x[:0], x[:0]
            xs, ys = x[first:last], y[first:last]
            index = _where((xs >= xmin) & (xs <= xmax) & (ys >= ymin) & (ys <= ymax)) + first
        if index is not None:
            x, y = x.index_select(0, index), y.index_select(0, index)
        qx, qy = local_points(row.frame, x, y)
        radius = torch.hypot(qx, qy)
        if index is None or row.reach == float("inf"):
            return index, qx, qy, radius
        near = radius <= reach
        if row.touch:
            touched[index[near]] = True
        else:
            near &= touched.index_select(0, index)
        kept = _where(near)
        index, qx, qy = index.index_select(0, kept), qx.index_select(0, kept), qy.index_select(0, kept)
        return index, qx, qy, radius.index_select(0, kept)

    def _decode(self, qx: Tensor, qy: Tensor, radius: Tensor, row: _Row) -> Tensor:
        """Features (F, m) of leaf coordinates (m,)."""
        x = torch.stack([qx, qy], 1)  # rows of points suit layers this narrow
        x *= (RADIUS / radius.clamp_min(RADIUS))[:, None]
        x = self._layers(x, row).T
        x += (radius - RADIUS).clamp_min_(0.0) * self.far
        x.mul_(row.frame.scale)
        return x.clamp_(-FAR, FAR) if row.frame.wild else x

    def _layers(self, x: Tensor, row: _Row) -> Tensor:
        """The decoder's layers on points (m, 2), to (m, F)."""
        for w, b in row.layers[:-1]:
            x = linear(x, w, b).relu_()
        return linear(x, *row.layers[-1])

    def _step(self, features: Tensor, memory: Tensor, row: _Row, s: int) -> Tensor:
        """The cell (`Framed.step`) on features (F, m) and on state and register (S + 3, m)."""
        cell = self.cells[row.token]
        state, colour = memory[:s], memory[s:]
        gates = torch.addmm(cell.bias, cell.lines, torch.cat([features, state]))
        take, paint = gates[:s].clamp_(0.0, 1.0), gates[s:].amax(0, keepdim=True).clamp_(0.0, 1.0)
        new = torch.empty_like(memory)
        gap = (cell.candidate @ features).sub_(state)
        torch.addcmul(state, take, gap, out=new[:s]).sub_((take * (1 - take)).mul_(cell.bump))
        torch.addcmul(colour, paint, row.colour - colour, out=new[s:])
        return new
