"""Outlines of curves: signed distances at many points of many letters, polygons and splines at once.

A plain method, as nothing learned is as good: curves are cut into pieces that are nearly straight. A grid
over the whole plane, finer where outlines lie, lists for each cell the pieces that may be nearest to a point
of it. From the nearest point of a chord a step of Newton's method leads to one of its curve; of the nearest
of these another step leads to the nearest point. Inside is where the winding number is not 0. It is known at
one point of each cell, the *post*; on the way from there to a point of the cell it changes with each chord
that is crossed, and between a chord and its curve by one, so that no piece has to know what others cover.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import GRAIN, Element
from scenelang.assets.pyramid import curves_of
from scenelang.drawing.arrays import Array, Arrays

Floats = npt.NDArray[np.float64]
FLAT: Final = 0.001  # leaf units: farthest from its chord that a piece may bend
SIDES: Final = 8, 24, 48  # cells along an axis of the grid, and of those by which it is made
FEW: Final = 8, 32  # pieces for which the first and the second of these do
WIDE: Final = 4 / 3  # half the grid's width: from 1 on, 1 + (1 - 1/x) (WIDE - 1) is the place of x
LAST: Final = 16.0  # leaf units: farther points are asked at this distance
MEET: Final = 4.0 / GRAIN  # leaf units: ends so near each other are one


class Table(NamedTuple):
    """Pieces of outlines, and the grid of where they matter."""

    pieces: npt.NDArray[np.float32]  # (8, P) start, first and second coefficient, end
    side: int  # cells along an axis
    first: npt.NDArray[np.intp]  # (cells + 1,) where the list of each cell begins
    near: npt.NDArray[np.intp]  # pieces, cell by cell
    posts: npt.NDArray[np.float32]  # (3, cells) a point of each, and its winding number
    begins: npt.NDArray[np.intp]  # (cells + 1,) where the list of what passes each cell begins
    # cell by cell twice the piece, and 1 where the cell's post is on its left
    passing: npt.NDArray[np.intp]


def _cut(curves: Floats) -> Floats:
    """Pieces (m, 3, 2) of curves, each as flat as `FLAT`."""
    a, b, c = curves.swapaxes(0, 1)
    count = np.ceil(np.sqrt(np.hypot(*(a - 2 * b + c).T) / (4 * FLAT))).astype(int).clip(1, 64)
    which = np.repeat(np.arange(len(curves)), count)
    step = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    s, e = ((step + k)[:, None] / count[which, None] for k in (0, 1))
    a, u, w = a[which], 2 * (b - a)[which], (a - 2 * b + c)[which]
    ends = [a + t * (u + t * w) for t in (s, e)]
    return np.stack([ends[0], a + u * (s + e) / 2 + w * s * e, ends[1]], 1)


def _edges(cells: int) -> Floats:
    """Where cells of the grid begin and end along an axis (cells + 1,)."""
    w = np.linspace(-WIDE, WIDE, cells + 1)[1:-1]
    beyond = 1 - (abs(w) - 1).clip(0) / (WIDE - 1)
    return np.concatenate([[-LAST], (w.clip(-1, 1) / beyond).clip(-LAST, LAST), [LAST]])


@lru_cache(maxsize=2048)
def table_of(element: Element, most: int = SIDES[-1]) -> Table:
    """The table of one outline, with at most so many cells along an axis."""
    pieces = _closed(_cut(curves_of(element)))
    a, b, c = pieces.swapaxes(0, 1)
    sides = SIDES[: 1 + min(SIDES.index(most), sum(len(pieces) > few for few in FEW))]
    ax, ay = a.T
    ex, ey = (c - a).T
    inverse = 1 / np.maximum(ex * ex + ey * ey, 1e-18)
    cells, near = np.divmod(np.arange(sides[0] ** 2 * len(pieces)), len(pieces))
    for side, finer in zip(sides, (*sides[1:], 0), strict=True):
        edges = _edges(side)
        middle, half = (edges[1:] + edges[:-1]) / 2, (edges[1:] - edges[:-1]) / 2
        y, x = np.divmod(np.arange(side * side), side)
        dx, dy = middle[x][cells] - ax[near], middle[y][cells] - ay[near]
        t = ((dx * ex[near] + dy * ey[near]) * inverse[near]).clip(0, 1)
        dx -= t * ex[near]
        dy -= t * ey[near]
        off = np.sqrt(dx * dx + dy * dy)
        first = np.flatnonzero(np.diff(cells, prepend=-1))  # cells are in order, and none is empty
        most_off = np.minimum.reduceat(off, first) + 2 * np.hypot(half[x], half[y]) + 4 * FLAT
        kept = off <= most_off[cells]
        cells, near = cells[kept], near[kept]
        # the way from a point beyond the square to what is nearest enters the square: that is near there too
        out = np.maximum(abs(middle[x]), abs(middle[y]))
        rim = np.zeros(len(pieces), bool)
        rim[near[((out < 1) & (out + 2 * half.min() > 1))[cells]]] = True
        kept = rim[near] | (out < 1)[cells]
        cells, near = cells[kept], near[kept]
        if finer:
            y, x = np.divmod(cells, side)
            parts, inner = finer // side, np.arange(finer // side)
            row, column = (y * parts)[:, None, None] + inner[:, None], (x * parts)[:, None, None] + inner
            cells = (row * finer + column).reshape(-1)
            by = np.argsort(cells, kind="stable")
            cells, near = cells[by], np.repeat(near, parts * parts)[by]
    counts = np.arange(sides[-1] ** 2 + 1)
    posts = _posts(a, c, _edges(sides[-1]))
    # a piece passes a cell only where its chord comes as near as it bends, and to a box on both sides of it
    y, x = np.divmod(cells, sides[-1])
    across, wide = abs((middle[x] - ax[near]) * ey[near] - (middle[y] - ay[near]) * ex[near]), FLAT + half
    meets = across <= wide[x] * abs(ey[near]) + wide[y] * abs(ex[near])
    for axis, at in ((0, x), (1, y)):
        mean, reach = (a[near, axis] + c[near, axis]) / 2, abs(c[near, axis] - a[near, axis]) / 2
        meets &= abs(middle[at] - mean) <= wide[at] + reach
    passed, through = cells[meets], near[meets]
    left = ex[through] * (posts[1, passed] - ay[through]) >= ey[through] * (posts[0, passed] - ax[through])
    rows = np.concatenate([a, 2 * (b - a), a - 2 * b + c, c], 1).T.astype(np.float32)
    lists = np.searchsorted(cells, counts), near, posts.astype(np.float32), np.searchsorted(passed, counts)
    return Table(rows, sides[-1], *lists, 2 * through + left)


def _closed(pieces: Floats) -> Floats:
    """Pieces whose ends are where others begin, to the last digit of float32, where they nearly were."""
    pieces = pieces.astype(np.float32).astype(np.float64)
    a, c = pieces[:, 0], pieces[:, 2]
    follows = np.append(np.hypot(*(a[1:] - c[:-1]).T) <= MEET, False)
    for at in np.flatnonzero(~follows):
        off = np.hypot(*(a - c[at]).T)
        c[at] = a[off.argmin()] if off.min() <= MEET else c[at]
    c[:-1][follows[:-1]] = a[1:][follows[:-1]]
    return pieces


def _posts(a: Floats, c: Floats, edges: Floats) -> Floats:
    """A point of each cell (3, cells) that lies on no chord from a to c (m, 2), and its winding number."""
    side = len(edges) - 1
    y = edges[:-1] + 0.4367 * np.diff(edges)  # of a row, where no corner of a usual shape lies
    low, high = np.minimum(a[:, 1], c[:, 1]), np.maximum(a[:, 1], c[:, 1])
    begin, end = np.searchsorted(y, low), np.searchsorted(y, high)  # rows that a chord crosses
    which = np.repeat(np.arange(len(a)), end - begin)
    row = np.arange(len(which)) - np.repeat(np.cumsum(end - begin) - end, end - begin)
    way = c - a
    x = a[which, 0] + (y[row] - a[which, 1]) * way[which, 0] / way[which, 1]
    turn = np.where(way[which, 1] > 0, 1.0, -1.0)
    result = np.zeros((3, side, side))
    result[1] = y[:, None]
    for at in range(side):
        own = row == at
        by = np.argsort(x[own])
        crossed, turns = x[own][by], turn[own][by]
        stops = np.sort(np.concatenate([edges, crossed]))
        gaps, cell = np.diff(stops), (np.searchsorted(edges, stops[:-1], "right") - 1).clip(0, side - 1)
        widest = np.lexsort((gaps, cell))[np.searchsorted(np.sort(cell), np.arange(side), "right") - 1]
        result[0, at] = (stops[widest] + stops[widest + 1]) / 2
        left = np.concatenate([[0.0], np.cumsum(turns)])  # what passes on the left of a point goes up
        result[2, at] = left[-1] - left[np.searchsorted(crossed, result[0, at])]
    return result.reshape(3, -1)


@lru_cache(maxsize=16)
def _joined(elements: tuple[Element, ...]) -> tuple[npt.NDArray[np.generic], ...]:
    """The tables of outlines as one, with cells counted from those of each on, and (5, P) starts, ways and
    inverse squared lengths of chords.
    """
    tables = [table_of(element) for element in elements]
    cells = np.cumsum([0, *(table.side**2 for table in tables)])[:-1]
    at = np.cumsum([0, *(table.pieces.shape[1] for table in tables)])

    def listed(first: str, items: str, by: int) -> tuple[npt.NDArray[np.generic], ...]:
        begins = np.cumsum([0, *(len(getattr(table, items)) for table in tables)])
        starts = [getattr(table, first)[:-1] + begin for table, begin in zip(tables, begins, strict=False)]
        lists = [getattr(table, items) + by * more for table, more in zip(tables, at, strict=False)]
        return np.append(np.concatenate(starts), begins[-1]), np.concatenate(lists)

    pieces = np.concatenate([table.pieces for table in tables], 1)
    way = pieces[6:] - pieces[:2]
    chords = np.concatenate([pieces[:2], way, 1 / np.maximum((way * way).sum(0), 1e-12)[None]])
    posts = np.concatenate([table.posts for table in tables], 1)
    sides = np.stack([cells, [table.side for table in tables]])
    lists = *listed("first", "near", 1), *listed("begins", "passing", 2)
    return pieces, chords, posts, sides, *lists


class OutlineShapes:
    """Outlines (elements that are `curved`) where an array lies."""

    def __init__(self, xp: Arrays, elements: Sequence[Element], like: Array) -> None:
        parts = (xp.array(part, like) for part in _joined(tuple(elements)))
        self.xp, (self._pieces, self._chords, self._posts, self._sides, *lists) = xp, parts
        self._near, self._passing = (lists[0], lists[1]), (lists[2], lists[3])

    def distance(self, q: Array, which: Array) -> Array:
        """Distances (M,), in leaf units, at leaf coordinates (2, M) of outlines by their numbers (M,)."""
        xp = self.xp
        radius = xp.length(list(q))
        inside = q * (LAST / radius.clip(LAST))
        cell = self._cell(xp.frozen(inside), which)
        index, t = self._nearest(xp.frozen(inside), cell)
        x, y, ux, uy, wx, wy, *_ = xp.take(self._pieces, index)
        t = xp.frozen(self._step(index, t, inside))
        dx, dy = x + t * (ux + t * wx) - inside[0], y + t * (uy + t * wy) - inside[1]
        away = xp.length([dx, dy])
        result = xp.select(self._turns(xp.frozen(inside), cell) != 0, -away, away)
        return result + (radius - LAST).clip(0.0)

    def _step(self, piece: Array, t: Array, q: Sequence[Array]) -> Array:
        """A step of Newton's method, from t (M,) on pieces (M,) towards what is nearest to points (2, M)."""
        xp = self.xp
        x, y, ux, uy, wx, wy, *_ = xp.take(self._pieces, piece)
        dx, dy = x + t * (ux + t * wx) - q[0], y + t * (uy + t * wy) - q[1]
        vx, vy = ux + 2 * t * wx, uy + 2 * t * wy
        speed = vx * vx + vy * vy
        # near the curve, where it matters, the second derivative is small beside the first
        bend = xp.maximum(speed + 2 * (dx * wx + dy * wy), 0.25 * speed)
        return (t - (dx * vx + dy * vy) / bend.clip(1e-12)).clip(0.0, 1.0)

    def _cell(self, q: Array, which: Array) -> Array:
        """Cells (M,) of points (2, M) among those of all outlines."""
        xp = self.xp
        first, side = xp.take(self._sides, which)
        place = q.clip(-1.0, 1.0) * (WIDE - (WIDE - 1) / abs(q).clip(1.0))
        x, y = (xp.whole((at + WIDE) * (side * (1 / (2 * WIDE)))) for at in place)
        last = side - 1
        return first + xp.minimum(y.clip(0), last) * side + xp.minimum(x.clip(0), last)

    def _listed(self, lists: tuple[Array, Array], cell: Array) -> tuple[Array, Iterator[tuple[int, Array]]]:
        """An order of points by how long the lists of their cells are, longest first, and for each k how many
        have a k-th item, and these.
        """
        xp, (starts, items) = self.xp, lists
        first = xp.take(starts, cell)
        count = xp.take(starts, cell + 1) - first
        by = xp.order(-count)
        first, counts = xp.take(first, by), xp.to_numpy(xp.take(count, by))
        most = int(counts[0]) if len(counts) else 0
        ends = (int(np.searchsorted(-counts, -k)) for k in range(most))  # points with more than k
        return by, ((n, xp.take(items, first[:n] + k)) for k, n in enumerate(ends))

    def _nearest(self, q: Array, cell: Array) -> tuple[Array, Array]:
        """Pieces (M,) that are nearest to points (2, M) of cells, and about how far along these that is."""
        xp = self.xp
        by, listed = self._listed(self._near, cell)
        p, least = xp.take(q, by), xp.full(q[0].shape, 1e30, q)
        best, along = cell * 0, least * 0
        for n, piece in listed:
            ax, ay, ex, ey, inverse = xp.take(self._chords, piece)
            t = (((p[0, :n] - ax) * ex + (p[1, :n] - ay) * ey) * inverse).clip(0.0, 1.0)
            t = self._step(piece, t, p[:, :n])
            x, y, ux, uy, wx, wy, *_ = xp.take(self._pieces, piece)
            dx, dy = x + t * (ux + t * wx) - p[0, :n], y + t * (uy + t * wy) - p[1, :n]
            off = dx * dx + dy * dy
            nearer = off < least[:n]
            least[:n] = xp.select(nearer, off, least[:n])
            best[:n] = xp.select(nearer, piece, best[:n])
            along[:n] = xp.select(nearer, t, along[:n])
        result, share = best * 0, along * 0
        xp.put(result, by, best)
        xp.put(share, by, along)
        return result, share

    def _turns(self, q: Array, cell: Array) -> Array:
        """Winding numbers (M,) at points (2, M) of cells."""
        xp = self.xp
        by, listed = self._listed(self._passing, cell)
        p, (x, y, total) = xp.take(q, by), xp.take(self._posts, xp.take(cell, by))
        for n, item in listed:
            piece, post = item // 2, item % 2 > 0
            ax, ay, _, _, wx, wy, cx, cy = xp.take(self._pieces, piece)
            dx, dy, vx, vy = p[0, :n] - x[:n], p[1, :n] - y[:n], p[0, :n] - ax, p[1, :n] - ay
            ex, ey = cx - ax, cy - ay
            beside = ex * vy - ey * vx
            left = beside >= 0
            begins = dx * (ay - y[:n]) - dy * (ax - x[:n]) >= 0
            crossed = (begins != (dx * (cy - y[:n]) - dy * (cx - x[:n]) >= 0)) & (left != post)
            # between the chord and the curve, in whose own coordinates that is t^2 < y < t
            bent, off = ex * wy - ey * wx, vx * wy - vy * wx
            within = (left != (bent > 0)) & (off * off < bent * (beside + off))
            way = xp.select(left, total[:n] * 0 + 1, total[:n] * 0 - 1)
            total[:n] += way * (crossed * 1) - way * (within * 1)
        result = total * 0
        xp.put(result, by, total)
        return result
