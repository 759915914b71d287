"""Programs to pictures: sampling, tiles and threads around `Stream`.

A pixel is the mean of four samples at a quarter of a pixel from its centre. Most pixels have no outline
near them and one look at the centre is as good; only pixels that the network says are near one are
sampled four times. The rule looks at a pixel alone, so that tiles and threads change nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from scenelang.image import Image, from_samples
from scenelang.program.program import ProgramError
from scenelang.renderers.framed import Framed
from scenelang.renderers.kept import Kept
from scenelang.renderers.stream import PixelRows, Shade, Stream

TILE = 1 << 15  # pixels that are drawn at a time
NEAR = 0.85  # pixels: farther from an outline a pixel has one colour
CORNER = 0.36  # pixels from the centre to a sample, a little rounded up


@dataclass(slots=True)
class Drawing:
    """A picture and what it cost.

    Args:
        image: (H, W, 3), or (H, W, 4) with straight alpha.
        pairs: (object, sample) pairs that went through the network.
        refined: pixels that were sampled four times.
        met: pixels that an object reached; the others show the background, unseen by the network.
    """

    image: Image
    pairs: int
    refined: int
    met: int


def draw(
    network: Framed,
    vectors: npt.NDArray[np.float32],
    tokens: npt.NDArray[np.int8],
    canvas: tuple[int, int],
    background: tuple[float, float, float] | None,
    *,
    threads: int = 1,
    split: int | None = None,
    kept: Kept | None = None,
    skip: bool = True,
    adaptive: bool = True,
    refine: bool = True,
    tile: int = TILE,
    progress: Callable[[float], None] | None = None,
) -> Drawing:
    """Draw objects in stream order.

    Args:
        network: trained parameters; the picture is computed on their device.
        vectors: (N, 64).
        tokens: (N,).
        canvas: width and height in pixels.
        background: colour as written, or None for alpha.
        threads: tiles drawn at the same time.
        split: tiles are as high as for so many threads; by default ``threads``.
        kept: the picture before this one, of which tiles that show the same are taken over.
        skip: leave out points that an object cannot reach.
        adaptive: sample once where no outline is near, instead of four times everywhere.
        refine: sample four times near outlines; without it pixels are hard-edged and faster.
        tile: pixels at a time, at least one row.
        progress: called with the share done, from any thread.

    Raises:
        ProgramError: an object's vector holds no way from the world to a leaf, or numbers out of all
            proportion; no compiled scene has such.
    """
    width, height = canvas
    frames = kept.frames if kept is not None else None
    stream = Stream(network, vectors, tokens, skip=skip, frames=frames)
    rows = max(1, min(tile // width, -(-height // (split or threads))))
    tiles = [range(top, min(top + rows, height)) for top in range(0, height, rows)]
    out = np.empty((height, width, 4), np.float32)
    pairs, refined, met = [0] * len(tiles), [0] * len(tiles), [0] * len(tiles)
    finished: list[int] = []

    shown = kept.compare(stream, canvas, tiles) if kept is not None and skip and adaptive else None

    def one(index: int) -> None:
        band = tiles[index]
        if shown is not None and shown.same[index]:
            out[band.start : band.stop] = shown.before[band.start : band.stop]
        else:
            picture, pairs[index], refined[index], met[index] = _tile(stream, canvas, band, adaptive, refine)
            out[band.start : band.stop] = picture.reshape(len(band), width, 4)
        finished.append(index)
        if progress is not None:
            progress(len(finished) / len(tiles))

    if threads == 1 or len(tiles) == 1:
        for index in range(len(tiles)):
            one(index)
    else:
        # every worker computes on one core; torch would otherwise split each small product again
        with ThreadPoolExecutor(threads, initializer=torch.set_num_threads, initargs=(1,)) as pool:
            list(pool.map(one, range(len(tiles))))
    if kept is not None and shown is not None:
        kept.keep(out, shown, stream)
    if not np.isfinite(out).all():
        raise ProgramError("numbers that the network cannot draw with")
    colour, alpha = out[..., :3], out[..., 3]
    if background is None:
        return Drawing(from_samples(colour, alpha), sum(pairs), sum(refined), sum(met))
    colour += (1 - alpha)[..., None] * np.asarray(background, np.float32)
    return Drawing(from_samples(colour, None), sum(pairs), sum(refined), sum(met))


def _tile(
    stream: Stream, canvas: tuple[int, int], rows: range, adaptive: bool, refine: bool
) -> tuple[Tensor, int, int, int]:
    """Premultiplied colour and coverage (pixels, 4) of some rows, pairs evaluated, pixels refined, met."""
    width, height = canvas
    px = 2 / min(width, height)  # world units
    # float64 up to here: at 8192 pixels float32 would move samples by a hundredth of a pixel
    x = (torch.arange(width, dtype=torch.float64) + 0.5 - width / 2) * px
    y = (height / 2 - 0.5 - torch.arange(rows.start, rows.stop, dtype=torch.float64)) * px
    x = x.float().to(stream.device).repeat(len(rows))
    y = y.float().to(stream.device).repeat_interleave(width)
    if not adaptive:
        shade = _four(stream, x, y, px)
        return _means(shade).cpu(), shade.evaluated, x.numel(), int(shade.met.view(-1, 4).any(1).sum())
    shade = stream.shade(x, y, CORNER * px if refine else 0.0, PixelRows(-y.cpu().numpy()))
    picture = shade.premultiplied().T.contiguous()
    met = int(shade.met.sum())
    if not refine:
        return picture.cpu(), shade.evaluated, 0, met
    near = (shade.edge < NEAR * px).nonzero()[:, 0]
    pairs = shade.evaluated
    if near.numel():
        closer = _four(stream, x[near], y[near], px)
        picture[near] = _means(closer)
        pairs += closer.evaluated
    return picture.cpu(), pairs, near.numel(), met


def _four(stream: Stream, x: Tensor, y: Tensor, px: float) -> Shade:
    """The four samples, side by side, of pixels centred at x, y."""
    offsets = torch.tensor([-0.25, 0.25], device=x.device) * px
    sx = (x[:, None, None] + offsets[None, None, :]).expand(-1, 2, 2).reshape(-1)
    sy = (y[:, None, None] + offsets[None, :, None]).expand(-1, 2, 2).reshape(-1)
    return stream.shade(sx, sy, 0.0, PixelRows(-y.cpu().numpy(), 4, 0.3 * px))


def _means(shade: Shade) -> Tensor:
    """Premultiplied colour and coverage (M, 4) of pixels of four samples each."""
    return shade.premultiplied().view(4, -1, 4).mean(2).T.contiguous()
