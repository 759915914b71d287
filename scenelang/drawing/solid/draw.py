"""Light on solids: surfaces, ground, sky and media along rays, and pictures and outputs of them.

The light is computed, as the language defines it; places and colours of solids are learned. Pictures are
drawn in bands of pixels, with more samples where they are needed. Letters as in `network.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from scenelang.compiler.program import ProgramError
from scenelang.compiler.spaces import AMBIENT, LIFT, NEAREST, Camera, Light, Stage
from scenelang.drawing.arrays import Array
from scenelang.drawing.image import DEEP, Image, Outputs, from_light, sample_places
from scenelang.drawing.kernel import Asked, load_kernel
from scenelang.drawing.solid.around import CAP, ELSEWHERE, OFF, arriving, to_ground
from scenelang.drawing.solid.centres import EACH, LARGE, Centres
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.gloss import MIRRORS, coated, reflected
from scenelang.drawing.solid.march import CAREFUL, INF, MARCH_SETTINGS, MarchSettings, Pieces, Trail, Work
from scenelang.drawing.solid.mist import ALBEDO
from scenelang.drawing.solid.soft import ASIDE, BEAMS, MORE_BEAMS, WIDE, form
from scenelang.drawing.tables import stage_rows

INTO = 3e-5  # world units behind a surface where its material is asked for
UNEVEN = 0.3  # difference of beams of a lamp through media for which more are asked
EVEN = 2  # how much more evenly than the light that the medium takes nodes lie
BUSY = 8.0  # texels that a piece may cross with `FEW` panels of two points each
FEW, MANY = 4, 12
CHUNK = 1024  # pieces of which textures are looked up at once
PIXELS = 4096  # on surfaces, likewise
PIECES = 1 << 14  # of which the light is asked for at once
GRAZING = 0.5  # how much farther or nearer a pixel's samples may be on a surface, as a part of the way
TILE, SIDE = 1 << 16, 8  # samples at a time; pixels of tiles whose samples follow each other
ROWS = 6  # of what a ray tells: depth, normal, object and alpha
CLEAR = 2e-4  # world units before a surface where rays from the light end
THIRDS = 3  # of pieces of which nodes do not tell enough
LEAST = 0.04  # of what is seen, that a piece has to have a part of to be cut
LONG = 2.0  # world units: longer pieces are cut
SMALL = 0.15  # world units: lamps with shadows that may be sharper than pixels
SMALLISH = 12.0  # pixels: median radius of objects below which samples share no light
DISTANT = 6.0  # radii of a lamp: points in media so far from it see the same through media all over its disc
STEEP = 1.2  # how much more light the last node may get than the first
NARROW = 0.8  # cosine: pieces of media that the light sees under a larger angle are cut
CUTS = (-INF, -14.0, -3.7, -1.0, -0.27, 0.27, 1.0, 3.7, 14.0, INF)  # tangents of angles at the light


# of points on surfaces: the centres of pixels, and the rays (F,) that met them
Beside = tuple[Centres, Array] | None


class Shade(NamedTuple):
    """Light along M rays."""

    radiance: Array  # premultiplied and linear (3, M)
    plain: Array  # the same with plain colours for those of textures
    alpha: Array  # (M,)
    work: Work


class Points(NamedTuple):
    """K points that lamps may reach: F on surfaces, then those in media."""

    p: Array  # (3, K)
    n: Array  # (3, F) unit normals
    base: Array  # (R, K): what they send to the eye without lamps
    colour: Array  # (R, K): of what reaches them the part that the eye gets
    coat: Array = None  # (4 + R, F) as of `coated`, or (0, F)


class Lamp(NamedTuple):
    """A lamp where arrays lie."""

    light: Light
    at: Array  # (3,)
    power: Array  # (R,)


class Lighting:
    """A field under the light of its stage, drawn at a pace.

    Under a sky ``around`` takes the place of ambient light: ``surface(p, n)`` is what points of surfaces
    (3, K) with unit normals receive, ``medium(p)`` the mean radiance at points in media, linear, each (3, K)
    and without what lamps send there.
    """

    def __init__(
        self, field: SolidField, stage: Stage, pace: MarchSettings = CAREFUL, around: Any = None
    ) -> None:
        pace = paced(field, pace)
        self.field, self.stage, self.xp, self.pace, self.around = field, stage, field.xp, pace, around
        like = field.network.codes
        twice = 2 if field.textures else 1  # colours, and plain ones in place of textures'
        forward, right, up = np.asarray(stage.camera.axes())
        # the samples of a pixel; the sides of pixels, px, are those of a picture that is 2 wide
        four = [across * right + along * up for along in (0.25, -0.25) for across in (-0.25, 0.25)]

        def placed(value: object) -> Array:
            return field.xp.array(np.asarray(value, np.float32), like)

        self.eye, self._four = placed(stage.camera.eye), placed(np.transpose(four)[:, :, None])
        self.horizon, self.zenith = placed(stage.horizon * twice), placed(stage.zenith * twice)
        mirrors = field.rough and stage.sky is not None
        self._bare = placed(np.zeros((4 + 3 * twice if mirrors else 0, 1)))  # coat of what does not mirror
        self._forward = placed(forward * np.tan(stage.camera.fov_rad / 2))
        self.opaque, self.hazy = shadowing(field, stage)
        self.lamps = [
            Lamp(light, placed(light.position), placed([light.power * c for c in light.rgb] * twice))
            for light in stage.lights
        ]

    def shade(self, way: Array, px: float = 0.0, centres: Centres | None = None) -> Shade:
        """Light along rays from the eye, whose unit directions are (3, M). Textures are looked up four times
        for pixels of a side px, of a picture that is 2 wide; once for 0. Rays to centres of pixels tell what
        arrives there, of which other rays take theirs.
        """
        xp, stage = self.xp, self.stage
        high, limit = (way[1] * 2).clip(0.0, 1.0), self.limit(way)
        seen = self.horizon[:, None] + (self.zenith - self.horizon)[:, None] * high
        alpha = 0 * way[0] + (0.0 if stage.transparent else 1.0)
        if stage.transparent:
            seen = seen * 0
        trail = self.field.march(self.eye, way, limit, gap=self.pace.gap)
        surface, both, met = self._met(way, trail, limit, px)
        work = trail.work + Work(rays=way.shape[1], met=len(surface))
        if met:
            beside = None if centres is None else (centres, both)
            points = self._reflecting(met, beside)
            light, _, more = self._lit(points, xp.take(trail.soft, surface), beside=beside)
            work += more
            xp.put(seen, both, light)
            xp.put(alpha, both, xp.take(alpha, both) * 0 + 1)
        if len(trail.pieces.ray):
            glow, clear = 0 * seen, xp.exp(-trail.depth)
            for pieces in _some(xp, trail.pieces):
                work += self._glow(way, pieces, px, glow)
            seen, alpha = seen * clear + glow, 1 - (1 - alpha) * clear
        return Shade(seen[:3], seen[-3:], alpha, work)

    def _glow(self, way: Array, pieces: Pieces, px: float, glow: Array) -> Work:
        """Add the light (R, M) that pieces of rays in media send towards the eye, and tell what it took.

        Those whose nodes do not tell how the light goes on between them are cut and asked again.
        """
        xp, count = self.xp, self.pace.nodes
        for lamp in self.lamps:
            pieces = self._cut(way, pieces, lamp)
        points, share = self._scattering(way, pieces, px)
        light, free, work = self._lit(points, way[0, :0])
        work += Work(met=light.shape[1])
        sent, nodes = light.reshape(len(light), count, -1), free.reshape(count, -1)
        shown = sent[-3:].sum(0)
        edge = (nodes != nodes[:1]).sum(0) > 0
        cut = (edge | (shown[-1] > STEEP * shown[0]) | (pieces.end - pieces.begin > LONG)) & (share > LEAST)
        whole, parts = xp.where(~cut), xp.where(cut)
        xp.add(glow, xp.take(pieces.ray, whole), xp.take(sent.sum(1), whole))
        if len(parts):
            ray, begin, end, before, sigma = (xp.take(part, parts) for part in pieces)
            each = (end - begin) / THIRDS
            finer = [
                (ray, begin + i * each, begin + (i + 1) * each, before + i * each, sigma)
                for i in range(THIRDS)
            ]
            pieces = Pieces(*(xp.concat(list(part), 0) for part in zip(*finer, strict=True)))
            light, _, more = self._lit(self._scattering(way, pieces, px)[0], way[0, :0])
            work += more + Work(met=light.shape[1])
            xp.add(glow, pieces.ray, light.reshape(len(light), count, -1).sum(1))
        return work

    def received(self, p: Array, n: Array) -> Array:
        """What points on surfaces (3, K) with unit normals receive from lamps (3, K) whose middles they see;
        bounces blur the shadows.
        """
        points = Points(p, n, self._twice(0 * p), self._twice(0 * p + 1))
        return self._lit(points, p[0, :0], False)[0][:3]

    def places(self, canvas: tuple[int, int], x: np.ndarray, y: np.ndarray) -> tuple[Array, Array]:
        """Points of surfaces and ground, and their normals (3, K), at places of the picture in pixels; points
        far away where there are none.
        """
        xp = self.xp
        way = xp.array(directions(self.stage.camera, canvas, x, y).reshape(3, -1), self.eye)
        limit = self.limit(way)
        trail = self.field.march(self.eye, way, limit, gap=self.pace.gap, whole=True)
        p, n = 0 * way + ELSEWHERE, 0 * way
        _, both, met = self._met(way, trail, limit)
        for part, values in zip((p, n), met, strict=False):
            xp.put(part, both, values)
        return p, n

    def size(self, canvas: tuple[int, int]) -> float:
        """The median radius of objects as the eye sees them, in pixels."""
        rows = self.field.objects.rows
        away = np.linalg.norm(rows["centre"] - np.asarray(self.stage.camera.eye), axis=1)
        seen = rows["extent"] / away.clip(1e-6) if len(rows) else [0.0]
        return float(np.median(seen) * min(canvas) / 2 / np.tan(self.stage.camera.fov_rad / 2))

    def limit(self, way: Array) -> Array:
        """Distances (M,) to the ground along rays from the eye, inf for rays that never meet it."""
        return to_ground(self.xp, self.stage.ground, self.stage.camera.eye[1], way)

    def _met(
        self, way: Array, trail: Trail, limit: Array, px: float = 0.0, origin: Array = None
    ) -> tuple[Array, Array, list[Array]]:
        """Rays that met solids (F,), these and those that met the ground, what `surface` tells of both."""
        xp, parts = self.xp, []
        surface, floor = xp.where(trail.hit < INF), xp.where((trail.hit == INF) & (limit < INF))
        for some, on_ground in ((surface, False), (floor, True)):
            if len(some):
                ways = xp.take(way, some)
                start = self.eye[:, None] if origin is None else xp.take(origin, some)
                if on_ground:
                    parts.append(self._ground(ways, xp.take(limit, some), start, origin is None))
                else:
                    parts.append(self.surface(ways, some, trail, px, start))
        both = xp.concat([surface, floor], 0)
        return surface, both, [xp.concat(list(each), 1) for each in zip(*parts, strict=True)]

    def _reflecting(self, met: list[Array], beside: Beside = None, mirrors: int = MIRRORS) -> Points:
        """Points that light, of `_met`; with ``beside`` as of `_lit`."""
        p, n, colour, haze, coat = met
        if self.around is None:
            received = AMBIENT[0] + AMBIENT[1] * n[1]
        elif beside is None:
            received = self._twice(self.around.surface(p, n))
        else:
            centres, rays = beside
            every = self.around.emitters.there or self.around.hollow
            received = self._twice(centres.received(rays, p, n, self.around.surface, every))
        base = colour * received + haze
        if len(coat):
            base = base + reflected(self, p, n, coat, received, mirrors)
        return Points(p, n, base, colour, coat)

    def _twice(self, light: Array) -> Array:
        """Light (R, K) on colours and plain colours, of (3, K)."""
        return light if len(self.horizon) == 3 else self.xp.concat([light, light], 0)

    def _scattering(self, way: Array, pieces: Pieces, px: float) -> tuple[Points, Array]:
        """Nodes in media, whose light comes towards the eye, all pieces for each in turn, and shares (P,).

        With u = 1 - T^(1 / EVEN), the integral over T sigma dt is one over EVEN (1 - u)^(EVEN - 1) du. Where
        light fades as T does, three nodes are exact.
        """
        xp, (ray, begin, end, before, sigma) = self.xp, pieces
        taken = 1 - xp.exp(-sigma / EVEN * (end - begin))
        nodes, weights = (
            xp.array(values[:, None].astype(np.float32), way)
            for values in np.polynomial.legendre.leggauss(self.pace.nodes)
        )
        nodes, weights = (nodes + 1) / 2, weights / 2
        left = 1 - nodes * taken
        t = (begin - xp.log(left) * (EVEN / sigma)).reshape(-1)  # of (nodes, P)
        weight = weights * (EVEN * taken * left ** (EVEN - 1) * xp.exp(-sigma * before))
        rays = xp.concat([ray] * self.pace.nodes, 0)
        p = self.eye[:, None] + xp.take(way, rays) * t
        register = self.field.near(p, self.pace.gap, every=True).register
        colour = register[: self.field.hues] * weight.reshape(-1)
        for index, node, woven in self._textured(way, pieces, px):
            xp.put(colour[:3], index + node * len(ray), woven)
        if self.around is not None:
            colour = xp.minimum(colour, ALBEDO * weight.reshape(-1))
        received = AMBIENT[0] if self.around is None else self._twice(self.around.medium(p))
        base = colour * received
        if self.field.glowing:
            base = base + self._twice(self.field.glow(register) * weight.reshape(-1))
        return Points(p, way[:, :0], base, colour, self._bare * p[:1, :0]), weight.sum(0)

    def _lit(
        self, points: Points, soft: Array, wide: bool = True, beside: Beside = None
    ) -> tuple[Array, Array, Work]:
        """Light (R, K) from points, a number (K,) that tells by which lamps they are reached, and what it
        took. Of the first, ``soft`` is 1 where they are not at a distance of 0 though something begins there.
        Unless ``wide``, what hides a lamp's middle hides all of it.
        With ``beside`` points on surfaces are those that rays (F,) met.
        """
        xp, p, light, work = self.xp, points.p, points.base, Work()
        free, edge = 0 * p[0], 0 * p[0]
        edge[: len(soft)] = soft
        surfaces = points.n.shape[1]
        normals = xp.concat([points.n, 0 * p[:, surfaces:]], 1)
        off = p + LIFT * normals
        for number, lamp in enumerate(self.lamps):
            more = self._sent(points, lamp)
            lit = xp.where(abs(more).sum(0) > 0)
            if lamp.light.radius and wide:
                clear, took = self._softly(number, lit, off, normals, beside)
            else:
                clear, took = self._reached(lamp, xp.take(off, lit), xp.take(edge, lit) > 0)
            xp.put(light, lit, xp.take(light, lit) + xp.take(more, lit) * clear)
            xp.put(free, lit, xp.take(free, lit) + (clear > 0) * 2.0**number)
            work += took
        return light, free, work

    def _softly(self, number: int, lit: Array, p: Array, n: Array, beside: Beside) -> tuple[Array, Work]:
        """As `_shared`, of some points (k,) of those that `_lit` has."""
        xp, work, lamp = self.xp, Work(), self.lamps[number]

        def ask(index: Array) -> Array:
            nonlocal work
            clear, took = self._shared(lamp, xp.take(p, index), xp.take(n, index))
            work += took
            return clear

        if beside is None:
            return ask(lit), work
        centres, rays = beside
        on, rest = xp.take(lit, xp.where(lit < len(rays))), xp.take(lit, xp.where(lit >= len(rays)))
        ray, at, up = (xp.take(part, on) for part in (rays, p, n))
        small = lamp.light.radius < SMALL
        share = centres.shares(number, small, ray, at, up, lambda index: ask(xp.take(on, index)))
        return xp.concat([share, ask(rest)], 0) if len(rest) else share, work

    def _sent(self, points: Points, lamp: Lamp) -> Array:
        """What points send to the eye (R, K) of a lamp's light if nothing is in its way."""
        xp, surfaces = self.xp, points.n.shape[1]
        to = lamp.at[:, None] - points.p
        r = xp.length(to).clip(NEAREST)
        more = points.colour * lamp.power[:, None]
        near, far, radius = r[:surfaces], r[surfaces:], lamp.light.radius
        facing = _dot(points.n, to[:, :surfaces]) / near
        received, over = facing.clip(0.0) / (near * near), 4 * far * far
        if radius:
            received, rim = form(xp, facing, near, radius), (1 - (radius / far) ** 2).clip(0.0)
            over = xp.select(far > radius, 2 * far * far * (1 + xp.sqrt(rim)), 0 * far + INF)
        more = xp.concat([more[:, :surfaces] * received, more[:, surfaces:] / over], 1)
        if len(self._bare) and points.coat is not None:
            some = xp.where(points.coat[0] > 0)
            p, n, coat = (xp.take(part, some) for part in (points.p, points.n, points.coat))
            lobe = load_kernel().mirrored(lamp.at, radius, p, n, coat) * lamp.power[:, None]
            xp.put(more, some, xp.take(more, some) + lobe)
        return more

    def _shared(self, lamp: Lamp, p: Array, n: Array) -> tuple[Array, Work]:
        """As `_reached`, of a lamp of a radius; n (3, K) are normals, 0 in media."""
        xp, radius = self.xp, lamp.light.radius
        part, work = self.opaque.shown(lamp.at, radius, p, n)
        some = xp.where(part > 0)
        if self.field.media and len(some):
            clear, took = self._hazed(lamp, xp.take(p, some), xp.take(n, some))
            xp.put(part, some, xp.take(part, some) * clear)
            work += took
        return part, work + Work(lights=len(part))

    def _hazed(self, lamp: Lamp, p: Array, n: Array) -> tuple[Array, Work]:
        """Parts of a lamp's light (K,) that media let through to points as of `_shared`, along `BEAMS`, more
        where these differ; from the middle alone to points in media that are far from it.
        """
        xp, passed, work = self.xp, 0 * p[0], Work()
        single = (_dot(n, n) < 0.5) & (xp.length(p - lamp.at[:, None]) > DISTANT * lamp.light.radius)
        more: list[tuple[Array, Any]] = [(xp.where(single), 0 * BEAMS[:1]), (xp.where(~single), BEAMS)]
        while more:
            some, beams = more.pop()
            clear, took = self._through(lamp, xp.take(p, some), beams)
            xp.put(passed, some, clear.mean(0))
            work += took
            if len(beams) == len(BEAMS):
                uneven = xp.where(xp.largest(clear)[0] - xp.least(clear) > UNEVEN)
                more.append((xp.take(some, uneven), MORE_BEAMS))
        return passed, work

    def _through(self, lamp: Lamp, p: Array, beams: np.ndarray) -> tuple[Array, Work]:
        """Parts (B, K) of light that media let through from a lamp's points (B, 3) to points (3, K)."""
        xp, radius = self.xp, lamp.light.radius
        start = xp.array(np.repeat(radius * beams.T, p.shape[1], 1).astype(np.float32), p)
        way = xp.concat([p] * len(beams), 1) - (start + lamp.at[:, None])
        r = xp.length(way)
        way, along = way / r, _dot(start, way) / r
        rim = xp.sqrt(along * along + (radius * radius - _dot(start, start))) - along  # of the lamp
        origin, gap = start + lamp.at[:, None], self.pace.gap
        trail = self.hazy.march(origin, way, r - CLEAR, start=rim, gap=gap, halvings=0, whole=True)
        return xp.exp(-trail.depth).reshape(len(beams), -1), trail.work

    def _reached(self, lamp: Lamp, p: Array, edge: Array) -> tuple[Array, Work]:
        """Parts of a lamp's light (K,) that arrive at points (3, K), and what it took; of ``edge`` as `_lit`
        of ``soft``.
        """
        xp, way = self.xp, p - lamp.at[:, None]
        r = xp.length(way)
        limit, ways, gap = xp.select(edge, r, r - CLEAR), way / r.clip(1e-9), self.pace.gap
        start = lamp.light.radius
        trail = self.field.march(lamp.at, ways, limit, start=start, gap=gap, halvings=0, whole=True)
        clear = (trail.hit == INF) * xp.exp(-trail.depth)
        inside = xp.where(edge & (clear > 0))
        if len(inside):  # rays may have ended before they met what is opaque there
            at = self.field.near(xp.take(p, inside), gap, every=True)
            opaque = (at.distance < 0) & (at.register[-1] < 0.5)
            xp.put(clear, inside, xp.take(clear, inside) * ~opaque)
        return clear, trail.work + Work(lights=len(r))

    def surface(self, way: Array, index: Array, trail: Trail, px: float, origin: Array) -> tuple[Array, ...]:
        """Points where rays meet solids, normals (3, K), colours, light from before them (R, K), coats."""
        xp = self.xp
        t = xp.take(trail.hit, index)
        result = self.field.near(origin + way * (t + INTO), self.pace.gap, gradient=True, every=True)
        sharp = xp.take(trail.soft, index) == 0
        for last in (False, True):  # beside an edge, or where distances said little about the surface
            left = _dot(result.gradient, way) > 0
            off = xp.where(sharp & (left | (abs(result.distance) > 3 * INTO)))
            if not len(off):
                break
            left, ways, t_off = (xp.take(part, off) for part in (left, way, t))
            beyond = left & (last | (xp.take(result.distance, off) <= 3 * INTO))
            t_off = t_off + INTO + xp.select(beyond, 0 * t_off - self.pace.gap, self._ahead(result, way, off))
            begin = origin if origin.shape[1] == 1 else xp.take(origin, off)
            again = self.field.near(begin + ways * t_off, self.pace.gap, gradient=True, every=True)
            past = (left | (again.distance > 3 * INTO)) & (_dot(again.gradient, ways) > 0)
            there = xp.where((_dot(again.gradient, again.gradient) > 0.01) & ~past)
            off = xp.take(off, there)
            xp.put(t, off, xp.take(t_off, there) - INTO)
            for name in ("distance", "register", "gradient", "owner"):
                xp.put(getattr(result, name), off, xp.take(getattr(again, name), there))
        g = result.gradient
        towards = _dot(g, way)
        t = t + sharp * (INTO + self._ahead(result, way, None))
        p = origin + way * t
        n = g * (xp.select(towards > 0, 0 * t - 1, 0 * t + 1) / xp.length(g).clip(1e-12))
        colour = result.register[: self.field.hues]
        glow = self._twice(self.field.glow(result.register)) if self.field.glowing else 0 * colour
        for soft in (False, True) if px and self.field.textures else ():
            some = xp.where((self.field.texels(origin, way, t, t) > 0) & (sharp != soft))
            if len(some):
                owners = xp.whole(xp.take(result.owner, some) - 1).clip(0)
                ways, ts, ns = (xp.take(each, some) for each in (way, t, n))
                xp.put(colour[:3], some, self._mean(owners, ways, ts, ns, soft, px))
        if self.around is not None:
            colour = colour.clip(None, CAP)
            some = xp.where(~sharp)
            if len(some):  # normals may be the medium's, and no light begins within what is opaque
                met = self.field.near(xp.take(p + OFF * n, some), self.pace.gap, every=True)
                inside = (met.distance < 0) & (met.register[-1] < 0.5)
                xp.put(colour, some, xp.take(colour, some) * ~inside)
        if not len(self._bare):
            return p, n, colour, glow, self._bare * p[:1]
        colour, coat = coated(xp, n, -way, colour, self.field.material(result).roughness)
        return p, n, colour, glow, coat

    def _ahead(self, met: Asked, way: Array, index: Array | None) -> Array:
        """Distance along rays from the points where the field was asked to the surface."""
        xp, d, g = self.xp, met.distance, met.gradient
        if index is not None:
            d, g, way = xp.take(d, index), xp.take(g, index), xp.take(way, index)
        towards = _dot(g, way)
        # along one, at a cosine over -0.02, the distance says nothing of it, but rays met it within the gap
        along = xp.select(d > 3 * INTO, 0 * d + self.pace.gap, 0 * d - INTO)
        return xp.select(towards < -0.02, -d / towards, along).clip(-self.pace.gap, self.pace.gap)

    def _ground(self, way: Array, t: Array, origin: Array, seen: bool) -> tuple[Array, ...]:
        """As `surface`, of the ground at t (K,), as the eye has seen it or other light meets it."""
        xp, ground = self.xp, self.stage.ground
        assert ground is not None
        horizon = self.horizon[:, None] if seen else self._twice(self.around.horizon)
        p = origin + way * t
        n = p * 0
        n[1] = 1.0
        kept = xp.exp((p[0] * p[0] + p[2] * p[2]) * (-1 / ground.fade**2))
        rgb = np.tile(np.asarray(ground.rgb, np.float32), len(self.horizon) // 3)
        colour = xp.array(rgb, p)[:, None]
        if self.around is not None:
            colour = colour.clip(None, CAP)
        return p, n, kept * colour, (1 - kept) * horizon, self._bare * p[:1]

    def _cut(self, way: Array, piece: Pieces, lamp: Lamp) -> Pieces:
        """The same pieces of rays, cut where the light of a lamp falls unevenly along them."""
        xp, (ray, begin, end, before, sigma) = self.xp, piece
        ways, to = xp.take(way, ray), (lamp.at - self.eye)[:, None]
        first, last = to - ways * begin, to - ways * end
        narrow = _dot(first, last) > NARROW * xp.length(first) * xp.length(last)
        result = [Pieces(*(xp.take(part, xp.where(narrow)) for part in piece))]
        wide = xp.where(~narrow)
        if not len(wide):
            return result[0]
        ray, begin, end, before, sigma, ways = (xp.take(part, wide) for part in (*piece, ways))
        middle = _dot(ways, to)
        aside = xp.length(to - ways * middle).clip(NEAREST)
        for low, high in pairwise(CUTS):
            a, b = xp.maximum(begin, middle + low * aside), xp.minimum(end, middle + high * aside)
            some = xp.where(a < b)
            parts = ray, a, b, before + a - begin, sigma
            result.append(Pieces(*(xp.take(part, some) for part in parts)))
        return Pieces(*(xp.concat(list(parts), 0) for parts in zip(*result, strict=True)))

    def _mean(self, owners: Array, way: Array, t: Array, n: Array, soft: bool, px: float) -> Array:
        """Mean colours (3, K) where the samples of pixels meet the planes through points at t, of objects by
        their numbers, with normals n; what a medium gives way to, if soft, has its own plane and colours.
        """
        xp, field = self.xp, self.field
        if len(t) > PIXELS:
            parts = [slice(at, at + PIXELS) for at in range(0, len(t), PIXELS)]
            some = [(owners[at], way[:, at], t[at], n[:, at]) for at in parts]
            return xp.concat([self._mean(*each, soft, px) for each in some], 1)
        seen = way * t
        if soft:
            n = field.own(owners, self.eye[:, None] + seen)[1]
        side = px * t * (self._forward @ way)
        off = self._four * side
        towards = (n * seen).sum(0)
        towards = xp.select(abs(towards) > 1e-6, towards, 0 * t - 1e-6)  # of planes seen from the side
        ratio = ((n[:, None] * off).sum(0) / towards).clip(-GRAZING, GRAZING)
        off = (off - seen[:, None] * ratio) / (1 + ratio)
        p = ((self.eye[:, None] + way * (t + INTO))[:, None] + off).reshape(3, -1)
        owners = xp.concat([owners] * 4, 0)
        if soft:
            return field.worn(owners, p).reshape(3, 4, -1).mean(1)
        met = field.near(p, xp.concat([side] * 4, 0), every=True)
        colours = met.register[:3]
        beside = xp.where(met.owner == 0)  # the plane goes on beyond the surface
        if len(beside):
            xp.put(colours, beside, field.worn(xp.take(owners, beside), xp.take(p, beside)))
        return colours.reshape(3, 4, -1).mean(1)

    def _textured(self, way: Array, pieces: Pieces, px: float) -> Iterator[tuple[Array, int, Array]]:
        """Pieces of rays in media with textures: their indices, a node, and the result of `_woven` there."""
        xp, (ray, begin, end, _, sigma) = self.xp, pieces
        if not self.field.textures:
            return
        texels = self.field.texels(self.eye[:, None], xp.take(way, ray), begin, end)
        texels = texels * xp.minimum(end - begin, 1 / sigma)
        for some, panels in (((texels > 0) & (texels <= BUSY), FEW), (texels > BUSY, MANY)):
            whole = xp.where(some)
            for start in range(0, len(whole), CHUNK):
                index = whole[start : start + CHUNK]
                part = Pieces(*(xp.take(each, index) for each in pieces))
                for node, woven in enumerate(self._woven(way, part, panels, px)):
                    yield index, node, woven

    def _woven(self, way: Array, pieces: Pieces, panels: int, px: float) -> list[Array]:
        """The colours (3, P) that nodes on pieces of rays have, times their weights, where colours vary.
        Between nodes the light is a polynomial; it meets colours of many more points, in turn the samples'.
        """
        xp, (ray, begin, end, before, sigma) = self.xp, pieces
        gauss, count = np.polynomial.legendre.leggauss, 2 * panels
        places = ((np.arange(panels)[:, None] + (gauss(2)[0] + 1) / 2) / panels).reshape(-1)
        nodes = (gauss(self.pace.nodes)[0] + 1) / 2
        bases = [
            np.prod([(places - other) / (node - other) for other in nodes if other != node], 0)
            for node in nodes
        ]
        taken = 1 - xp.exp(-sigma / EVEN * (end - begin))
        left = 1 - xp.array(places[:, None].astype(np.float32), way) * taken
        t = (begin - xp.log(left) * (EVEN / sigma)).reshape(-1)  # of (places, P)
        weight = EVEN / count * taken * left ** (EVEN - 1) * xp.exp(-sigma * before)
        rays = xp.concat([ray] * count, 0)
        ways = xp.take(way, rays)
        p, side = self.eye[:, None] + ways * t, px * t * (self._forward @ ways)
        if px:
            turns = np.resize((0, 1, 2, 3, 3, 2, 1, 0), count)
            four = xp.stack([self._four[:, i] for i in turns.tolist()], 1)  # (3, places, 1)
            p = p + (four * side.reshape(count, -1)).reshape(3, -1)
        met = self.field.near(p, self.pace.gap + side, every=True)
        colours = met.register[:3].reshape(3, count, -1) * weight
        shares = [xp.array(base[:, None].astype(np.float32), way) for base in bases]
        return [(colours * share).sum(1) for share in shares]


def _some(xp: Any, pieces: Pieces) -> Iterator[Pieces]:
    """So many pieces at a time as memory allows, all those of a ray together."""
    ray = np.asarray(xp.to_numpy(pieces.ray))
    ends = np.searchsorted(ray, ray[PIECES::PIECES])
    for first, last in pairwise(np.unique([0, *ends, len(ray)]).tolist()):
        yield Pieces(*(part[first:last] for part in pieces))


def _dot(a: Array, b: Array) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def draw_solids(
    field: SolidField,
    stage: Stage,
    canvas: tuple[int, int],
    *,
    threads: int = 1,
    split: int | None = None,
    samples: str = "adaptive",
    count: int = 4,
    progress: Callable[[float], None] | None = None,
) -> tuple[Image, Work]:
    """Draw a field of solids: the picture, and what it took; arguments are those of `Run`, and ``count`` of
    samples of a pixel. Raises `ProgramError` for numbers out of all proportion, which no compiled scene has.
    """
    (width, height), pace = canvas, MARCH_SETTINGS[samples]
    tell, lit = progress or (lambda _: None), 0.0  # how much of the share done is light from everywhere
    rows = max(1, min(4 * TILE // (count * width), -(-height // (split or threads))))
    bands = [range(top, min(top + rows, height)) for top in range(0, height, rows)]
    costs: list[Work] = []
    direct = stage.sky is None and field.shades
    if direct:
        every, pace = samples == "four" or (samples != "one" and min(canvas) == 1), paced(field, pace)
        shadows = [part.tables for part in shadowing(field, stage)]
        more = count * (samples != "one"), every, field.hues * field.glowing, shadows
        row, _kept = stage_rows(stage, canvas, pace, *more)
        out = np.empty((height, width, 4 if stage.transparent else 3), np.float32)
    else:
        lighting, out = Lighting(field, stage, pace), np.empty((4, height, width), np.float32)
        if stage.sky is not None:
            lighting.around = around = arriving(lighting)
            tell(0.3)
            around.look(canvas, partial(lighting.places, canvas))
            tell(lit := 0.5)

    def one(band: range) -> None:
        if direct:
            out[band.start : band.stop], work = field.shade(row, band)
        else:
            out[:, band.start : band.stop], work = _band(lighting, canvas, band, samples, count)
        costs.append(work)
        tell(lit + (1 - lit) * len(costs) / len(bands))

    field.xp.each(threads, one, bands)
    if direct:
        return out.view(Image), sum(costs, Work())
    if not np.isfinite(out).all():
        raise ProgramError("numbers that the network cannot draw with")
    return from_light(out, stage.transparent, stage.camera.exposure), sum(costs, Work())


def paced(field: SolidField, pace: MarchSettings) -> MarchSettings:
    """The pace at which a field is followed: rays may clip edges."""
    return pace._replace(gap=pace.gap / 2) if field.edged else pace


def shadowing(field: SolidField, stage: Stage) -> tuple[SolidField, SolidField]:
    """The field of what is opaque alone, and that of the rest, for lamps of a radius; itself without such."""
    reach = max([light.radius for light in stage.lights], default=0.0)
    return (field.opaque((ASIDE + WIDE) * reach), field.hazy()) if reach else (field, field)


def _band(
    lighting: Lighting, canvas: tuple[int, int], rows: range, samples: str, count: int
) -> tuple[np.ndarray, Work]:
    """Premultiplied radiance and alpha (4, rows, W) of some rows of pixels, and what they took."""
    width, height = canvas
    if samples == "one":
        every = np.array(rows)[:, None] + 0.5
        result, work = _shade(lighting, canvas, np.arange(width) + 0.5, every)
        return result[:4], work
    if samples != "four" and min(canvas) > 1:  # a line of pixels shows too little of what changes
        # from a row that `Centres` asks to another, as bands tell the same of rows that they share
        each = EACH[min(canvas) > LARGE]
        first, last = (rows.start - 2) // each * each, -(-(rows.stop + 1) // each) * each + 1
        near = range(max(first, 0), min(last, height))
        x_centres, y_centres = np.arange(width) + 0.5, np.array(near)[:, None] + 0.5
        xp, like = lighting.xp, lighting.field.network.codes
        useful = lighting.around is not None or any(lamp.light.radius for lamp in lighting.lamps)
        useful = useful and lighting.size(canvas) > SMALLISH
        centres = Centres(xp, like, (len(near), width), each) if useful else None
        once, work = _shade(lighting, canvas, x_centres, y_centres, 2 / min(canvas), centres)
        band = slice(rows.start - near.start, rows.stop - near.start)
        picture = np.ascontiguousarray(once[:4, band])
        shown = lighting.stage.camera.exposure * once[4:]
        shown = np.concatenate([once[3:4], shown]) if lighting.stage.transparent else shown
        y, x = np.nonzero(rough(shown, lighting.pace.contrast)[band])
    else:
        centres, picture, work = None, np.empty((4, len(rows), width), np.float32), Work()
        y, x = (a.reshape(-1) for a in np.mgrid[0 : len(rows), 0:width])
    if len(x):
        tiles = np.argsort(y // SIDE * -(-width // SIDE) + x // SIDE, kind="stable")
        x, y = x[tiles], y[tiles]  # near each other, the same objects are met
        across, down = sample_places(count)
        y_samples = y[:, None] + rows.start + down
        if centres is not None:
            aside = [np.tile(np.where(part < 0.5, -1, 1), len(x)) for part in (down, across)]
            at = [np.repeat(y + rows.start - near.start, count), np.repeat(x, count), *aside]
            centres.pixels = [lighting.xp.array(part, like) for part in at]
        every, more = _shade(lighting, canvas, x[:, None] + across, y_samples, centres=centres)
        picture[:, y, x] = every[:4].mean(2)
        work += more + Work(refined=len(x))
    return picture, work


def _shade(
    lighting: Lighting,
    canvas: tuple[int, int],
    x: np.ndarray,
    y: np.ndarray,
    px: float = 0.0,
    centres: Centres | None = None,
) -> tuple[np.ndarray, Work]:
    """Radiance, alpha and plain radiance (7, …) at places of the picture; the rest as of `Lighting.shade`."""
    xp, way = lighting.xp, directions(lighting.stage.camera, canvas, x, y)
    with xp.inference():
        shade = lighting.shade(xp.array(way.reshape(3, -1), lighting.field.network.codes), px, centres)
        result = xp.to_numpy(xp.concat([shade.radiance, shade.alpha[None], shade.plain], 0))
    return result.reshape(7, *way.shape[1:]), shade.work


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


def rough(picture: np.ndarray, contrast: float = CAREFUL.contrast) -> np.ndarray:
    """Pixels (H, W) of (4, H, W) that differ from what lies evenly between neighbours on opposite sides."""
    shown = np.sqrt(np.clip(picture, 0.0, 1.0))  # nearly as bright as it looks
    shown = np.pad(shown, ((0, 0), (1, 1), (1, 1)), "edge")
    here = 2 * shown[:, 1:-1, 1:-1]
    across = abs(shown[:, 1:-1, 2:] + shown[:, 1:-1, :-2] - here).max(0)
    along = abs(shown[:, 2:, 1:-1] + shown[:, :-2, 1:-1] - here).max(0)
    return np.asarray(np.maximum(across, along) > contrast)


def solid_outputs(
    field: SolidField, stage: Stage, canvas: tuple[int, int], *, threads: int = 1, count: int = 4
) -> Outputs:
    """Outputs of a field, by pixels' centres, alpha by ``count`` samples; objects are numbered from 1."""
    width, height = canvas
    lighting = Lighting(field, stage)
    result = np.empty((ROWS, height, width), np.float32)
    every = max(1, min(TILE // width, -(-height // threads)))

    def row(top: int) -> None:
        y = np.arange(top, min(top + every, height))[:, None] + 0.5
        result[:, top : top + every] = _shown(lighting, directions(stage.camera, canvas, x_centres, y))

    def sampled(start: int) -> None:
        at = slice(start, start + TILE // count)
        way = directions(stage.camera, canvas, across[at, None] + right, down[at, None] + below)
        alpha = _alpha(lighting, way.reshape(3, -1))[1]
        result[5, down[at], across[at]] = field.xp.to_numpy(alpha).reshape(-1, count).mean(1)

    x_centres = np.arange(width) + 0.5
    field.xp.each(threads, row, range(0, height, every))
    down, across = np.nonzero(rough(result[5:]))
    right, below = sample_places(count)
    field.xp.each(threads, sampled, range(0, len(down), TILE // count))
    return Outputs(result[0], np.moveaxis(result[1:4], 0, 2), result[4].astype(np.int32), result[5])


def _alpha(lighting: Lighting, way: Array) -> tuple[Trail, Array]:
    """The trail of rays (3, M) from the eye, and the share of the background that objects hide (M,)."""
    with lighting.xp.inference():
        trail = lighting.field.march(lighting.eye, way, lighting.limit(way), gap=CAREFUL.gap)
        return trail, 1 - (trail.hit == INF) * lighting.xp.exp(-trail.depth)


def _shown(lighting: Lighting, ways: np.ndarray) -> np.ndarray:
    """Depth, normal, object and alpha (6, …) along rays (3, …)."""
    xp, field, axis = lighting.xp, lighting.field, lighting.stage.camera.axes()[0]
    way = xp.array(ways.reshape(3, -1), field.network.codes)
    forward = xp.array(np.asarray(axis, np.float32), way)
    with xp.inference():
        trail, alpha = _alpha(lighting, way)
        depth = lighting.limit(way) * (forward @ way)
        out = xp.concat([depth[None], 0 * way, 0 * alpha[None], alpha[None]], 0)
        ground = xp.where(out[0] < INF)
        out[2, ground] = 1.0
        ray, begin, end, before, _ = trail.pieces
        first = xp.where(before == 0)
        if len(first):
            ray, t = xp.take(ray, first), xp.take(xp.minimum((begin + end) / 2, begin + DEEP), first)
            p = lighting.eye[:, None] + xp.take(way, ray) * t
            out[4, ray] = field.near(p, CAREFUL.gap, every=True).owner
        solid = xp.where(trail.hit < INF)
        if len(solid):
            to = xp.take(way, solid)
            p, n, *_ = lighting.surface(to, solid, trail, 0.0, lighting.eye[:, None])
            away = p - lighting.eye[:, None]
            out[0, solid], out[1:4, solid] = forward @ away, n
            out[4, solid] = field.near(p + to * INTO, CAREFUL.gap, every=True).owner
    return np.asarray(xp.to_numpy(out)).reshape(ROWS, *ways.shape[1:])
