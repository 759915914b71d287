"""Cost of drawing a scene: sizes after each pass, the chosen model, and the work and error of the picture."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

from scenelang.compiler.compile import why_chosen
from scenelang.compiler.graph import Fold, Graph, nodes
from scenelang.compiler.groups import OPERATOR
from scenelang.compiler.lower import Spans, lower
from scenelang.compiler.manifest import Manifest, available, load_manifest
from scenelang.compiler.program import Program
from scenelang.compiler.steps import Affine
from scenelang.drawing.exact.picture import reference_image
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import MOST_DB, flip, over_white, psnr
from scenelang.drawing.small import draw_small
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import Scene
from scenelang.language.words import TOKENS

if TYPE_CHECKING:
    from scenelang.drawing.neural.load import Model

REPEATS = 3


def token_counts(tokens: Iterable[int]) -> dict[str, int]:
    """Number of rows that join by each word, of the words in use."""
    values = list(tokens)
    return {word: values.count(value) for word, value in TOKENS.items() if value in values}


def stages(graphs: Mapping[str, Graph]) -> list[dict[str, Any]]:
    """Sizes after ``lower`` and each pass, and whether it changed anything; each move is a matrix."""
    out: list[dict[str, Any]] = []
    before: Graph | None = None
    for name, graph in graphs.items():
        result = list(nodes(graph.root))
        folds = [node for node in result if isinstance(node, Fold)]
        steps = [move.step for node in result for move in node.moves]
        affines = sum(isinstance(step, Affine) for step in steps)
        sizes: dict[str, Any] = {"stage": name, "objects": len(result) - len(folds), "matrices": len(steps)}
        sizes |= {"affines": affines, "deformations": len(steps) - affines, "folds": len(folds)}
        tokens = token_counts(TOKENS[link.op] for fold in folds for link in fold.links)
        out.append({**sizes, "tokens": tokens, "changed": before is not None and graph != before})
        before = graph
    return out


def plan_of(
    scene: Scene,
    program: Program,
    graphs: Mapping[str, Graph],
    model: Model,
    *,
    asked: bool = False,
    spans: Spans | None = None,
    threads: int = 1,
) -> dict[str, Any]:
    """Results of `choice`, `stages` and `drawing_cost`, and the rows and tokens of the stream."""
    return {
        **choice(scene, program.model, asked),
        "stages": stages(graphs),
        "rows": len(program),
        "tokens": token_counts((program.tokens & OPERATOR).tolist()),
        "drawing": drawing_cost(scene, program, model, spans, threads),
    }


def choice(scene: Scene, chosen: str, asked: bool) -> dict[str, Any]:
    """The model that draws a scene, the reason (or that it was ``asked`` for), and the runner-up."""
    lacking, able = {}, []
    for model in (load_manifest(name) for name in available() if name != chosen):
        lower(scene, model, None, diagnostics := Diagnostics())
        if diagnostics.errors:
            lacking[model.name] = list(dict.fromkeys(error.message for error in diagnostics.errors))
        else:
            able.append(model)
    runner_up = min(able, key=lambda model: (model.flip(), model.name), default=None)
    why, second = why_chosen(scene, asked), runner_up.name if runner_up else None
    return {"model": chosen, "why": why, "runner_up": second, "lacking": lacking}


def reference_of(scene: Scene, manifest: Manifest, *, per_side: int = 2, spans: Spans | None = None) -> Image:
    """The exact picture of a scene over its background; ``per_side`` samples along each side of a pixel."""
    graph = lower(scene, manifest, spans, Diagnostics())
    if not graph.elements:
        return reference_image(graph, per_side=per_side)
    from scenelang.drawing.exact.originals import originals_of

    return reference_image(graph, per_side=per_side, brought=originals_of(scene, graph))


def drawing_cost(
    scene: Scene, program: Program, model: Model, spans: Spans | None = None, threads: int = 1
) -> dict[str, Any]:
    """Draw a Program of a scene and measure its work, time and error.

    Returns:
        ``pixels`` of the canvas, ``refined`` (pixels sampled four times),
        ``ms`` (the best of three frames, after one that does not count), ``psnr`` (dB, at most 50), ``flip``
        (None without its package), ``unknown`` (why there is no exact picture, or None) and ``parameters``.
        In the plane: ``evaluated`` (pixels that an object reached; the network saw no other), ``samples``,
        ``meetings`` (a sample and an object through the network) and ``meetings_unskipped`` (every sample
        with every object). In space: ``rays`` from the eye, ``light_rays`` between surfaces or media and the
        light, how many of both came ``near`` an object, their ``steps`` (points at which the field was asked)
        and ``evaluations`` (an object's network at a point).
    """
    from scenelang.drawing.neural.load import place_of
    from scenelang.drawing.torch_backend import draw_program

    by_numpy = program.stage is not None and place_of(model.network).type == "cpu"  # as `render` draws them

    draw = partial(draw_small, program) if by_numpy else partial(draw_program, program, model)
    times = []
    for _ in range(1 + REPEATS):
        started = time.perf_counter()
        drawing = draw(threads=threads)
        times.append(1000 * (time.perf_counter() - started))
    own, unknown = over_white(drawing.image), None
    try:
        exact = over_white(reference_of(scene, model.manifest, spans=spans))
    except ValueError as error:
        exact, unknown = None, str(error)
    if (work := drawing.work) is not None:
        counts = {"rays": work.rays, "light_rays": work.lights, "near": work.near, "steps": work.steps}
        counts["evaluations"] = work.met
    else:
        samples = program.canvas[0] * program.canvas[1] + program.samples * drawing.refined
        if model.manifest.renderer != "framed":  # others take every sample, with every object
            samples = drawing.pairs // max(1, len(program))
        counts = {"evaluated": drawing.met, "samples": samples, "meetings": drawing.pairs}
        counts["meetings_unskipped"] = samples * len(program)
    off = None
    with suppress(ImportError):
        off = None if exact is None else round(flip(own, exact), 5)
    return {
        "pixels": program.canvas[0] * program.canvas[1],
        "refined": drawing.refined,
        **counts,
        "ms": round(min(times[1:]), 2),
        "psnr": None if exact is None else round(min(MOST_DB, psnr(own, exact)), 2),
        "flip": off,
        "unknown": unknown,
        "parameters": sum(p.numel() for p in model.network.parameters()),
    }
