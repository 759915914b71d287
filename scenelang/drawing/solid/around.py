"""Light that arrives from everywhere: sky, ground, and surfaces that pass light on.

1. *Nodes* (`nodes.py`) on objects and ground are lit by lamps. Rays from each, the same in every picture,
   find what it sees; what nodes send to nodes is a matrix, and its fixed point has all bounces (radiosity).
   The kernel (`light.h`) sends rays, looks up nodes around their ends, and sums what comes.
2. From the points of a lattice on the picture rays go all over the hemisphere (final gathering). Nodes around
   where they end say what comes from there.
3. Points of the lattice share what they receive with those around on the same surface. Pixels between take
   from these, or send a few rays themselves.

Letters: J nodes, K points, L points of the lattice, R rays.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from math import ceil, isqrt
from typing import Any, NamedTuple

import numpy as np

from scenelang.compiler.spaces import Ground, Sky, Stage
from scenelang.drawing.arrays import NUMPY, Array, Arrays
from scenelang.drawing.kernel import Exchange, load_kernel
from scenelang.drawing.solid.centres import UNKNOWN
from scenelang.drawing.solid.emitters import Emitters
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import INF
from scenelang.drawing.solid.mist import Mist
from scenelang.drawing.solid.nodes import (
    ALL,
    FAR,
    HOLLOW,
    LEAST,
    NODES,
    SCATTER,
    SIDES,
    WARP,
    Nodes,
    on_ground,
    on_objects,
    sphere,
    spread,
)
from scenelang.drawing.tables import AROUND, NODE

RAYS = 8, 64  # of nodes, and where something may be hollow
GAP = 0.01  # world units, as of `MarchSettings`
CAP = 0.98  # of colours
ROUNDS, KEPT = 100, 8  # of the solver at most, and earlier directions that each is made to differ from
EXACT = 1e-3  # the part of the light that bounces leave out at most
NEAREST, CLOSE = 12, 64  # nodes that a place takes light from, of so many nearby
TURNED, AWAY = 0.3, 1e3  # cosine, and what sorts out nodes that no way of a cell meets
GOLDEN = 2.399963  # radians
CLOSED = 0.02  # of nodes on objects, more of which see nothing but objects in what is closed
# so far before surfaces, in world units, parts of a way, and at most, ways begin and end that walls may cross
APART, RISE, HIGHEST = 0.02, 0.3, 0.1
# points along the picture's shorter side and rays of each; where something glows; in hollows, lamps in media
LATTICE = (52, 12), (96, 16), (96, 32)
POINT_RAYS, PIXEL_RAYS = 40, 16  # of points without a picture, and of pixels that are asked themselves
WORTH = 0.5  # of the mean light on the lattice, for which points ask what glows with all their rays
OFF = 1e-3  # world units off a surface where rays begin
TURNS = np.array([[0.8130, 0.8931], [0.6199, 0.3014]])  # of rays, by places: a search's least noise
DRAWN = 32  # rays at most from a point to what glows
EIGHTHS = 8  # of pixels are places told apart by
# of the light on the lattice, in hollows; above it rays are sent again, so often, far above more, turned so
NOISE, MORE, FURTHER = (0.035, 0.025), (3, 7), np.array([[1.3756], [-0.5877]])
WIDER = (2, 1.0), (4, 0.35)  # steps of the lattice, and parts of the noise by which they change light
ELSEWHERE = 1e6  # world units: where points are that the eye does not see
PRODUCTS = 1 << 18  # of numbers: OpenBLAS splits larger jobs among cores, whose threads wait for each other
# of what is foretold: rays that are asked, and what each takes beside asking the network, in times of that;
# rays sent for each that gathers light, and from each pixel that mirrors, and where walls may hide nodes;
# media; the share of rays of the ground that meet media; and what is not asked, for each pixel
PROBES, EACH_RAY, MORE_RAYS, SHINY, MIST, ASIDE_RAYS = 64, 2.0, (1.0, 2.0), (10, 50), 1.5e7, 0.2
EACH_PIXEL = 250
CELLS = 8  # of the grid of nodes, along its longest side


def disc(r: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Directions (3, …) above places of the unit disc."""
    return np.stack([r * np.cos(angle), r * np.sin(angle), np.sqrt(1 - r * r)])


def product(xp: Arrays, a: Array, b: Array) -> Array:
    """The product of matrices (M, K) and (K, N), so few rows at once that OpenBLAS keeps to one core."""
    each = max(1, PRODUCTS // max(1, b.shape[0] * b.shape[1]))
    return xp.concat([a[at : at + each] @ b for at in range(0, max(1, len(a)), each)], 0)


def to_ground(xp: Arrays, ground: Ground | None, y: Array | float, way: Array) -> Array:
    """Distances (K,) to the ground along rays (3, K) from a height y, inf where there is none."""
    never = 0 * way[0] + INF
    if ground is None:
        return never
    down = (way[1] < 0) & (y > ground.y)
    return xp.select(down, (ground.y - y) / xp.select(down, way[1], way[1] * 0 - 1), never)


class Lookup:
    """Nodes on objects near places, by a grid whose cells know the nearest ones."""

    def __init__(self, xp: Arrays, nodes: Nodes) -> None:
        self.xp, self.nodes = xp, nodes
        p = np.asarray(xp.to_numpy(nodes.p))  # (3, J)
        low, high = p.min(1), p.max(1)
        self.side = max(float((high - low).max()) / CELLS, 1e-3)
        self.low, self.counts = low, np.ceil((high - low) / self.side).astype(int).clip(1)
        places = np.stack(np.meshgrid(*map(np.arange, self.counts), indexing="ij"), 0).reshape(3, -1)
        centres = (low[:, None] + (places + 0.5) * self.side).astype(np.float32)
        off = (p * p).sum(0) - 2 * product(NUMPY, centres.T, p)  # (cells, J), less the same in each row
        count, most = (min(number, p.shape[1]) for number in (NEAREST, CLOSE))
        close = np.argpartition(off, most - 1, 1)[:, :most]
        off = np.take_along_axis(off, close, 1)
        off -= off.min(1)[:, None]
        facing, found = np.asarray(xp.to_numpy(nodes.n)).T[close], []
        for axis, sign in np.ndindex(3, 2):  # of ways: those nodes that face against them
            along = facing[..., axis] * (2 * sign - 1)
            chosen = np.argpartition(off + AWAY * (along > -TURNED), count - 1, 1)[:, :count]
            found.append(np.take_along_axis(close, chosen, 1))
        self.index = np.concatenate(found, dtype=np.int32)  # (6 cells, k)
        # whether no wall is between nodes and the first of their cell (6 cells, 16)
        self.alike = np.zeros((len(self.index), 16), np.uint8)
        # positions, normals and weights of a cell's nodes, in whole packets (6 cells, 7, 16)
        self.about = np.zeros((len(self.index), 7, 16), np.float32)
        rows = np.concatenate([nodes.p, nodes.n, nodes.weight[None]])[:, self.index]
        self.about[:, :, : self.index.shape[1]] = rows.swapaxes(0, 1)


class Seen(NamedTuple):
    """Points of the eye's rays on a lattice of the picture, row by row."""

    p: Array  # (3, L); where there is nothing, far away
    n: Array  # (3, L) unit normals


class Around:
    """The light that arrives at points of a field under a stage, but for what comes straight from lamps.

    ``lamps`` tells what points (3, K) with unit normals (3, K) receive of these.
    """

    fixed: Any = None  # what it rests on, see `arriving`

    def __init__(self, field: SolidField, stage: Stage, lamps: Callable[[Array, Array], Array]) -> None:
        self.field, self.stage, self.xp = field, stage, field.xp
        xp, like, sky = field.xp, field.network.codes, stage.sky or Sky()
        self.horizon, self.zenith = (
            xp.array(np.asarray(colour, np.float32) * np.float32(sky.power), like)[:, None]
            for colour in (sky.horizon, sky.zenith)
        )
        self.seen: Any = None  # a `Seen`, once a picture is looked at
        self.mist = Mist(field, stage) if field.media else None
        with xp.inference():
            for self.hollow in (field.hollow, True):  # again where walls turn out to be around many nodes
                self._place()
                if self.hollow or self.closed < CLOSED:
                    break
        self.light(lamps)

    def _place(self) -> None:
        """Place the nodes, and find what they see."""
        xp, field, stage = self.xp, self.field, self.stage
        own, floor = on_objects(field, stage, self.hollow), on_ground(field, stage, self.hollow)
        self.emitters = Emitters(own)
        kept = xp.where(own.place[4] > 0)
        own = Nodes(*(xp.take(part, kept) for part in own))
        self.first = own.p.shape[1]  # node of the ground
        self.lookup: Any = Lookup(xp, own) if self.first else None
        self.nodes = Nodes(*(xp.concat([a, b], -1) for a, b in zip(own, floor, strict=True)))
        self.count = self.nodes.p.shape[1]
        self.finer = self.hollow and not self.emitters.there
        if self.hollow and self.lookup is not None:
            index = self.lookup.index
            first = np.broadcast_to(index[:, :1], index.shape).reshape(-1)
            free = self._open(own.p[:, first], own.n[:, first], index.reshape(-1))
            self.lookup.alike[:, : index.shape[1]] = free.reshape(index.shape)
        self._tell(0 * self.nodes.p)
        self.exchange = self._exchange(RAYS[self.hollow])

    def _tell(self, sent: Array) -> None:
        """Make the tables of the kernel's `Around`, of what nodes send (3, J)."""
        nodes, lookup, ground, emitters = self.nodes, self.lookup, self.stage.ground, self.emitters
        row, own = np.zeros((), AROUND), np.zeros(self.count, NODE)
        for name, part in (("p", nodes.p), ("n", nodes.n), ("sent", sent), ("colour", nodes.colour)):
            own[name] = part.T
        own["weight"] = nodes.weight
        lamps = [
            [*lamp.position, *(lamp.power * np.array(lamp.rgb)), lamp.radius] for lamp in self.stage.lights
        ]
        tables = {"node": own, "lamp": np.array(lamps, np.float32), "disc": emitters.discs}
        values = {
            "horizon": self.horizon[:, 0],
            "zenith": self.zenith[:, 0],
            "fade": (ground or Ground()).fade ** 2,
            "nodes": self.count,
        }
        values |= {
            "first": self.first,
            "lamps": len(lamps),
            "discs": len(emitters.discs),
            "hollow": self.hollow,
        }
        if lookup is not None:
            tables |= {"index": lookup.index, "alike": lookup.alike, "about": lookup.about}
            values |= {"low": lookup.low, "side": lookup.side, "counts": lookup.counts}
            values["near"] = lookup.index.shape[1]
        if ground is not None:
            values |= {"grounded": 1, "floor": ground.y, "ground": isqrt(self.count - self.first)}
            values |= {"scale": np.sinh(WARP) / FAR, "warp": WARP}
        for name, value in (values | {name: table.ctypes.data for name, table in tables.items()}).items():
            row[name] = value
        if self.mist is not None:
            self.mist.tell(row)
        self.row, self.tables = row, tables  # the row points to these

    def light(self, lamps: Callable[[Array, Array], Array]) -> None:
        """Find what nodes send and receive under lamps."""
        n, self.lamps = self.nodes, lamps
        with self.xp.inference():
            direct = lamps(n.p, n.n) + self._glowing(n.p, n.n)
            received = self._solved(direct)
            self._tell(n.colour.clip(0.0, CAP) * (direct + received))  # without what glows
        if self.mist is not None:
            self.mist.relight(self._floored)
            self.medium = self.mist.medium

    def look(
        self, canvas: tuple[int, int], places: Callable[[np.ndarray, np.ndarray], tuple[Array, Array]]
    ) -> None:
        """Note what points on a lattice of a picture receive; ``places`` tells them (3, L) and their normals
        by places of the picture in pixels.
        """
        side, rays = LATTICE[2 if self.hollow or (self.mist and self.mist.lit) else int(self.emitters.there)]
        self.step, camera = max(1, round(min(canvas) / side)), self.stage.camera
        self.columns, self.rows = (-(-side // self.step) + 1 for side in canvas)
        scale = min(canvas) / 2 / float(np.tan(camera.fov_rad / 2))
        sizes = scale, canvas[0] / 2, canvas[1] / 2, self.step, self.columns, self.rows
        # the kernel's `View`
        self.view = np.array([*camera.eye, *np.ravel(camera.axes()), *sizes], np.float32)
        with self.xp.inference():
            p, n = places(np.arange(self.columns) * self.step, np.arange(self.rows)[:, None] * self.step)
            found = self.field.near(p + OFF * n, 0 * p[0] + GAP, every=self.field.mixed)
            buried = found.distance < 0  # in what touches the surface
            if self.field.mixed:
                buried = buried & (found.register[-1] < 0.5)
            p = self.xp.select(buried, p + 2 * ELSEWHERE, p)
            there = self.xp.where(p[0] < ELSEWHERE)
            numbers = np.stack(np.divmod(np.asarray(self.xp.to_numpy(there)), self.columns))

            def everywhere(values: Array) -> Array:
                result = self.xp.full((len(values), p.shape[1]), 0.0, p)
                self.xp.put(result, there, values)
                return result

            at, up = self.xp.take(p, there), self.xp.take(n, there)

            def received(turn: int) -> Array:
                return everywhere(self.gathered(at, up, numbers + turn * FURTHER, rays))

            light, self.seen = received(0), Seen(p, n)
            self.worth = WORTH * float(light[:3].sum()) / max(len(there), 1)
            glow, free = self.glow(at, up, self.worth)
            whole = float(light[:3].sum()) + float((glow * free).sum())
            over = (float(abs(self._evened(light[3:])).sum()) / max(NOISE[self.finer] * whole, 1e-9)) ** 2
            light, more = light[:3], min(max(over - 1, 0.0), max(MORE[0], over / MORE[0]), MORE[1])
            for turn in range(ceil(more)):  # the last one counts in part
                part = min(more - turn, 1.0)
                light = light + (received(turn + 1)[:3] - light) * (part / (1 + turn + part))
            every = [light, everywhere(free)] if self.emitters.there else [light]
            even = self.xp.concat([self._smoothed(each) for each in every], 0)
            slopes = [self._evened(even, part=part) for part in (1, 2)]
            # of each point what comes from everywhere, and if something glows the parts of its light that
            # nothing hides; then how these change from it to the next across, and down
            self.lattice = np.ascontiguousarray(np.concatenate([p, n, even, *slopes]).T, np.float32)

    def sky(self, way: Array) -> Array:
        """Light of the sky (3, …) from directions (3, …)."""
        high = (way[1] * 2).clip(0.0, 1.0)
        shape = (3,) + (1,) * (way.ndim - 1)
        return self.horizon.reshape(shape) + (self.zenith - self.horizon).reshape(shape) * high

    def _exchange(self, rays: int) -> tuple[Exchange, Array]:
        """Parts of nodes that nodes see by so many rays, and what they receive of the sky, the horizon and
        media (3, J).
        """
        nodes, near = self.nodes, max(int(self.row["near"]), 4)
        turn = SCATTER @ nodes.place[:3].astype(np.float64) % 1.0
        most = self.count * rays * near
        parts = Exchange(
            np.zeros(self.count + 1, np.int64), np.empty(most, np.int32), np.empty(most, np.float32)
        )
        found = self._received(nodes.p, nodes.n, np.stack([0 * turn + 0.5, turn]), rays, parts=parts)
        weight = nodes.weight[: self.first]
        within = weight * (found[3, : self.first] > 1 - 0.5 / rays)
        self.closed = float(within.sum()) / max(float(weight.sum()), 1e-9)
        whole = slice(parts.begin[-1])
        return Exchange(parts.begin, parts.node[whole].copy(), parts.share[whole].copy()), found[:3]

    def _open(self, p: Array, n: Array, nodes: Array) -> Array:
        """Whether (K,) no wall is between points (3, K) with unit normals (3, K) and nodes (K,): 1 or 0."""
        xp, other, up = self.xp, *(self.xp.take(part, nodes) for part in (self.nodes.p, self.nodes.n))
        lift = (APART + RISE * xp.length(list(other - p))).clip(None, HIGHEST)  # over what is round
        p = p + lift * n
        to = other + lift * up - p
        far = xp.length(list(to)).clip(1e-6)
        return 1.0 * (self.field.march(p, to / far, far, halvings=0, gap=GAP, whole=True).hit == INF)

    def _solved(self, direct: Array) -> Array:
        """What nodes receive (3, J) after any number of bounces, by generalised conjugate residuals
        (Eisenstat, Elman and Schultz 1983).
        """
        colour, (parts, escaped) = self.nodes.colour.clip(0.0, CAP), self.exchange

        def through(values: Array) -> Array:
            return load_kernel().exchanged(parts, values)

        r = through(direct * colour) + escaped
        x, least, kept = 0 * r, EXACT**2 * float((r * r).sum()), list[tuple[Array, Array, float]]()
        for _ in range(ROUNDS):
            p, q = r, r - through(colour * r)
            for before, image, size in kept:
                share = float((q * image).sum()) / size
                p, q = p - share * before, q - share * image
            size = float((q * q).sum())
            if size <= 1e-3 * least:
                break
            share = float((r * q).sum()) / size
            x, r, kept = x + share * p, r - share * q, [*kept[1 - KEPT :], (p, q, size)]
            if float((r * r).sum()) <= least:
                break
        return x

    def _floored(self, at: Array) -> Array:
        """What the ground sends (3, K) from points (3, K) of it."""
        up = np.array([[0], [1], [0]], np.float32) + 0 * at
        return self.arriving(at + OFF * up, -up)[0]

    def surface(self, p: Array, n: Array, last: bool = True) -> Array:
        """Light (3, K) that surfaces receive at points (3, K) with unit normals; where the lattice does not
        tell, `UNKNOWN` unless it is the ``last`` time of asking.
        """
        xp = self.xp
        if self.seen is None:
            numbers = np.stack([np.arange(p.shape[1])] * 2)
            return self.gathered(p, n, numbers, POINT_RAYS)[:3] + self._glowing(p, n)
        result, fits = load_kernel().between(p, n, self.view, self.lattice)
        alone = xp.where(fits == 0)
        if len(alone) and not (last or self.emitters.there):
            xp.put(result, alone, 0 * xp.take(result, alone) + UNKNOWN)
        elif len(alone):
            here, up = xp.take(p, alone), xp.take(n, alone)
            numbers = np.rint(np.asarray(self._places(here), np.float64) * (EIGHTHS * self.step))
            xp.put(result[:3], alone, self.gathered(here, up, numbers, PIXEL_RAYS, self.hollow)[:3])
            result[3:, alone] = self.glow(here, up, self.worth)[1][: len(result) - 3]
        if not self.emitters.there:
            return result
        return result[:3] + result[3:].clip(None, 1.0) * self.glow(p, n, INF)[0]

    def _glowing(self, p: Array, n: Array) -> Array:
        """The light (3, K) that points with unit normals (3, K) receive straight from what glows."""
        light, free = self.glow(p, n)
        return light * free

    def glow(self, p: Array, n: Array, worth: float = 0.0) -> tuple[Array, Array]:
        """The light (3, K) that points with unit normals (3, K) receive straight from what glows if nothing
        hides it, and the parts (3, K) that arrive, by fewer rays where less is received than ``worth``; 1
        where that is inf.
        """
        if not self.emitters.there:
            return 0 * p, 0 * p + 1
        tables, until, parts = self.field.tables, self.field.network.until_s, worth < INF
        return load_kernel().glowing(tables, self.row, p, n, worth, parts=parts, until_s=until)[:2]

    def drawn(self, p: Array) -> tuple[np.ndarray, Array, Array]:
        """Rays from points (3, K) to some of what glows, drawn by what surfaces that face it receive:
        numbers (k,) of the points, unit ways (3, k), and light (3, k), in sum what arrives.
        """
        tables, until = self.field.tables, self.field.network.until_s
        *_, point, ray = load_kernel().glowing(tables, self.row, p, None, 0.0, drawn=DRAWN + 1, until_s=until)
        return point, ray[:3], ray[3:]

    def gathered(self, p: Array, n: Array, numbers: np.ndarray, rays: int, finer: bool = True) -> Array:
        """Light that points (3, K) with unit normals receive by so many rays, which numbers (2, K) turn, and
        how far halves of these are from it (6, K).
        """
        return self._received(
            p, n, (TURNS @ numbers + 0.5) % 1.0, rays, finer=finer and not self.emitters.there
        )

    def _received(self, p: Array, n: Array, turns: np.ndarray, rays: int, **more: Any) -> Array:
        """The light of `Kernel.around`."""
        until = self.field.network.until_s
        return load_kernel().around(self.field.tables, self.row, p, n, turns, rays, until_s=until, **more)[0]

    def arriving(self, p: Array, way: Array, finer: bool = False) -> tuple[Array, Array]:
        """Light (3, K) that comes to points (3, K) from unit directions, without media, and from how far. If
        ``finer``, places nearer than nodes may be, and in hollows those where nodes differ, send rays.
        """
        finer, until = finer and not self.emitters.there, self.field.network.until_s
        return load_kernel().arriving(self.field.tables, self.row, p, way, finer, until)

    def _places(self, p: Array) -> Array:
        """Places (2, K) on the lattice, across and down, where the eye sees points (3, K)."""
        scale, *middle, step, columns, rows = self.view[12:].tolist()
        forward, right, up = self.view[3:12].reshape(3, 3) @ (p - self.view[:3, None])
        ahead = forward.clip(1e-6)
        places = [
            ((scale * off / ahead + half) / step).clip(0.0, count - 1.001)
            for off, half, count in zip((right, -up), middle, (columns, rows), strict=True)
        ]
        return np.stack(places)

    def _smoothed(self, light: Array) -> Array:
        """Light (3, L) of the lattice without the noise of rays: of points next to each, and of those farther
        off where that changes it by less than the noise (wavelets à trous).
        """
        even = self._evened(light)
        even = even + self._evened(light - even)  # which leaves bends in the light (Tukey)
        noise = self._evened(self._evened(abs(light - even).sum(0)[None]))
        for step, part in WIDER:
            wide = self._evened(even, step)
            change = wide + self._evened(even - wide, step) - even
            much = self._evened(abs(change).sum(0)[None])
            even = even + change * (2 - much / (part * noise).clip(1e-9)).clip(0.0, 1.0)
        return even.clip(0.0)

    def _evened(self, values: Array, step: int = 1, part: int = 0) -> Array:
        """`Kernel.evened` of values (R, L)."""
        return load_kernel().evened(self.view, self.seen.p, self.seen.n, values, step, part)


def light_work(field: SolidField, stage: Stage, canvas: tuple[int, int], samples: int) -> float:
    """About how often the network is asked for what arrives from everywhere: rays, each as probes ask."""
    xp, count, walls = field.xp, len(field), field.hollow
    opaque = bool((np.asarray(xp.to_numpy(field.looks))[-1] < 0.5).any())
    floor = 0.0 if stage.ground is None else SIDES[walls] ** 2 / 4  # from which many rays meet nothing
    if not count:
        return 0.0
    nodes = floor + opaque * min(ALL, NODES * (HOLLOW if walls else 1) + LEAST[walls] * count)
    side, rays = LATTICE[2 if walls else 0]
    step = max(1, round(min(canvas) / side))
    points = (-(-canvas[0] // step) + 1) * (-(-canvas[1] // step) + 1)
    number = MORE_RAYS[walls] * (nodes * RAYS[walls] + 2 * points * rays)
    number += SHINY[walls] * field.rough * canvas[0] * canvas[1] * (samples / 4)
    # from balls around objects to places in those of others
    u, v, r, turn = spread(np.arange(PROBES))
    own, other = np.arange(PROBES) * 7919 % count, (np.arange(PROBES) * 104729 + count // 2) % count
    centre, extent = field.objects.rows["centre"].T, field.objects.rows["extent"]
    p = centre[:, own] + extent[own] * sphere(u, v)
    way = centre[:, other] + r**0.5 * extent[other] * sphere(turn, u) - p
    way /= np.linalg.norm(way, axis=0).clip(1e-9)
    p, way = (xp.array(part.astype(np.float32), field.network.codes) for part in (p, way))
    with xp.inference():
        met = field.march(p, way, to_ground(xp, None, 0.0, way), halvings=0, gap=GAP, whole=True).work.met
    number *= 1.0 if opaque else ASIDE_RAYS * (floor > 0)
    more = EACH_PIXEL * canvas[0] * canvas[1] + MIST * field.media
    return number * (met / PROBES + EACH_RAY) + more


def arriving(lighting: Any) -> Around:
    """`Around` of a `Lighting`; the last one's where only the camera or, without media, lamps differ."""
    field, stage, last = lighting.field, lighting.stage, lighting.field.network.last
    things = [*map(id, [*(field.rows[2] or ()), None, *(field.paints or ())])]
    numbers = [things, *(rows.tobytes() for rows in field.rows[:2])]
    fixed = numbers, stage.ground, stage.sky, lighting.pace, field.media and stage.lights
    if last is None or last.fixed != fixed:
        result = Around(field, stage, lighting.received)
    else:
        result = copy(last)
        result.field, result.stage, result.seen, result.lamps = field, stage, None, lighting.received
        if last.stage.lights != stage.lights:
            result.light(lighting.received)
    result.fixed, field.network.last = fixed, result
    return result
