"""Coverage: how pixels of the plane ask the field, with as few questions as show.

A pixel is the mean of four samples at a quarter of a pixel from its centre. Most pixels have no outline
near them and one look at the centre is as good; only pixels that the network says are near one are
sampled four times. An object is met only by the points that it can reach. Both rules look at a pixel
alone, so that tiles and threads change nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenelang.renderers.arrays import Array
from scenelang.renderers.field import Field, Row
from scenelang.renderers.network import RADIUS

CHUNK = 4096  # points that go through the network at once; their activations stay in the L2 cache
NEAR = 0.85  # pixels: farther from an outline a pixel has one colour
CORNER = 0.36  # pixels from the centre to a sample, a little rounded up
_ROUNDING = 1e-6  # world units


@dataclass(slots=True)
class Shade:
    """What `Coverage.shade` gives at M points.

    Args:
        picture: premultiplied colour, and coverage in [0, 1], (4, M).
        edge: (M,) world distance to the nearest outline, as the network sees it, at most.
        evaluated: number of (object, point) pairs that went through the network.
        met: (M,) which points went through it at all; the others show the background.
    """

    picture: Array
    edge: Array
    evaluated: int
    met: Array


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


@dataclass(slots=True)
class Tile:
    """Some rows of pixels.

    Args:
        picture: premultiplied colour and coverage (pixels, 4).
        pairs: (object, sample) pairs that went through the network.
        refined: pixels that were sampled four times.
        met: pixels that an object reached.
    """

    picture: np.ndarray
    pairs: int
    refined: int
    met: int


class Coverage:
    """Asks a field for pixels.

    Args:
        skip: leave out the points that an object cannot reach.
    """

    def __init__(self, field: Field, *, skip: bool = True) -> None:
        self.field, self.xp, self.skip = field, field.xp, skip
        self._reach = np.array(
            [(r.frame.centre[1], *r.frame.half[1], self.reach(r), r.frame.growth) for r in field.rows],
            np.float64,
        ).reshape(-1, 5)

    def reach(self, row: Row) -> float:
        """Leaf units from its origin up to which points meet an object; inf where all do."""
        return row.reach if self.skip else float("inf")

    def tile(self, canvas: tuple[int, int], rows: range, samples: str) -> Tile:
        """Draw some rows of a picture; see `scenelang.renderers.draw.draw`."""
        xp, refine = self.xp, samples == "adaptive"
        width, height = canvas
        px = 2 / min(width, height)  # world units
        # float64 up to here: at 8192 pixels float32 would move samples by a hundredth of a pixel
        x = (np.arange(width) + 0.5 - width / 2) * px
        y = (height / 2 - 0.5 - np.arange(rows.start, rows.stop)) * px
        grid = np.empty((2, len(rows), width), np.float32)
        grid[0], grid[1] = x, y[:, None]
        centres = grid.reshape(2, -1)
        points = xp.array(centres, self.field.network.codes)
        if samples == "four":
            shade = self._four(points, centres[1], px)
            met = int(shade.met.reshape(-1, 4).any(1).sum())
            return Tile(xp.to_numpy(_means(shade)).T, shade.evaluated, centres.shape[1], met)
        shade = self.shade(points, CORNER * px if refine else 0.0, PixelRows(-centres[1]))
        pairs, refined = shade.evaluated, 0
        if refine and (refined := len(near := xp.where(shade.edge < NEAR * px))):
            closer = self._four(xp.take(points, near), centres[1][xp.to_numpy(near)], px)
            xp.put(shade.picture, near, _means(closer))
            pairs += closer.evaluated
        return Tile(xp.to_numpy(shade.picture).T, pairs, refined, int(shade.met.sum()))

    def _four(self, p: Array, y: np.ndarray, px: float) -> Shade:
        """The four samples, side by side, of pixels centred at points (2, M), whose y are (M,)."""
        quarter = np.array([[-0.25, 0.25, -0.25, 0.25], [-0.25, -0.25, 0.25, 0.25]], np.float32)
        samples = p[:, :, None] + self.xp.array(quarter * np.float32(px), p)[:, None]  # (2, M, 4)
        return self.shade(samples.reshape(2, -1), 0.0, PixelRows(-y, 4, 0.3 * px))

    def shade(self, p: Array, pad: float = 0.0, rows: PixelRows | None = None) -> Shade:
        """Draw at world points.

        Args:
            p: (2, M).
            pad: objects that come within so many world units of a point meet it.
            rows: how the points lie in rows; saves an object the look at points above and below it.
        """
        field, xp, count = self.field, self.xp, p.shape[1]
        with xp.inference():
            memory = field.empty(count)  # state and register of each point
            edge = xp.full((count,), float("inf"), p)
            touched = edge < 0  # what nothing was drawn on stays empty whatever follows
            evaluated = 0
            for row in field.rows if rows is None else self._near(rows, pad):
                index, q, radius = self.meeting(row, p, touched, pad, rows)
                met = q.shape[1]
                evaluated += met
                for start in range(0, met, CHUNK):
                    at = slice(start, start + CHUNK)
                    points, lengths = q[:, at], None if radius is None else radius[at]
                    if index is None:
                        memory[:, at], near = field.meet(row, points, lengths, memory[:, at])
                        edge[at] = xp.minimum(edge[at], near)
                        continue
                    part = index[at]
                    new, near = field.meet(row, points, lengths, xp.take(memory, part))
                    xp.put(memory, part, new)
                    xp.put(edge, part, xp.minimum(xp.take(edge, part), near))
            edge = xp.minimum(edge, abs(memory[0]) / field.unit)
            met = touched if self.skip else touched | bool(field.rows)
            return Shade(field.picture(memory), edge, evaluated, met)

    def _near(self, rows: PixelRows, pad: float) -> list[Row]:
        """The objects that may meet points in some rows; `meeting` finds none for the others."""
        if not len(rows.down):
            return []
        y, slope, more, reach, growth = self._reach.T
        high = slope * (reach + pad * growth) + more + rows.spread + _ROUNDING
        near = ((y + high >= -rows.down[-1]) & (y - high <= -rows.down[0])) | np.isinf(reach)
        return [self.field.rows[i] for i in np.flatnonzero(near).tolist()]

    def meeting(
        self, row: Row, p: Array, touched: Array, pad: float, rows: PixelRows | None
    ) -> tuple[Array | None, Array, Array | None]:
        """Which points an object meets, and marks those on which a union draws.

        Returns:
            Their indices (k,), None for all, leaf coordinates (2, k), and lengths (k,), None if all are near.
        """
        field, xp, reach = self.field, self.xp, self.reach(row)
        if reach == float("inf"):
            index = xp.where(touched) if self.skip else None
            q = field.local(row, p if index is None else xp.take(p, index))
            return index, q, xp.length(list(q))
        reach += pad * row.frame.growth
        xmin, ymin, xmax, ymax = row.frame.box(reach)
        first, last = (0, p.shape[1]) if rows is None else rows.between(ymin, ymax)
        x, y = p[:, first : max(first, last)]
        index = xp.where((x >= xmin) & (x <= xmax) & (y >= ymin) & (y <= ymax)) + first
        q = field.local(row, xp.take(p, index))
        radius = xp.length(list(q))
        near = radius <= reach
        if not row.draws:
            near &= xp.take(touched, index)
        kept = xp.where(near)
        index = xp.take(index, kept)
        if row.draws:
            touched[index] = True
        return index, xp.take(q, kept), xp.take(radius, kept) if reach > RADIUS else None


def _means(shade: Shade) -> Array:
    """Premultiplied colour and coverage (4, M) of pixels of four samples each."""
    return shade.picture.reshape(4, -1, 4).mean(2)
