"""What pixels of a plane scene show for certain: regions are asked, then quarters of them, then samples.

A region's distance to an object is the exact one at its centre, enclosed, give or take how far the region
reaches in the leaf's own coordinates, as exact distances change by no more. Intervals through the exact fold
say what it shows. Where that is one colour, all of its samples do. Elsewhere objects that are certain to
change nothing are dropped, and the region's quarters are asked, down to single samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scenelang.proof.fold import INTERSECT, NOTHING, SMOOTH, SUBTRACT, Enclosure, Floats, Mask, enclosed
from scenelang.renderers.frames import Frames
from scenelang.renderers.meetings import Index, Pairs, meetings_of

SIDES = 8, 4, 2, 1  # of regions, pixels
FLAT = 5e-4  # of a channel: a region that is known so well is not cut
Distance = Callable[[Index, Floats], Enclosure]


@dataclass(frozen=True, slots=True)
class Objects:
    """A stream of N objects, in float64.

    Args:
        frames: their ways from the world to their leaves.
        tokens, widths: (N,) operators, and widths of blends.
        colour: encloses what is shown (3, P) of some of them (P,), within radii (P,) of leaf coordinates
            (2, P).
        distance: likewise their exact distances (P,), in leaf units, at leaf coordinates.
        exact: the same, as the language defines them.
    """

    frames: Frames
    tokens: Index
    widths: Floats
    colour: Callable[[Index, Floats, Floats], Enclosure]
    distance: Distance
    exact: Distance

    @property
    def reach(self) -> Floats:
        """Leaf units (N,) from its origin beyond which an object has no say.

        Without it the fold is the same, or both folds are so far outside of everything that the blends to
        come, each of which brings them nearer by its width at most, leave them outside.
        """
        blends = np.where(self.tokens == SMOOTH, self.widths, 0.0)[::-1].cumsum()[::-1]
        every = (self.tokens == INTERSECT) | ((self.tokens == SUBTRACT) & (blends > 0))
        return np.where(every, np.inf, 1.0 + blends / self.frames.scale)


class Band:
    """Some rows of pixels.

    Args:
        canvas: width and height, pixels.
        behind: (K,) what is shown where nothing is.

    Attributes:
        shown: by pixels (rows, width, K), once they have been asked.
    """

    def __init__(self, objects: Objects, canvas: tuple[int, int], rows: range, behind: Floats) -> None:
        self._objects, self._behind, self._reach = objects, behind, objects.reach
        self._px = 2 / min(canvas)  # world units
        self._corner = -canvas[0] / 2 * self._px, (canvas[1] / 2 - rows.start) * self._px
        self._size = tuple(-(-n // SIDES[0]) * SIDES[0] for n in (len(rows), canvas[0]))
        self._every = np.empty((2, *self._size, len(behind)))
        self._every[:] = behind
        self.shown = Enclosure(*self._every[:, : len(rows), : canvas[0]])
        region, thing = self._first()
        for side in SIDES:
            region, thing = self._cut(region, thing, side)
            columns, shown, region, thing = self._looked(region, thing, side, objects.distance)
            known = (shown.high - shown.low).max(0) <= FLAT
            self._write(columns[known], Enclosure(*(values[:, known] for values in shown)), side)
            done = np.zeros(self._size[0] * self._size[1] // side**2, bool)
            done[columns[known]] = True
            left = ~done[region]
            region, thing = region[left], thing[left]
        self._region, self._thing = region, thing  # pixels that are told by their samples
        self._sampled(objects.distance)

    def draw(self, wanted: Mask) -> int:
        """Ask for pixels (rows, width) by exact distances where samples told what they show; how many."""
        every = np.zeros(self._size, bool)
        every[: wanted.shape[0], : wanted.shape[1]] = wanted
        left = every.ravel()[self._region]
        self._region, self._thing = self._region[left], self._thing[left]
        return self._sampled(self._objects.exact)

    def _first(self) -> tuple[Index, Index]:
        """Objects and the largest regions that they may reach, by regions."""
        size = SIDES[0] * self._px
        low, high = self._objects.frames.boxes(np.where(np.isinf(self._reach), 0.0, self._reach))
        most = np.array(self._size[::-1])[:, None] / SIDES[0]
        left, top = self._corner
        ends = np.stack([[low[0] - left, top - high[1]], [high[0] - left, top - low[1]]]) / size
        # what is not a number rules nothing out
        first = np.floor(np.fmax(ends[0] - 1e-6, 0)).clip(None, most)
        last = np.ceil(np.fmin(ends[1] + 1e-6, most)).clip(0)
        first, last = np.where(np.isinf(self._reach), 0, first), np.where(np.isinf(self._reach), most, last)
        first, (wide, high) = first.astype(np.intp), (last - first).astype(np.intp)
        thing = np.repeat(np.arange(len(wide)), wide * high)
        at = np.arange(len(thing)) - np.repeat(np.cumsum(wide * high) - wide * high, wide * high)
        y, x = np.divmod(at, wide[thing])
        region = (first[1][thing] + y) * int(most[0, 0]) + first[0][thing] + x
        by = np.argsort(region, kind="stable")
        return region[by], thing[by]

    def _cut(self, region: Index, thing: Index, side: float) -> tuple[Index, Index]:
        """The quarters of regions of twice a side, by regions; the largest as they are."""
        if side == SIDES[0]:
            return region, thing
        wide = int(self._size[1] / side)
        y, x = np.divmod(region, wide // 2)
        first = 2 * (y * wide + x)
        quarters = (first[:, None] + [0, 1, wide, wide + 1]).ravel()
        by = np.argsort(quarters, kind="stable")
        return quarters[by], thing[by // 4]

    def _looked(
        self, region: Index, thing: Index, side: float, distance: Distance
    ) -> tuple[Index, Enclosure, Index, Index]:
        """Regions, what they show (K, B), and the pairs that have to be asked again."""
        objects = self._objects
        y, x = np.divmod(region, int(self._size[1] / side))
        centre = np.stack([(x + 0.5) * side, -(y + 0.5) * side]) * self._px + np.reshape(self._corner, (2, 1))
        half = (side - 0.5) / 2**0.5 * self._px  # to the farthest sample
        q, radius = objects.frames.blocks(thing, centre, np.full(len(region), half))
        some = np.flatnonzero(~(np.hypot(*q) - radius > self._reach[thing]))
        none = np.zeros(len(some))
        pairs = Pairs(region[some], thing[some], none > 0, none > 0, none)
        meetings, source = meetings_of(pairs)
        some, thing = some[source], meetings.pairs.object
        q, radius, scale = q[:, some], radius[some], objects.frames.scale[thing]
        found, colour = distance(thing, q), objects.colour(thing, q, radius)
        # what is not a number bounds nothing
        low = np.fmax((found.low - radius) * scale, -NOTHING)
        world = Enclosure(low, np.fmin((found.high + radius) * scale, NOTHING))
        shown, left = enclosed(
            meetings, world, colour, objects.tokens[thing], objects.widths[thing], self._behind
        )
        kept = np.empty(len(some), bool)
        kept[source] = left
        return meetings.columns, shown, pairs.block[kept], pairs.object[kept]

    def _write(self, region: Index, shown: Enclosure, side: int) -> None:
        y, x = np.divmod(region, self._size[1] // side)
        for every, values in zip(self._every, shown, strict=True):
            shape = self._size[0] // side, side, -1, side, len(self._behind)
            every.reshape(shape)[y, :, x] = values.T[:, None, None]

    def _sampled(self, distance: Distance) -> int:
        """Ask for the samples of pixels that they have to tell, and take their means; how many pixels."""
        pixels = np.unique(self._region)
        columns, shown, _, _ = self._looked(*self._cut(self._region, self._thing, 0.5), 0.5, distance)
        y, x = np.divmod(columns, 2 * self._size[1])
        for every, values in zip(self._every, shown, strict=True):
            flat = every.reshape(-1, len(self._behind))
            flat[pixels] = self._behind
            np.add.at(flat, y // 2 * self._size[1] + x // 2, (values.T - self._behind) / 4)
        return len(pixels)
