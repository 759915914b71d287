"""Cases of the conformance suite: how a scene is evaluated, and what is expected of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.compiler.compile import compile_scene
from scenelang.compiler.graph import Graph
from scenelang.compiler.lifting import LAYOUTS
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.program import Program
from scenelang.compiler.spaces import stage_data
from scenelang.drawing.exact.field import evaluate, sample_points
from scenelang.drawing.exact.picture import reference_image, true_shapes
from scenelang.drawing.exact.solid import solid_image
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.evaluation import Source
from scenelang.language.reports import SceneError

FOLDER = Path(__file__).parent / "cases"
NAMES = sorted(path.stem for path in FOLDER.glob("*.nsg"))

Arrays = dict[str, npt.NDArray[np.float32]]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a scene gives: the JSON and the arrays of its case, and the graph as lowered."""

    facts: dict[str, Any]
    arrays: Arrays
    graph: Graph | None


def stored(name: str) -> tuple[dict[str, Any], Arrays]:
    """The expectations of a case."""
    facts = json.loads((FOLDER / f"{name}.json").read_text("utf-8"))
    path = FOLDER / f"{name}.npz"
    if not path.exists():
        return facts, {}
    with np.load(path, allow_pickle=False) as data:
        return facts, {key: data[key] for key in data.files}


def run(name: str, given: Mapping[str, Any]) -> Outcome:
    """Evaluate, compile and draw a case by the reference.

    Args:
        name: of the case.
        given: ``input`` of its JSON.
    """
    found = Diagnostics()
    path = FOLDER / f"{name}.nsg"
    scene, spans = Source(path, params=given["params"]).scene(found, given["frame"])
    program = None
    if scene is not None:
        try:
            program = compile_scene(scene, spans=spans, diagnostics=found)
        except SceneError:
            program = None
    facts: dict[str, Any] = {"input": dict(given), "errors": [d.code for d in found.errors]}
    if scene is None or program is None:
        return Outcome(facts, {}, None)
    graph = lower(scene, load_manifest(program.model), None, Diagnostics())
    geometry, material = unlearned(program)
    arrays: Arrays = {
        "picture": np.asarray(reference_image(graph)),
        "geometry": program.vectors[:, geometry],
        "material": program.vectors[:, material],
    }
    if program.stage is not None:
        facts["stage"] = json.loads(json.dumps(stage_data(program.stage)))
    facts |= {
        "canvas": list(program.canvas),
        "background": None if program.background is None else list(program.background),
        "model": program.model,
        "objects": list(program.objects),
        "tokens": program.tokens.tolist(),
        "stream": stream_digest(program),
        "weights": program.weights,
        "program": program.digest(),
    }
    return Outcome(facts, arrays, graph)


def unlearned(program: Program) -> tuple[slice, slice]:
    """What of the geometry and of the material part of its vectors is not learned: all but the codes."""
    at = LAYOUTS[2 if program.stage is None else 3].places
    return slice(at.code.stop, at.texture.start), slice(at.texture.start, at.material.start)


def stream_digest(program: Program) -> str:
    """SHA-256, hex, of the stream without anything learned; README.md defines it."""
    total = hashlib.sha256()
    for name in program.objects:
        total.update(name.encode() + b"\0")
    total.update(program.tokens.astype("i1").tobytes())
    for part in unlearned(program):
        total.update(np.ascontiguousarray(program.vectors[:, part], dtype="<f4").tobytes())
    return total.hexdigest()


def is_stable(graph: Graph, by: float = 1e-9) -> bool:
    """Whether moving all samples, or the eye, by a little changes nothing that shows."""
    if graph.stage is not None:
        camera = graph.stage.camera
        eyes = (camera.eye, *(tuple(c + d for c in camera.eye) for d in (-by, by)))
        stages = (replace(graph.stage, camera=replace(camera, eye=eye)) for eye in eyes)
        seen = [np.asarray(solid_image(graph.root, stage, graph.canvas)) for stage in stages]
        return all(np.abs(picture - seen[0]).max() < 1e-5 for picture in seen)
    points = sample_points(graph.canvas, range(graph.canvas[1]), 2)
    pictures = []
    for dx, dy in ((0.0, 0.0), (by, by), (-by, by), (by, -by), (-by, -by)):
        d, c = evaluate(graph.root, points + np.array([[dx], [dy]]), brought=true_shapes(graph, None))
        pictures.append(np.where((d < 0)[:, None], c, -1.0))
    return all(np.abs(p - pictures[0]).max() < 1e-6 for p in pictures)
