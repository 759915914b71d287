"""What pixels of a plane scene show for certain: regions are asked, then quarters of them, then samples.

A region's distance to an object is the exact one at its centre, enclosed, give or take how far the region
reaches in the leaf's own coordinates, as exact distances change by no more. Intervals through the exact fold
say what it shows. Where that is one colour, all of its samples do. Elsewhere objects that are certain to
change nothing are dropped, and the region's quarters are asked, down to single samples.
"""

from __future__ import annotations

import numpy as np

from scenelang.proof.fold import NOTHING, Enclosure, Floats, blended, enclosed
from scenelang.proof.stream import Stream
from scenelang.renderers.meetings import Index, Mask, Pairs, meetings_of, nesting
from scenelang.renderers.raster import raster

SIDES = 16, 8, 4, 2, 1  # of regions, samples: two along a side of a pixel
FLAT = 5e-4  # of a channel: a region that is known so well is not cut


class Band:
    """Some rows of pixels.

    Args:
        canvas: width and height, pixels.
        behind: (K,) what is shown where nothing is.

    Attributes:
        shown: by pixels (rows, width, K).
    """

    def __init__(self, stream: Stream, canvas: tuple[int, int], rows: range, behind: Floats) -> None:
        self._stream, self._behind, self._reach = stream, behind, stream.reach
        width, height = canvas
        self._grid = grid = raster(
            (2 * width, 2 * height), range(2 * rows.start, 2 * rows.stop), largest=SIDES[0]
        )
        self._every = np.empty((2, grid.high // 2, grid.wide // 2, len(behind)))
        self._every[:] = behind
        self.shown = Enclosure(*self._every[:, : len(rows), :width])
        pairs = grid.reached(stream.frames, self._reach)
        for side in SIDES[:-1]:
            columns, shown, pairs = self._looked(pairs, side)
            known = (shown.high - shown.low).max(0) <= FLAT
            self._write(columns[known], Enclosure(shown.low[:, known], shown.high[:, known]), side)
            done = np.zeros(grid.wide * grid.high // side**2, bool)
            done[columns[known]] = True
            pairs = pairs.take(~done[pairs.block])
            if side > 2:
                pairs = pairs.split(grid.wide // side, 2)
        self._pixels = pairs  # those that are told by their samples
        self._sampled(exactly=False)

    def draw(self, wanted: Mask) -> None:
        """Ask for pixels (rows, width) by exact distances, among those that are told by their samples."""
        every = np.zeros(self._every.shape[1:3], bool)
        every[: wanted.shape[0], : wanted.shape[1]] = wanted
        self._pixels = self._pixels.take(every.ravel()[self._pixels.block])
        self._sampled(exactly=True)

    def _looked(self, pairs: Pairs, side: int, exactly: bool = False) -> tuple[Index, Enclosure, Pairs]:
        """Regions, what they show (K, B), and the pairs that have to be asked again."""
        stream, grid = self._stream, self._grid
        place, half = np.stack(grid.place(pairs.block, side)), (side - 1) / 2
        centre = np.array([[grid.left], [grid.top]]) + (place + half) * [[grid.px], [-grid.px]]
        world = np.full(len(pairs), half * 2**0.5 * grid.px)
        q, radius = stream.frames.blocks(pairs.object, centre, world)
        radius = radius + stream.rounding[pairs.object]
        some = np.flatnonzero(~(np.hypot(*q) - radius > self._reach[pairs.object]))
        pairs = pairs.take(some)
        meetings, source = meetings_of(pairs)
        thing, some = meetings.pairs.object, some[source]
        q, radius, scale = q[:, some], radius[some], stream.frames.scale[thing]
        exact, colour = stream.distance(thing, q, exactly), stream.colour(thing, q, side == 1)
        # what is not a number bounds nothing
        low = np.fmax((exact.low - radius) * scale, -NOTHING)
        world_distance = Enclosure(low, np.fmin((exact.high + radius) * scale, NOTHING))
        joins, nest = stream.joins.some(thing), None
        if stream.groups.deepest:
            nest = nesting(meetings, stream.groups)
        else:
            joins = joins._replace(free=~blended(meetings, stream.rounds[thing]))
        told = enclosed(meetings, world_distance, colour, joins, self._behind, nest, stream.group_joins)
        left = np.empty(len(pairs), bool)
        left[source] = told.left
        return meetings.columns, told.shown, pairs.take(left)

    def _write(self, region: Index, shown: Enclosure, side: int) -> None:
        x, y = self._grid.place(region, side)
        for every, values in zip(self._every, shown, strict=True):
            shape = self._grid.high // side, side // 2, -1, side // 2, len(self._behind)
            every.reshape(shape)[y // side, :, x // side] = values.T[:, None, None]

    def _sampled(self, *, exactly: bool) -> None:
        """Ask for the samples of pixels that they have to tell, and take their means."""
        wide = self._grid.wide // 2
        columns, shown, _ = self._looked(self._pixels.split(wide, 2), 1, exactly)
        x, y = self._grid.place(columns, 1)
        for every, values in zip(self._every, shown, strict=True):
            flat = every.reshape(-1, len(self._behind))
            flat[self._pixels.block] = self._behind
            np.add.at(flat, y // 2 * wide + x // 2, (values.T - self._behind) / 4)
