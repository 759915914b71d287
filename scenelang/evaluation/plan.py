"""What drawing a scene takes, before and after each rewrite, and what was left out: no more than it needs."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenelang.backend.neural import draw_program
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.evaluation.metrics import MOST_DB, psnr
from scenelang.graph.lower import Spans, lower
from scenelang.graph.nodes import Fold, Graph, Leaf
from scenelang.graph.steps import Affine
from scenelang.graph.walk import nodes
from scenelang.image import Image
from scenelang.models.choose import choose_model, names_used
from scenelang.models.load import Model
from scenelang.models.manifest import Manifest, available, load_manifest
from scenelang.program.program import TOKENS, Program
from scenelang.reference.image import reference_image
from scenelang.scene.schema import Scene

REPEATS = 3


@dataclass(frozen=True, slots=True)
class Counts:
    """The size of a graph.

    Args:
        objects: leaves.
        matrices: affine maps and deformations on leaves and folds: each is one matrix of the lifting.
        affines, deformations: of these.
        folds: groups, chains and boolean nodes.
    """

    objects: int
    matrices: int
    affines: int
    deformations: int
    folds: int


def count(graph: Graph) -> Counts:
    """Count a graph's parts."""
    found = [node for node, _ in nodes(graph.root)]
    steps = [move.step for node in found for move in node.moves]
    affines = sum(isinstance(step, Affine) for step in steps)
    return Counts(
        objects=sum(isinstance(node, Leaf) for node in found),
        matrices=len(steps),
        affines=affines,
        deformations=len(steps) - affines,
        folds=sum(isinstance(node, Fold) for node in found),
    )


def choice(scene: Scene, chosen: str, asked: bool) -> dict[str, Any]:
    """Which model draws a scene, why, and what would have been next.

    Args:
        scene: what is drawn.
        chosen: the model that draws it.
        asked: whether the command line named it.
    """
    others = [load_manifest(name) for name in available() if name != chosen]
    free = scene.model_copy(update={"model": None})
    runner_up = choose_model(free, others)
    if asked:
        why = "by --model"
    elif scene.model is not None:
        why = "named by the scene"
    else:
        why = "the smallest that has all it uses"
    refused = {m.name: missing(free, m) for m in others if missing(free, m)}
    return {
        "model": chosen,
        "why": why,
        "runner_up": runner_up.name if runner_up else None,
        "lacking": refused,
    }


def missing(scene: Scene, manifest: Manifest) -> list[str]:
    """Names that a scene uses and a model does not have."""
    has = (manifest.geometries, manifest.materials, manifest.transforms, manifest.material_ops)
    return sorted(
        name for used, known in zip(names_used(scene), has, strict=True) for name in used.difference(known)
    )


def drawing_cost(
    scene: Scene, program: Program, model: Model, spans: Spans | None = None, threads: int = 1
) -> dict[str, Any]:
    """Draw a Program and say what it took and how far it is off.

    Args:
        scene: what the Program was compiled of.
        program: its Program.
        model: what draws it.
        spans: where the scene was written.
        threads: for drawing.

    Returns:
        ``pixels``, ``refined`` (pixels sampled four times), ``samples``, ``meetings`` (a sample and an object
        through the network), ``meetings_unskipped`` (every sample with every object), ``ms`` (the best of
        three frames, the first draws once before), ``psnr`` (dB, at most 50) and ``parameters``.
    """
    drawing = draw_program(program, model, threads=threads)
    times = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        drawing = draw_program(program, model, threads=threads)
        times.append(1000 * (time.perf_counter() - started))
    exact = reference_image(lower(scene, model.manifest, spans, Diagnostics()))
    width, height = program.canvas
    samples = width * height + 4 * drawing.refined
    return {
        "pixels": width * height,
        "refined": drawing.refined,
        "samples": samples,
        "meetings": drawing.pairs,
        "meetings_unskipped": samples * len(program),
        "ms": round(min(times), 2),
        "psnr": round(min(MOST_DB, psnr(_opaque(drawing.image), _opaque(exact))), 2),
        "parameters": sum(p.numel() for p in model.network.parameters()),
    }


def _opaque(image: Image) -> np.ndarray:
    values = np.asarray(image, np.float64)
    if values.shape[2] == 3:
        return values
    over: np.ndarray = values[..., :3] * values[..., 3:] + 1 - values[..., 3:]
    return over


def token_counts(tokens: Iterable[int]) -> dict[str, int]:
    """How many rows join by each word, of the words in use."""
    values = list(tokens)
    return {word: values.count(value) for word, value in TOKENS.items() if value in values}


def stages(graphs: Mapping[str, Graph]) -> list[dict[str, Any]]:
    """Sizes after ``lower`` and each pass, with what the pass changed."""
    out = []
    before: Counts | None = None
    for name, graph in graphs.items():
        now = count(graph)
        out.append(
            {
                "stage": name,
                "objects": now.objects,
                "matrices": now.matrices,
                "affines": now.affines,
                "deformations": now.deformations,
                "folds": now.folds,
                "changed": before is not None and now != before,
            }
        )
        before = now
    return out
