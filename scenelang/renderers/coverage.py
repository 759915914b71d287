"""Coverage: how pixels of the plane ask the field, with as few questions as show.

A pixel is the mean of four samples at a quarter of a pixel from its centre. Most pixels have no outline
near them and one look at the centre is as good; only pixels that the network says are near one are
sampled four times. Elsewhere only textures are looked up at all four. An object is met only by the points
that it can reach. These rules look at a pixel alone, so that tiles and threads change nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenelang.renderers.arrays import Array
from scenelang.renderers.field import SMOOTH, Field, Row
from scenelang.renderers.network import RADIUS

CHUNK = 4096  # points that go through the network at once; their activations stay in the L2 cache
NEAR = 0.85  # pixels: farther from an outline a pixel has one colour
CORNER = 0.36  # pixels from the centre to a sample, a little rounded up
NARROW = 1 / 16  # of a pixel by the width of a blend: above it colours change much across the pixel
LEAST = 1e-4  # of a colour, that counts as part of what a point shows
NOBODY = -1.0  # in place of an object's number
_ROUNDING = 1e-6  # world units
_FOUR = np.array([[-0.25, 0.25, -0.25, 0.25], [-0.25, -0.25, 0.25, 0.25]], np.float32)  # pixels


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
        pad, spread = (CORNER * px, px) if refine else (0.0, 0.0)
        shade = self.shade(points, pad, PixelRows(-centres[1]), spread)
        pairs, refined = shade.evaluated, 0
        if refine and (refined := len(near := xp.where(shade.edge < NEAR * px))):
            closer = self._four(xp.take(points, near), centres[1][xp.to_numpy(near)], px)
            xp.put(shade.picture, near, _means(closer))
            pairs += closer.evaluated
        return Tile(xp.to_numpy(shade.picture).T, pairs, refined, int(shade.met.sum()))

    def _four(self, p: Array, y: np.ndarray, px: float) -> Shade:
        """The four samples, side by side, of pixels centred at points (2, M), whose y are (M,)."""
        samples = p[:, :, None] + self.xp.array(_FOUR * np.float32(px), p)[:, None]  # (2, M, 4)
        return self.shade(samples.reshape(2, -1), 0.0, PixelRows(-y, 4, 0.3 * px))

    def shade(self, p: Array, pad: float = 0.0, rows: PixelRows | None = None, spread: float = 0.0) -> Shade:
        """Draw at world points.

        Args:
            p: (2, M).
            pad: objects that come within so many world units of a point meet it.
            rows: how the points lie in rows; saves an object the look at points above and below it.
            spread: side of the pixels for which textures are looked up four times, world units; 0: once.
        """
        field, xp, count = self.field, self.xp, p.shape[1]
        with xp.inference():
            worn = Worn(field, p, spread) if field.textured else None
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
                    part = at if index is None else index[at]
                    before = memory[:, at] if index is None else xp.take(memory, part)
                    new, d = field.meet(row, points, lengths, before)
                    near = abs(d) / row.frame.stretch
                    if worn is not None:
                        worn.note(
                            row, xp.where(edge == edge)[part] if index is None else part, before, new, d
                        )
                    if index is None:
                        memory[:, at], edge[at] = new, xp.minimum(edge[at], near)
                        continue
                    xp.put(memory, part, new)
                    xp.put(edge, part, xp.minimum(xp.take(edge, part), near))
            edge = xp.minimum(edge, abs(memory[0]) / field.unit)
            if worn is not None:
                edge = worn.look(memory, edge)
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


class Worn:
    """Which textures M points show; they are looked up when all objects are met, where they are seen.

    The register says how much of a point's colour is a texture's, and here is whose. Where one blends with
    another, the first is looked up at once, or, where blends are narrow, the point is called near an outline.

    Args:
        field: with textures.
        p: the points (2, M).
        spread: as `Coverage.shade` takes it.
    """

    def __init__(self, field: Field, p: Array, spread: float) -> None:
        self._field, self._xp, self._p, self._spread = field, field.xp, p, spread
        self._four = self._xp.array(_FOUR * np.float32(spread), p)[:, :, None]
        self._number = 0 * p[0] + NOBODY
        self._mixed = p[0] != p[0]
        self._rows: dict[int, Row] = {}

    def note(self, row: Row, index: Array, before: Array, memory: Array, d: Array) -> None:
        """Note what points (k,) show behind an object.

        Args:
            before: their memory (S + R, k) before it.
            memory: and behind it, which is brought up to date.
            d: its distances (k,).
        """
        xp, share, gate = self._xp, memory[-2], memory[-1]
        taken = gate > LEAST
        mixed = xp.where(taken & (gate < 1 - LEAST))
        mixed = xp.take(mixed, xp.where(xp.take(share, mixed) > LEAST))
        if row.token == SMOOTH and self._spread > NARROW * row.width:
            gap = row.width + CORNER * self._spread * (1 + row.frame.stretch)
            blends = abs(before[0] / self._field.unit - d) < gap
            if row.texture is None:
                blends = blends & (before[-2] > LEAST)
            self._mixed[xp.take(index, xp.where(blends))] = True
        elif row.texture is not None and len(mixed):
            left = share - gate  # of the texture before
            numbers = xp.take(self._number, xp.take(index, mixed))
            for number in {*numbers.tolist()} - {NOBODY}:
                some = xp.take(mixed, xp.where(numbers == number))
                self._add(self._rows[number], memory, some, xp.take(index, some), left)
        if row.texture is not None:
            self._rows[row.number] = row
            self._number[xp.take(index, xp.where(taken))] = row.number
            xp.put(share, mixed, xp.take(gate, mixed))
        memory[-1] = 0.0

    def look(self, memory: Array, edge: Array) -> Array:
        """Add to memories (S + R, M) the textures that are seen; the least distances (M,) to an outline, and
        0 where colours mix.
        """
        xp, field = self._xp, self._field
        seen = memory[0] * field.slope < 0.5
        edge = xp.select(self._mixed & seen, 0 * edge, edge)
        seen = seen & (memory[-2] > LEAST)
        if self._spread:  # the others are looked at again
            seen = seen & (edge >= NEAR * self._spread)
        for number, row in self._rows.items():
            whole = xp.where(seen & (self._number == number))
            for start in range(0, len(whole), CHUNK):
                some = whole[start : start + CHUNK]
                self._add(row, memory, some, some, memory[-2])
        return edge

    def _add(self, row: Row, memory: Array, some: Array, index: Array, share: Array) -> None:
        """Add an object's texture at points of an index to some of the memories, as large as a share (k,)."""
        xp, field, s = self._xp, self._field, self._field.network.config.state
        spots = xp.take(self._p, index)
        if self._spread:
            found = field.texture(row, (spots[:, None] + self._four).reshape(2, -1)).reshape(3, 4, -1)
            found = (found[:, 0] + found[:, 1] + found[:, 2] + found[:, 3]) / 4
        else:
            found = field.texture(row, spots)
        colour = memory[s : s + 3]
        xp.put(colour, some, xp.take(colour, some) + found * xp.take(share, some))


def _means(shade: Shade) -> Array:
    """Premultiplied colour and coverage (4, M) of pixels of four samples each."""
    return shade.picture.reshape(4, -1, 4).mean(2)
