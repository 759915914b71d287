"""Solids to pictures: bands of pixels, samples where they are needed, and colours as they are shown."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from scenelang.graph.stage import Camera, Stage
from scenelang.image import Image, from_light
from scenelang.program.program import ProgramError
from scenelang.renderers.solid.field import SolidField
from scenelang.renderers.solid.light import Lighting
from scenelang.renderers.solid.march import CAREFUL, Pace, Work

TILE = 1 << 16  # samples at a time
PACES = {"quick": Pace(0.04, 2, 0.15), "one": Pace(0.04, 2)}
"""How carefully solids are drawn by ways to sample them; the others are `CAREFUL`."""


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
    """Draw a field of solids.

    Args:
        field: the solids.
        stage: camera, light, ground and sky.
        canvas: width and height in pixels.
        threads: bands drawn at the same time.
        split: bands are as high as for so many threads; by default ``threads``.
        samples: of a pixel: ``"adaptive"``, four where something changes from pixel to pixel and one
            elsewhere, ``"quick"``, the same at another of `PACES`, ``"four"`` or ``"one"``.
        progress: called with the share done, from any thread.

    Returns:
        The picture and what it took.

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

    if threads == 1 or len(bands) == 1:
        for band in bands:
            one(band)
    else:
        with ThreadPoolExecutor(threads, initializer=field.xp.one_core) as pool:
            list(pool.map(one, bands))
    if not np.isfinite(out).all():
        raise ProgramError("numbers that the network cannot draw with")
    return from_light(out, stage.transparent), sum(costs, Work())


def _band(lighting: Lighting, canvas: tuple[int, int], rows: range, samples: str) -> tuple[np.ndarray, Work]:
    """Premultiplied radiance and alpha (4, rows, W) of some rows of pixels, and what they took."""
    width, height = canvas
    if samples == "one":
        every = np.array(rows)[:, None] + 0.5
        found, work = _shade(lighting, canvas, np.arange(width) + 0.5, every)
        return found[:4], work
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
        quarter = np.array([[0.25, 0.75, 0.25, 0.75], [0.25, 0.25, 0.75, 0.75]])
        four, more = _shade(lighting, canvas, x[:, None] + quarter[0], y[:, None] + rows.start + quarter[1])
        picture[:, y, x] = four[:4].mean(2)
        work += more + Work(refined=len(x))
    return picture, work


def _shade(
    lighting: Lighting, canvas: tuple[int, int], x: np.ndarray, y: np.ndarray, px: float = 0.0
) -> tuple[np.ndarray, Work]:
    """Radiance, alpha and plain radiance (7, …) at places in pixels from the picture's upper left corner.

    With px as of `Lighting.shade`.
    """
    xp, way = lighting.xp, directions(lighting.stage.camera, canvas, x, y)
    with xp.inference():
        shade = lighting.shade(xp.array(way.reshape(3, -1), lighting.field.network.codes), px)
        found = xp.to_numpy(xp.concat([shade.radiance, shade.alpha[None], shade.plain], 0))
    return found.reshape(7, *way.shape[1:]), shade.work


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
