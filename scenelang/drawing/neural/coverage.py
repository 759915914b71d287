"""Coverage: how pixels of the plane ask the field, with as few questions as show; textures and blends.

Blocks of pixels are asked before pixels. An object is looked at by the blocks that it can reach; of each
such pair the distance at the block's centre, and how fast it is proved to change, bound it on all of the
block, and intervals through the cell bound what the block shows (`meetings.py`). Blocks of one colour are
filled; of the others, objects that are proved to change nothing there are dropped, and so is what lies behind
one that hides it. What is left is asked again in smaller blocks, and pixel by pixel in the end.

A pixel is the mean of 4 or 16 samples on a regular grid. Most pixels have no outline near them and one look
at the centre is as good; only pixels that the network says are near one are sampled so often. Blocks lie
where they do whatever the tiles are, so that tiles and threads change nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from scenelang.assets.records import Record
from scenelang.compiler.groups import SMOOTH, UNION
from scenelang.drawing.arrays import Array
from scenelang.drawing.how import check_time
from scenelang.drawing.image import sample_places
from scenelang.drawing.neural.field import NO_TEXTURE, Field, Trace
from scenelang.drawing.neural.meetings import (
    LEVELS,
    ROUNDING,
    Index,
    Meetings,
    Pairs,
    Raster,
    meetings_of,
    nesting,
    raster,
)
from scenelang.drawing.neural.network import RADIUS

CORNERS = {4: 0.36, 16: 0.54}  # pixels from the centre to the farthest of samples, a little rounded up
NARROW = 1 / 16  # of a pixel by the width of a blend: above it colours change much across the pixel
LEAST = 1e-4  # of a colour, that counts as part of what a point shows


def blending(field: Field, meetings: Meetings, trace: Trace, px: float, corner: float) -> Array:
    """A mask of pixels (groups, B), of a side, that may have samples in a narrow blend with a texture;
    ``corner`` is as in `CORNERS`.
    """
    xp, textured = field.xp, field.texture[meetings.pairs.object] != NO_TEXTURE
    result, worn = trace.none(), np.zeros(len(meetings.columns), bool)
    worn[meetings.places()[textured]] = True
    for turn, rows, _, _, margin, _ in trace if worn.any() else ():
        width, stretch = field.widths[rows], field.stretch[rows]
        narrow = (field.operators[rows] == SMOOTH) & (px > NARROW * width) & worn[turn.columns]
        if turn.ending is None:
            narrow &= ~meetings.pairs.open[turn.which]
        if narrow.any():
            gap = xp.array((width + corner * px * (1 + stretch)).astype(np.float32), field.like)
            result[:, turn.columns] |= (abs(margin) < gap) & xp.array(narrow, field.like)
    return result


def beneath(trace: Trace, width: float) -> Array:
    """A mask (groups, B) of pixels within a width, world units, of an outline that lies beneath something."""
    result = trace.none()
    for turn, _, distance, paint, margin, _ in trace:
        result[:, turn.columns] |= (abs(margin + distance) < width) & (paint > 0)
    return result


def ties(field: Field, trace: Trace, reach: float) -> Array:
    """A mask (groups, B) of pixels where one object's colour may tie with another's at a sample, ``reach``
    world units from the centre at most.
    """
    tied, blended, shown = (trace.none() for _ in range(3))
    for turn, rows, _, paint, margin, _ in trace:
        operators, at = field.operators[rows], turn.columns
        joins, blends = (field.xp.array(operators == kind, field.like) for kind in (UNION, SMOOTH))
        mixed = blends & (paint > LEAST) & (paint < 1 - LEAST)
        shown[:, at] |= tied[:, at] & mixed
        blended[:, at] |= mixed
        tied[:, at] |= joins & (abs(margin) < 2 * reach)
    return tied & blended if any(met.turn.ending is not None for met in trace) else shown


def add_textures(
    field: Field,
    meetings: Meetings,
    trace: Trace,
    p: Array,
    memory: Array,
    seen: Array,
    places: np.ndarray | None = None,
) -> None:
    """Add the textures that points (2, groups, B) show, where ``seen``, to their colours in ``memory``
    (groups, S + R, B); of pixels they are looked up at several ``places`` (2, n) about the points.
    """
    xp, objects, place = field.xp, meetings.pairs.object, meetings.places()
    shares = trace.shares(xp, nesting(meetings, field.groups), seen, len(objects))
    groups, columns = seen.shape
    offsets = None if places is None else xp.array(places, p)[:, :, None]
    total = xp.full((3, groups * columns), 0.0, p)
    texture = field.texture[objects]
    for number in np.unique(texture[texture != NO_TEXTURE]).tolist():
        pairs = np.flatnonzero(texture == number)
        share = xp.take(shares, xp.array(pairs, p))
        if field.clear:
            share = share * xp.array(field.opacity[objects[pairs]], p)
        share = share.reshape(-1)
        some = xp.where(share > LEAST)
        if not len(some):
            continue
        group, pair = np.divmod(xp.to_numpy(some), len(pairs))
        pair = pairs[pair]
        index = xp.array(group * columns + place[pair], p)
        spots = xp.take(p.reshape(2, -1), index)
        if offsets is not None:
            spots = spots[:, None] + offsets
        q = field.frames.local(xp, objects[pair], spots)
        result = field.textures[number][1].at(q.reshape(2, -1)).reshape(3, -1, len(pair))
        xp.add(total, index, result.mean(1) * xp.take(share, some))
    s = field.network.config.state
    memory[:, s : s + 3] += total.reshape(3, groups, columns).swapaxes(0, 1)


ENOUGH = 1 << 14  # pairs of an object and a pixel up to which blocks are not looked at again
PAIRS = 1 << 16  # of an object and a point that are met at a time
NEAR = 0.85  # pixels: farther from an outline a pixel has one colour
MANY = 2  # objects a pixel above which it is asked which of them matter to its samples
FLAT = 1e-4  # of a channel: a block that is known so well has one colour


class Tile(Record, frozen=False):
    """Some rows of pixels."""

    # (rows, width, 3) over a background, else premultiplied colour and coverage (rows, width, 4)
    picture: np.ndarray
    background: np.ndarray | None  # (3,), if any
    pairs: int = 0  # (object, sample) pairs that went through the network
    refined: int = 0  # pixels of which all samples were taken
    met: int = 0  # pixels that were asked one by one

    def over(self, picture: np.ndarray) -> np.ndarray:
        """The picture (…, 3 or 4) over the background, of premultiplied colour and coverage (…, 4)."""
        if self.background is None:
            return picture
        shown: np.ndarray = picture[..., :3] + (1 - picture[..., 3:]) * self.background
        return shown


class Coverage:
    """Asks a field for pixels of ``count`` samples; ``skip`` leaves out what is out of reach or unseen."""

    def __init__(self, field: Field, *, skip: bool = True, prove: bool = True, count: int = 4) -> None:
        self.count, self.corner = count, CORNERS[count]
        self.places = (sample_places(count) - 0.5).astype(np.float32)  # from the centre
        self.near = NEAR + (self.corner - CORNERS[4])
        self.field, self.xp, self.skip = field, field.xp, skip
        self.prove = prove and field.network.config.state == field.network.config.features == 1
        self._all_draw = bool(field.draws.all())
        self._flat = not field.groups.deepest

    def tile(
        self, canvas: tuple[int, int], rows: range, samples: str, background: np.ndarray | None = None
    ) -> Tile:
        """Draw some rows of a picture; see `scenelang.drawing.neural.draw.draw`."""
        grid = raster(canvas, rows)
        nothing = np.zeros(4, np.float32) if background is None else background
        picture = np.empty((grid.high, grid.wide, len(nothing)), np.float32)
        picture[:] = nothing
        tile = Tile(picture, background)

        def answer(meetings: Meetings, points: Array, inside: np.ndarray | None) -> np.ndarray:
            tile.met += points.shape[1] * points.shape[2] if inside is None else int(inside.sum())
            result = self.xp.to_numpy(self._points(meetings, points, grid.px, samples, tile, inside))
            return tile.over(np.ascontiguousarray(result.transpose(2, 0, 1)))

        self._fill(grid, tile, picture, answer)
        tile.picture = picture[: len(rows), : canvas[0]]
        return tile

    def _fill(
        self,
        grid: Raster,
        tile: Tile,
        pixels: np.ndarray,
        answer: Callable[[Meetings, Array, np.ndarray | None], np.ndarray],
    ) -> None:
        """Fill pixels (high, wide, K) that objects reach by answers (B, groups, K) for columns' meetings,
        centres (2, groups, B) of their pixels, and a mask (groups, B) of those that are wanted.
        """
        with self.xp.inference():
            side, meetings = self.meetings(grid, tile)
            blocks = grid.blocks(pixels, side)
            for _, part in _portions(meetings, side * side):
                across, down = at = grid.place(part.columns, side)
                points = self.xp.array(grid.centres(at, side), self.field.like)
                values = answer(part, points, grid.inside(at, side))
                blocks[down // side, :, across // side] = values.reshape(-1, side, side, blocks.shape[-1])

    def _points(
        self, meetings: Meetings, p: Array, px: float, samples: str, tile: Tile, wanted: np.ndarray | None
    ) -> Array:
        """Pictures (groups, 4, B) of pixels with centres (2, groups, B)."""
        if samples == "four":
            tile.refined += p.shape[1] * p.shape[2] if wanted is None else int(wanted.sum())
            return self._sampled(meetings, p, px, tile)
        if samples == "one":
            return self._picture(meetings, p, tile)
        field = self.field
        traced = field.textured or field.blended or not self._flat
        trace = Trace() if traced else None
        q, d, memory = self.ask(meetings, p, tile, trace)
        edge = abs(memory[:, 0]) / field.unit
        rate = self.xp.array((1 / self.field.frames.stretch[meetings.pairs.object]).astype(np.float32), p)
        near = abs(d[:, 0]) * rate
        for part in meetings.slots():
            some = edge[:, : part.stop - part.start]
            some[:] = self.xp.minimum(some, near[:, part])
        for turn, _, distance, *_ in trace or ():
            if turn.ending is not None:
                edge[:, turn.columns] = self.xp.minimum(edge[:, turn.columns], abs(distance))
        near = edge < self.near * px
        if trace is not None:
            seen = memory[:, 0] * field.slope < 0.5
            near = near | (seen & ties(field, trace, self.corner * px))
            if field.clear and field.rounded:
                near = near | (seen & beneath(trace, self.near * px))
            if field.textured:
                near = near | (seen & blending(field, meetings, trace, px, self.corner))
                places = self.places * np.float32(px)
                add_textures(field, meetings, trace, p, memory, seen & ~near, places)
        picture = field.picture(memory)
        close = self.xp.to_numpy(near)
        column, group = np.nonzero((close if wanted is None else close & wanted).T)
        if not len(column):
            return picture
        many = meetings.counts()[column] > MANY
        if self.prove and many.any():
            left, kept = self._matter(meetings, column[many], group[many], px, q, d)
            few = ~many
            jobs = [(meetings.some(column[few])[0], column[few], group[few]), (left, *kept)]
        else:
            jobs = [(meetings.some(column)[0], column, group)]
        planes = self.xp.packed(picture.swapaxes(0, 1)).reshape(4, -1)
        for some, column, group in jobs:
            tile.refined += len(column)
            flat = self.xp.array(group * p.shape[2] + column, p)
            centres = self.xp.take(p.reshape(2, -1), flat)[:, None]
            for first, portion in _portions(some, self.count):
                last = first + len(portion.columns)
                result = self._sampled(portion, centres[..., first:last], px, tile)[0]
                self.xp.put(planes, flat[first:last], result)
        return planes.reshape(4, *p.shape[1:]).swapaxes(0, 1)

    def _matter(
        self, meetings: Meetings, column: Index, group: Index, px: float, q: Array, d: Array
    ) -> tuple[Meetings, tuple[Index, Index]]:
        """Pairs that matter to the samples of pixels, but for pixels proved to be as their middles."""
        some, source = meetings.some(column)
        place = some.places()
        by = np.argsort(place, kind="stable")
        source, place = source[by], place[by]
        pairs = replace(some.pairs.take(by), block=place)
        middle = self.xp.to_numpy(d)[group[place], 0, source]
        here = self.xp.to_numpy(q)[:, group[place], source].astype(np.float64)
        rise = self.field.rise(pairs.object, here, pairs.rate * (self.corner * px))
        some, _ = meetings_of(self._proved(pairs, middle, rise)[0])
        return some, (column[some.columns], group[some.columns])

    def owners(self, canvas: tuple[int, int], rows: range) -> np.ndarray:
        """Numbers (rows, width), from 1, of the objects that paint pixels' centres, 0 where none does."""
        grid = raster(canvas, rows)
        tile = Tile(np.empty((grid.high, grid.wide, 4), np.float32), None)
        result = np.zeros((grid.high, grid.wide), np.int32)

        def answer(meetings: Meetings, points: Array, _: np.ndarray | None) -> np.ndarray:
            trace = Trace()
            memory = self.ask(meetings, points, tile, trace)[2]
            covered = self.xp.to_numpy(memory[:, 0]) * self.field.slope < 0.0
            return np.where(covered, self._owners(meetings, trace), 0).T

        self._fill(grid, tile, result[..., None], answer)
        return result[: len(rows), : canvas[0]]

    def _owners(self, meetings: Meetings, trace: Trace) -> np.ndarray:
        """Numbers (groups, B), from 1, of the objects that show most; 0 for none."""
        count, host = len(meetings.columns), self.xp.to_numpy
        states = nesting(meetings, self.field.groups).states
        own = np.zeros((2, len(trace[0].paint), states))  # numbers, and how much they show
        for turn, rows, _, paint, _, through in trace:
            share, clear = host(paint), 0.0 if through is None else host(through)
            if turn.ending is None:
                number, most = np.stack([rows + 1, self.field.opacity[rows]])[:, None]
            else:
                number, most = own[..., turn.ending]
                own[..., turn.ending] = 0.0
            old, left = own[..., turn.at], 1.0 - share * (1.0 - clear)
            comes = (share > 0.5) & (most >= clear * old[1])
            new = [number + 0.0 * share, share * most]
            own[..., turn.at] = np.where(comes, new, [old[0], left * old[1]])
        return own[0, :, :count].astype(np.int32)

    def _sampled(self, meetings: Meetings, p: Array, px: float, tile: Tile) -> Array:
        """Means (groups, 4, B) of all samples of pixels."""
        offsets = self.xp.array(self.places * np.float32(px), p)
        samples = (p[:, :, None] + offsets[:, None, :, None]).reshape(2, -1, p.shape[2])
        picture = self._picture(meetings, samples, tile)
        return picture.reshape(p.shape[1], self.count, 4, p.shape[2]).mean(1)

    def _picture(self, meetings: Meetings, p: Array, tile: Tile) -> Array:
        """Premultiplied colour and coverage (groups, 4, B) at single points (2, groups, B)."""
        field = self.field
        trace = Trace() if field.textured else None
        memory = self.ask(meetings, p, tile, trace)[2]
        if trace is not None:
            seen = memory[:, 0] * field.slope < 0.5
            add_textures(field, meetings, trace, p, memory, seen)
        return field.picture(memory)

    def ask(
        self, meetings: Meetings, p: Array, tile: Tile, trace: Trace | None = None
    ) -> tuple[Array, Array, Array]:
        """Leaf coordinates (2, groups, P), features (groups, F, P), memory (groups, S + R, B)."""
        field, objects = self.field, meetings.pairs.object
        check_time(field.network.until_s)
        q = field.frames.local(self.xp, objects, self.xp.take(p, self.xp.array(meetings.places(), p)))
        d = field.features(objects, q, meetings.pairs.far)
        tile.pairs += d.shape[0] * len(objects)
        return q, d, field.fold(meetings, d, trace)

    # ------------------------------------------------------------ blocks

    def meetings(self, grid: Raster, tile: Tile) -> tuple[int, Meetings]:
        """Side and objects of the blocks that need an answer for each pixel; fills others in the tile."""
        count = len(self.field.tokens)
        if not self.skip:
            side = LEVELS[-1]
            blocks = grid.high // side * (grid.wide // side)
            block, objects = np.divmod(np.arange(blocks * count), max(count, 1))
            every = np.ones(len(block), bool)
            rate = np.full(len(block), np.inf)
            return side, meetings_of(Pairs(block, objects, ~every, every, rate))[0]
        pairs = self.candidates(grid)
        side = LEVELS[0]
        pairs = self._looked(grid, pairs, side, tile)
        for smaller in LEVELS[1:]:
            if len(pairs) * side * side <= ENOUGH:
                break
            pairs, side = pairs.split(grid.wide // side, side // smaller), smaller
            pairs = self._looked(grid, pairs, side, tile)
        return side, meetings_of(pairs)[0]

    def candidates(self, grid: Raster) -> Pairs:
        """Objects at the largest blocks that their bounds meet."""
        return grid.reached(self.field.frames, self.field.reach)

    def _looked(self, grid: Raster, pairs: Pairs, side: int, tile: Tile) -> Pairs:
        """Fill the blocks that are proved to be of one colour, and return the pairs of the others."""
        field, objects = self.field, pairs.object
        across, down = grid.place(pairs.block, side)
        half = side / 2 - 0.5
        centre = np.stack([grid.left + (across + half) * grid.px, grid.top - (down + half) * grid.px])
        world = side * grid.px / 2**0.5 + ROUNDING
        q, radius = field.frames.blocks(objects, centre, np.full(len(objects), world))
        length = np.hypot(*q)
        with np.errstate(invalid="ignore"):
            kept = ~(length - radius > field.reach[objects])
            far = ~(length + radius <= RADIUS)
        if not self._all_draw:
            # what draws nothing by itself matters where something was drawn before
            drawn = np.cumsum(kept & (field.draws[objects] | (pairs.open & self._flat)))
            begins = np.searchsorted(pairs.block, pairs.block)
            kept &= drawn > np.where(begins > 0, drawn[begins - 1], 0)
        index = np.flatnonzero(kept)
        pairs, q = replace(pairs, far=far).take(index), q[:, index]
        if not (self.prove and len(index)):
            return pairs
        tile.pairs += len(pairs)
        rise = field.rise(pairs.object, q, radius[index])
        pairs = replace(pairs, rate=radius[index] / world)
        left, flat, values = self._proved(pairs, field.middles(pairs.object, q), rise)
        x, y = grid.place(flat, side)
        grid.blocks(tile.picture, side)[y // side, :, x // side] = tile.over(values)[:, None, None]
        return left

    def _proved(self, pairs: Pairs, middle: np.ndarray, rise: np.ndarray) -> tuple[Pairs, Index, np.ndarray]:
        """Pairs, sorted by block, that are still open, and blocks of one colour (n,) with their pictures (n,
        4). Others in a block differ from the ``middle`` distance by ``rise`` at most.
        """
        meetings, source = meetings_of(pairs)
        shown = self.field.proved(meetings, middle[source], rise[source])
        low, high = shown.picture
        flat = (high - low).max(0) <= FLAT
        left, opened = np.empty((2, len(pairs)), bool)
        left[source], opened[source] = ~shown.shut & ~flat[meetings.places()], shown.open
        kept = replace(pairs, open=opened).take(np.flatnonzero(left))
        return kept, meetings.columns[flat], ((low + high) / 2).T[flat]


def _portions(meetings: Meetings, points: int) -> list[tuple[int, Meetings]]:
    """Columns in turn, as many at a time as make `PAIRS` with so many points each, and which is the first."""
    if not (total := len(meetings.pairs) * points):
        return []
    if total <= PAIRS:
        return [(0, meetings)]
    which = np.cumsum(meetings.counts() * points) // PAIRS
    starts = np.flatnonzero(np.concatenate([[True], which[1:] != which[:-1]])).tolist()
    ends = [*starts[1:], len(which)]
    return [(a, meetings.some(np.arange(a, b))[0]) for a, b in zip(starts, ends, strict=True)]
