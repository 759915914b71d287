"""Outlines of quadratic curves: signed distances at many points of many outlines at once.

A plain method, as nothing learned is as good: curves are cut into pieces that are nearly straight. A grid
over the whole plane, finer where outlines lie, lists for each cell the pieces that may be nearest to a point
of it; of these the nearest chord is found, and two steps of Newton's method lead to the nearest point of its
curve. The tangent there tells on which side the asking point lies; where curves meet, the mean of both
(Bærentzen and Aanæs 2005, in the plane), so that no two pieces can disagree.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import GRAIN, Element
from scenelang.assets.pyramid import curves_of
from scenelang.drawing.arrays import Array, Arrays

Floats = npt.NDArray[np.float64]
FLAT: Final = 0.001  # leaf units: farthest from its chord that a piece may bend
SIDES: Final = 12, 24, 48  # cells along an axis of the grid, and of those by which it is made
WIDE: Final = 4 / 3  # half the grid's width: from 1 on, 1 + (1 - 1/x) (WIDE - 1) is the place of x
LAST: Final = 16.0  # leaf units: farther points are asked at this distance
MEET: Final = 4.0 / GRAIN  # leaf units: ends so near each other are one


class Table(NamedTuple):
    """Pieces of outlines and the grids of where they matter."""

    pieces: npt.NDArray[np.float32]  # (10, P) start, first and second coefficient, tangents at both ends
    first: npt.NDArray[np.intp]  # (cells + 1,) where the list of each cell begins
    near: npt.NDArray[np.intp]  # pieces, cell by cell


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


def _tangents(pieces: Floats) -> tuple[Floats, Floats]:
    """Directions (m, 2) at starts and ends of pieces: where two meet, the mean of both."""
    a, b, c = pieces.swapaxes(0, 1)
    before, after = _unit(c - b, c - a), _unit(b - a, c - a)  # at ends, at starts
    follows = np.append(np.hypot(*(a[1:] - c[:-1]).T) <= MEET, False)
    at_start, at_end = after.copy(), before.copy()
    for at, end in enumerate(c):
        then = at + 1 if follows[at] else int(np.hypot(*(a - end).T).argmin())
        if follows[at] or np.hypot(*(a[then] - end)) <= MEET:
            at_end[at] = at_start[then] = before[at] + after[then]
    return at_start, at_end


def _unit(way: Floats, otherwise: Floats) -> Floats:
    chosen = np.where(np.hypot(*way.T)[:, None] > 1e-9, way, otherwise)
    return np.asarray(chosen / np.hypot(*chosen.T)[:, None].clip(1e-12))


def _edges(cells: int) -> Floats:
    """Where cells of the grid begin and end along an axis (cells + 1,)."""
    w = np.linspace(-WIDE, WIDE, cells + 1)[1:-1]
    beyond = 1 - (abs(w) - 1).clip(0) / (WIDE - 1)
    return np.concatenate([[-LAST], (w.clip(-1, 1) / beyond).clip(-LAST, LAST), [LAST]])


@lru_cache(maxsize=2048)
def table_of(element: Element, sides: tuple[int, ...] = SIDES) -> Table:
    """The table of one outline; ``sides`` are those of the grids that lead to its own."""
    pieces = _cut(curves_of(element))
    a, b, c = pieces.swapaxes(0, 1)
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
        most = np.minimum.reduceat(off, first) + 2 * np.hypot(half[x], half[y]) + 4 * FLAT
        kept = off <= most[cells]
        cells, near = cells[kept], near[kept]
        if finer:
            y, x = np.divmod(cells, side)
            parts, inner = finer // side, np.arange(finer // side)
            at = (y * parts)[:, None, None] + inner[:, None], (x * parts)[:, None, None] + inner
            cells = (at[0] * finer + at[1]).reshape(-1)
            by = np.argsort(cells, kind="stable")
            cells, near = cells[by], np.repeat(near, parts * parts)[by]
    first = np.searchsorted(cells, np.arange(sides[-1] ** 2 + 1))
    rows = [a, 2 * (b - a), a - 2 * b + c, *_tangents(pieces)]
    return Table(np.concatenate(rows, 1).T.astype(np.float32), first, near)


@lru_cache(maxsize=16)
def _joined(elements: tuple[Element, ...]) -> tuple[npt.NDArray[np.generic], ...]:
    """The tables of outlines as one, and (5, P) starts, ways and inverse squared lengths of chords."""
    tables = [table_of(element) for element in elements]
    begins = np.cumsum([0, *(table.pieces.shape[1] for table in tables)])
    listed = np.cumsum([0, *(len(table.near) for table in tables)])
    first = [table.first[:-1] + at for table, at in zip(tables, listed, strict=False)]
    near = np.concatenate([table.near + at for table, at in zip(tables, begins, strict=False)])
    pieces = np.concatenate([table.pieces for table in tables], 1)
    way = pieces[2:4] + pieces[4:6]
    chords = np.concatenate([pieces[:2], way, 1 / np.maximum((way * way).sum(0), 1e-12)[None]])
    return pieces, np.append(np.concatenate(first), len(near)), near, chords


class OutlineShapes:
    """Outlines (elements of that form) where an array lies."""

    def __init__(self, xp: Arrays, elements: Sequence[Element], like: Array) -> None:
        parts = (xp.array(part, like) for part in _joined(tuple(elements)))
        self.xp, (self._pieces, self._first, self._near, self._chords) = xp, parts

    def distance(self, q: Array, which: Array) -> Array:
        """Distances (M,), in leaf units, at leaf coordinates (2, M) of outlines by their numbers (M,)."""
        xp = self.xp
        radius = xp.length(list(q))
        inside = q * (LAST / radius.clip(LAST))
        index, t = self._nearest(xp.frozen(inside), which)
        x, y, ux, uy, wx, wy, *ends = xp.take(self._pieces, index)
        dx = dy = t
        for last in (False, False, True):
            dx, dy = x + t * (ux + t * wx) - inside[0], y + t * (uy + t * wy) - inside[1]
            vx, vy = ux + 2 * t * wx, uy + 2 * t * wy
            if not last:  # near the curve, where it matters, the second derivative is small beside the first
                speed = vx * vx + vy * vy
                bend = xp.maximum(speed + 2 * (dx * wx + dy * wy), 0.25 * speed)
                t = xp.frozen((t - (dx * vx + dy * vy) / bend.clip(1e-12)).clip(0.0, 1.0))
        begins, stops = t <= 0.0, t >= 1.0
        vx = xp.select(begins, ends[0], xp.select(stops, ends[2], vx))
        vy = xp.select(begins, ends[1], xp.select(stops, ends[3], vy))
        away = xp.length([dx, dy])
        result = xp.select(vy * dx - vx * dy > 0, -away, away)  # the inside is on the left
        return result + (radius - LAST).clip(0.0)

    def _nearest(self, q: Array, which: Array) -> tuple[Array, Array]:
        """Pieces (M,) whose chords are nearest to points (2, M), and how far along these that is."""
        xp = self.xp
        side, inner = SIDES[-1], q.clip(-1.0, 1.0)
        place = inner * (WIDE - (WIDE - 1) / abs(q).clip(1.0))
        x, y = xp.whole((place + WIDE) * (side / (2 * WIDE))).clip(0, side - 1)
        cell = which * (side * side) + y * side + x
        first = xp.take(self._first, cell)
        count = xp.take(self._first, cell + 1) - first
        by = xp.order(-count)
        first, p = xp.take(first, by), xp.take(q, by)
        counts = xp.to_numpy(xp.take(count, by))
        least = xp.full(p[0].shape, 1e30, p)
        best, along = first * 0, least * 0
        for k in range(int(counts[0]) if len(counts) else 0):
            n = int(np.searchsorted(-counts, -k))  # points with more than k
            piece = xp.take(self._near, first[:n] + k)
            ax, ay, ex, ey, inverse = xp.take(self._chords, piece)
            dx, dy = p[0, :n] - ax, p[1, :n] - ay
            t = ((dx * ex + dy * ey) * inverse).clip(0.0, 1.0)
            dx, dy = dx - t * ex, dy - t * ey
            off = dx * dx + dy * dy
            nearer = off < least[:n]
            least[:n] = xp.select(nearer, off, least[:n])
            best[:n] = xp.select(nearer, piece, best[:n])
            along[:n] = xp.select(nearer, t, along[:n])
        result, share = best * 0, along * 0
        xp.put(result, by, best)
        xp.put(share, by, along)
        return result, share
