"""No more than a scene needs: plans of scenes, and what leaving out saves."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import torch

from lab.about import about
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.graph import Graph
from scenelang.compiler.passes import OPTIONAL
from scenelang.drawing.metrics import over_white, psnr
from scenelang.drawing.neural.draw import draw
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.load import Model
from scenelang.drawing.torch_backend import open_model
from scenelang.language.evaluation import load
from scenelang.language.scene import Scene
from scenelang.output.frontier import plan_of, reference_of

REPEATS = 2

WAYS: Mapping[str, Mapping[str, Any]] = {
    "as shipped": {},
    "every sample meets every object": {"skip": False},
    "four samples in every pixel": {"samples": "four"},
    "both": {"skip": False, "samples": "four"},
    "hidden and unseen objects stay": {"without": OPTIONAL},
}
"""Ways of drawing that leave out less, by the arguments of `draw` and `compile_scene`."""


def shown_frame(path: Path) -> int:
    """The frame that stands for a scene: the first, or the last of an animation that does not loop."""
    animation = load(path).animation
    return 0 if animation is None or animation.loop else animation.frames - 1


def example_plan(path: Path) -> dict[str, Any]:
    """Result of `scenelang dump --costs` for a scene on one thread, and the cost of each of `WAYS`."""
    frame = shown_frame(path)
    scene = load(path, frame=frame)
    graphs: dict[str, Graph] = {}
    program = compile_scene(scene, after=graphs.__setitem__)
    model = open_model(program.model)
    return {
        "file": path.name,
        "frame": frame,
        "canvas": list(program.canvas),
        **plan_of(scene, program, graphs, model),
        "ways": ways_of(scene, model) if model.manifest.renderer == "framed" else {},
    }


def ways_of(scene: Scene, model: Model) -> dict[str, dict[str, float]]:
    """``meetings``, ``ms`` (the better of two) and ``psnr`` (dB) of a scene by each of `WAYS`."""
    exact = over_white(reference_of(scene, model.manifest))
    result = {}
    for name, options in WAYS.items():
        arguments = dict(options)
        without = arguments.pop("without", ())
        p = compile_scene(scene, model=model.manifest.name, codes=model.codes, without=without)
        network: Any = load_arrays(p.model, p.weights).network
        best = math.inf
        for _ in range(REPEATS):
            started = time.perf_counter()
            drawing = draw(network, p, **arguments)
            best = min(best, 1000 * (time.perf_counter() - started))
        error = psnr(over_white(drawing.image), exact)
        result[name] = {"meetings": drawing.pairs, "ms": round(best, 2), "psnr": round(error, 2)}
    return result


def measure_examples(
    paths: Iterable[Path], report: Callable[[dict[str, Any]], None] | None = None
) -> dict[str, Any]:
    """Plans of scenes on one thread, with the machine they were measured on."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    plans, digests = [], {}
    try:
        for path in paths:
            plans.append(example_plan(path))
            digests[plans[-1]["model"]] = open_model(plans[-1]["model"]).digest
            if report is not None:
                report(plans[-1])
        result = about()
    finally:
        torch.set_num_threads(before)
    return {
        **result,
        "weights": digests,
        "plans": plans,
    }
