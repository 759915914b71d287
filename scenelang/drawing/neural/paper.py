"""The paper's renderers: a ConvLSTM over whole images, and a GRU by which each pixel reads the scene.

Source: Granskog, Schnabel, Rousselle, Novák, *Neural Scene Graph Rendering*, ACM TOG 40(4), 2021: section 5
for `Reading`; section 4, and Table 3 of its supplement (filters of each resolution, progressive growing), for
`Streaming`. Fourier features after Tancik et al. 2020; gated recurrent unit after Cho et al. 2014.

Letters: B scenes, N objects, P points, D = d_g + d_m numbers of an object, H = `hidden`, L = `octaves`,
F filters of a level, R = resolution.

`Reading` answers samples, four a pixel as the language defines. A pixel has a state. In a read, a GRU looks
at each object from that state; the answers are pooled over the objects by their maximum, so that a read does
not depend on their number or order; a second GRU makes the next state of the pooled answer. After the last
read a linear layer gives the colour. Boolean operators depend on the order, so each object comes with its
token and its place in the stream, which the paper's unions do not need.

`Streaming` draws the whole canvas at once, at the one size it was trained for. An object's vectors pass
through deconvolutions from 1 x 1 to R x R; the boolean token is joined to the feature map there; a
convolutional LSTM (Shi et al. 2015) takes the maps one after the other; three 1 x 1 convolutions turn its
last hidden map into colours.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import one_hot

from scenelang.compiler.groups import OPERATOR
from scenelang.compiler.program import Program, ProgramError
from scenelang.drawing.image import from_samples
from scenelang.drawing.neural.draw import Drawing
from scenelang.language.words import TOKENS


@dataclass(frozen=True, slots=True)
class ReadingConfig:
    """Sizes of the network."""

    vector: int = 64  # numbers D of an object
    hidden: int = 128  # entries H of both states
    reads: int = 8  # how often a pixel reads the scene
    octaves: int = 6  # frequencies L of the Fourier features, π to 2^(L - 1) π per world unit
    leaves: int = 0  # affine maps of an object by which a pixel has coordinates in it, besides the paper's


LEAF_OCTAVES = 2
LEAF = 2 + 4 * LEAF_OCTAVES  # features of a pair of leaf coordinates


def fourier_features(points: Tensor, octaves: int) -> Tensor:
    """Points (…, 2) in world units to (…, 2 + 4 L): themselves, sines and cosines."""
    octave = torch.arange(octaves, dtype=points.dtype, device=points.device)
    angles = points[..., None] * (math.pi * 2.0**octave)  # (…, 2, L)
    return torch.cat([points, angles.sin().flatten(-2), angles.cos().flatten(-2)], -1)


class Reading(nn.Module):
    """Parameters and forward pass of the reading renderer."""

    def __init__(self, config: ReadingConfig) -> None:
        super().__init__()
        self.config = config
        place = 2 + 4 * config.octaves
        self.start = nn.Parameter(torch.zeros(config.hidden))
        # The first GRU's input is linear in position and object, so the two are multiplied apart: a
        # pixel's part once, an object's part once, instead of both for every pair.
        self.look_place = nn.Linear(place, 3 * config.hidden)
        self.look_object = nn.Linear(config.vector + len(TOKENS) + 1, 3 * config.hidden, bias=False)
        if config.leaves:
            self.frames = nn.Linear(config.vector, 6 * config.leaves)
            self.look_leaf = nn.Linear(LEAF * config.leaves, 3 * config.hidden, bias=False)
        self.look_state = nn.Linear(config.hidden, 3 * config.hidden)
        self.next = nn.GRUCell(config.hidden, config.hidden)
        self.head = nn.Linear(config.hidden, 3)

    def forward(self, vectors: Tensor, tokens: Tensor, points: Tensor, count: Tensor | None = None) -> Tensor:
        """Colours (B, P, 3) at points (B, P, 2), world units, of vectors (B, N, D) and tokens (B, N), int64;
        of each stream ``count`` (B,) objects are in use.
        """
        b, n, _ = vectors.shape
        order = torch.arange(n, device=vectors.device, dtype=vectors.dtype) / 4
        marks = one_hot(tokens, len(TOKENS)).to(vectors.dtype)
        objects = torch.cat([vectors, marks, order.expand(b, n)[..., None]], -1)  # (B, N, D + 5)
        seen = self.look_object(objects)  # (B, N, 3 H)
        where = self.look_place(fourier_features(points, self.config.octaves))  # (B, P, 3 H)
        rows = self.frames(vectors).view(b, n, -1, 2, 3) if self.config.leaves else None

        def pair(i: int) -> Tensor:
            found: Tensor = where + seen[:, i, None]  # (B, P, 3 H)
            if rows is None:
                return found
            own = torch.einsum("bkij,bpj->bpki", rows[:, i, ..., :2], points) + rows[:, i, None, ..., 2]
            leaf: Tensor = self.look_leaf(fourier_features(own, LEAF_OCTAVES).flatten(2))
            return found + leaf

        unused = None
        if count is not None:
            unused = torch.arange(n, device=vectors.device) >= count[:, None]  # (B, N)
        state = self.start.expand(b, points.shape[1], -1)  # (B, P, H)
        for _ in range(self.config.reads):
            state = self._read(state, pair, n, unused)
        colour: Tensor = self.head(state)
        return colour

    def _read(self, state: Tensor, pair: Callable[[int], Tensor], n: int, unused: Tensor | None) -> Tensor:
        """One read: every object from the state, the maximum over objects, the next state."""
        from_state = self.look_state(state)  # (B, P, 3 H)
        pooled = torch.full_like(state, -math.inf)
        rs, zs, ns = from_state.chunk(3, -1)
        for i in range(n):
            ri, zi, ni = pair(i).chunk(3, -1)
            reset, keep = (ri + rs).sigmoid(), (zi + zs).sigmoid()
            answer = torch.lerp((ni + reset * ns).tanh(), state, keep)  # (B, P, H)
            if unused is not None:
                answer = answer.masked_fill(unused[:, i, None, None], -math.inf)
            pooled = torch.maximum(pooled, answer)
        b, p, h = state.shape
        after: Tensor = self.next(pooled.reshape(b * p, h), state.reshape(b * p, h))
        return after.view(b, p, h)


SMALLEST = 4  # pixels along a side at which growing starts
# Table 3: filters at each resolution, 1 x 1 up to 512 x 512
FILTERS = {2: 256, 4: 256, 8: 256, 16: 256, 32: 256, 64: 128, 128: 64, 256: 32, 512: 32}


@dataclass(frozen=True, slots=True)
class StreamingConfig:
    """Sizes of the network."""

    vector: int = 64  # numbers D of an object
    resolution: int = 32  # pixels along a side, a power of two from 4 to 512
    width: float = 1.0  # share of the filters of Table 3; 1 is the paper's network
    most: int = 256  # filters of a level at most

    def __post_init__(self) -> None:
        if self.resolution not in FILTERS or self.resolution < SMALLEST:
            raise ValueError(f"resolution {self.resolution} is not a power of two from {SMALLEST} to 512")
        if not 0 < self.width <= 1:
            raise ValueError(f"width {self.width} is not a share of the paper's")

    def filters(self, resolution: int) -> int:
        """Filters F of a level."""
        return min(self.most, max(4, round(FILTERS[resolution] * self.width)))

    @property
    def levels(self) -> tuple[int, ...]:
        """Resolutions of the deconvolutions' outputs, 2, 4, …, R."""
        return tuple(2 ** (i + 1) for i in range(int(math.log2(self.resolution))))


class ConvLSTM(nn.Module):
    """A convolutional LSTM cell without peepholes, of F filters: four 5 x 5 convolutions in one."""

    def __init__(self, inputs: int, filters: int) -> None:
        super().__init__()
        self.filters = filters
        self.gates = nn.Conv2d(inputs + filters, 4 * filters, 5, 1, 2)
        with torch.no_grad():  # an open forget gate, so that early objects are not lost at the start
            assert self.gates.bias is not None
            self.gates.bias[filters : 2 * filters] = 1.0

    def forward(self, x: Tensor, state: tuple[Tensor, Tensor]) -> tuple[Tensor, Tensor]:
        """One object: (B, inputs, R, R) and (hidden, cell), each (B, F, R, R), to the next pair."""
        hidden, cell = state
        gates = self.gates(torch.cat([x, hidden], 1)).to(cell.dtype)  # sums stay exact where maps are halves
        i, f, o, g = gates.chunk(4, 1)  # each (B, F, R, R)
        cell = f.sigmoid() * cell + i.sigmoid() * g.tanh()
        return (o.sigmoid() * cell.tanh()).to(x.dtype), cell


class Level(nn.Module):
    """The LSTM cell and the pixel generator of one resolution."""

    def __init__(self, filters: int) -> None:
        super().__init__()
        self.cell = ConvLSTM(filters + len(TOKENS), filters)
        self.pixels = nn.Sequential(
            nn.Conv2d(filters, filters, 1),
            nn.ReLU(),
            nn.Conv2d(filters, filters, 1),
            nn.ReLU(),
            nn.Conv2d(filters, 3, 1),
        )
        last = self.pixels[-1]
        assert isinstance(last, nn.Conv2d)
        assert last.bias is not None
        nn.init.ones_(last.bias)  # pictures are over white

    def states(self, maps: Tensor, marks: Tensor, count: Tensor | None = None) -> list[Tensor]:
        """Hidden maps (B, F, R, R) after each object, from maps (B, N, F, R, R) and marks (B, N, 4)."""
        hidden = torch.zeros_like(maps[:, 0])
        cell = torch.zeros_like(hidden, dtype=marks.dtype)
        result = []
        for i in range(maps.shape[1]):
            mark = marks[:, i, :, None, None].to(maps.dtype).expand(-1, -1, *maps.shape[3:])
            after = self.cell(torch.cat([maps[:, i], mark], 1), (hidden, cell))
            if count is None:
                hidden, cell = after
            else:
                used = (i < count)[:, None, None, None]
                hidden, cell = (torch.where(used, a, b) for a, b in zip(after, (hidden, cell), strict=True))
            result.append(hidden)
        return result


class Streaming(nn.Module):
    """Parameters and forward pass of the streaming renderer, with the levels of growing if ``grown``."""

    def __init__(self, config: StreamingConfig, *, grown: bool = False) -> None:
        super().__init__()
        self.config = config
        sizes = [config.vector, *(config.filters(r) for r in config.levels)]
        pairs = itertools.pairwise(sizes)
        self.deconvolutions = nn.ModuleList(nn.ConvTranspose2d(a, b, 4, 2, 1) for a, b in pairs)
        first = SMALLEST if grown else config.resolution
        self.stages = nn.ModuleDict({str(r): Level(config.filters(r)) for r in config.levels if r >= first})

    def forward(
        self, vectors: Tensor, tokens: Tensor, count: Tensor | None = None, *, resolution: int | None = None
    ) -> Tensor:
        """Images (B, 3, R, R) of streams, row 0 at the top, of vectors (B, N, D) and tokens (B, N), int64;
        ``count`` (B,) objects are in use, behind which the state stays as it is. In growing, ``resolution``
        is that of a level.
        """
        r = resolution or self.config.resolution
        x = vectors.flatten(0, 1)[..., None, None]
        for deconvolution in self.deconvolutions[: int(math.log2(r))]:
            x = torch.relu(deconvolution(x))  # (B N, F, 2^k, 2^k)
        level = self.stages[str(r)]
        assert isinstance(level, Level)
        maps = x.view(*vectors.shape[:2], *x.shape[1:])  # (B, N, F, R, R)
        marks = one_hot(tokens, len(TOKENS)).to(vectors.dtype)  # (B, N, 4)
        image: Tensor = level.pixels(level.states(maps, marks, count)[-1])
        return image


TILE = 1 << 13  # samples that `reading` answers at a time


@torch.no_grad()
def draw_whole(
    network: Streaming | Reading, program: Program, *, progress: Callable[[float], None] | None = None
) -> Drawing:
    """Draw a Program's objects in stream order; `ProgramError` for other canvases or backgrounds."""
    if program.background is None or min(program.background) < 1.0:
        raise ProgramError("this model draws on white only")
    if (program.tokens > OPERATOR).any():
        raise ProgramError("this model draws no groups")
    width, height = program.canvas
    if not len(program):
        return Drawing(from_samples(np.ones((height, width, 3), np.float32), None), 0, 0, 0)
    device = next(network.parameters()).device
    v = torch.from_numpy(program.vectors.copy())[None].to(device)
    t = torch.from_numpy(program.tokens.astype(np.int64))[None].to(device)
    if isinstance(network, Streaming):
        side = network.config.resolution
        if program.canvas != (side, side):
            raise ProgramError(f"this model draws {side} x {side} pixels, not {width} x {height}")
        result = network(v, t)[0].permute(1, 2, 0)
        pairs = len(program) * side * side
    else:
        result = _sampled(network, v, t, width, height, progress)
        pairs = len(program) * 4 * width * height
    if progress is not None:
        progress(1.0)
    picture = result.clamp(0.0, 1.0).cpu().numpy()
    return Drawing(from_samples(np.ascontiguousarray(picture), None), pairs, 0, width * height)


def _sampled(
    network: Reading, v: Tensor, t: Tensor, width: int, height: int, progress: Callable[[float], None] | None
) -> Tensor:
    """Means (H, W, 3) of the four samples of every pixel."""
    px = 2 / min(width, height)  # world units
    quarter = torch.tensor([-0.25, 0.25], dtype=torch.float64)
    x = ((torch.arange(width, dtype=torch.float64)[:, None] + 0.5 + quarter - width / 2) * px).to(v)
    y = ((height / 2 - 0.5 - torch.arange(height, dtype=torch.float64)[:, None] + quarter) * px).to(v)
    rows = max(1, TILE // (4 * width))
    parts = []
    for top in range(0, height, rows):
        band = y[top : top + rows]  # (rows, 2)
        across, down = x[None, :, None, :], band[:, None, :, None]
        grid = torch.stack([across + 0 * down, down + 0 * across], -1)  # (rows, W, 2, 2, 2)
        shape = grid.shape[:2]
        colours = network(v, t, grid.reshape(1, -1, 2))[0]
        parts.append(colours.view(*shape, 4, 3).mean(2))
        if progress is not None:
            progress(min(1.0, (top + rows) / height))
    return torch.cat(parts)
