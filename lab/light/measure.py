"""How near renderers come to light as it is: scenes of families, their traced pictures, and figures."""

from __future__ import annotations

import hashlib
import io
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from lab.light.families import scene_text
from lab.light.field import world_of
from lab.light.paths import Traced, traced_picture
from lab.light.probes import PROBES
from scenelang import Program, loads, render
from scenelang import compile as compile_scene
from scenelang.assets.files import write_whole
from scenelang.compiler.graph import Graph
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.image import from_light
from scenelang.drawing.metrics import MOST_DB, flip, over_white, psnr
from scenelang.language.diagnostics import Diagnostics

ENOUGH = 52.0  # decibels of a traced picture's own noise
BATCH = 64  # paths of a pixel in a batch
WORST = 3  # pictures that are shown
FIGURES = "psnr", "clean", "flip", "clean_flip", "own_flip", "seconds"  # whose means are told


def scene_of(text: str) -> tuple[Program, Graph]:
    """A Program, and the graph as written, of a scene's text."""
    scene = loads(text)
    program = compile_scene(scene)
    model = {"model": program.model}
    return program, lower(scene.model_copy(update=model), load_manifest(program.model), None, Diagnostics())


def reference(
    text: str, graph: Graph, paths: int, threads: int, cache: Path | None, name: str, points: bool = False
) -> Traced:
    """The traced picture of a scene, from a folder where it was kept for the same text and as many paths;
    ``points`` as of `traced_picture`.
    """
    key = hashlib.sha256(text.encode()).hexdigest()[:16]
    path = cache / f"{name}.npz" if cache is not None else None
    known: Traced | None = None
    batch = min(BATCH, paths // 2)
    if path is not None and path.is_file():
        with np.load(path) as kept:
            known = Traced(
                kept["mean"].astype(np.float64), kept["error"].astype(np.float64), int(kept["paths"])
            )
            if kept["key"] != key or known.paths < 2 * batch:  # those few had smaller batches
                known = None
            elif known.paths >= paths or known.decibels >= ENOUGH:
                return known
    assert graph.stage is not None
    side = round(graph.samples**0.5)
    how: dict[str, Any] = {"per_side": side, "paths": paths, "enough": ENOUGH, "threads": threads}
    how |= {"points": points, "batch": batch}
    found = traced_picture(world_of(graph), graph.stage, graph.canvas, known=known, **how)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        data = io.BytesIO()
        mean, error = found.mean.astype(np.float32), found.error.astype(np.float32)
        np.savez_compressed(data, mean=mean, error=error, paths=found.paths, key=key, text=text)
        write_whole(path, data.getvalue())
    return found


def measure(
    family: str,
    scenes: int,
    size: int,
    paths: int,
    seed: int,
    *,
    threads: int = 1,
    cache: Path | None = None,
    first: int = 0,
    drawn: bool = True,
    points: bool = False,
    say: Callable[[str], None] = lambda _: None,
) -> tuple[dict[str, Any], list[np.ndarray]]:
    """Figures of a family's scenes, and the worst pictures beside what they should be (H, 3 W, 3)."""
    rows, pictures = list[dict[str, Any]](), list[tuple[float, np.ndarray]]()
    last = len(PROBES[family][1]) if family in PROBES else first + scenes
    for index in range(first, min(last, first + scenes)):
        text = scene_text(family, seed, index, size)
        program, graph = scene_of(text)
        began = time.perf_counter()
        truth = reference(text, graph, paths, threads, cache, f"{family}-{seed}-{size}-{index:03}", points)
        traced_s = time.perf_counter() - began
        row = {"scene": index, "paths": truth.paths, "own": round(truth.decibels, 2), "traced_s": traced_s}
        if drawn:
            render(program, threads=threads)  # a model is loaded once
            began = time.perf_counter()
            image = render(program, threads=threads)
            row["seconds"] = time.perf_counter() - began
            exposure = program.stage.camera.exposure if program.stage else 1.0
            exact = over_white(from_light(truth.mean, program.background is None, exposure))
            picture = over_white(image)
            row |= {"psnr": psnr(picture, exact), "flip": flip(picture, exact)}
            # what a renderer without error would have, if the traced picture's noise were Gaussian
            noise = np.random.default_rng(seed).standard_normal(truth.mean.shape) * truth.error
            noisy = over_white(from_light(truth.mean + noise, program.background is None, exposure))
            row["own_flip"] = flip(noisy, exact)
            # squares of errors add, so twice the noise tells how much of it is in FLIP
            square = 2 * row["flip"] ** 2 - flip(picture, noisy) ** 2
            row["clean_flip"] = math.sqrt(max(square, 0.0))
            # without the traced picture's noise, whose square adds to that of the error
            square = float(np.mean((picture - exact) ** 2)) - 10 ** (-truth.decibels / 10)
            row["clean"] = min(-10 * math.log10(max(square, 1e-12)), MOST_DB)
            row |= {"mean": 255 * float(picture.mean()), "traced_mean": 255 * float(exact.mean())}
            if family in PROBES:
                row["value"] = PROBES[family][1][index]
            error = np.clip(0.5 + 4.0 * (picture - exact), 0.0, 1.0)
            pictures.append((row["psnr"], np.concatenate([exact, picture, error], 1)))
        rows.append({name: round(v, 4) if isinstance(v, float) else v for name, v in row.items()})
        say(f"{family} {rows[-1]}")
    result: dict[str, Any] = {"family": family, "seed": seed, "size": size}
    result["own"] = round(float(np.mean([row["own"] for row in rows])), 2)
    if drawn:
        every = {name: np.array([row[name] for row in rows]) for name in FIGURES}
        result |= {f"mean_{name}": round(float(values.mean()), 4) for name, values in every.items()}
        result |= {f"{name}_5": round(float(np.percentile(every[name], 5)), 2) for name in ("psnr", "clean")}
    pictures.sort(key=lambda pair: pair[0])
    return result | {"scenes": rows}, [picture for _, picture in pictures[:WORST]]
