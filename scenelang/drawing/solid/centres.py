"""Light at the centres of pixels, from which pixels between them and samples near them take theirs.

Light and shares of soft lamps change slowly along a surface: one in `EACH` pixels of as many rows asks for
its own, and those between take from both sides where these lie on the same surface and agree. Samples of a
pixel take what its centre has where they lie on its surface.

Letters: K points, M pixels.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scenelang.drawing.arrays import Array, Arrays
from scenelang.drawing.solid.march import INF

EACH, LARGE = (2, 3), 160  # pixels, along both sides, from one that asks to the next; and in large pictures
# differences of shares: from one that asks to the next, and to a pixel's neighbours, whose samples take from
# around, and of small lamps ask themselves
EVEN, STEADY, SHARP = 0.2, 0.2, 0.5
APART = 0.1  # sine: so far off each other's planes lie points of one surface at most
ALIGNED = 0.8  # cosine of their normals
UNKNOWN = -1.0
OTHERS = 1e-3  # weight of pixels on other surfaces, where a sample's own has none, unless all have to ask
# of pixels around a sample, steps towards it down and across, and weights
AROUND = (0, 0, 9 / 16), (0, 1, 3 / 16), (1, 0, 3 / 16), (1, 1, 1 / 16)


class Centres:
    """The centres of rows of pixels, numbered row by row."""

    def __init__(self, xp: Arrays, like: Array, shape: tuple[int, int], each: int) -> None:
        self.xp, self.shape, self.each, count = xp, shape, each, shape[0] * shape[1]
        # of samples, once all centres are known: row and column of the pixel, and the next to each (K,)
        self.pixels: Any = None
        self.others = 0.0  # as `OTHERS`
        self.p, self.n, self.light = (xp.full((3, count), 0.0, like) for _ in range(3))
        self.lit: dict[int, tuple[Array, Array]] = {}  # shares (M,) of lamps, and how uneven they are

    def received(
        self, rays: Array, p: Array, n: Array, ask: Callable[[Array, Array, bool], Array], every: bool
    ) -> Array:
        """Light (3, K) from everywhere on points (3, K) with unit normals that rays (K,) met. With ``every``
        all centres ask, else some; unless it is the last time, `UNKNOWN` is an answer.
        """
        xp = self.xp

        def some(index: Array, last: bool = True) -> Array:
            return ask(xp.take(p, index), xp.take(n, index), last)

        if self.pixels is not None:
            return self._mixed(self.light, None, rays, p, n, some)
        xp.put(self.p, rays, p)
        xp.put(self.n, rays, n)
        self.others = OTHERS * (not every)
        self.light = self._spread(rays, 3, some, 0.0 if every else INF)
        return xp.take(self.light, rays)

    def shares(
        self, lamp: int, small: bool, rays: Array, p: Array, n: Array, ask: Callable[[Array], Array]
    ) -> Array:
        """Shares (K,) of a lamp, which may be small, at such points; some are asked by their indices."""
        if self.pixels is None:
            share = self._spread(rays, 1, lambda index, _: ask(index)[None], EVEN)[0]
            self.lit[lamp] = share, self._uneven(share.reshape(self.shape))
            return self.xp.take(share, rays)
        if lamp not in self.lit:
            return ask(self.xp.where(rays >= 0))
        share, uneven = self.lit[lamp]
        uneven = uneven if small else uneven.clip(0.0, SHARP)
        return self._mixed(share[None], uneven, rays, p, n, lambda rest: ask(rest)[None])[0]

    def _mixed(
        self, values: Array, uneven: Array, rays: Array, p: Array, n: Array, ask: Callable[[Array], Array]
    ) -> Array:
        """Values (R, K) of samples from those (R, M) of pixels, on the same surface if any: their own where
        these are not ``uneven``, else of those around them. Where they are very much so, or nothing is known
        around, samples are asked by their indices.
        """
        xp, (rows, columns) = self.xp, self.shape
        at = [xp.take(part, rays) for part in self.pixels]
        index = at[0] * columns + at[1]
        own = _same(xp.take(self.p, index) - p, xp.take(self.n, index), n) & (xp.take(values[0], index) >= 0)
        result, sharp = xp.take(values, index), rays < 0
        if uneven is not None:
            differs = xp.take(uneven, index)
            own, sharp = own & (differs < STEADY), differs > SHARP
        if len(some := xp.where(sharp)):
            xp.put(result, some, ask(some))
        rest = xp.where(~(own | sharp))
        if not len(rest):
            return result
        row, column, down, right = (xp.take(part, rest) for part in at)
        here, up = xp.take(p, rest), xp.take(n, rest)
        total: Any = 0.0
        mean: Any = 0.0
        for one, other, weight in AROUND:
            index = (row + one * down).clip(0, rows - 1) * columns
            index = index + (column + other * right).clip(0, columns - 1)
            value = xp.take(values, index)
            alike = _same(xp.take(self.p, index) - here, xp.take(self.n, index), up) + self.others
            weight = weight * (value[0] >= 0) * alike
            total, mean = total + weight, mean + weight * value
        xp.put(result, rest, mean / (total + (total == 0)))
        rest = xp.take(rest, xp.where(total == 0))
        if len(rest):
            xp.put(result, rest, ask(rest))
        return result

    def _spread(self, rays: Array, count: int, ask: Callable[[Array, bool], Array], most: float) -> Array:
        """Values (count, M) that rays (K,) want; between others' where these differ by no more."""
        xp, each, (rows, columns) = self.xp, self.each, self.shape
        result = xp.full((count, rows * columns), UNKNOWN, self.p)
        wanted = 1 * result[0]
        wanted[rays] = 1.0
        first = xp.where((rays // columns % each == 0) & (rays % columns % each == 0))
        if len(first):
            xp.put(result, xp.take(rays, first), ask(first, False))
        grids = [part.reshape(-1, rows, columns) for part in (result, self.p, self.n)]
        _fill(xp, [part[:, ::each] for part in grids], most, each)
        _fill(xp, [part.swapaxes(1, 2) for part in grids], most, each)
        result = xp.select(wanted > 0, result, wanted)
        rest = xp.where(xp.take(result[0], rays) < 0)
        if len(rest):
            xp.put(result, xp.take(rays, rest), ask(rest, True))
        return result

    def _uneven(self, share: Array) -> Array:
        """Greatest differences (M,) of pixels' shares (R, C) from those of their neighbours that have any."""
        result = 0 * share
        for here, there, one, other in (
            (share[1:], share[:-1], result[1:], result[:-1]),
            (share[:, 1:], share[:, :-1], result[:, 1:], result[:, :-1]),
        ):
            differs = abs(here - there) * ((here >= 0) & (there >= 0))
            one[:] = self.xp.maximum(one, differs)
            other[:] = self.xp.maximum(other, differs)
        return result.reshape(-1)


def _same(off: Array, n: Array, other: Array) -> Array:
    """Whether points that are so far (3, …) apart, with unit normals, lie on one surface."""
    above = (off * (n + other)).sum(0)
    square = (off * off).sum(0)
    return ((n * other).sum(0) > ALIGNED) & (above * above < 4 * APART * APART * square + 1e-12)


def _fill(xp: Arrays, grids: list[Array], most: float, each: int) -> None:
    """Set values (…, R, C) of rows between two that asked, linearly, where both lie on the same surface and
    differ by no more; of grids of values, points and normals.
    """
    values, p, n = grids
    count = (values.shape[2] - 1) // each  # of gaps between
    if not count:
        return
    last = each * count
    a, b = values[:, :, :last:each], values[:, :, each : last + 1 : each]
    agree = (abs(a[0] - b[0]) < most) & (a[0] >= 0) & (b[0] >= 0)
    for step in range(1, each):
        here, up = (part[:, :, step:last:each] for part in (p, n))
        fits = agree
        for side in (slice(None, last, each), slice(each, last + 1, each)):
            fits = fits & _same(p[:, :, side] - here, n[:, :, side], up)
        between = a + (b - a) * (step / each)
        values[:, :, step:last:each] = xp.select(fits, between, 0 * a + UNKNOWN)
