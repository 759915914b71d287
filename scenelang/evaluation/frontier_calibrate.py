"""Ranges for 8 bits of a shipped model, found on scenes of its set that nothing else uses."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from scenelang.backend.neural import open_model
from scenelang.backend.onnx_calibrate import calibrate, save_ranges, tune
from scenelang.backend.onnx_draw import RANGES
from scenelang.evaluation.run import scenes_of
from scenelang.program.compile import compile_scene
from scenelang.renderers.streaming import Streaming

SCENES: Final = 64
TUNED: Final = 24
SEED: Final = 1_000_003
"""Of the calibration alone: figures and promises come from other scenes."""


def calibrate_model(name: str, folder: Path) -> Path:
    """Write ``NAME/int8.safetensors`` into a folder.

    Args:
        name: a model whose renderer is `streaming`.
        folder: gets it; the package's ``models`` to ship it.

    Returns:
        The file.

    Raises:
        RenderError: the model's weights are missing or damaged.
        OSError: the file cannot be written.
    """
    model = open_model(name)
    assert isinstance(model.network, Streaming)
    side = model.network.config.resolution
    scene_at = scenes_of(model, model.manifest.set, SEED)
    streams = []
    for index in range(SCENES):
        scene = scene_at(index).model_copy(update={"canvas": (side, side)})
        program = compile_scene(scene, model=name)
        streams.append((program.vectors, program.tokens))
    ranges = tune(model.network, streams[:TUNED], calibrate(model.network, streams))
    path = folder / name / RANGES
    path.parent.mkdir(parents=True, exist_ok=True)
    about = {"model": name, "scenes": SCENES, "seed": SEED}
    save_ranges(path, ranges, model.digest, about)
    return path
