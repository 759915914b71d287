"""Scenes of a set as a model draws them, their exact pictures, and figures over all of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lab.sets.plane import SETS, Rng, random_scene
from lab.sets.solids import SOLID_SETS, random_solid
from lab.training.checkpoint import load_tensors, save_tensors
from scenelang.assets.element_file import SUFFIX
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import Manifest
from scenelang.compiler.program import Program
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import psnr
from scenelang.drawing.neural.load import Model, load_model
from scenelang.drawing.small import draw_small
from scenelang.drawing.torch_backend import draw_program
from scenelang.language.scene import Scene
from scenelang.output.frontier import reference_of

PROBE = 48  # pixels along a side of the picture that tells how much a scene covers
LEAST_COVER = 0.02  # share of the canvas
RECORDED = 60  # scenes of each set that a weights' header tells the error of


def coverage(scene: Scene, manifest: Manifest) -> float:
    """About which share of the canvas a scene's objects cover; 0 where they hide all from the eye."""
    small = scene.model_copy(update={"canvas": (PROBE, PROBE), "background": None})
    if manifest.dimension == 3:
        small = small.model_copy(update={"ground": None, "canvas": (PROBE // 2, PROBE // 2)})
    if scene.elements:  # as they are drawn, which needs no originals
        return float(draw_small(compile_scene(small, model=manifest.name)).image[..., 3].mean())
    try:
        return float(reference_of(small, manifest)[..., 3].mean())
    except ValueError:
        return 0.0  # the eye is inside something opaque


def sets_of(manifest: Manifest) -> dict[str, Callable[[Rng], Scene]]:
    """Generators of random scenes, by set, of what a model draws."""
    if manifest.dimension == 3:
        return {name: partial(random_solid, config=config) for name, config in SOLID_SETS.items()}
    return {
        name: partial(random_scene, config=config)
        for name, config in SETS.items()
        if {*config.geometries} <= {*manifest.geometries}
        and (manifest.elements or not (config.textures or config.skins or config.clear or config.words))
    }


def usual_set(manifest: Manifest) -> str:
    """The set that speed and accuracy of a model's set are measured on: of solids one that has everything."""
    return "mixed" if manifest.dimension == 3 else manifest.set


def scenes_of(model: Model, name: str, seed: int, side: int | None = None) -> Callable[[int], Scene]:
    """Scenes by index of a set, or of `meshes3d` with the solids of a file, on a canvas that a model draws.

    Those that cover under 2 % of the canvas are drawn again. ``side`` is the shorter one, in pixels.
    """
    manifest = model.manifest
    brought = replace(SOLID_SETS["meshes3d"], meshes=name)
    make = partial(random_solid, config=brought) if name.endswith(SUFFIX) else sets_of(manifest)[name]
    least = LEAST_COVER
    if manifest.dimension == 2:
        least *= min(1.0, SETS[name].size ** 2)  # a tenth of the size covers a hundredth as much

    def scene(index: int) -> Scene:
        for attempt in range(1000):
            made = make(np.random.default_rng([seed, index, attempt]))
            if coverage(made, manifest) >= least:
                width, height = made.canvas
                factor = 1 if side is None else side / min(width, height)
                return sized(made.sized((round(width * factor), round(height * factor))), manifest)
        raise RuntimeError(f"no scene of set {name} covers enough")

    return scene


def sized(scene: Scene, manifest: Manifest) -> Scene:
    """The scene on a canvas that a model draws."""
    return scene.model_copy(update={"canvas": manifest.sizes[0]}) if manifest.sizes else scene


def draw_scene(model: Model, scene: Scene, threads: int = 1) -> tuple[Program, Image]:
    """Compile a scene and draw it with a model."""
    program = compile_scene(scene, model=model.manifest.name, codes=model.codes)
    return program, draw_program(program, model, threads=threads, patient=True).image


def spread(values: Sequence[float], bad_end: int) -> dict[str, float]:
    """Mean and its `interval`, worst, and the percentile ``bad_end``, where the bad values lie; named p5."""
    worst = max(values) if bad_end > 50 else min(values)
    return {
        "mean": round(float(np.mean(values)), 5),
        "interval": interval(values),
        "p5": round(float(np.percentile(values, bad_end)), 5),
        "worst": round(worst, 5),
    }


def interval(values: Sequence[float]) -> float:
    """Half the width of the 95 % interval of a mean, by its normal approximation."""
    return round(1.96 * float(np.std(values, ddof=1)) / math.sqrt(len(values)), 5) if len(values) > 1 else 0.0


def summarise(cases: Sequence[Mapping[str, float]]) -> dict[str, dict[str, float]]:
    """Mean, worst and the tail towards it of what `compare` said of each case."""
    bad_ends = {"psnr": 5, "ssim": 5, "flip": 95}
    return {name: spread([case[name] for case in cases], bad_end) for name, bad_end in bad_ends.items()}


def record_measured(path: Path, name: str) -> dict[str, Any]:
    """Measure PSNR (dB, at most 50) on unseen scenes and write it into the header of a model's weights."""
    model = load_model(name, path=path)
    measured: dict[str, Any] = {"scenes": RECORDED, "seed": 99}
    for group in ("unions", "affine", "chains"):
        drawn = map(scenes_of(model, group, 99), range(RECORDED))
        values = [psnr(draw_scene(model, s)[1], reference_of(s, model.manifest)) for s in drawn]
        measured[f"psnr_{group}"] = spread(values, 5)
    tensors, header = load_tensors(path)
    save_tensors(path, tensors, {**header, "measured": measured})
    return measured
