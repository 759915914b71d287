"""Light that media scatter any number of times, solved on a lattice.

The field is asked once at the nodes of a cubic lattice around the media; the rest is arithmetic. Light goes
along the lattice's axes and the diagonals of its cells, so that a ray passes through nodes and nothing is
interpolated between rays (long characteristics, with the quadrature of 14 points that is exact to degree 5;
where lamps are within, lest they be seen as stars, with Lebedev's of 26, exact to degree 7).
On the way from a node to the next the source is linear, and what lamps send fades exponentially. What arrives
at the nodes, J, is the fixed point of sending it on, found by sweeps that Anderson's method speeds up.

Media that are denser than the lattice resolves are drawn thinner, by similarity: what they show depends on
optical depths, so a point is looked up where the thinner medium is as deep.

Letters: n nodes, K points.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.compiler.spaces import Light, Sky, Stage
from scenelang.drawing.arrays import Array
from scenelang.drawing.kernel import load_kernel
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import INF
from scenelang.drawing.tables import AROUND, BOXED, DRAWS, Rows, inverses

Floats = npt.NDArray[np.float32]
Shift = tuple[int, ...]

NODES, MANY = (18**3, 22**3), 32**3  # of a lattice, with lamps within, and where media are dense
FINE = 0.5  # whose optical depth from a node to the next is this
DEEPEST = 2.5  # optical depth from a node to the next; denser media are drawn thinner
DEEP = 3.0  # cells by which points move inwards at most, where these are
ENOUGH = 1e-2, 3e-4  # of the most light there is, by which the last sweep changes it; with lamps within;
FIRST = 5e-2  # and where the ground's light is not known
SWEEPS, KEPT = 60, 6  # at most, and as many of the last tell where the next begins
DARK = 1e-30
ALBEDO, WHITEST = 0.99, 0.98  # colours of media and of surfaces count as no more
NEAR, SPLIT = 3, 6  # cells around a lamp in which its light is uneven, and parts along their sides
HALF_UP = 0.135  # share of the zenith's colour in directions about the horizontal: the sky's mean is right
STEPS = 8, 24  # through media of light for surfaces, and of what has lamps within
GAP = 0.03  # world units, as of `MarchSettings`

NEIGHBOURS: Final = [d for d in product((-1, 0, 1), repeat=3) if any(d)]
SHARES: Final = {1: 1 / 15, 3: 3 / 40}, {1: 1 / 21, 2: 4 / 105, 3: 9 / 280}  # of directions, by their steps


class Segment(NamedTuple):
    """Ways from all nodes in one direction, each to the next node; arrays are (n…,), or of light (n…, 4)."""

    share: float
    here: Floats  # parts of the sources at a node and at the next that come along
    next: Floats
    surface: Floats | None  # part of J that an opaque surface between sends back
    base: Floats  # light that joins whatever J is
    clear: Floats  # what comes through from the next
    far: int  # how far on that is in a row of all nodes


class Mist:
    """Light in the media of a field under a sky."""

    def __init__(self, field: SolidField, stage: Stage) -> None:
        self.field, self.stage, self.xp, self.sky = field, stage, field.xp, stage.sky or Sky()
        with np.errstate(all="ignore"):
            self._place(*box_of(field, np.asarray(self.xp.to_numpy(field.looks))[-1] > 0.5))
            self._ask()
            self._segments()
            self.light = 0 * self.albedo
            self.relight()

    def _place(self, low: np.ndarray, high: np.ndarray) -> None:
        """Lay the lattice around a box; it moves with the box, and has more nodes only where nothing is."""
        self.lit = (self.field.glowing and self.field.mixed) or any(
            bool(((low < light.position) & (light.position < high)).all()) for light in self.stage.lights
        )
        a, b, c = (high - low).clip(1e-3).tolist()
        coarse, fine = (  # where the product of a / h + 2 and the others is the number of nodes
            1 / np.roots([a * b * c, 2 * (a * b + b * c + c * a), 4 * (a + b + c), 8 - count]).real.max()
            for count in (NODES[self.lit], MANY)
        )
        densest = float((self.field.density * self.field.looks[-1]).max())
        h = float(min(max(FINE / max(densest, 1e-9), fine), coarse))
        self.h, ground = h, self.stage.ground
        self.low = low - 0.999 * h
        if ground is not None and high[1] > ground.y:
            self.low[1] = max(self.low[1], ground.y + 1e-3)
        self.sides = tuple(int(n) for n in np.ceil((high - self.low).clip(0.0) / h) + 2)
        self.strides = self.sides[1] * self.sides[2], self.sides[2], 1
        axes = [a + h * np.arange(n) for a, n in zip(self.low, self.sides, strict=True)]
        # (n, 4) by nodes what their light is on the way to surfaces, and their density
        self.haze = np.zeros((int(np.prod(self.sides)), 4), np.float32)
        self.p = np.stack(np.meshgrid(*axes, indexing="ij")).astype(np.float32)  # (3, n…)

    def _ask(self) -> None:
        """Ask the field, and lamps, at the nodes."""
        field, like = self.field, self.field.network.codes
        p = self.xp.array(self.p.reshape(3, -1), like)
        with self.xp.inference():
            met = field.near(p, 0 * p[0] + 2 * self.h, every=True)
            answers = [met.distance.clip(None, 2 * self.h), *field.material(met)]
        d, colour, medium, glow, density, _ = (
            np.asarray(self.xp.to_numpy(part)).reshape(*part.shape[:-1], *self.sides) for part in answers
        )
        self.d, inside = d, d < 0
        self.mist, self.opaque = inside & medium, inside & ~medium
        self.reflected, self.shining = colour.clip(0.0, WHITEST) * self.opaque, glow * self.opaque
        looks = np.concatenate([colour.clip(0.0, ALBEDO), glow, density[None]]) * self.mist
        # nodes around media have what those next to them have
        self.count, hard = 0 * d, np.float32(1) * self.opaque
        for shift in NEIGHBOURS:
            to, on = pair_of(self.sides, shift)
            hard[to] += self.opaque[on]
            self.count[to] += self.mist[on]
        self._take_around(looks, ~self.mist & (self.count > 0))
        self.albedo, self.glow, self.density = looks[:3], looks[3:6], looks[6]
        self.thin = np.minimum(1.0, DEEPEST / (self.h * self.density).clip(1e-9))
        self.thinned = self.density * self.thin
        active = np.flatnonzero(((self.count > 0) | self.mist) & ~self.opaque)
        normal = -np.array(np.gradient(hard))  # of what is opaque, next to it; not yet of length 1
        self.slopes = np.array(np.gradient(d, self.h))
        # what arrives (n…,), where it is uneven, and colours with their power
        self.lamps: list[tuple[Any, ...]] = []
        self.received = 0 * self.albedo  # from lamps, by surfaces next to nodes
        for light in self.stage.lights:
            sent = np.zeros(d.size, np.float32)
            clear = self._reached(light, self.p.reshape(3, -1)[:, active])
            sent[active] = np.where(clear > 0, clear.clip(DARK) ** self.thin.reshape(-1)[active], 0.0)
            at, rgb = np.reshape((light.position, light.rgb), (2, 3, 1, 1, 1)).astype(np.float32)
            r, sent = np.linalg.norm(self.p - at, axis=0), sent.reshape(self.sides)
            sent = sent * _aside(r, light.radius, sent)
            own = sent * _received(r, light.radius)
            uneven = r < light.radius + NEAR * self.h  # there cells have the mean
            if uneven.any():
                parts = (np.mgrid[:SPLIT, :SPLIT, :SPLIT].reshape(3, -1, 1) + 0.5) / SPLIT - 0.5
                away = self.p[:, None, uneven] - at.reshape(3, 1, 1) + self.h * parts
                own[uneven] = sent[uneven] * _received(np.linalg.norm(away, axis=0), light.radius).mean(0)
            self.lamps.append((own, uneven, light.power * rgb))
            facing = (normal * (at - self.p)).sum(0).clip(0.0) / (r * np.linalg.norm(normal, axis=0) + 1e-6)
            self.received += 4 * light.power * rgb * own * facing

    def _take_around(self, values: Floats, wanted: np.ndarray) -> None:
        """Set values (R, n…) of the nodes wanted (n…,) to the mean of their neighbours' in media, if any."""
        some, flat = np.flatnonzero(wanted), values.reshape(len(values), -1)
        dense = flat * self.mist.reshape(-1)
        around = sum(dense.take(some + far, 1, mode="wrap") for far in np.dot(NEIGHBOURS, self.strides))
        flat[:, some] = around / self.count.reshape(-1)[some].clip(1.0)

    def _reached(self, light: Light, p: np.ndarray) -> np.ndarray:
        """Parts of a lamp's light (K,) that arrive at points (3, K)."""
        xp, like = self.xp, self.field.network.codes
        at = xp.array(np.asarray(light.position, np.float32), like)
        with xp.inference():
            way = xp.array(p, like) - at[:, None]
            r = xp.length(list(way)).clip(1e-6)
            begin = xp.minimum(r, 0 * r + light.radius)
            trail = self.field.march(at, way / r, r, start=begin, halvings=0, gap=GAP, whole=True)
            return np.asarray(xp.to_numpy((trail.hit == INF) * xp.exp(-trail.depth)))

    def _segments(self) -> None:
        """Integrate along the ways from all nodes to their neighbours."""
        self.segments, sides, d, mist, shares = [], self.sides, self.d, self.mist, SHARES[self.lit]
        self.directions = [d for d in NEIGHBOURS if sum(map(abs, d)) in shares]
        for shift in self.directions:
            steps = sum(map(abs, shift))
            to, on = pair_of(sides, shift)
            m0, m1 = mist[to], mist[on]
            # the part of the way, from begin to end, that is in the medium
            cross = abs(d[to]) / (abs(d[to]) + abs(d[on])).clip(1e-9)
            begin, end = np.where(m0, 0.0, cross), np.where(m1, 1.0, cross)
            density = (self.thinned[to] * m0 + self.thinned[on] * m1) / (m0 * np.float32(1) + m1).clip(1.0)
            depth = density * (self.h * steps**0.5) * (end - begin)
            t = depth.clip(1e-4)
            gone = np.exp(-t)
            e0, e1 = 1 - gone, np.where(t < 3e-2, t * (0.5 - t / 3), (1 - (1 + t) * gone) / t)
            stop = self.opaque[on]  # nothing is known of light behind it
            following = (e0 * begin + e1 * (end - begin)) * ~stop
            parts = np.zeros((2, *sides), np.float32)
            parts[:, *to] = np.stack([e0 - following, following]) * (m0 | m1)
            base = self.glow * parts[0]
            base[:, *to] += self.glow[:, *on] * parts[1][to]
            for sent, uneven, rgb in self.lamps:
                first = sent[to].clip(DARK)
                last = np.where(stop, first, sent[on].clip(DARK))
                x = (1 + (np.log(first / last) / t).clip(-8.0, 50.0)) * t
                x = np.where(abs(x) < 1e-4, 1e-4, x)
                along = np.where(m0 | m1, first * t * -np.expm1(-x) / x, 0.0)
                evenly = parts[0][to] * sent[to] + parts[1][to] * sent[on]
                along = np.where(uneven[to] | uneven[on], evenly, along)
                base[:, *to] += self.albedo[:, *to] * rgb * along
            through, surface = np.zeros(sides, np.float32), None
            if self.opaque.any():
                surface, shown = np.zeros_like(base), np.exp(-depth) * (stop & ~self.opaque[to])
                surface[:, *to] = self.reflected[:, *on] * shown
                base += surface * self.received
                base[:, *to] += self.shining[:, *on] * shown
            through[to] = np.where(stop | self.opaque[to], 0.0, np.exp(-depth))
            back = None if surface is None else _rows(surface)
            far = int(np.dot(shift, self.strides))
            self.segments.append(Segment(shares[steps], parts[0], parts[1], back, _rows(base), through, far))

    def relight(self, floor: Callable[[Array], Array] | None = None) -> None:
        """Find the light at the nodes, beginning with what it was; ``floor`` tells what the ground sends
        (3, K) from points (3, K), without it as much as the horizon.
        """
        horizon, zenith = np.reshape((self.sky.horizon, self.sky.zenith), (2, 3, 1)) * self.sky.power
        base, ground = [1 * segment.base for segment in self.segments], self.stage.ground
        for shift, light in zip(self.directions, base, strict=True):
            edge = np.ones(self.sides, bool)  # nodes that have no next
            edge[pair_of(self.sides, shift)[0]] = False
            p, rise = self.p[:, edge], shift[1] / sum(map(abs, shift)) ** 0.5
            sent = horizon + (zenith - horizon) * min(max(2 * rise + HALF_UP, 0.0), 1.0)
            if ground is not None and floor is not None and rise < 0:
                at = p + np.reshape(shift, (3, 1)) * ((ground.y - p[1]) / shift[1])
                sent = self.xp.to_numpy(floor(self.xp.array(at.astype(np.float32), self.field.network.codes)))
            light[edge, :3] = sent.T
        self._solve(base, FIRST if floor is None else ENOUGH[self.lit])
        light = np.where(self.opaque, 0.0, self.light).astype(np.float32)
        sends = self.albedo * light + self.glow
        for sent, _, rgb in self.lamps:
            sends += self.albedo * sent * rgb
        dense = self.density * (0.5 - self.d / self.h).clip(0.0, 1.0)
        if self.opaque.any():  # there as around, lest rays begin and end in less than there is
            self._take_around(sends, self.opaque)
            dense = dense * (~self.opaque | (self.count > 0))
        rows = [light, ~self.opaque[None], self.d[None], self.slopes, 1 / self.thin[None] - 1]
        rows += [dense * sends, dense[None]]
        self.table = np.concatenate(rows, dtype=np.float32).reshape(13, -1)
        self.haze[:] = self.table[9:].T

    def _solve(self, base: list[Floats], enough: float) -> None:
        """Sweep until the light changes by no more than that (Anderson 1965)."""
        kept: list[tuple[Floats, Floats]] = []
        stays = sum((segment.share * segment.here for segment in self.segments), 0 * self.d)
        ahead = 1 / (1 - self.albedo * stays)  # what a node sends to itself is summed to its end
        for _ in range(SWEEPS):
            change = (self._sweep(base) - self.light) * ahead
            swept = self.light = self.light + change
            if abs(change).max() <= enough * swept.max():
                break
            kept = [*kept[-KEPT:], (change.reshape(-1), swept.reshape(-1))]
            if len(kept) > 1:
                changes, lights = (np.diff(np.stack(part), axis=0) for part in zip(*kept, strict=True))
                gram = np.einsum("ik,jk->ij", changes, changes).astype(np.float64)
                gram += 1e-7 * np.trace(gram) * np.eye(len(gram))
                off = np.einsum("ik,k->i", changes, kept[-1][0])
                mix = np.linalg.lstsq(gram, off)[0].astype(np.float32)  # changes may be too small to tell
                self.light = (kept[-1][1] - np.einsum("i,ik->k", mix, lights)).reshape(swept.shape)

    def _sweep(self, base: list[Floats]) -> Floats:
        """What arrives at the nodes (3, n…) if that is sent on which arrived before."""
        source, light, result = _rows(self.albedo * self.light), _rows(self.light), np.zeros_like(base[0])
        for segment, more in zip(self.segments, base, strict=True):
            load_kernel().passed_on(segment, more, source, light, result)
        return np.moveaxis(result[..., :3], -1, 0)

    def medium(self, p: Array) -> Array:
        """The mean radiance (3, K), linear, that arrives at points (3, K) in media from all directions, but
        for what lamps send there.
        """
        xp = self.xp
        if self.thin.min() < 1.0:
            d, *slope, denser = self._between(p, slice(4, 9))
            length = xp.length(slope).clip(1e-6)
            moved = ((-d).clip(0.0) * denser).clip(0.0, DEEP * self.h)
            p = p - xp.stack(slope, 0) * (moved / length)
        light = self._between(p, slice(0, 4))
        return (light[:3] / light[3].clip(1e-6)).clip(0.0)

    def tell(self, row: Rows) -> None:
        """Write what the kernel's `Around` knows of media into its row, which points to what is kept here."""
        row["corner"], row["spacing"], row["sides"], row["steps"] = (
            self.low,
            self.h,
            self.sides,
            STEPS[self.lit],
        )
        row["haze"] = self.haze.ctypes.data

    def along(self, p: Array, way: Array, reach: Array) -> tuple[Array, Array]:
        """Light (3, K) that media send back along rays from points (3, K) in unit directions (3, K), from as
        far as a reach (K,), and the part (K,) that they let through.
        """
        self.tell(row := np.zeros((), AROUND))
        return load_kernel().haze(self.field.tables, row, p, way, reach)

    def _between(self, p: Array, rows: slice) -> Array:
        """Rows of the table at points (3, K), linear between nodes."""
        xp, table, parts, index = self.xp, self.table[rows], [], 0
        for x, low, count in zip(p, self.low.tolist(), self.sides, strict=True):
            u = ((x - low) * (1 / self.h)).clip(0.0, count - 1.001)
            i = xp.floor(u)
            parts.append((u - i, 1 - (u - i)))
            index = index * count + xp.whole(i)
        _, b, c = self.sides
        result = 0.0
        for x, y, z in product((0, 1), repeat=3):
            weight = parts[0][1 - x] * parts[1][1 - y] * parts[2][1 - z]
            result = result + weight * xp.take(table, index + ((x * b + y) * c + z))
        return result


def pair_of(sides: Shift, shift: Shift) -> tuple[tuple[slice, ...], ...]:
    """Slices of the nodes from which a shift leads to another, and of those others."""
    ends = list(zip(sides, shift, strict=True))
    to = tuple(slice(max(0, -s), n - max(0, s)) for n, s in ends)
    return to, tuple(slice(max(0, s), n - max(0, -s)) for n, s in ends)


def _rows(values: Floats) -> Floats:
    """Values (3, n…) node by node, and a 0 (n…, 4)."""
    result = np.zeros((*values.shape[1:], 4), np.float32)
    result[..., :3] = np.moveaxis(values, 0, -1)
    return result


def _received(r: np.ndarray, radius: float) -> np.ndarray:
    """Light on media of a lamp of power 1 that nothing hides, at distances of its middle."""
    rim = np.sqrt((1 - (radius / r.clip(1e-6)) ** 2).clip(0.0))  # of a ball, seen from nearby
    result: np.ndarray = (r > radius) / (2 * (1 + rim) * r.clip(1e-6) ** 2)
    return result


def _aside(r: np.ndarray, radius: float, sent: np.ndarray) -> np.ndarray:
    """The transmittance of even media to a whole ball, at distances from its middle, as a part of that to its
    nearest point, which is given.
    """
    least, result = (r - radius).clip(1e-6), 0 * r
    sigma, rim = -np.log(sent.clip(DARK)) / least, np.sqrt((1 - (radius / r.clip(1e-6)) ** 2).clip(0.0))
    for node, weight in zip(*np.polynomial.legendre.leggauss(4), strict=True):
        cos = 1 - (1 - rim) * (node + 1) / 2
        way = r * cos - np.sqrt((radius**2 - r * r * (1 - cos * cos)).clip(0.0))
        result = result + weight / 2 * np.exp(-sigma * (way - least).clip(0.0))
    return result


def box_of(field: SolidField, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The least and the greatest coordinates (3,) of where those objects may be that are wanted (N,)."""
    rows = field.objects.rows[wanted.astype(bool) & field.objects.flagged(DRAWS)]
    if not len(rows):
        return np.zeros(3), np.zeros(3)
    back = inverses(rows["map"][:, :9].reshape(-1, 3, 3).astype(np.float64))
    low, high = rows["low"].astype(np.float64), rows["high"].astype(np.float64)
    boxed = ((rows["flags"] & BOXED) > 0)[:, None]
    half = np.where(
        boxed,
        (abs(back) @ ((high - low) / 2)[:, :, None])[:, :, 0],
        rows["ball"][:, None] * np.linalg.norm(back, axis=2),
    )
    middle = (back @ (boxed * ((low + high) / 2) - rows["map"][:, 9:])[:, :, None])[:, :, 0]
    return (middle - half).min(0), (middle + half).max(0)
