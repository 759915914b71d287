"""Solids to pictures: camera rays, light, ground, sky and media around the field.

The light is computed, as the language defines it; what is learned is where things are and what they look
like. Colours are linear up to the last step. Letters as in `network.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from scenelang.graph.stage import AMBIENT, EXTINCTION, FADE, LIFT, NEAREST, Camera, Stage
from scenelang.image import Image, from_samples
from scenelang.program.program import ProgramError
from scenelang.renderers.arrays import Array, Arrays
from scenelang.renderers.solid.field import INF, Meeting, SolidField
from scenelang.renderers.solid.march import GAP, Piece, Trail, Work, march
from scenelang.renderers.solid.network import Wanted

INTO = 3e-5  # world units behind a surface where its material is asked for
CLEAR = 2e-4  # world units before a surface where rays from the light end
NODES, WEIGHTS = np.polynomial.legendre.leggauss(3)
NODES, WEIGHTS = (NODES + 1) / 2, WEIGHTS / 2  # of a way through a medium, by what it takes of the light
NARROW = 0.8  # cosine: pieces of media that the light sees under a larger angle are cut
CUTS = (-INF, -14.0, -3.7, -1.0, -0.27, 0.27, 1.0, 3.7, 14.0, INF)  # tangents of angles at the light
TILE = 1 << 16  # samples at a time
CONTRAST = 0.04  # sRGB: pixels that differ more from a neighbour are sampled four times


class Shade(NamedTuple):
    """What M rays see: premultiplied linear radiance (3, M), alpha (M,), and what it took."""

    radiance: Array
    alpha: Array
    work: Work


class Lighting:
    """A field under the light of its stage.

    Args:
        field: the solids.
        stage: where they are.
    """

    def __init__(self, field: SolidField, stage: Stage) -> None:
        self.field, self.stage, self.xp = field, stage, field.xp
        like = field.network.codes
        self.eye, self.lamp, self.power, self.horizon, self.zenith = (
            field.xp.array(np.asarray(value, np.float32), like)
            for value in (
                stage.camera.eye,
                stage.light.position,
                [stage.light.power * c for c in stage.light.rgb],
                stage.horizon,
                stage.zenith,
            )
        )

    def shade(self, way: Array) -> Shade:
        """What rays from the eye see.

        Args:
            way: unit directions (3, M).
        """
        xp, stage, field = self.xp, self.stage, self.field
        seen, limit = self._sky(way), self.limit(way)
        alpha = 0 * way[0] + (0.0 if stage.transparent else 1.0)
        if stage.transparent:
            seen = seen * 0
        trail = march(field, self.eye, way, limit)
        work = Work(way.shape[1], 0, trail.near, trail.steps, trail.met)
        surface, floor = xp.where(trail.hit < INF), xp.where((trail.hit == INF) & (limit < INF))
        both = xp.concat([surface, floor], 0)
        if len(both):
            parts = [self.surface(xp.take(way, surface), surface, trail)] if len(surface) else []
            if len(floor):
                parts.append(self._ground(xp.take(way, floor), xp.take(limit, floor)))
            p, n, colour, haze, free = (xp.concat(list(part), -1) for part in zip(*parts, strict=True))
            light, more = self._received(p, n, free)
            xp.put(seen, both, colour * light + haze)
            xp.put(alpha, both, xp.take(alpha, both) * 0 + 1)
            work += more + Work(met=len(surface))
        if trail.pieces:
            clear = xp.exp(-EXTINCTION * trail.length)
            glow, more = self._scattered(way, trail)
            seen, alpha, work = seen * clear + glow, 1 - (1 - alpha) * clear, work + more
        return Shade(seen, alpha, work)

    def limit(self, way: Array) -> Array:
        """How far rays from the eye go before they meet the ground (M,), inf for ever."""
        xp, eye, ground, never = self.xp, self.stage.camera.eye, self.stage.ground, 0 * way[0] + INF
        if ground is None or eye[1] <= ground.y:
            return never
        down = way[1] < 0
        return xp.select(down, (ground.y - eye[1]) / xp.select(down, way[1], way[1] * 0 - 1), never)

    def _sky(self, way: Array) -> Array:
        high = (way[1] * 2).clip(0.0, 1.0)
        return self.horizon[:, None] + (self.zenith - self.horizon)[:, None] * high

    def _received(self, p: Array, n: Array, free: Array) -> tuple[Array, Work]:
        """Light (3, K) that surface points (3, K) with unit normals receive: the lamp's where free."""
        xp = self.xp
        to = self.lamp[:, None] - p
        r = _length(xp, to).clip(NEAREST)
        facing = _dot(n, to) / r
        lit = xp.where((facing > 0) & free)
        got = facing * 0
        lifted = xp.take(p, lit) + LIFT * xp.take(n, lit)
        clear, work = self._clear(lifted, CLEAR)
        xp.put(got, lit, xp.take(facing / (r * r), lit) * clear)
        return got * self.power[:, None] + (AMBIENT[0] + AMBIENT[1] * n[1]), work

    def _clear(self, p: Array, before: float) -> tuple[Array, Work]:
        """The share (K,) of the light that reaches points (3, K)."""
        xp = self.xp
        way = p - self.lamp[:, None]
        r = _length(xp, way)
        trail = march(self.field, self.lamp, way / r.clip(1e-9), r - before, halvings=0)
        work = Work(0, p.shape[1], trail.near, trail.steps, trail.met)
        return (trail.hit == INF) * xp.exp(-EXTINCTION * trail.length), work

    def surface(self, way: Array, index: Array, trail: Trail) -> tuple[Array, ...]:
        """Points where rays meet solids, normals, colours, and light that joins in before, (3, K) each, and
        where a ray to the light starts outside of what is opaque (K,)."""
        xp = self.xp
        t = xp.take(trail.hit, index)
        found = self._look(way, t + INTO, gradient=True)
        sharp = xp.take(trail.soft, index) == 0
        off = xp.where(sharp & (abs(found.distance) > 3 * INTO))
        if len(off):  # where the distances on both sides of the surface said little about it
            t_off = xp.take(t, off) + INTO + self._ahead(found, way, off)
            again = self._look(xp.take(way, off), t_off, gradient=True)
            xp.put(t, off, t_off - INTO)
            for old, new in zip(found[:3], again[:3], strict=True):
                xp.put(old, off, new)
        g = found.gradient
        towards = _dot(g, way)
        p = self.eye[:, None] + way * (t + sharp * (INTO + self._ahead(found, way, None)))
        n = g * (xp.select(towards > 0, 0 * t - 1, 0 * t + 1) / _length(xp, g).clip(1e-12))
        free = found.distance < INF
        soft = xp.where(~sharp)
        if len(soft):  # the medium's distance gives the normal, which may point into the solid
            start = xp.take(p + LIFT * n, soft) - self.eye[:, None]
            there = self._look(start, 0 * start[0] + 1)
            xp.put(free, soft, (there.distance >= 0) | (there.register[3] > 0.5))
        return p, n, found.register[:3], 0 * p, free

    def _look(self, way: Array, t: Array, gradient: bool = False) -> Meeting:
        """All about the points way t (3, K) from the eye."""
        begin, end, _ = self.field.spans(self.eye, way, t)
        inside = (begin <= t) & (t <= end)
        return self.field.meet(self.eye[:, None] + way * t, inside, Wanted.ALL, gradient)

    def _ahead(self, found: Meeting, way: Array, index: Array | None) -> Array:
        """How much farther rays meet the surface than where the field was asked."""
        xp, d, g = self.xp, found.distance, found.gradient
        if index is not None:
            d, g, way = xp.take(d, index), xp.take(g, index), xp.take(way, index)
        towards = _dot(g, way)
        return xp.select(towards < -0.02, -d / towards, 0 * d - INTO).clip(-GAP, GAP)

    def _ground(self, way: Array, t: Array) -> tuple[Array, ...]:
        """As `surface`, of the ground at t (K,)."""
        xp, ground = self.xp, self.stage.ground
        assert ground is not None
        p = self.eye[:, None] + way * t
        n = p * 0
        n[1] = 1.0
        kept = xp.exp((p[0] * p[0] + p[2] * p[2]) * (-1 / FADE))
        colour = xp.array(np.asarray(ground.rgb, np.float32), p)[:, None]
        return p, n, kept * colour, (1 - kept) * self.horizon[:, None], t < INF

    def _scattered(self, way: Array, trail: Trail) -> tuple[Array, Work]:
        """Light (3, M) that media send towards the eye.

        Of a piece that takes u of the light, the integral over T sigma dt is one over du, from 0 to u.
        """
        xp, pieces = self.xp, [part for piece in trail.pieces for part in self._cut(way, piece)]
        ray, begin, end, before = (xp.concat(parts, 0) for parts in zip(*pieces, strict=True))
        taken = 1 - xp.exp(-EXTINCTION * (end - begin))
        nodes = xp.array(NODES.astype(np.float32), way)[:, None]
        weights = xp.array(WEIGHTS.astype(np.float32), way)[:, None]
        t = begin - xp.log(1 - nodes * taken) / EXTINCTION  # (nodes, P)
        weight = weights * (taken * xp.exp(-EXTINCTION * before))
        count = len(NODES)
        t, weight, rays = t.reshape(-1), weight.reshape(-1), xp.concat([ray] * count, 0)
        ways = xp.take(way, rays)
        p = self.eye[:, None] + ways * t
        colour = self._look(ways, t).register[:3]
        r = _length(xp, self.lamp[:, None] - p).clip(NEAREST)
        clear, work = self._clear(p, 0.0)
        light = (clear / (4 * r * r)) * self.power[:, None] + AMBIENT[0]
        sent = (colour * light * weight).reshape(3, count, -1).sum(1)
        glow = 0 * way
        done = 0
        for part in pieces:  # a ray occurs once in each
            k = len(part[0])
            xp.put(glow, part[0], xp.take(glow, part[0]) + sent[:, done : done + k])
            done += k
        return glow, work + Work(met=len(rays))

    def _cut(self, way: Array, piece: Piece) -> Iterator[Piece]:
        """Pieces along which the light falls evenly enough, of pieces of rays, each ray once."""
        xp, (ray, begin, end, before) = self.xp, piece
        ways, to = xp.take(way, ray), (self.lamp - self.eye)[:, None]
        first, last = to - ways * begin, to - ways * end
        narrow = _dot(first, last) > NARROW * _length(xp, first) * _length(xp, last)
        yield tuple(xp.take(part, xp.where(narrow)) for part in piece)
        wide = xp.where(~narrow)
        if not len(wide):
            return
        ray, begin, end, before, ways = (xp.take(part, wide) for part in (*piece, ways))
        middle = _dot(ways, to)
        aside = _length(xp, to - ways * middle).clip(NEAREST)
        for low, high in pairwise(CUTS):
            a, b = xp.maximum(begin, middle + low * aside), xp.minimum(end, middle + high * aside)
            some = xp.where(a < b)
            yield tuple(xp.take(part, some) for part in (ray, a, b, before + a - begin))


def draw_solids(
    field: SolidField,
    stage: Stage,
    canvas: tuple[int, int],
    *,
    threads: int = 1,
    samples: str = "adaptive",
    progress: Callable[[float], None] | None = None,
) -> tuple[Image, Work]:
    """Draw a field of solids.

    Args:
        field: the solids.
        stage: camera, light, ground and sky.
        canvas: width and height in pixels.
        threads: bands drawn at the same time.
        samples: of a pixel: ``"adaptive"``, four where something changes from pixel to pixel and one
            elsewhere, ``"four"`` or ``"one"``.
        progress: called with the share done, from any thread.

    Returns:
        The picture and what it took.

    Raises:
        ProgramError: numbers out of all proportion, which no compiled scene has.
    """
    width, height = canvas
    lighting = Lighting(field, stage)
    out = np.empty((4, height, width), np.float32)
    rows = max(1, min(TILE // width, -(-height // threads)))
    bands = [range(top, min(top + rows, height)) for top in range(0, height, rows)]
    costs: list[Work] = []

    def one(band: range) -> None:
        out[:, band.start : band.stop], work = _band(lighting, canvas, band, samples)
        costs.append(work)
        if progress is not None:
            progress(len(costs) / len(bands))

    if threads == 1 or len(bands) == 1:
        for band in bands:
            one(band)
    else:
        with ThreadPoolExecutor(threads, initializer=field.xp.one_core) as pool:
            list(pool.map(one, bands))
    if not np.isfinite(out).all():
        raise ProgramError("numbers that the network cannot draw with")
    colour, alpha = np.moveaxis(out[:3], 0, 2), out[3]
    work = sum(costs, Work())
    if stage.transparent:
        straight = encoded(colour / np.maximum(alpha, 1e-6)[..., None])
        return from_samples(straight * alpha[..., None], alpha), work
    return from_samples(encoded(colour), None), work


def encoded(linear: np.ndarray) -> Any:
    """sRGB of linear values, clamped to [0, 1] (IEC 61966-2-1)."""
    x = np.clip(linear, 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)


def _band(lighting: Lighting, canvas: tuple[int, int], rows: range, samples: str) -> tuple[np.ndarray, Work]:
    """Premultiplied radiance and alpha (4, rows, W) of some rows of pixels, and what they took."""
    width, height = canvas
    if samples == "one":
        every = np.array(rows)[:, None] + 0.5
        return _shade(lighting, canvas, np.arange(width) + 0.5, every)
    if samples == "adaptive":
        near = range(max(rows.start - 1, 0), min(rows.stop + 1, height))
        once, work = _shade(lighting, canvas, np.arange(width) + 0.5, np.array(near)[:, None] + 0.5)
        band = slice(rows.start - near.start, rows.stop - near.start)
        picture = np.ascontiguousarray(once[:, band])
        y, x = np.nonzero(rough(once if lighting.stage.transparent else once[:3])[band])
    else:
        picture, work = np.empty((4, len(rows), width), np.float32), Work()
        y, x = (a.reshape(-1) for a in np.mgrid[0 : len(rows), 0:width])
    if len(x):
        quarter = np.array([[0.25, 0.75, 0.25, 0.75], [0.25, 0.25, 0.75, 0.75]])
        four, more = _shade(lighting, canvas, x[:, None] + quarter[0], y[:, None] + rows.start + quarter[1])
        picture[:, y, x] = four.mean(2)
        work += more + Work(refined=len(x))
    return picture, work


def _shade(
    lighting: Lighting, canvas: tuple[int, int], x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, Work]:
    """Radiance and alpha (4, …) at places of the picture in pixels from its upper left corner."""
    xp, way = lighting.xp, directions(lighting.stage.camera, canvas, x, y)
    with xp.inference():
        shade = lighting.shade(xp.array(way.reshape(3, -1), lighting.field.network.codes))
        both = xp.to_numpy(xp.concat([shade.radiance, shade.alpha[None]], 0))
    return both.reshape(4, *way.shape[1:]), shade.work


def directions(camera: Camera, canvas: tuple[int, int], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Unit directions (3, …) of rays through places of the picture in pixels from its upper left corner."""
    forward, right, up = (np.reshape(axis, (3, 1, 1)) for axis in camera.axes())
    px, (width, height) = 2 / min(canvas), canvas
    # float64 up to here: at 8192 pixels float32 would move samples by a thousandth of a pixel
    across = (right * ((x - width / 2) * px)).astype(np.float32)
    ahead = (forward / np.tan(camera.fov_rad / 2) + up * ((height / 2 - y) * px)).astype(np.float32)
    way: np.ndarray = ahead + across
    way /= np.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    return way


def rough(picture: np.ndarray) -> np.ndarray:
    """Pixels (H, W) of (4, H, W) that differ from what lies evenly between neighbours on opposite sides."""
    shown = np.sqrt(np.clip(picture, 0.0, 1.0))  # nearly as bright as it looks
    shown = np.pad(shown, ((0, 0), (1, 1), (1, 1)), "edge")
    here = 2 * shown[:, 1:-1, 1:-1]
    across = abs(shown[:, 1:-1, 2:] + shown[:, 1:-1, :-2] - here).max(0)
    along = abs(shown[:, 2:, 1:-1] + shown[:, :-2, 1:-1] - here).max(0)
    return np.asarray(np.maximum(across, along) > CONTRAST)


def _dot(a: Array, b: Array) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _length(xp: Arrays, a: Array) -> Array:
    return xp.sqrt(_dot(a, a))
