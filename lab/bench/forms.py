"""Error against bytes: elements beside plain grids, fewer triangles, smaller pictures and other coders.

    python -m lab bench forms FILES... [-o docs/results/element-bytes.json]

Each file, a mesh or a picture as `scenelang learn` takes them, is given in every form at many sizes. A mesh's
error is the mean distance, in radii, of 20,000 points of its true surface from what is given; a picture's is
the PSNR of its 256 x 256 texels, at most 50 dB. For each number of bytes the record has the best that a form
reaches with as many or fewer, mean over all files. What has no coder of its own is deflated.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import math
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import igl
import numpy as np
import torch
from PIL import Image

from lab.about import about
from lab.commands.common import write_json
from lab.sets.scenes import interval
from scenelang.elements.pyramid import Grid, finest
from scenelang.fitting import picture as pictures
from scenelang.fitting.ladder import SAMPLES, SETTLED, fit
from scenelang.fitting.mesh import Mesh, Points
from scenelang.fitting.parts import shape_in
from scenelang.fitting.settle import settled
from scenelang.measure.metrics import MOST_DB
from scenelang.renderers.arrays import NUMPY
from scenelang.renderers.grid import GridShape

BUDGETS = (500, 1000, 2000, 4000, 8000, 16000, 32000)  # bytes
GRIDS = (33, 49)  # nodes along an axis, and every second and fourth of them
STEPS = 7  # pyramids that are tried: up to 97 nodes along an axis
BAND = 4.0  # cells within which distances of 8 bits lie
TRIANGLES = (50, 100, 200, 400, 800, 1600, 3200, 6400)
SIDES = (16, 24, 32, 48, 64, 96, 128, 160, 192, 224)
QUALITIES = (2, 5, 10, 15, 20, 30, 40, 50, 60, 70, 80, 90, 95)
COLOURS = (2, 4, 8, 16, 32, 64, 128, 256)

Found = Iterator[tuple[str, int, float]]  # a form, its bytes, and its error or PSNR


def solid_forms(shape: Mesh) -> Found:
    points = shape.surface(SAMPLES + SETTLED[3])[0]
    points, others = points[:SAMPLES], points[SAMPLES:]
    rungs = fit(shape, "it", max_error=1e-9, steps=STEPS)[1]
    yield from (("element", rung.bytes, rung.error) for rung in rungs)
    for most in GRIDS:
        axis = np.linspace(-1, 1, most)
        at = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
        whole = shape.distances(at).reshape((most,) * 3).astype(np.float32)
        for every in (1, 2, 4):
            true = np.ascontiguousarray(whole[::every, ::every, ::every])
            grid, reach = settled(true, others), np.float32(BAND * 2 / (len(true) - 1))
            half = grid.astype("<f2")
            byte = np.rint(np.clip(grid / reach, -1, 1) * 127).astype(np.int8)
            yield "grid, 16 bits", deflated(half), surface_error(half.astype(np.float32), points)
            yield "grid, 8 bits", deflated(byte), surface_error(byte.astype(np.float32) * reach / 127, points)
    for count in [n for n in TRIANGLES if n < len(shape.triangles)]:
        v, f, *_ = igl.qslim(shape.vertices, shape.triangles, count)
        if not len(f):  # nothing is left of thin parts that do not hang together
            continue
        corners, kept = np.ascontiguousarray(f, np.int64), np.rint((v + 1) * 32767.5).clip(0, 65535)
        size = deflated(kept.astype("<u2")) + deflated(np.diff(corners, axis=0, prepend=0).astype("<i2"))
        at = np.ascontiguousarray(kept / 32767.5 - 1)
        off = igl.point_mesh_squared_distance(np.ascontiguousarray(points), at, corners)[0]
        yield "triangles", size, float(np.sqrt(off).mean())


def deflated(values: np.ndarray) -> int:
    return len(zlib.compress(np.ascontiguousarray(values).tobytes(), 9))


def surface_error(grid: Grid, points: Points) -> float:
    drawn = finest(grid)
    off = GridShape(NUMPY, drawn.reshape(-1), len(drawn), 3).distance(points.T.astype(np.float32))
    return float(abs(off).mean())


def decibels(error: float) -> float:
    """PSNR of a root mean square of channels in [0, 1], at most `MOST_DB`."""
    return min(MOST_DB, -20 * math.log10(max(error, 1e-9)))


def picture_forms(true: np.ndarray) -> Found:
    def found(form: str, size: int, given: Image.Image) -> tuple[str, int, float]:
        off = np.asarray(given.convert("RGB"), np.float64) - true
        return form, size, decibels(math.sqrt((off**2).mean()) / 255)

    image = Image.fromarray(true)
    for coded in pictures.fit_picture(pictures.Picture(true), "it", max_error=1e-9)[1][:1]:
        yield "element", coded.bytes, decibels(coded.error)  # without loss
    for quality in QUALITIES:
        element = pictures._still("it", true, quality)
        given = (pictures.texels(element) * 255).round().astype(np.uint8)
        yield found("element", len(element.data), Image.fromarray(given))
        for sampling in ("4:4:4", "4:2:0"):
            data = written(image, "JPEG", quality=quality, subsampling=sampling, optimize=True)
            yield found("JPEG", len(data), Image.open(io.BytesIO(data)))
    for side in SIDES:
        small = image.resize((side, side), Image.Resampling.LANCZOS)
        size = len(written(small, "WEBP", lossless=True, quality=100, method=6))
        yield found("smaller picture", size, small.resize(image.size, Image.Resampling.BICUBIC))
    for count in COLOURS:
        few = image.quantize(count, dither=Image.Dither.NONE)
        yield found("palette, PNG", len(written(few, "PNG", optimize=True)), few)


def written(image: Image.Image, form: str, **options: object) -> bytes:
    file = io.BytesIO()
    image.save(file, form, **options)  # type: ignore[arg-type]
    return file.getvalue()


def forms_of(path: Path) -> tuple[str, Found]:
    """The kind of a file, and what there is of it."""
    data, suffix = path.read_bytes(), path.suffix.lower()
    if suffix in pictures.MOST_OF:
        return "pictures", picture_forms(pictures.read_picture(data).colours)
    shape = shape_in(data, suffix, "auto", 0)
    assert isinstance(shape, Mesh)
    return "meshes", solid_forms(shape)


def best(points: list[tuple[int, float]], budget: int, better: Callable[..., float]) -> float | None:
    """The best of what takes at most so many bytes."""
    within = [value for size, value in points if size <= budget]
    return better(within) if within else None


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("files", nargs="+", type=Path, metavar="FILES")
    parser.add_argument("-o", "--out", type=Path, default=Path("docs/results/element-bytes.json"))
    asked = parser.parse_args()
    torch.set_num_threads(1)
    kinds: dict[str, dict[str, dict[str, list[tuple[int, float]]]]] = {}
    for path in asked.files:
        kind, found = forms_of(path)
        of = kinds.setdefault(kind, {}).setdefault(path.name, {})
        for form, size, value in found:
            of.setdefault(form, []).append((size, round(value, 6)))
        print(path.name, {form: len(points) for form, points in of.items()}, flush=True)
    record = {**about(), "files": {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in asked.files}}
    for kind, files in kinds.items():
        rows, better = [], (max if kind == "pictures" else min)
        for form in next(iter(files.values())):
            for budget in BUDGETS:
                having = [of[form] for of in files.values() if of.get(form)]
                known = [v for v in (best(points, budget, better) for points in having) if v is not None]
                if len(known) == len(having):
                    mean = sum(known) / len(known)
                    rows.append({"form": form, "bytes": budget, "mean": mean, "interval": interval(known)})
        record[kind] = {"files": len(files), "rows": rows, "points": files}
    write_json(asked.out, record)


if __name__ == "__main__":
    main()
