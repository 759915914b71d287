"""The kernel: the field of solids in compiled code, asked by way of ctypes, which lets other threads run.

A wheel and an editable install bring its library. In a checkout whose C has changed since, it is built again
where Zig's compiler is installed (`pip install ziglang`); else that is an error that says so.
"""

from __future__ import annotations

import ctypes
import importlib.util
import sys
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.drawing.arrays import Array
from scenelang.drawing.how import RenderError, check_time
from scenelang.drawing.neural import tables as flat
from scenelang.drawing.tables import (
    AROUND,
    CELL,
    DECODER,
    LAMP,
    NODE,
    OBJECT,
    PIECE,
    SCENE,
    STAGE,
    STEP,
    TEXTURE,
    Rows,
    Tables,
)

FOLDER: Final = Path(__file__).resolve().parent
ROOT: Final = FOLDER.parents[1]  # of a checkout
_ROWS: Final = (
    *(OBJECT, STEP, DECODER, CELL, TEXTURE, PIECE, SCENE, LAMP, STAGE, NODE, AROUND),
    *(flat.SHAPE, flat.STEP, flat.LEAF, flat.JOINT, flat.FLAT, flat.PAGE),
)
_SIZES: Final = [dtype.itemsize for dtype in _ROWS]
_CALLS: Final = {
    **{"newest": ("", "i"), "sizes": ("p", ""), "scratch": ("ip", "l")},
    **{"field": ("iplppppppp", "l"), "own": ("iplppppp", ""), "rays": ("ipllppppfiiipppppplp", "l")},
    **{"cones": ("iplpfppppppp", ""), "shade": ("ippiiiippp", ""), "finish": ("ippiiiippppp", "")},
    **{
        "around": ("ipplpppiippppppp", ""),
        "exchanged": ("ilppppp", ""),
        "arriving": ("ipplppippp", ""),
        "glowing": ("ipplppfpppplp", "l"),
    },
    **{"passed_on": ("illfppppppppp", ""), "evened": ("ipppipiip", ""), "between": ("ilppppipp", "")},
    **{"haze": ("ipplpppppp", ""), "crossings": ("iplppppplpp", "l")},
    **{"mirrored": ("ilpfpppppp", "")},
    **{"plane": ("ippiipppp", ""), "states": ("iplpfpp", "")},
}
"""Arguments and results of the library's functions: i int32, l int64, f float32, p an address."""
_TYPES: Final = {
    **{"i": ctypes.c_int32, "l": ctypes.c_int64, "f": ctypes.c_float, "p": ctypes.c_void_p},
    **{"": None},
}

Floats = npt.NDArray[np.float32]
PORTION: Final = 1 << 15  # rays of a call of the library, between which the time is checked,
MANY: Final = 128  # and fewer where there are more objects than these
NEVER: Final = float("inf")


class KernelError(RenderError):
    """The kernel's library cannot be loaded here, and why."""


class Asked(NamedTuple):
    """Answers of the field at M points; what was not asked for has none."""

    distance: Array  # (M,) world units
    gradient: Array  # (3, M)
    register: Array  # (R, M) as `Looks`
    owner: Array  # (M,) numbers of objects whose material holds, from 1; 0 for none
    met: int  # pairs of points and objects that met


class Exchange(NamedTuple):
    """Parts of nodes that M nodes see."""

    begin: npt.NDArray[np.int64]  # (M + 1,) where those that each sees begin
    node: npt.NDArray[np.int32]  # (k,) which these are
    share: Floats  # (k,)


class Trails(NamedTuple):
    """Surfaces and media that M rays met."""

    hit: Floats  # (M,) how far the first opaque surface is, inf where there is none
    length: Floats  # (M,) world units in media before that or before the ray's end
    soft: npt.NDArray[np.bool_]  # (M,) where a medium gives way to a surface: the distance is not 0 there
    depth: Floats  # (M,) optical depth of those media
    pieces: npt.NDArray[Any]  # `PIECE` rows of the ways in media, ray by ray and in order
    near: int  # rays that pass a ball of something that draws
    steps: int  # points of space at which the field was asked
    lost: int  # rays that took all steps without coming to an end
    met: int  # pairs of points and objects


class Kernel:
    """A library's functions; raises `KernelError` where it is not one of these sources."""

    def __init__(self, path: Path) -> None:
        try:
            self._library = ctypes.CDLL(str(path))
            for name, (arguments, result) in _CALLS.items():
                call = getattr(self._library, name)
                call.argtypes, call.restype = [_TYPES[kind] for kind in arguments], _TYPES[result]
        except (OSError, AttributeError) as error:
            raise KernelError(f"the kernel's library cannot be loaded: {error}") from None
        self.variant: int = self._library.newest()
        sizes = np.zeros(len(_SIZES), np.int32)
        self._library.sizes(sizes.ctypes.data)
        if sizes.tolist() != _SIZES:
            raise KernelError("the kernel's library is one of other tables")

    def field(
        self,
        tables: Tables,
        points: npt.NDArray[Any],
        reach: Any,
        gradient: bool = False,
        every: bool = False,
    ) -> Asked:
        """The field at points (3, M), exact where D is less than a reach, (M,) or one, in world units;
        elsewhere D is anything from there on, 100 where no object is near. ``every`` asks for registers and
        owners, too.
        """
        points = np.ascontiguousarray(points, np.float32)
        count, rows = points.shape[1], int(tables.scene["rows"])
        assert points.shape == (3, count)
        reach = np.ascontiguousarray(np.broadcast_to(np.asarray(reach, np.float32), (count,)))
        slopes, looks = count * gradient, count * every
        answers = np.empty(count, np.float32), np.empty((3, slopes), np.float32)
        more = np.empty((rows, looks), np.float32), np.empty(looks, np.int32)
        scene = tables.scene.ctypes.data
        scratch = np.empty(self._library.scratch(self.variant, scene), np.uint8)
        parts = (points, reach, *answers, *more, scratch)
        places = [part.ctypes.data if part.size else None for part in parts]
        met = self._library.field(self.variant, scene, count, *places) if count else 0
        return Asked(*answers, *more, met)

    def own(
        self,
        tables: Tables,
        objects: npt.NDArray[np.integer],
        points: npt.NDArray[Any],
        gradient: bool = True,
    ) -> tuple[Floats, Floats]:
        """Distances (M,) of objects alone by their numbers (M,), from 0, whatever else is at points (3, M),
        and the gradients (3, M) of these, or none.
        """
        numbers, points = _alone(tables, objects, points)
        count = len(numbers)
        distance, slope = np.empty(count, np.float32), np.empty((3, count * gradient), np.float32)
        places = [part.ctypes.data if part.size else None for part in (numbers, points, distance, slope)]
        self._library.own(self.variant, tables.scene.ctypes.data, count, *places, None)
        return distance, slope

    def worn(self, tables: Tables, objects: npt.NDArray[np.integer], points: npt.NDArray[Any]) -> Floats:
        """Colours (3, M) of objects alone by their numbers (M,), from 0, at points (3, M), with textures."""
        numbers, points = _alone(tables, objects, points)
        result = np.empty_like(points)
        given = numbers.ctypes.data, points.ctypes.data, None, None, result.ctypes.data
        self._library.own(self.variant, tables.scene.ctypes.data, len(numbers), *given)
        return result

    def crossings(
        self,
        tables: Tables,
        objects: npt.NDArray[np.integer],
        begin: Floats,
        way: Floats,
        *parts: npt.NDArray[Any],
    ) -> tuple[npt.NDArray[np.int32], Floats]:
        """Lines (k,), of those that begin at (3, M) and go all the way (3, M), that meet the surfaces of
        objects alone, by their numbers (M,), from 0, and how far along (k,), from 0 to 1. Steps are as long
        as the distance, which changes at rates (M,) at most, and at least so small a part (M,) of a line.
        """
        numbers, begin = _alone(tables, objects, begin)
        given = [np.ascontiguousarray(part, np.float32) for part in (begin, way, *parts)]
        count, room = len(numbers), 4 * len(numbers)
        while True:
            line, along = np.empty(room, np.int32), np.empty(room, np.float32)
            places = [part.ctypes.data for part in (numbers, *given)]
            rest = room, line.ctypes.data, along.ctypes.data
            found = self._library.crossings(self.variant, tables.scene.ctypes.data, count, *places, *rest)
            if found <= room:
                return line[:found], along[:found]
            room = found

    def rays(
        self,
        tables: Tables,
        origin: Floats,
        way: Floats,
        limit: npt.NDArray[Any] | float,
        begin: npt.NDArray[Any] | float = 0.0,
        *,
        gap: float,
        steps: int = 800,
        halvings: int = 16,
        parted: bool = True,
        until_s: float = NEVER,
    ) -> Trails:
        """Follow rays from an origin (3,), or one each (3, M), along unit directions (3, M), from ``begin``
        (M,) up to a limit (M,), in so many steps at most.

        Steps may pass what is certain, and what is thinner, by ``gap`` world units; ``halvings`` of an
        interval find where a medium gives way to a solid. Ways in media are cut where their density, or
        colour, changes; unless ``parted``, there are none, and depth alone is right. Raises `RenderError`
        as `check_time` does.
        """
        origin, way = (np.ascontiguousarray(part, np.float32) for part in (origin, way))
        count = way.shape[1]
        assert way.shape == (3, count)
        assert origin.shape in ((3,), (3, count))
        begin, limit = (np.broadcast_to(np.asarray(part, np.float32), (count,)) for part in (begin, limit))
        settings = gap, steps, halvings, int(parted)
        found = []
        for some in _portions(tables, count, until_s):
            start = origin if origin.ndim == 1 else origin[:, some]
            given = [np.ascontiguousarray(part) for part in (start, way[:, some], begin[some], limit[some])]
            found.append(self._rays(tables, given, settings, parted))
            found[-1].pieces["ray"] += some.start
        if len(found) == 1:
            return found[0]
        joined: list[Any] = [
            np.concatenate(parts) if isinstance(parts[0], np.ndarray) else sum(parts)
            for parts in zip(*found, strict=True)
        ]
        return Trails(*joined)

    def _rays(self, tables: Tables, given: list[Floats], settings: tuple[Any, ...], parted: bool) -> Trails:
        """As `rays`, in one call of the library."""
        count, many, scene = given[1].shape[1], given[0].ndim == 2, tables.scene.ctypes.data
        hit, length, depth = (np.full(count, value, np.float32) for value in (np.inf, 0.0, 0.0))
        soft, counts = np.zeros(count, np.int32), np.zeros(5, np.int64)
        scratch = np.empty(self._library.scratch(self.variant, scene), np.uint8)
        places = [part.ctypes.data for part in given]
        answers = [part.ctypes.data for part in (hit, length, soft, depth, counts)]
        room = 2 * count if tables.scene["media"] and parted else 0
        while True:
            pieces = np.empty(room, PIECE)
            rest = [*answers, pieces.ctypes.data, room, scratch.ctypes.data]
            if count:
                first = self.variant, scene, count, count if many else 1
                self._library.rays(*first, *places, *settings, *rest)
            found, lost, met, near, asked = counts.tolist()
            if found <= room or not parted:
                pieces = pieces[: min(found, room)]
                pieces = pieces[np.argsort(pieces["ray"], kind="stable")]
                return Trails(hit, length, soft != 0, depth, pieces, near, asked, lost, met)
            room = found

    def cones(
        self, tables: Tables, at: Floats, radius: float, p: Floats, n: Floats, until_s: float = NEVER
    ) -> tuple[Floats, int, int]:
        """Shares (M,) of the light of a lamp at a point (3,) that come to points (3, M) outside of it through
        what there is, all of it opaque, with distances up to `Tables`' reach; how many pass near something,
        and pairs of points and objects.

        Surfaces have normals n (3, M); in media, where one edge is enough, 0.
        """
        at, p, n = (np.ascontiguousarray(part, np.float32) for part in (at, p, n))
        assert p.shape == n.shape == (3, p.shape[1])
        way = p - at[:, None]
        square = (way * way).sum(0)
        far = np.sqrt(square.clip(1e-30))
        spread = radius / np.sqrt((square - radius * radius).clip(1e-9))  # of half the angle
        way, count, counts = way / far, len(far), np.zeros((2, 2), np.int64)
        result, scene = np.ones(count, np.float32), tables.scene.ctypes.data
        scratch = np.empty(self._library.scratch(self.variant, scene), np.uint8)
        for some in _portions(tables, count, until_s):
            parts = [part[..., some] for part in (way, far, spread, n)]
            given = [np.ascontiguousarray(part, np.float32) for part in parts]
            places = [part.ctypes.data for part in (*given, result[some], counts[0], scratch)]
            start = scene, len(given[1]), at.ctypes.data, radius
            self._library.cones(self.variant, *start, *places)
            counts[1] += counts[0]
        near, met = counts[1].tolist()
        return result, near, met

    def shade(
        self, tables: Tables, stage: Rows, band: range, until_s: float = NEVER
    ) -> tuple[Floats, tuple[int, ...]]:
        """Rows of a picture (rows, W, 3 or 4) in sRGB, with straight alpha where the background is
        transparent, by a `STAGE` row. Counts are of rays from lamps, of rays near what draws, of points, of
        pairs of points and objects, of pixels with more samples, of rays that came to no end, and of pixels
        whose numbers are none.
        """
        width, height = int(stage["width"]), int(stage["height"])
        near = range(max(band.start - 1, 0), min(band.stop + 1, height))
        planes = 4 if int(tables.scene["hues"]) == 3 else 7
        picture = np.empty((0 if stage["every"] else planes, len(near), width), np.float32)
        result = np.empty((len(band), width, 4 if stage["transparent"] else 3), np.float32)
        pixels, counts = np.empty(result.shape[:2], np.int32), np.zeros((2, 7), np.int64)
        given = tables.scene.ctypes.data, stage.ctypes.data, near.start, near.stop
        scratch = np.empty(self._library.scratch(self.variant, given[0]), np.uint8)
        last = counts[0].ctypes.data, scratch.ctypes.data
        each = max(1, _portion(tables) // width // 16) * 16
        for rows, call in (near if len(picture) else range(0), "shade"), (band, "finish"):
            for top in rows[::each]:
                check_time(until_s)
                some, more = (top, min(top + each, rows.stop)), [picture.ctypes.data]
                if call == "finish":
                    more += [pixels.ctypes.data, result[top - band.start :].ctypes.data]
                getattr(self._library, call)(self.variant, *given, *some, *more, *last)
                counts[1] += counts[0]
        return result, tuple(counts[1].tolist())

    def plane(
        self, tables: flat.FlatTables, page: Rows, rows: range, out: npt.NDArray[Any]
    ) -> tuple[int, int, int]:
        """Draw rows of a picture of a `PAGE` row into ``out``, colours (rows, width, 3 or 4) float32, or
        owners (rows, width) int32. Counts are of pairs of points and objects, of pixels of which all samples
        were taken, and of those that were asked one by one.
        """
        owners = out.dtype == np.int32
        assert out.flags.c_contiguous
        assert out.shape[:2] == (len(rows), int(page["width"]))
        assert (out.ndim == 2) == owners == (int(page["samples"]) == flat.WAYS.index("owners"))
        assert owners or (out.dtype == np.float32 and out.shape[2] == int(page["channels"]))
        scratch = np.empty(64 * (2 + int(tables.scene["objects"]) + int(tables.scene["groups"])), np.uint8)
        counts = np.zeros(3, np.int64)
        places = (None, out.ctypes.data) if owners else (out.ctypes.data, None)
        given = tables.scene.ctypes.data, page.ctypes.data, rows.start, len(rows)
        self._library.plane(self.variant, *given, *places, counts.ctypes.data, scratch.ctypes.data)
        pairs, refined, met = counts.tolist()
        return pairs, refined, met

    def states(self, tables: flat.FlatTables, p: npt.NDArray[Any], room: float = 0.0) -> Floats:
        """States (M,) of the plane's fold at points (2, M), right within ``room`` world units around them."""
        p = np.ascontiguousarray(p, np.float32)
        result = np.empty(p.shape[1], np.float32)
        assert p.shape == (2, len(result))
        scratch = np.empty(64 * (2 + int(tables.scene["objects"])), np.uint8)
        given = tables.scene.ctypes.data, len(result), p.ctypes.data, room
        self._library.states(self.variant, *given, result.ctypes.data, scratch.ctypes.data)
        return result

    def around(
        self,
        tables: Tables,
        around: Rows,
        p: Floats,
        n: Floats,
        turns: Floats,
        rays: int,
        *,
        finer: bool = False,
        parts: Exchange | None = None,
        until_s: float = NEVER,
    ) -> tuple[Floats, int, int]:
        """Light that points (3, M) with unit normals (3, M) receive by so many rays, by the tables of an
        `AROUND` row, and how far halves of these are from it (6, M). Turns (2, M) tell points apart. If
        ``finer``, some rays send others where they end. All of these, and pairs of points and objects, are
        counted.

        With ``parts`` those of nodes that are seen are written there, and the result is what comes from
        elsewhere, then the part of rays that meet objects.
        """
        row, counts = np.zeros(int(around["nodes"]), np.float32), np.zeros((2, 2), np.int64)
        scene, result = tables.scene.ctypes.data, np.empty((6, p.shape[1]), np.float32)
        scratch = np.empty(self._library.scratch(self.variant, scene), np.uint8)
        for some in _portions(tables, p.shape[1], until_s, rays):
            given = [np.ascontiguousarray(part[:, some], np.float32) for part in (p, n, turns)]
            light = np.empty((6, given[0].shape[1]), np.float32)
            into: list[Any] = [None] * 4
            if parts is not None:
                into = [part.ctypes.data for part in (parts.begin[some.start :], *parts[1:], row)]
            start = scene, around.ctypes.data, light.shape[1], *(part.ctypes.data for part in given)
            rest = rays, finer, light.ctypes.data, *into, counts[0].ctypes.data, scratch.ctypes.data
            self._library.around(self.variant, *start, *rest)
            result[:, some] = light
            counts[1] += counts[0]
        asked, met = counts[1].tolist()
        return result, asked, met

    def exchanged(self, parts: Exchange, sent: Floats) -> Floats:
        """Light that nodes receive (3, M) where they send (3, M)."""
        sent = np.ascontiguousarray(sent.T, np.float32)
        result = np.empty_like(sent)
        places = [part.ctypes.data for part in (*parts, sent, result)]
        self._library.exchanged(self.variant, len(sent), *places)
        return result.T

    def arriving(
        self,
        tables: Tables,
        around: Rows,
        p: Floats,
        way: Floats,
        finer: bool = False,
        until_s: float = NEVER,
    ) -> tuple[Floats, Floats]:
        """Light (3, M) that comes to points (3, M) from unit directions (3, M), without media, and from how
        far; the rest as of `around`.
        """
        scene, count = tables.scene.ctypes.data, p.shape[1]
        light, reach = np.empty((3, count), np.float32), np.empty(count, np.float32)
        scratch = np.empty(self._library.scratch(self.variant, scene), np.uint8)
        for some in _portions(tables, count, until_s):
            given = [np.ascontiguousarray(part[:, some], np.float32) for part in (p, way)]
            part, far = np.empty_like(given[0]), reach[some]
            start = scene, around.ctypes.data, len(far), *(part.ctypes.data for part in given)
            rest = finer, part.ctypes.data, far.ctypes.data, scratch.ctypes.data
            self._library.arriving(self.variant, *start, *rest)
            light[:, some] = part
        return light, reach

    def haze(
        self, tables: Tables, around: Rows, p: Floats, way: Floats, reach: Floats
    ) -> tuple[Floats, Floats]:
        """Light (3, M) of media along rays from points (3, M) in unit directions (3, M) from as far as a
        reach (M,), by the tables of an `AROUND` row, and the part (M,) that they let through.
        """
        given = [np.ascontiguousarray(part, np.float32) for part in (p, way, reach)]
        scene, clear = tables.scene.ctypes.data, np.empty_like(given[2])
        light = np.empty((3, len(clear)), np.float32)
        scratch = np.empty(self._library.scratch(self.variant, scene), np.uint8)
        places = [part.ctypes.data for part in (*given, light, clear, scratch)]
        self._library.haze(self.variant, scene, around.ctypes.data, len(clear), *places)
        return light, clear

    def passed_on(self, segment: Any, base: Floats, source: Floats, light: Floats, result: Floats) -> None:
        """Add to a result (n…, 4) a share of the light that comes to nodes of a lattice along a segment, of
        what joins, sources, and the light that was (n…, 4).
        """
        parts: list[Any] = [segment.here, segment.next, segment.clear, base, segment.surface, source, light]
        along = np.empty_like(base)
        assert all(part is None or part.size in (base.size, base.size // 4) for part in parts)
        places = [None if part is None else part.ctypes.data for part in (*parts, along, result)]
        self._library.passed_on(self.variant, base.size // 4, segment.far, segment.share, *places)

    def evened(
        self, view: Floats, p: Floats, n: Floats, values: Floats, step: int = 1, part: int = 0
    ) -> Floats:
        """Values (R, L) that planes have, by least squares over a lattice's points (3, L) with unit normals
        (3, L) so many steps around on the same surface; part 1 and 2 are how much these rise from a point to
        the next across and down. A view (18,) tells of the lattice.
        """
        p, n, values = (np.ascontiguousarray(part, np.float32) for part in (p, n, values))
        assert p.shape[1] == values.shape[1] == int(view[-1]) * int(view[-2])
        result, rows = np.empty_like(values), len(values)
        places = [part.ctypes.data for part in (view, p, n)]
        self._library.evened(self.variant, *places, rows, values.ctypes.data, step, part, result.ctypes.data)
        return result

    def between(
        self, p: Floats, n: Floats, view: Floats, seen: Floats
    ) -> tuple[Floats, npt.NDArray[np.int32]]:
        """Values (R, M) that points (3, M) with unit normals (3, M) have of a picture's lattice, by its view
        (18,) and what is seen at its points (L, 6 + 3R), and where (M,) any of these is on the same surface.
        """
        p, n = (np.ascontiguousarray(part, np.float32) for part in (p, n))
        values, count = seen.shape[1] // 3 - 2, p.shape[1]
        result, fits = np.empty((values, count), np.float32), np.empty(count, np.int32)
        places = [part.ctypes.data for part in (p, n, view, seen)]
        self._library.between(self.variant, count, *places, values, result.ctypes.data, fits.ctypes.data)
        return result, fits

    def mirrored(self, at: Floats, radius: float, p: Floats, n: Floats, coat: Floats) -> Floats:
        """Light (R, M) of a lamp at a point (3,) of a radius and power 1 that rough mirrors at points (3, M)
        with unit normals (3, M) send back if nothing is in its way; coats (4 + R, M) have their roughness,
        unit ways back, and what they reflect along the normal, in threes.
        """
        at, p, n, coat = (np.ascontiguousarray(part, np.float32) for part in (at, p, n, coat))
        result = np.empty_like(coat[4:])
        for row in range(0, len(result), 3):
            parts = (p, n, coat, coat[1:4], coat[4 + row :], result[row:])
            places = [part.ctypes.data for part in parts]
            self._library.mirrored(self.variant, p.shape[1], at.ctypes.data, radius, *places)
        return result

    def glowing(
        self,
        tables: Tables,
        around: Rows,
        p: Floats,
        n: Floats | None,
        worth: float,
        *,
        parts: bool = True,
        drawn: int = 0,
        until_s: float = NEVER,
    ) -> tuple[Floats, Floats, npt.NDArray[np.int32], Floats]:
        """Light (3, M) of discs at points (3, M) with unit normals (3, M), or surfaces that face each disc,
        if nothing hides it, and the parts (3, M) that arrive, if asked, by fewer rays where less is received
        than ``worth``. Of so many of these rays from each point numbers (k,) of points, and unit ways and
        light that arrives (6, k).
        """
        scene, count = tables.scene.ctypes.data, p.shape[1]
        light, free = np.empty((3, count), np.float32), np.ones((3, count), np.float32)
        scratch = np.empty(self._library.scratch(self.variant, scene), np.uint8)
        numbers, rays = [np.empty(0, np.int32)], [np.empty((6, 0), np.float32)]
        for some in _portions(tables, count, until_s, 32):
            given = [np.ascontiguousarray(part[:, some], np.float32) for part in (p, n) if part is not None]
            size = given[0].shape[1]
            sent, clear = np.empty((3, size), np.float32), np.empty((3, size), np.float32)
            point, ray = np.empty(drawn * size, np.int32), np.empty((6, drawn * size), np.float32)
            start = scene, around.ctypes.data, size, given[0].ctypes.data
            facing = given[1].ctypes.data if n is not None else None
            into = sent.ctypes.data, clear.ctypes.data if parts else None
            rest = point.ctypes.data, ray.ctypes.data, drawn * size, scratch.ctypes.data
            found = self._library.glowing(self.variant, *start, facing, worth, *into, *rest)
            light[:, some] = sent
            if parts:
                free[:, some] = clear
            numbers.append(point[:found] + np.int32(some.start))
            rays.append(ray[:, :found])
        return light, free, np.concatenate(numbers), np.concatenate(rays, 1)


def _alone(
    tables: Tables, objects: npt.NDArray[np.integer], points: npt.NDArray[Any]
) -> tuple[npt.NDArray[np.int32], Floats]:
    """Numbers (M,) of objects, from 0, and a point (3, M) for each, as the library takes them."""
    numbers, points = np.ascontiguousarray(objects, np.int32), np.ascontiguousarray(points, np.float32)
    assert points.shape == (3, len(numbers))
    assert ((numbers >= 0) & (numbers < tables.scene["objects"])).all()
    return numbers, points


def _portion(tables: Tables) -> int:
    """Rays, at least one, between which the time is checked."""
    return max(PORTION * MANY // max(int(tables.scene["objects"]), MANY), PORTION >> 6)


def _portions(tables: Tables, count: int, until_s: float, each: int = 1) -> Iterator[slice]:
    """Parts of so many points with rays of ``each``, at least one; raises `RenderError` as `check_time` does
    before each.
    """
    size = max(_portion(tables) // each, 16)
    for begin in range(0, max(count, 1), size):
        check_time(until_s)
        yield slice(begin, min(begin + size, count))


def _source() -> Any:
    """The module that builds the library; None outside of a checkout."""
    path = ROOT / "kernel" / "build.py"
    if not (path.is_file() and (ROOT / "hatch_build.py").is_file()):
        return None
    spec = importlib.util.spec_from_file_location("scenelang_kernel_build", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def load_kernel() -> Kernel:
    """The kernel of this machine, loaded once; raises `KernelError` where there is none."""
    source = _source()
    path = FOLDER / ("libkernel.dll" if sys.platform == "win32" else "libkernel.so")
    if source is None:
        return Kernel(path)
    # looked for in the file, as a library that was loaded once is not loaded again from the same place
    if source.is_built(path):
        return Kernel(path)
    if importlib.util.find_spec("ziglang") is None:
        raise KernelError("the kernel's library is not that of kernel/; pip install ziglang, which builds it")
    try:
        source.build(path)
    except (RuntimeError, OSError) as error:
        raise KernelError(str(error)) from None
    return Kernel(path)


@cache
def there_is_a_kernel() -> bool:
    """Whether `load_kernel` has one; warns once where it has not, as all else is slow."""
    try:
        load_kernel()
    except KernelError as error:
        warnings.warn(f"{error}; torch draws in its place, slowly, and no skies", stacklevel=2)
        return False
    return True
