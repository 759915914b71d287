"""Programs to pictures: tiles and threads around `Coverage`, whichever library the network is in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenelang.image import Image, from_samples
from scenelang.program.program import Program, ProgramError
from scenelang.renderers.coverage import Coverage, Tile
from scenelang.renderers.field import Field
from scenelang.renderers.kept import Kept
from scenelang.renderers.network import FramedNetwork

if TYPE_CHECKING:
    from scenelang.renderers.solid.network import SolidNetwork

TILE = 1 << 15  # pixels that are drawn at a time


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


def draw_objects(
    network: FramedNetwork | SolidNetwork,
    program: Program,
    *,
    threads: int = 1,
    split: int | None = None,
    kept: Kept | None = None,
    skip: bool = True,
    samples: str = "adaptive",
    progress: Callable[[float], None] | None = None,
) -> Drawing:
    """Draw a Program of the plane or of solids, as `draw` does.

    Solids are drawn anew in each picture, and always with the rules that ``skip`` leaves out.

    Raises:
        ProgramError: as `draw`, or the Program and the network are of different dimensions.
    """
    if network.layout.dimension == 2:
        if program.stage is not None:
            raise ProgramError("a program of solids, which the model does not draw")
        return draw(
            network,  # type: ignore[arg-type]
            program,
            threads=threads,
            split=split,
            kept=kept,
            skip=skip,
            samples=samples,
            progress=progress,
        )
    from scenelang.renderers.solid.draw import draw_solids
    from scenelang.renderers.solid.field import SolidField

    if program.stage is None:
        raise ProgramError("a program of the plane, which the model does not draw")
    field = SolidField(network, program.vectors, program.tokens)  # type: ignore[arg-type]
    image, met = draw_solids(field, program.stage, program.canvas, adaptive=samples == "adaptive")
    return Drawing(image, met, 0, 0)


def draw(
    network: FramedNetwork,
    program: Program,
    *,
    threads: int = 1,
    split: int | None = None,
    kept: Kept | None = None,
    skip: bool = True,
    samples: str = "adaptive",
    tile: int = TILE,
    progress: Callable[[float], None] | None = None,
) -> Drawing:
    """Draw a Program's objects in stream order.

    Args:
        network: trained parameters; the picture is computed on their device.
        program: compiled for them.
        threads: tiles drawn at the same time.
        split: tiles are as high as for so many threads; by default ``threads``.
        kept: the picture before this one, of which tiles that show the same are taken over.
        skip: leave out points that an object cannot reach.
        samples: of a pixel: ``"adaptive"``, four near outlines and one elsewhere, ``"four"`` or ``"one"``.
        tile: pixels at a time, at least one row.
        progress: called with the share done, from any thread.

    Raises:
        ProgramError: an object's vector holds no way from the world to a leaf, or numbers out of all
            proportion; no compiled scene has such.
    """
    width, height = program.canvas
    field = Field(network, program.vectors, program.tokens, frames=kept.frames if kept is not None else None)
    coverage = Coverage(field, skip=skip)
    rows = max(1, min(tile // width, -(-height // (split or threads))))
    tiles = [range(top, min(top + rows, height)) for top in range(0, height, rows)]
    out = np.empty((height, width, 4), np.float32)
    drawn: list[Tile] = []
    finished: list[int] = []
    seen = (
        kept.look(coverage, program.canvas, tiles)
        if kept is not None and skip and samples != "four"
        else None
    )

    def one(index: int) -> None:
        band = tiles[index]
        if kept is not None and seen is not None and kept.shows(index, seen, out.shape):
            out[band.start : band.stop] = kept.picture[band.start : band.stop]
        else:
            found = coverage.tile(program.canvas, band, samples)
            out[band.start : band.stop] = found.picture.reshape(len(band), width, 4)
            drawn.append(found)
        finished.append(index)
        if progress is not None:
            progress(len(finished) / len(tiles))

    if threads == 1 or len(tiles) == 1:
        for index in range(len(tiles)):
            one(index)
    else:
        from concurrent.futures import ThreadPoolExecutor

        # every worker computes on one core; torch would otherwise split each small product again
        with ThreadPoolExecutor(threads, initializer=network.xp.one_core) as pool:
            list(pool.map(one, range(len(tiles))))
    if kept is not None and seen is not None:
        kept.picture, kept.keys, kept.frames = out.copy(), seen, field.frames
    if not np.isfinite(out).all():
        raise ProgramError("a damaged program: numbers that the network cannot draw with")
    cost = [sum(getattr(t, name) for t in drawn) for name in ("pairs", "refined", "met")]
    colour, alpha = out[..., :3], out[..., 3]
    if program.background is None:
        return Drawing(from_samples(colour, alpha), *cost)
    colour += (1 - alpha)[..., None] * np.asarray(program.background, np.float32)
    return Drawing(from_samples(colour, None), *cost)
