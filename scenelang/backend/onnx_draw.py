"""Programs drawn in 8 bits: which models have that form, and one call that draws."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from scenelang.backend.errors import RenderError
from scenelang.backend.onnx_calibrate import load_ranges
from scenelang.backend.onnx_session import need_onnx
from scenelang.backend.onnx_streaming import StreamingGraphs
from scenelang.image import from_samples
from scenelang.models.load import Model
from scenelang.models.manifest import ROOT
from scenelang.program.program import Program
from scenelang.renderers.draw import Drawing
from scenelang.renderers.streaming import Streaming
from scenelang.renderers.whole import need_side, need_white

RANGES: Final = "int8.safetensors"


def ranges_path(name: str) -> Path:
    """Where a shipped model's ranges for 8 bits lie."""
    return ROOT / name / RANGES


def has_int8(name: str) -> bool:
    """Whether a shipped model can be drawn in 8 bits."""
    return ranges_path(name).is_file()


def draw_int8(program: Program, model: Model, threads: int) -> Drawing:
    """Draw a Program in 8 bits, on the CPU.

    Args:
        program: compiled for this model's weights.
        model: a shipped one.
        threads: cores to compute on.

    Raises:
        RenderError: onnxruntime is missing, or the model has no such form.
        ProgramError: the canvas or background is one that the model does not draw.
    """
    graphs = open_int8(model, threads)
    need_white(program.background)
    side = graphs.resolution
    need_side(program.canvas, side)
    if not len(program):
        return Drawing(from_samples(np.ones((side, side, 3), np.float32), None), 0, 0, 0)
    picture = graphs.draw(program.vectors, program.tokens)
    return Drawing(from_samples(picture, None), len(program) * side * side, 0, side * side)


_opened: dict[tuple[str, int], StreamingGraphs] = {}


def open_int8(model: Model, threads: int) -> StreamingGraphs:
    """A model's graphs, made once for each number of threads.

    Raises:
        RenderError: onnxruntime is missing, or the model has no such form.
    """
    name = model.manifest.name
    if not isinstance(model.network, Streaming):
        raise RenderError(
            f"model `{name}` has no int8 form: of the {model.manifest.renderer} renderer it was measured "
            "to gain nothing (docs/frontier.md)"
        )
    if not has_int8(name):
        raise RenderError(f"model `{name}` has no int8 form: no ranges were found for its weights")
    need_onnx()
    key = model.digest, threads
    if key not in _opened:
        ranges = load_ranges(ranges_path(name), model.network, model.digest)
        _opened[key] = StreamingGraphs(model.network, ranges, threads)
    return _opened[key]
