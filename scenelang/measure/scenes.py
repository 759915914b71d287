"""Scenes of a set as a model draws them, their exact pictures, and figures over all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scenelang.backend.neural import draw_program
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.graph.lower import Spans, lower
from scenelang.image import Image
from scenelang.measure.metrics import psnr
from scenelang.measure.sets import scenes
from scenelang.models.load import Model, load_model
from scenelang.models.manifest import Manifest
from scenelang.program.compile import compile_scene
from scenelang.program.program import Program
from scenelang.reference.image import reference_image
from scenelang.scene.schema import Scene
from scenelang.training.checkpoint import load_tensors, save_tensors

PROBE = 48  # pixels along a side of the picture that tells how much a scene covers
RECORDED = 60  # scenes of each set that a weights' header tells the error of


def reference_of(scene: Scene, manifest: Manifest, *, per_side: int = 2, spans: Spans | None = None) -> Image:
    """The exact picture of a scene over its background, names as a model knows them.

    ``per_side`` is samples along each side of a pixel; 2 is the definition.
    """
    return reference_image(lower(scene, manifest, spans, Diagnostics()), per_side=per_side)


def coverage(scene: Scene, manifest: Manifest) -> float:
    """About which share of the canvas a scene covers."""
    small = scene.model_copy(update={"canvas": (PROBE, PROBE), "background": None})
    return float(reference_of(small, manifest)[..., 3].mean())


def scenes_of(model: Model, name: str, seed: int) -> Callable[[int], Scene]:
    """The scenes of a set by index, as `scenes` makes them for a model, on a canvas that it draws."""
    made = scenes(name, seed, lambda scene: coverage(scene, model.manifest))
    return lambda index: sized(made(index), model.manifest)


def sized(scene: Scene, manifest: Manifest) -> Scene:
    """The scene on a canvas that a model draws."""
    return scene.model_copy(update={"canvas": manifest.sizes[0]}) if manifest.sizes else scene


def draw_scene(model: Model, scene: Scene, threads: int = 1) -> tuple[Program, Image]:
    """Compile a scene and draw it with a model."""
    program = compile_scene(scene, model=model.manifest.name, codes=model.codes)
    return program, draw_program(program, model, threads=threads).image


def spread(values: list[float], bad_end: int) -> dict[str, float]:
    """Mean, worst and the percentile ``bad_end``, which says where the bad values lie; named p5."""
    worst = max(values) if bad_end > 50 else min(values)
    return {
        "mean": round(float(np.mean(values)), 5),
        "p5": round(float(np.percentile(values, bad_end)), 5),
        "worst": round(worst, 5),
    }


def summarise(cases: Sequence[Mapping[str, float]]) -> dict[str, dict[str, float]]:
    """Mean, worst and the tail towards it of what `compare` said of each case."""
    bad_ends = {"psnr": 5, "ssim": 5, "flip": 95}
    return {name: spread([case[name] for case in cases], bad_end) for name, bad_end in bad_ends.items()}


def record_measured(path: Path, name: str) -> dict[str, Any]:
    """Measure PSNR (dB, at most 50) on a few unseen scenes and write it into the header of a model's weights.

    Returns:
        What was written: scenes, seed, and mean, 5th percentile and worst of each set.
    """
    model = load_model(name, path=path)
    measured: dict[str, Any] = {"scenes": RECORDED, "seed": 99}
    for group in ("unions", "affine", "chains"):
        drawn = map(scenes_of(model, group, 99), range(RECORDED))
        values = [psnr(draw_scene(model, s)[1], reference_of(s, model.manifest)) for s in drawn]
        measured[f"psnr_{group}"] = spread(values, 5)
    tensors, header = load_tensors(path)
    save_tensors(path, tensors, {**header, "measured": measured})
    return measured
