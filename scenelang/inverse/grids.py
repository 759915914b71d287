"""The smallest grids of distances, and of colours, within an error.

Pyramids of two kinds of coarsest grid grow level by level. A grid that is true at its nodes cuts edges and
corners between them, so the nodes of the finest grid are moved by the errors at points of the surface (SIRT;
Gilbert 1972), which halves the error. Each is measured as it is drawn, at other points of the true surface.

In a grid of colours the nodes next to the surface start with the colour of its nearest point, and are then
corrected likewise by the errors at points of the surface between them; the others copy the nearest of these.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import field, replace
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import MOST_SIDE, Element, Facts
from scenelang.assets.pyramid import Grid, finest, packed, packed_colours, refine, unpacked, unpacked_colours
from scenelang.assets.records import Record
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.exact.mesh import Mesh, Points
from scenelang.drawing.exact.originals import Shape
from scenelang.drawing.neural.assets import GridShape

ROUNDS: Final = 8
Corner = tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]


def corners(points: Points, side: int) -> list[Corner]:
    """Flat indices and linear weights (M,) of nodes at each corner of the cells of points in [-1, 1]^d."""
    d = points.shape[1]
    place = (points + 1) * ((side - 1) / 2)
    cell = np.clip(place.astype(np.int64), 0, side - 2)
    share = place - cell
    return [
        (np.ravel_multi_index(tuple((cell + at).T), (side,) * d), np.where(at, share, 1 - share).prod(1))
        for at in product((0, 1), repeat=d)
    ]


def settled(grid: Grid, points: Points) -> Grid:
    """The grid with nodes moved so that its drawn distances at points (M, d) are nearer to 0."""
    around = corners(points, len(grid))
    shares = sum(np.bincount(node, weight, grid.size) for node, weight in around)
    grid, asked = grid.copy(), np.ascontiguousarray(points.T, np.float32)
    for _ in range(ROUNDS):
        drawn = finest(grid)
        off = GridShape(NUMPY, drawn.reshape(-1), len(drawn), grid.ndim).distance(asked)
        move = sum(np.bincount(node, weight * off, grid.size) for node, weight in around)
        grid -= np.asarray(move / np.maximum(shares, 1e-9), np.float32).reshape(grid.shape)
    return grid


CELLS: Final = (4, 6)  # of the coarsest grids, along an axis
FEWEST: Final = {2: 25, 3: 13}  # nodes along an axis of what is measured, by dimension
BAND: Final = 4.5  # cells from the surface within which distances are computed; farther ones are interpolated
SAMPLES: Final = 20_000  # points of the surface where an element is measured
SETTLED: Final = {2: 0, 3: 200_000}  # further points by which nodes are moved, by dimension
BLOCK: Final = 100_000  # points for which distances are computed at a time
LONG_S: Final = 240.0  # processor time for the grids of a shape, unless a budget is larger
DEARER: Final = 4.0  # most times as long as the grid before that a grid is expected to take
THIN: Final = 0.02  # share of a surface that may be too thin for a grid
NEAR: Final = {2: 1e-4, 3: 1.5e-4}  # mean distance off that is near enough, by dimension


class Rung(NamedTuple):
    """One pyramid that was tried."""

    side: int  # nodes along an axis of its finest grid
    bytes: int
    error: float  # mean distance off at the surface, in leaf units
    worst: float  # 99th percentile of the distance off
    normal_deg: float  # median angle between normals
    thin: float  # share of the surface with no inside of the grid, or of the shape, within a cell


class _Pyramid(Record, frozen=False):
    """A pyramid as far as it has grown."""

    cells: int
    grid: Grid | None = None
    before: Grid | None = None
    true: Grid | None = None
    steps: list[npt.NDArray[np.int8]] = field(default_factory=list)

    @property
    def next_side(self) -> int:
        return (self.cells << len(self.steps)) + 1

    def grow(self, shape: Shape, progress: Callable[[int, float], None]) -> None:
        side = self.next_side
        axis = np.linspace(-1, 1, side)

        def true(expected: Grid) -> Grid:
            result = expected.reshape(-1).copy()
            near = abs(result) < BAND * 2 / (side - 1) if len(self.steps) > 1 else result < np.inf
            at = np.stack(np.unravel_index(np.nonzero(near)[0], expected.shape), 1)
            for first in range(0, len(at), BLOCK):
                progress(side, first / len(at))
                part = at[first : first + BLOCK]
                result[np.ravel_multi_index(tuple(part.T), expected.shape)] = shape.distances(axis[part])
            self.true = result.reshape(expected.shape)
            return self.true

        self.before = self.grid
        self.grid, steps = refine(self.grid, side, shape.dimension, true)
        self.steps.append(steps)

    def element(self, name: str, points: Points) -> Element:
        """The element so far, settled on points of the surface; of a solid with fine steps there."""
        steps, true, finer = self.steps, self.true, False
        if len(points) and true is not None:
            finer, grid = true.ndim == 3, settled(true, points)
            steps = [*steps[:-1], refine(self.before, len(true), true.ndim, lambda _: grid, finer)[1]]
        return packed(name, self.cells, steps, {}, finer)


def fit(
    shape: Shape,
    name: str,
    *,
    max_error: float | None = None,
    budget_s: float = np.inf,
    steps: int | None = None,
    about: Facts | None = None,
    report: Callable[[Rung], None] = lambda rung: None,
    progress: Callable[[int, float], None] = lambda side, share: None,
) -> tuple[Element, list[Rung]]:
    """The smallest element whose mean error, in leaf units, is at most asked, or the nearest that was tried.

    No further pyramid is begun after so many seconds or ``steps``; the same number of steps gives the same
    bytes. Without ``steps``, none is begun that may end after `LONG_S` of processor time. ``progress`` is
    called with nodes along an axis of what grows, and the share of it that is done.
    """
    started, worked, spent = time.monotonic(), time.process_time(), 0.0
    long_s = max(LONG_S, budget_s) if budget_s < np.inf else LONG_S
    points, normals, thin = shape.surface(SAMPLES + SETTLED[shape.dimension])
    others, points, normals = points[SAMPLES:], points[:SAMPLES], normals[:SAMPLES]
    growing = [_Pyramid(cells) for cells in CELLS]
    best: tuple[Rung, Element] | None = None
    tried: list[Rung] = []
    ended = "steps"
    while best is None or (time.monotonic() - started < budget_s if steps is None else len(tried) < steps):
        pyramid = min(growing, key=lambda p: p.next_side)
        if pyramid.next_side > MOST_SIDE[shape.dimension]:
            ended = "largest grid"
            break
        spent, before = time.process_time() - worked, spent
        if tried and steps is None and spent + DEARER * (spent - before) > long_s:
            ended = "time"
            break
        pyramid.grow(shape, progress)
        if pyramid.next_side // 2 + 1 < FEWEST[shape.dimension]:
            continue
        element = pyramid.element(name, others)
        rung = measured(element, points, normals, thin)
        tried.append(rung)
        report(rung)
        if best is None or rung.error < best[0].error:
            best = rung, element
        if rung.error <= (max_error or NEAR[shape.dimension]):
            ended = "near enough"
            break
    assert best is not None
    rung, kept = best
    said = {**(about or {}), "error": rung.error, "thin": rung.thin, "steps": len(tried), "ended": ended}
    said |= {"size": shape.size, **dict(zip("xyz", shape.centre, strict=False))}
    return replace(kept, about=said), tried


def measured(element: Element, points: Points, normals: Points, thin: float = 0.0) -> Rung:
    """Measure an element at points (M, d) of a surface, of which a share ``thin`` has no points here."""
    grid = unpacked(element)
    drawn = GridShape(NUMPY, grid.reshape(-1), len(grid), grid.ndim)
    off, *slope = drawn.field(np.ascontiguousarray(points.T, np.float32), gradient=True)
    length = np.maximum(np.linalg.norm(slope, axis=0), 1e-9)
    facing = np.clip((np.array(slope) * normals.T).sum(0) / length, -1, 1)
    away = abs(off)
    angle = float(np.degrees(np.median(np.arccos(facing))))
    side, worst = element.sides[-1], float(np.quantile(away, 0.99))
    thin += (1 - thin) * _lost(drawn, side, points)
    return Rung(side, len(element.data), float(away.mean()), worst, angle, thin)


def _lost(drawn: GridShape, side: int, points: Points) -> float:
    """Share of surface points (M, d) with nothing inside within a cell, such as a fin between the nodes."""
    ways = np.array([*product((-1, 0, 1), repeat=drawn.d)], float)
    ways *= 2 / (side - 1) / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1)
    left = points
    for way in ways:
        left = left[drawn.distance(np.ascontiguousarray((left + way).T, np.float32)) > 0]
    return len(left) / len(points)


SIDES: Final = 17, 25, 33, 49, 65, 97, 129, 193  # nodes along an axis; the last only where an error is asked
NEAR_COLOURS: Final = 0.025  # root mean square of channels off, 0 to 1, that is near enough
MOST_BYTES: Final = 150_000  # of a grid that is tried where that is not met
_COVER: Final = 60  # points for each cell of a grid's face, which find the nodes next to the surface
_EACH: Final = 4  # points for each of these nodes, by which it is corrected
_TIMES: Final = 8  # rounds of corrections
_HOLD: Final = 0.3  # added to a node's weights, so that a node with little evidence moves little


def fit_colours(
    mesh: Mesh,
    name: str,
    *,
    max_error: float | None = None,
    budget_s: float = np.inf,
    steps: int | None = None,
    about: Facts | None = None,
    report: Callable[[int, int, float], None] = lambda side, size, error: None,
) -> Element:
    """Fit the smallest grid that gives a mesh the look in its file, or the best of at most `MOST_BYTES`.

    Errors are root mean squares of channels off at the surface, 0 to 1. No further grid is begun after so
    many seconds or ``steps``. ``report`` is called with nodes along an axis, bytes and the error of each.
    """
    assert mesh.look is not None
    started, asked = time.monotonic(), max_error or NEAR_COLOURS
    fine = round(min(255, max(8, 1 / asked)))  # steps of luma, whose rounding is half of the error asked
    at, share = mesh.spread(SAMPLES, 1)
    points, true = mesh.points(at, share), mesh.look.at(at, share)
    best: Element | None = None
    for count, side in enumerate(SIDES if max_error else SIDES[:-1]):
        late = time.monotonic() - started > budget_s if steps is None else count >= steps
        if best is not None and late:
            break
        element = packed_colours(name, *_grid(mesh, side), {}, fine)
        drawn = _weights(points, side) @ unpacked_colours(element).reshape(3, -1).T
        error = float(np.sqrt(np.square(drawn - true).mean()))
        report(side, len(element.data), error)
        if best is not None and len(element.data) > MOST_BYTES:
            break
        said = {**(about or {}), "error": error}
        best = Element(name, "colours", element.sizes, element.coding, element.data, said)
        if error <= asked:
            break
    assert best is not None
    return best


def _weights(points: npt.NDArray[np.float64], side: int) -> Any:
    """Weights of a grid's nodes at points (M, 3) between them, as a sparse matrix (M, n³)."""
    from scipy.sparse import csr_matrix

    columns, values = zip(*corners(points, side), strict=True)
    start = np.arange(0, 8 * len(points) + 1, 8)
    result = np.stack(values, 1).astype(np.float32).ravel(), np.stack(columns, 1).ravel(), start
    return csr_matrix(result, shape=(len(points), side**3))


def _grid(mesh: Mesh, side: int) -> tuple[Grid, npt.NDArray[np.bool_]]:
    """Colours (3, n, n, n), and a mask (n, n, n) of the nodes next to the surface."""
    from scipy.ndimage import distance_transform_edt

    assert mesh.look is not None
    near = np.zeros((side,) * 3, bool)
    for node, _ in corners(mesh.points(*mesh.spread(_COVER * side * side, 2)), side):
        near.reshape(-1)[node] = True
    nodes = np.argwhere(near)
    colours = mesh.look.at(*mesh.touched(nodes * np.float64(2 / (side - 1)) - 1)).astype(np.float32)
    at, share = mesh.spread(_EACH * len(nodes), 3)
    weights = _weights(mesh.points(at, share), side)[:, np.flatnonzero(near)]
    back, true = weights.T.tocsr(), mesh.look.at(at, share).astype(np.float32)
    whole = np.asarray(weights.sum(0), np.float32).reshape(-1, 1) + np.float32(_HOLD)
    for _ in range(_TIMES):
        colours += back @ (true - weights @ colours) / whole
    grid = np.zeros((3, *near.shape), np.float32)
    grid[:, near] = colours.clip(0, 1).T
    nearest = distance_transform_edt(~near, return_distances=False, return_indices=True)
    return np.ascontiguousarray(grid[:, *nearest]), near
