"""The paper's streaming renderer: a ConvLSTM over whole images.

Source: Granskog, Schnabel, Rousselle, Novák, *Neural Scene Graph Rendering*, ACM TOG 40(4), 2021, section 4,
and Table 3 of its supplement (filters of each resolution, progressive growing).

Letters: B scenes, N objects, D = d_g + d_m numbers of an object, F filters of a level, R = resolution.

An object's vectors pass through deconvolutions from 1 x 1 to R x R; the boolean token is joined to the
feature map there; a convolutional LSTM (Shi et al. 2015) takes the maps one after the other; three 1 x 1
convolutions turn its last hidden map into colours.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn.functional import interpolate, one_hot

from scenelang.words import TOKENS

SMALLEST = 4  # pixels along a side at which growing starts
# Table 3: filters at each resolution, 1 x 1 up to 512 x 512
FILTERS = {2: 256, 4: 256, 8: 256, 16: 256, 32: 256, 64: 128, 128: 64, 256: 32, 512: 32}


@dataclass(frozen=True, slots=True)
class StreamingConfig:
    """Sizes of the network.

    Args:
        vector: numbers D of an object.
        resolution: pixels along a side, a power of two from 4 to 512.
        width: share of the filters of Table 3; 1 is the paper's network.
        most: filters of a level at most.
    """

    vector: int = 64
    resolution: int = 32
    width: float = 1.0
    most: int = 256

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
    """A convolutional LSTM cell without peepholes: four 5 x 5 convolutions in one.

    Args:
        inputs: channels of an object's map, tokens among them.
        filters: channels F of state and output.
    """

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
    """What belongs to one resolution: the LSTM cell and the pixel generator."""

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
        """Hidden maps (B, F, R, R) after each object of a stream.

        Args:
            maps: of the objects (B, N, F, R, R).
            marks: tokens as one of four (B, N, 4).
            count: as `Streaming.forward` takes it.
        """
        hidden = torch.zeros_like(maps[:, 0])
        cell = torch.zeros_like(hidden, dtype=marks.dtype)
        found = []
        for i in range(maps.shape[1]):
            mark = marks[:, i, :, None, None].to(maps.dtype).expand(-1, -1, *maps.shape[3:])
            after = self.cell(torch.cat([maps[:, i], mark], 1), (hidden, cell))
            if count is None:
                hidden, cell = after
            else:
                used = (i < count)[:, None, None, None]
                hidden, cell = (torch.where(used, a, b) for a, b in zip(after, (hidden, cell), strict=True))
            found.append(hidden)
        return found


class Streaming(nn.Module):
    """Parameters and forward pass of the streaming renderer.

    Args:
        grown: build the levels of growing too, from 4 x 4; else the last alone.
    """

    def __init__(self, config: StreamingConfig, *, grown: bool = False) -> None:
        super().__init__()
        self.config = config
        sizes = [config.vector, *(config.filters(r) for r in config.levels)]
        self.deconvolutions = nn.ModuleList(
            nn.ConvTranspose2d(a, b, 4, 2, 1) for a, b in itertools.pairwise(sizes)
        )
        first = SMALLEST if grown else config.resolution
        self.stages = nn.ModuleDict({str(r): Level(config.filters(r)) for r in config.levels if r >= first})

    @torch.no_grad()
    def enlarge(self, resolution: int) -> bool:
        """Let a level of growing begin as the one below it, enlarged, instead of as noise.

        The new deconvolution becomes a bilinear enlargement of each channel, and the new cell and pixel
        generator copies of the old ones, if both levels have as many filters. Gives whether they have.
        """
        f, at = self.config.filters(resolution), int(math.log2(resolution)) - 1
        if self.config.filters(resolution // 2) != f:
            return False
        deconvolution = self.deconvolutions[at]
        assert isinstance(deconvolution, nn.ConvTranspose2d)
        assert deconvolution.bias is not None
        tent = torch.tensor([0.25, 0.75, 0.75, 0.25], device=deconvolution.weight.device)
        same = torch.eye(f, device=tent.device)
        deconvolution.weight.copy_(same[:, :, None, None] * torch.outer(tent, tent))
        deconvolution.bias.zero_()
        self.stages[str(resolution)].load_state_dict(self.stages[str(resolution // 2)].state_dict())
        return True

    def forward(
        self,
        vectors: Tensor,
        tokens: Tensor,
        count: Tensor | None = None,
        *,
        resolution: int | None = None,
        blend: float = 1.0,
    ) -> Tensor:
        """Images (B, 3, R, R) of streams, row 0 at the top.

        Args:
            vectors: (B, N, D).
            tokens: (B, N), int64.
            count: (B,) objects in use; the state stays as it is for the padding after them.
            resolution: draw at this level of growing instead of the last.
            blend: share of this level's image; the rest is that of the level below, enlarged.
        """
        r = resolution or self.config.resolution
        steps = int(math.log2(r))
        b, n, _ = vectors.shape
        marks = one_hot(tokens, len(TOKENS)).to(vectors.dtype)  # (B, N, 4)
        x = vectors.reshape(b * n, -1, 1, 1)
        below = None
        for deconvolution in self.deconvolutions[:steps]:
            below, x = x, torch.relu(deconvolution(x))  # (B N, F, 2^k, 2^k)
        new = self._level(r, x, marks, count)
        if blend >= 1.0:
            return new
        assert below is not None
        old = self._level(r // 2, below, marks, count)
        return blend * new + (1 - blend) * interpolate(old, scale_factor=2, mode="nearest")

    def _level(self, resolution: int, x: Tensor, marks: Tensor, count: Tensor | None) -> Tensor:
        level = self.stages[str(resolution)]
        assert isinstance(level, Level)
        maps = x.view(*marks.shape[:2], *x.shape[1:])  # (B, N, F, R, R)
        image: Tensor = level.pixels(level.states(maps, marks, count)[-1])
        return image
