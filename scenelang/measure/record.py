"""Put the measured error of new weights into their header."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenelang.measure.metrics import psnr
from scenelang.measure.scenes import draw_scene, reference_of, scenes_of, spread
from scenelang.models.load import load_model
from scenelang.training.checkpoint import load_tensors, save_tensors

SETS = ("unions", "affine", "chains")
SCENES, SEED = 60, 99


def record_measured(path: Path, name: str) -> dict[str, Any]:
    """Measure PSNR (dB, at most 50) on a few unseen scenes and write it into the header of the weights.

    Args:
        path: the weights file; it is replaced whole.
        name: the model that they are for.

    Returns:
        What was written: scenes, seed, and mean, 5th percentile and worst of each set.
    """
    model = load_model(name, path=path)
    measured: dict[str, Any] = {"scenes": SCENES, "seed": SEED}
    for group in SETS:
        scene_at = scenes_of(model, group, SEED)
        values = []
        for index in range(SCENES):
            scene = scene_at(index)
            values.append(psnr(draw_scene(model, scene)[1], reference_of(scene, model.manifest)))
        measured[f"psnr_{group}"] = spread(values, 5)
    tensors, header = load_tensors(path)
    save_tensors(path, tensors, {**header, "measured": measured})
    return measured
