"""Solids as closed triangle meshes: the learned field's surface, with its edges and its colours.

Cells of an octree that the surface may touch are cut to the resolution. In each, every sheet of the surface
gets one vertex, where the planes at the crossings with the cell's edges meet best; an edge that the surface
crosses joins those of the four cells around it. Sheets are told apart alike from both sides of a face.

Sources: T. Ju, F. Losasso, S. Schaefer, J. Warren, Dual contouring of Hermite data, SIGGRAPH 2002;
S. Schaefer, T. Ju, J. Warren, Manifold dual contouring, TVCG 13(3), 2007.
"""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.files import write_output
from scenelang.compiler.program import Program
from scenelang.drawing.image import decoded, encoded
from scenelang.drawing.kernel import Asked, load_kernel
from scenelang.drawing.tables import DRAWS, Tables

Floats = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Up = Literal["y", "z"]

MOST_CELLS: Final = 1 << 22
COARSE: Final = 8  # cells along the longest side to begin with, about
STEEP: Final = 1.1  # how much faster than exact ones learned distances change at most
SEARCHED: Final = 32  # cells along the longest side when the box is made smaller
TIGHT: Final = 0.9  # of a side: a box that comes out longer is small enough
HALVINGS, STEPS = 14, 12  # that find a crossing at most, where a medium may begin and elsewhere
NEAR: Final = 1e-5  # of a cell: how far off the surface a crossing may be
TINY: Final = 1e-9  # world units: of nodes that are taken out of the solid
FLAT: Final = 0.01  # of the largest: a smaller spread of normals says nothing of where their planes meet
OUTSIDE: Final = 1.0  # cells: how far outside of its own a vertex may be, where an edge cuts a side of it
SKEW: Final = 1e-3  # of a cell: how far off a plane the corners of a quad may be that is cut either way
JUMP: Final = 0.06  # between sRGB colours that no triangle runs between
GAP: Final = 0.002  # of a triangle: between vertices on both sides of a jump
PROBES: Final = 20_000  # cells that are searched for what is thinner than they

_BITS: Final = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)])  # of a cell's corners, x first
_ENDS: Final = np.array([(i, i | 1 << a) for a in range(3) for i in range(8) if not i >> a & 1])
"""Corners at the ends of the edges: four along x, then along y and z."""


class TriangleMesh(NamedTuple):
    """A closed surface.

    Args:
        vertices: float64 (V, 3), world units.
        triangles: int64 (T, 3), counter-clockwise from outside.
        colours: float64 (V, 3), sRGB in [0, 1], of the surface before light.
    """

    vertices: Floats
    triangles: Index
    colours: Floats

    def save(self, path: str | os.PathLike[str], up: Up = "y") -> None:
        """Write a file, whole or not at all, as `encode`; raises OSError where it cannot be written."""
        write_output(path, self.encode(Path(path).suffix.lower(), up))

    def encode(self, suffix: str, up: Up = "y") -> bytes:
        """Make the bytes of a file: .stl (without colours), .ply, .obj or .glb, by its axis that points up.

        Raises `ValueError` for another suffix, and for a .glb with z up, which the format does not have.
        """
        if (write := WRITERS.get(suffix)) is None:
            raise ValueError(f"not one of {', '.join(WRITERS)}")
        if up == "y":
            return write(self)
        if suffix == ".glb":
            raise ValueError("a .glb is y up")
        return write(self._replace(vertices=self.vertices[:, [0, 2, 1]] * [1, -1, 1]))


class Sampler:
    """The field of a Program of solids, asked at points; raises `RenderError` without the kernel."""

    def __init__(self, program: Program, exact: bool) -> None:
        from scenelang.drawing.closed import field_of

        self.kernel = load_kernel()
        given = program.vectors, program.tokens, program.brought(), program.paints()
        self.tables = Tables(field_of(program, exact), *given)  # type: ignore[arg-type]
        rows, kinds = self.tables.objects.rows, self.tables.looks.register[-1] > 0.5
        self.media, self.mixed = bool(kinds.any()), bool(kinds.any() and not kinds.all())
        linear = rows["map"][:, :9].reshape(-1, 3, 3).astype(np.float64)
        rates = rows["rate"] * np.linalg.norm(linear, 2, axis=(1, 2))
        self.steep, self.reach = STEEP * max([1.0, *rates.tolist()]), 0.0
        drawn = rows[rows["flags"] & DRAWS > 0]
        ends = [drawn["centre"] + side * drawn["extent"][:, None].astype(np.float64) for side in (-1, 1)]
        corners = np.concatenate(ends) if len(drawn) else np.zeros((1, 3))
        self.low, self.high = corners.min(0), corners.max(0)
        longest = np.inf
        while (size := float((self.high - self.low).max())) and size < TIGHT * longest:  # booleans leave less
            side, longest = size / SEARCHED, size
            counts = np.ceil((self.high - self.low) / side).clip(1).astype(np.intp)
            cells = self.touched(np.indices(counts).reshape(3, -1).T, self.low, side)
            first, last = (cells.min(0), cells.max(0) + 1) if len(cells) else (0, 0)
            self.low, self.high = self.low + first * side, np.minimum(self.low + last * side, self.high)

    def touched(self, cells: Index, first: Floats, side: float) -> Index:
        """Those of some cells (M, 3), numbered from a point, that the surface may touch."""
        self.reach = 3**0.5 / 2 * side
        near: Index = cells[abs(self.at(first + (cells + 0.5) * side)) <= self.steep * self.reach]
        return near

    def meet(self, p: Floats, gradient: bool = False, every: bool = False) -> Asked:
        """The field at points (M, 3), distances as far as `reach`, world units, beyond objects' balls."""
        return self.kernel.field(self.tables, p.T, self.reach, gradient, every)

    def at(self, p: Floats) -> Floats:
        """Distances (M,) at points (M, 3), negative in what is opaque alone."""
        met = self.meet(p, every=self.media)
        distance = met.distance.astype(np.float64)
        inside = (distance < 0) & (met.register[-1] > 0.5) if self.media else False
        return np.asarray(np.where(inside, TINY - distance, distance))


class Sheets(NamedTuple):
    """Sheets of the surface in a cell, by its corners that are inside, as bits."""

    crossed: npt.NDArray[np.bool_]  # (256, 12) edges that it crosses
    sheet: Index  # (256, 12) of each
    number: Index  # (256,) of sheets
    pinched: npt.NDArray[np.bool_]  # (256, 6) faces that one sheet crosses twice: low x, high x, low y, …


@cache
def sheets() -> Sheets:
    """The table; on a face that is crossed four times corners that are inside are apart."""
    edge = {frozenset(ends): number for number, ends in enumerate(_ENDS.tolist())}
    faces = []
    for axis in range(3):
        u, v = 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
        faces += [[base, base | u, base | u | v, base | v] for base in (0, 1 << axis)]
    none = np.zeros((256, 12), bool)
    table = Sheets(none, np.zeros((256, 12), int), np.zeros(256, int), np.zeros((256, 6), bool))
    for case in range(256):
        owner, twice = list(range(12)), []
        for face in faces:
            inside = [case >> corner & 1 for corner in face]
            sides = [edge[frozenset((face[i], face[(i + 1) % 4]))] for i in range(4)]
            crossed = [sides[i] for i in range(4) if inside[i] != inside[(i + 1) % 4]]
            if len(crossed) == 4:  # the sides before and behind each corner that is inside
                first = inside.index(1)
                crossed = [sides[first - 1], sides[first], sides[first + 1], sides[(first + 2) % 4]]
            twice.append(crossed)
            for a, b in zip(crossed[::2], crossed[1::2], strict=True):
                old, new = owner[a], owner[b]
                owner = [new if one == old else one for one in owner]
        cut = [e for e, (a, b) in enumerate(_ENDS.tolist()) if (case >> a ^ case >> b) & 1]
        table.crossed[case, cut] = True
        number = {one: at for at, one in enumerate(dict.fromkeys(owner[e] for e in cut))}
        table.sheet[case, cut], table.number[case] = [number[owner[e]] for e in cut], len(number)
        table.pinched[case] = [len(face) == 4 and owner[face[0]] == owner[face[2]] for face in twice]
    return table


class Grid:
    """Cells of one size, by numbers, with the field's values at their corners."""

    def __init__(self, sampler: Sampler, resolution: int) -> None:
        self.sampler, self.resolution = sampler, resolution
        while (cells := self._split()) is None:
            self.resolution -= self.resolution // 8
        sampler.reach = 2 * self.side
        self.bits, self.cells = self.number(_BITS), self.number(cells)
        self.nodes, self.values, self.holed = np.zeros(0, np.intp), np.zeros(0), False
        self.inside = np.zeros(self.shape.prod(), bool)
        while True:
            fresh = self._others(self.cells[:, None] + self.bits, self.nodes)
            nodes = np.concatenate([self.nodes, fresh])
            order = np.argsort(nodes)
            self.values = np.concatenate([self.values, sampler.at(self.points(fresh))])[order]
            self.nodes, self.cells = nodes[order], np.sort(self.cells)
            self.inside[self.nodes] = self.values < 0
            left = self._others(self._around(), self.cells)  # the field may be steeper than it should be
            if len(left):
                self.cells = np.concatenate([self.cells, left])
            elif len(taken := self._pinched()):
                self.values[np.searchsorted(self.nodes, taken)] = TINY
                self.inside[taken] = False
                self.holed = True
            else:
                break

    def _split(self) -> Index | None:
        """Cells (K, 3) that the surface may touch; None where they are too many."""
        sampler, levels = self.sampler, max(0, int(np.log2(self.resolution / COARSE)))
        self.side = float((sampler.high - sampler.low).max()) / self.resolution
        self.first = sampler.low - 1.37 * self.side  # so that no plane of symmetry is one of the grid
        counts = np.ceil((sampler.high - self.first) / self.side / 2**levels).astype(np.intp) + 1
        self.shape = (counts << levels) + 1  # of nodes
        cells = np.indices(counts).reshape(3, -1).T
        for level in range(levels, 0, -1):
            cells = sampler.touched(cells, self.first, self.side * 2**level)
            if 8 * len(cells) > MOST_CELLS:
                return None
            cells = (2 * cells[:, None] + _BITS).reshape(-1, 3)
        return cells

    def number(self, place: Index) -> Index:
        """Numbers of nodes, or of cells by their first nodes, at places (…, 3)."""
        return np.asarray((place[..., 2] * self.shape[1] + place[..., 1]) * self.shape[0] + place[..., 0])

    def points(self, number: Index) -> Floats:
        """Points (…, 3) of nodes."""
        rest, x = np.divmod(number, self.shape[0])
        z, y = np.divmod(rest, self.shape[1])
        return np.asarray(self.first + np.stack([x, y, z], -1) * self.side)

    def value(self, number: Index) -> Floats:
        """Values at nodes."""
        return self.values[np.searchsorted(self.nodes, number)]

    def cases(self) -> Index:
        """Corners of the cells that are inside, as bits (K,)."""
        return np.asarray(sum(self.inside[self.cells + bit] * (1 << i) for i, bit in enumerate(self.bits)))

    def _others(self, numbers: Index, known: Index) -> Index:
        """Numbers beside the known ones, each once, in order."""
        result = np.zeros(len(self.inside), bool)
        result[numbers], result[known] = True, False
        return np.flatnonzero(result)

    def _around(self) -> Index:
        """Numbers of the cells around edges that the surface crosses, also more than once."""
        cases, found = self.cases(), [self.cells[:0]]
        for number, (a, b) in enumerate(_ENDS.tolist()):
            some = self.cells[((cases >> a ^ cases >> b) & 1) > 0] + self.bits[a]
            others = [i for i in range(8) if not i >> number // 4 & 1]
            found += [some - self.bits[i] for i in others]
        return np.concatenate(found)

    def _pinched(self) -> Index:
        """Nodes inside to take out, so that no sheets of two neighbours cross the face between them twice."""
        pinched, cases, taken = sheets().pinched, self.cases(), [self.cells[:0]]
        for axis in range(3):
            low = np.flatnonzero(pinched[cases, 2 * axis])
            before = self.cells[low] - self.bits[1 << axis]
            there = np.searchsorted(self.cells, before)
            both = low[(self.cells[there] == before) & pinched[cases[there], 2 * axis + 1]]
            corner = np.flatnonzero(_BITS[:, axis] == 0)
            inside = cases[both, None] >> corner & 1
            taken.append(self.cells[both] + self.bits[corner[inside.argmax(1)]])
        return np.concatenate(taken)


def surface_of(program: Program, resolution: int, exact: bool) -> tuple[TriangleMesh, dict[str, str]]:
    """The surface of what is opaque in a Program of solids, and warnings by code."""
    sampler = Sampler(program, exact)
    said = {"W0551": "a mesh has no media: what is volumetric is left out"} if sampler.media else {}
    empty = TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), np.intp), np.zeros((0, 3)))
    if not (sampler.high > sampler.low).all():
        return empty, said
    grid = Grid(sampler, resolution)
    cases, table, side = grid.cases(), sheets(), grid.side
    thin = grid.holed or _thin(grid, cases)
    active = np.flatnonzero((cases > 0) & (cases < 255))
    if not len(active):
        return empty, said
    cases, cells = cases[active], grid.cells[active]
    first = np.concatenate([[0], np.cumsum(table.number[cases])])
    at, edge = np.nonzero(table.crossed[cases])  # cells, and edges of them that are crossed
    vertex = first[at] + table.sheet[cases[at], edge]
    a, b = (cells[at] + grid.bits[_ENDS[edge, end]] for end in (0, 1))
    # of each edge the four cells around it, in the order of its place in them
    order = np.lexsort((edge, a, edge // 4))
    turns = edge[order].reshape(-1, 4)[:, 0] // 4
    quad = vertex[order].reshape(-1, 4)[:, [0, 1, 3, 2]]
    a, b = (ends[order].reshape(-1, 4)[:, 0] for ends in (a, b))
    p, n = _crossings(grid, a, b)
    places = _places(quad, p, n, first[-1], side)
    box = grid.points(np.repeat(cells, table.number[cases]))
    places = np.clip(places, box - OUTSIDE * side, box + (1 + OUTSIDE) * side)
    rising = grid.value(a) < 0  # from inside to outside
    back = rising == (turns == 1)
    quad[back] = quad[back][:, ::-1]
    triangles = _cut(sampler, quad, places, side)
    met = sampler.meet(places - _normals(quad, n, len(places)) * (0.05 * side), every=True)
    if grid.resolution < resolution:
        said["W0553"] = f"more than {MOST_CELLS:,} cells: a resolution of {grid.resolution}, not {resolution}"
    if thin:
        said["W0552"] = f"parts about as thin as a cell of {side:.2g} may be missing or have holes"
    assert met.register is not None
    colours = encoded(met.register[:3].T.astype(np.float64))
    return _parted(sampler, TriangleMesh(places, triangles, colours), side), said


def _crossings(grid: Grid, a: Index, b: Index) -> tuple[Floats, Floats]:
    """Points (E, 3) where edges between nodes cross the surface, and unit normals, by false position."""
    sampler, mixed = grid.sampler, grid.sampler.mixed  # a value jumps where a medium begins
    low, high, f, g = grid.points(a).T, grid.points(b).T, grid.value(a), grid.value(b)
    steps = HALVINGS if mixed else STEPS
    near = 0.0 if mixed else NEAR * grid.side
    zero, beyond = zeros(lambda p: sampler.at(p.T), low, high, f, g, steps, mixed, near)
    p = zero.T
    met = sampler.meet(p, gradient=True)
    n = np.asarray(met.gradient, np.float64).T
    if mixed:  # what ends where a medium begins ends as the medium's own distance says
        some = np.flatnonzero(met.distance < -0.05 * grid.side)
        outside = beyond.T[some]
        owner = np.asarray(sampler.meet(outside, every=True).owner) - 1
        kept = owner >= 0
        n[some[kept]] = -sampler.kernel.own(sampler.tables, owner[kept], outside[kept].T)[1].T
    return p, n / np.linalg.norm(n, axis=1).clip(1e-12)[:, None]


def _summed(quad: Index, values: Floats, count: int) -> Floats:
    """Sums (V, …) at vertices of the values (E, …) of quads around them."""
    flat = values.reshape(len(values), -1)
    rows = [np.bincount(quad.ravel(), np.repeat(column, 4), count) for column in flat.T]
    return np.stack(rows, 1).reshape(count, *values.shape[1:]).astype(np.float64)


def _normals(quad: Index, n: Floats, count: int) -> Floats:
    result = _summed(quad, n, count)
    return np.asarray(result / np.linalg.norm(result, axis=1).clip(1e-12)[:, None])


def _places(quad: Index, p: Floats, n: Floats, count: int, side: float) -> Floats:
    """Vertices (V, 3) where planes at points (E, 3) with normals meet best, nearest to the middle."""
    middle = _summed(quad, p, count) / np.bincount(quad.ravel(), minlength=count)[:, None]
    spread = _summed(quad, n[:, :, None] * n[:, None], count)
    rest = _summed(quad, n * (n * p).sum(1)[:, None], count) - (spread @ middle[..., None])[..., 0]
    size, axes = np.linalg.eigh(spread)
    along = (axes.swapaxes(1, 2) @ rest[..., None])[..., 0]
    along = np.where(size > FLAT * size[:, 2:], along / np.maximum(size, 1e-12), 0.0)
    return np.asarray(middle + (axes @ along[..., None])[..., 0])


def _cut(sampler: Sampler, quad: Index, places: Floats, side: float) -> Index:
    """Triangles (2 E, 3) of quads, each cut along the diagonal that lies nearer to the surface."""
    a, b, c, d = (places[quad[:, i]] for i in range(4))
    skew = abs((np.cross(b - a, d - a) * (c - a)).sum(1)) > SKEW * side**3
    one, other = (abs(sampler.at((x + y)[skew] / 2)) for x, y in ((a, c), (b, d)))
    turned = np.flatnonzero(skew)[other < one]
    quad[turned] = np.roll(quad[turned], 1, 1)
    return np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])


def _parted(sampler: Sampler, mesh: TriangleMesh, side: float) -> TriangleMesh:
    """Part a mesh where colours jump: each side of it has its own vertices, `GAP` of a cell apart.

    Corners of triangles around a vertex that follow each other with about the same colour share one vertex.
    The edges between are closed by slivers, and by a fan where three or more colours meet.
    """
    vertices, triangles, colours = mesh
    middle, tints = vertices[triangles].mean(1), colours[triangles]
    jumps = (np.ptp(tints, axis=1) > JUMP).any(1)
    some = np.flatnonzero(np.isin(triangles, triangles[jumps]).any(1))
    if not len(some):
        return mesh
    met = sampler.meet(middle[some], gradient=True)
    inside = middle[some] - ((met.distance + 0.02 * side) * met.gradient).T
    tint = encoded(sampler.meet(inside, every=True).register[:3].T)[:, None]
    tints[some] = np.where((abs(tints[some] - tint) > JUMP).any(2, keepdims=True), tint, tints[some])
    # of each edge its first and last corner here, and those of the same vertices beyond
    corner = np.arange(triangles.size).reshape(-1, 3)
    a, b = corner.ravel(), np.roll(corner, -1, 1).ravel()
    start, end, flat = triangles.ravel(), triangles.ravel()[b], tints.reshape(-1, 3)
    beyond = np.empty_like(a)
    beyond[np.lexsort((end, start))] = np.lexsort((start, end))
    c, d = b[beyond], beyond  # beyond, the edge runs from ``d``, which is where ``b`` is, to ``c``
    alike = (abs(flat[a] - flat[c]) <= JUMP).all(1)
    run = a.copy()
    while (apart := alike & (run[a] != run[c])).any():
        least = np.minimum(run[a], run[c])
        np.minimum.at(run, a[apart], least[apart])
        np.minimum.at(run, c[apart], least[apart])
    _, first, run, count = np.unique(run, return_index=True, return_inverse=True, return_counts=True)
    toward = np.repeat(middle, 3, 0) - vertices[start]
    means = [np.bincount(run, column) / count for column in (*flat.T, *toward.T)]
    split = np.bincount(start[first], minlength=len(vertices))[start[first]] > 1
    places = vertices[start[first]] + np.stack(means[3:], 1) * (GAP * split[:, None])
    a, b, c, d = (run[one] for one in (a, b, c, d))
    slivers = np.stack([b, a, c, b, c, d], 1)[start < end].reshape(-1, 3)
    after = np.arange(len(first))
    after[c[a != c]] = a[a != c]
    root = np.full(len(vertices), len(first))
    np.minimum.at(root, start[first], np.arange(len(first)))
    fans = np.stack([root[start[first]], np.arange(len(first)), after], 1)
    faces = np.concatenate([run.reshape(-1, 3), slivers, fans])
    whole = (faces != np.roll(faces, 1, 1)).all(1)
    return TriangleMesh(places, faces[whole], np.stack(means[:3], 1))


def _thin(grid: Grid, cases: Index) -> bool:
    """True where something lies inside cells whose corners are all outside."""
    sampler, empty = grid.sampler, grid.cells[cases == 0]
    some = empty[np.linspace(0, len(empty) - 1, min(PROBES, len(empty))).astype(np.intp)]
    p = grid.points(some) + grid.side / 2
    if not len(p):
        return False
    met = sampler.meet(p, gradient=True)
    p -= np.asarray((met.distance + 0.02 * grid.side) * met.gradient).T
    within = (abs(p - grid.points(some) - grid.side / 2) < grid.side / 2).all(1)
    hit = np.flatnonzero(within)[sampler.at(p[within]) < 0]
    beside = some[hit, None] + np.concatenate([grid.bits[[1, 2, 4]], -grid.bits[[1, 2, 4]]])
    active = grid.cells[(cases > 0) & (cases < 255)]
    return bool((~np.isin(beside, active)).all(1).any())


def _stl(mesh: TriangleMesh) -> bytes:
    corner = mesh.vertices[mesh.triangles].astype("<f4")
    rows = np.zeros(len(corner), [("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("more", "<u2")])
    rows["corner"], normal = corner, np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    rows["normal"] = normal / np.linalg.norm(normal, axis=1).clip(1e-30)[:, None]
    return bytes(80) + struct.pack("<I", len(rows)) + rows.tobytes()


def _ply(mesh: TriangleMesh) -> bytes:
    points = np.zeros(len(mesh.vertices), [("place", "<f4", 3), ("colour", "u1", 3)])
    points["place"], points["colour"] = mesh.vertices, np.floor(255 * mesh.colours + 0.5)
    faces = np.zeros(len(mesh.triangles), [("count", "u1"), ("corner", "<i4", 3)])
    faces["count"], faces["corner"] = 3, mesh.triangles
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    lines += [f"property float {name}" for name in "xyz"]
    lines += [f"property uchar {name}" for name in ("red", "green", "blue")]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    return "\n".join(lines).encode() + points.tobytes() + faces.tobytes()


def _obj(mesh: TriangleMesh) -> bytes:
    rows = np.concatenate([mesh.vertices, mesh.colours], 1).tolist()
    lines = ["v {:.6g} {:.6g} {:.6g} {:.4g} {:.4g} {:.4g}".format(*row) for row in rows]
    lines += ["f {} {} {}".format(*corners) for corners in (mesh.triangles + 1).tolist()]
    return "\n".join([*lines, ""]).encode()


def _glb(mesh: TriangleMesh) -> bytes:
    """Khronos Group, glTF 2.0 Specification, 2021; its colours are linear."""
    places, colours = mesh.vertices.astype("<f4"), decoded(mesh.colours).astype("<f4")
    parts = [places, colours, mesh.triangles.astype("<u4").ravel()]
    starts = np.cumsum([0, *(part.nbytes for part in parts)]).tolist()
    views, accessors = list[dict[str, Any]](), list[dict[str, Any]]()
    kinds = ("VEC3", 5126), ("VEC3", 5126), ("SCALAR", 5125)
    for part, start, (form, kind) in zip(parts, starts, kinds, strict=False):
        accessors.append({"bufferView": len(views), "componentType": kind, "type": form, "count": len(part)})
        views.append({"buffer": 0, "byteOffset": start, "byteLength": part.nbytes})
    accessors[0] |= {"min": places.min(0).tolist(), "max": places.max(0).tolist()}
    surface = {"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0}
    rough = {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}}
    whole: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "scenelang"},
        "buffers": [{"byteLength": starts[-1]}],
    }
    whole |= {"scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}]}
    whole |= {"meshes": [{"primitives": [surface]}], "materials": [rough]}
    whole |= {"bufferViews": views, "accessors": accessors}
    text = json.dumps(whole, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + starts[-1])
    body = struct.pack("<I4s", starts[-1], b"BIN\0") + b"".join(part.tobytes() for part in parts)
    return head + struct.pack("<I4s", len(text), b"JSON") + text + body


WRITERS: Final = {".stl": _stl, ".ply": _ply, ".obj": _obj, ".glb": _glb}


def crossed(a: Floats, b: Floats) -> Floats:
    """Cross products (…) of vectors (…, 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def zeros(
    at: Callable[[Floats], Floats],
    a: Floats,
    b: Floats,
    f: Floats,
    g: Floats,
    steps: int,
    halved: bool,
    near: float,
) -> tuple[Floats, Floats]:
    """Points (d, n) where a function is 0, and the ends outside of what is left to look in.

    Source: G. Dahlquist, Å. Björck, Numerical methods, 1974, section 6.3 (the Illinois method).

    Args:
        at: values (n,) at points (d, n); one of a step is a jump, for which ways are ``halved``.
        a, b: points (d, n) between which there are zeros.
        f, g: values (n,) there, of different signs.
        steps: how often the function is asked at most.
        near: a value that is near enough to 0.
    """
    a, b, f, g = (one.copy() for one in (a, b, f, g))
    some = np.arange(len(f))
    for _ in range(steps):
        p, q, u, v = a[:, some], b[:, some], f[some], g[some]
        middle = p + (0.5 if halved else (u / (u - v)).clip(0.01, 0.99)) * (q - p)
        value = at(middle)
        same = (value < 0) == (u < 0)
        f[some], g[some] = np.where(same, value, u / 2), np.where(same, v / 2, value)
        a[:, some], b[:, some] = np.where(same, middle, p), np.where(same, q, middle)
        some = some[abs(value) > near]
    zero = a + (0.5 if halved else f / (f - g)) * (b - a)
    return zero, np.where(f < 0, b, a)
