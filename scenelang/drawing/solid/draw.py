"""Solids to pictures and outputs: bands of pixels, and samples where they are needed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scenelang.compiler.program import ProgramError
from scenelang.compiler.spaces import EXTINCTION, Camera, Stage
from scenelang.drawing.arrays import Array
from scenelang.drawing.image import DEEP, Image, Outputs, from_light
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.light import INTO, Lighting
from scenelang.drawing.solid.march import CAREFUL, Pace, Trail, Work, march
from scenelang.drawing.solid.network import Wanted
from scenelang.drawing.solid.passes import INF

TILE = 1 << 16  # samples at a time
QUARTER = np.array([[0.25, 0.75, 0.25, 0.75], [0.25, 0.25, 0.75, 0.75]])  # x and y of a pixel's samples in it
PACES = {"quick": Pace(0.04, 2, 0.15), "one": Pace(0.04, 2)}
"""Paces of the ways to sample solids; the others are `CAREFUL`."""


def draw_solids(
    field: SolidField,
    stage: Stage,
    canvas: tuple[int, int],
    *,
    threads: int = 1,
    split: int | None = None,
    samples: str = "adaptive",
    progress: Callable[[float], None] | None = None,
) -> tuple[Image, Work]:
    """Draw a field of solids: the picture, and what it took.

    Args:
        canvas: width and height in pixels.
        threads: bands drawn at the same time.
        split: bands are as high as for so many threads; by default ``threads``.
        samples: of a pixel: ``"adaptive"``, four where something changes from pixel to pixel and one
            elsewhere, ``"quick"``, the same at another of `PACES`, ``"four"`` or ``"one"``.
        progress: called with the share done, from any thread.

    Raises:
        ProgramError: numbers out of all proportion, which no compiled scene has.
    """
    width, height = canvas
    lighting = Lighting(field, stage, PACES.get(samples, CAREFUL))
    out = np.empty((4, height, width), np.float32)
    rows = max(1, min(TILE // width, -(-height // (split or threads))))
    bands = [range(top, min(top + rows, height)) for top in range(0, height, rows)]
    costs: list[Work] = []

    def one(band: range) -> None:
        out[:, band.start : band.stop], work = _band(lighting, canvas, band, samples)
        costs.append(work)
        if progress is not None:
            progress(len(costs) / len(bands))

    field.xp.each(threads, one, bands)
    if not np.isfinite(out).all():
        raise ProgramError("numbers that the network cannot draw with")
    return from_light(out, stage.transparent), sum(costs, Work())


def _band(lighting: Lighting, canvas: tuple[int, int], rows: range, samples: str) -> tuple[np.ndarray, Work]:
    """Premultiplied radiance and alpha (4, rows, W) of some rows of pixels, and what they took."""
    width, height = canvas
    if samples == "one":
        every = np.array(rows)[:, None] + 0.5
        result, work = _shade(lighting, canvas, np.arange(width) + 0.5, every)
        return result[:4], work
    if samples != "four" and min(canvas) > 1:  # a line of pixels shows too little of what changes
        near = range(max(rows.start - 1, 0), min(rows.stop + 1, height))
        x_centres, y_centres = np.arange(width) + 0.5, np.array(near)[:, None] + 0.5
        once, work = _shade(lighting, canvas, x_centres, y_centres, 2 / min(canvas))
        band = slice(rows.start - near.start, rows.stop - near.start)
        picture = np.ascontiguousarray(once[:4, band])
        shown = once[3:] if lighting.stage.transparent else once[4:]
        y, x = np.nonzero(rough(shown, lighting.pace.contrast)[band])
    else:
        picture, work = np.empty((4, len(rows), width), np.float32), Work()
        y, x = (a.reshape(-1) for a in np.mgrid[0 : len(rows), 0:width])
    if len(x):
        four, more = _shade(lighting, canvas, x[:, None] + QUARTER[0], y[:, None] + rows.start + QUARTER[1])
        picture[:, y, x] = four[:4].mean(2)
        work += more + Work(refined=len(x))
    return picture, work


def _shade(
    lighting: Lighting, canvas: tuple[int, int], x: np.ndarray, y: np.ndarray, px: float = 0.0
) -> tuple[np.ndarray, Work]:
    """Radiance, alpha and plain radiance (7, …) at places of the picture; px as of `Lighting.shade`."""
    xp, way = lighting.xp, directions(lighting.stage.camera, canvas, x, y)
    with xp.inference():
        shade = lighting.shade(xp.array(way.reshape(3, -1), lighting.field.network.codes), px)
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


ROWS = 6  # of what a ray tells: depth, normal, object and alpha


def solid_outputs(field: SolidField, stage: Stage, canvas: tuple[int, int], *, threads: int = 1) -> Outputs:
    """Outputs of a field of solids; objects are numbered as the field has them, from 1.

    Alpha is the mean of four samples where it changes from pixel to pixel, the rest is of the centre.
    """
    width, height = canvas
    lighting = Lighting(field, stage)
    result = np.empty((ROWS, height, width), np.float32)
    every = max(1, min(TILE // width, -(-height // threads)))

    def row(top: int) -> None:
        y = np.arange(top, min(top + every, height))[:, None] + 0.5
        result[:, top : top + every] = _shown(lighting, directions(stage.camera, canvas, x_centres, y))

    def four(start: int) -> None:
        at = slice(start, start + TILE // 4)
        way = directions(stage.camera, canvas, across[at, None] + QUARTER[0], down[at, None] + QUARTER[1])
        alpha = _alpha(lighting, way.reshape(3, -1))[1]
        result[5, down[at], across[at]] = field.xp.to_numpy(alpha).reshape(-1, 4).mean(1)

    x_centres = np.arange(width) + 0.5
    field.xp.each(threads, row, range(0, height, every))
    down, across = np.nonzero(rough(result[5:]))
    field.xp.each(threads, four, range(0, len(down), TILE // 4))
    return Outputs(result[0], np.moveaxis(result[1:4], 0, 2), result[4].astype(np.int32), result[5])


def _alpha(lighting: Lighting, way: Array) -> tuple[Trail, Array]:
    """The trail of rays (3, M) from the eye, and the share of the background that objects hide (M,)."""
    with lighting.xp.inference():
        trail = march(lighting.field, lighting.eye, way, lighting.limit(way))
        return trail, 1 - (trail.hit == INF) * lighting.xp.exp(-EXTINCTION * trail.length)


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
        for ray, begin, end, before in reversed(trail.pieces):
            first = xp.where(before == 0)  # a ray's pieces come in order
            ray, t = xp.take(ray, first), xp.take(xp.minimum((begin + end) / 2, begin + DEEP), first)
            out[4, ray] = field.meet(trail.at(xp, ray), t, Wanted.KIND, owners=True).owner
        solid = xp.where(trail.hit < INF)
        if len(solid):
            to = xp.take(way, solid)
            p, n, *_ = lighting.surface(to, solid, trail)
            away = p - lighting.eye[:, None]
            out[0, solid], out[1:4, solid] = forward @ away, n
            t = xp.length(list(away)) + INTO
            out[4, solid] = field.meet(trail.at(xp, solid), t, Wanted.KIND, owners=True).owner
    return np.asarray(xp.to_numpy(out)).reshape(ROWS, *ways.shape[1:])
