"""Unions in the plane by a rasteriser of polygons, Skia, beside the network and the exact field.

    python -m lab bench unions [-o docs/results/unions-rivals.json] [--scenes N] [--seed N]

Draws scenes of the set `unions` (deformed objects, no blends), each by all ways in turn. Milliseconds are
processor time of one thread for a warm frame of what was not drawn before: of ours from the Program, of Skia
from the graph, so that making the polygons, which lie within 1/50 pixel of the outlines, and painting them
count, and are told apart. FLIP and PSNR of pictures in 8 bits are against four samples a pixel, the
definition, and against 64, which coverage is nearer to. Needs the extra ``oracles``.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from pathlib import Path
from typing import Any

import numpy as np
import skia
import torch

from lab import ROOT
from lab.about import about
from lab.frontier.measure import median_interval
from lab.frontier.outlines import Outline, outlines
from lab.frontier.ways import FIELD, REFERENCE, ways_of
from lab.sets.scenes import interval, scenes_of
from scenelang.backend.neural import open_model
from scenelang.backend.options import keep_memory
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.files import write_whole
from scenelang.graph.lower import lower
from scenelang.image import Image, from_samples
from scenelang.measure.metrics import UNCAPPED_DB, flip, over_white, psnr
from scenelang.measure.plan import reference_of
from scenelang.models.manifest import load_manifest
from scenelang.scene.schema import Scene

MODEL, SET = "shapes2d", "unions"
OUT = ROOT / "docs/results/unions-rivals.json"
OURS = f"{MODEL}", f"{MODEL}, four samples", FIELD, f"{FIELD}, four samples", f"{REFERENCE}, 4 spp"
SKIA = "Skia"


def saved(image: Image) -> Image:
    """The picture over white as it is saved, in 8 bits, which is what Skia paints with."""
    white = from_samples(over_white(image), None)
    return from_samples(white.to_uint8().astype(np.float32) / 255, None)


def by_skia(objects: list[Outline], canvas: tuple[int, int]) -> Image:
    """Polygons painted over each other on white, with Skia's own antialiasing."""
    width, height = canvas
    pixels = np.empty((height, width, 4), np.uint8)
    surface = skia.Surface(pixels, colorType=skia.kRGBA_8888_ColorType)  # draws as long as it is there
    sheet = surface.getCanvas()
    sheet.clear(skia.ColorWHITE)
    for points, colour in objects:
        path = skia.Path()
        path.addPoly([skia.Point(x, y) for x, y in points.T.tolist()], True)
        sheet.drawPath(path, skia.Paint(AntiAlias=True, Color4f=skia.Color4f(*colour, 1.0)))
    return from_samples(pixels[..., :3].astype(np.float32) / 255, None)


def measure(scenes: int, seed: int) -> dict[str, Any]:
    """The record: of each way its milliseconds and errors, and ratios of times on the same scenes."""
    keep_memory()
    torch.set_num_threads(1)
    manifest = load_manifest(MODEL)
    ways = {way.name: way for way in ways_of(MODEL, 1) if way.name in OURS}
    scene_at = scenes_of(open_model(MODEL), SET, seed)
    found: dict[str, dict[str, list[float]]] = {name: {} for name in (*ways, SKIA)}
    names = list(found)

    def note(name: str, **values: float) -> None:
        for key, value in values.items():
            found[name].setdefault(key, []).append(value)

    for index in range(-2, scenes):  # two that warm up
        scene: Scene = scene_at(index % (scenes + 2))
        graph = lower(scene.model_copy(update={"model": MODEL}), manifest, None, Diagnostics())
        exact, many = (saved(reference_of(scene, manifest, per_side=side)) for side in (2, 8))
        prepared = {name: way.prepare(scene) for name, way in ways.items()}
        turn = index % len(names)
        for name in names[turn:] + names[:turn]:
            started = made = time.thread_time()
            if name in prepared:
                image = prepared[name]()
            else:
                polygons: list[Outline] = outlines(graph)
                made = time.thread_time()
                image = by_skia(polygons, scene.canvas)
            ended = time.thread_time()
            if index < 0:
                continue
            picture = saved(image)
            note(name, ms=1000 * (ended - started), outlines_ms=1000 * (made - started))
            note(name, flip=flip(picture, exact), psnr=psnr(picture, exact, UNCAPPED_DB))
            note(name, flip64=flip(picture, many), psnr64=psnr(picture, many, UNCAPPED_DB))
        if index >= 0:
            note(SKIA, points=float(sum(outline.points.shape[1] for outline in polygons)))
    ratios = []
    for slow in (MODEL, FIELD):
        pairs = [a / b for a, b in zip(found[slow]["ms"], found[SKIA]["ms"], strict=True)]
        ratio = {"slow": slow, "fast": SKIA, "mean": statistics.mean(pairs), "interval": interval(pairs)}
        ratios.append(ratio)
    return {
        **about(),
        "set": SET,
        "seed": seed,
        "scenes": scenes,
        "canvas": scene.canvas,
        "skia": skia.__version__,
        "ways": {name: _summary(values) for name, values in found.items()},
        "ratios": ratios,
    }


def _summary(values: dict[str, list[float]]) -> dict[str, Any]:
    low, high = median_interval(values["ms"])
    told: dict[str, Any] = {"ms": statistics.median(values["ms"]), "ms_low": low, "ms_high": high}
    told["outlines_ms"] = statistics.median(values["outlines_ms"])
    for key in ("flip", "psnr", "flip64", "psnr64", "points"):
        if key in values:
            told[key] = {"mean": statistics.mean(values[key]), "interval": interval(values[key])}
    return told


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--out", type=Path, default=OUT, metavar="FILE")
    parser.add_argument("--scenes", type=int, default=100, metavar="N")
    parser.add_argument("--seed", type=int, default=2021)
    given = parser.parse_args()
    found = measure(given.scenes, given.seed)
    rounded = json.loads(json.dumps(found), parse_float=lambda text: float(f"{float(text):.4g}"))
    write_whole(given.out, (json.dumps(rounded, indent=1) + "\n").encode())
    for name, way in found["ways"].items():
        errors = " ".join(f"{way[key]['mean']:9.4f}" for key in ("flip", "flip64", "psnr", "psnr64"))
        print(f"{name:34}{way['ms']:8.2f} ms, of which {way['outlines_ms']:.2f} outlines; {errors}")


if __name__ == "__main__":
    main()
