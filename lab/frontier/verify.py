"""Check of the promised errors on scenes that the frontier never saw."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import torch

from lab.about import Report, about, silent
from lab.evaluate import exact_of
from lab.frontier.measure import CASES, SIDE
from lab.frontier.record import Frontier
from lab.frontier.ways import ways_of
from lab.sets.scenes import scenes_of, usual_set
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.metrics import flip, over_white
from scenelang.drawing.torch_backend import open_model
from scenelang.output.frontier import error_scale

KEPT: Final = 0.95
"""Share of scenes in which a promise has to hold."""
SLOW: Final = 6
"""Scenes of the first case for ways that take over half a second a frame; the other cases have none."""


def verify(
    frontier: Frontier,
    base: str,
    scenes: int,
    seed: int,
    report: Report = silent,
    kept: Path | None = None,
) -> dict[str, Any]:
    """Draw unseen scenes by every offered point and count in how many the promised FLIP is kept.

    The ``seed`` may not be the frontier's (ValueError); exact pictures are ``kept`` in a folder. For JSON: of
    each case and point ``scenes``, ``kept`` (share), ``worst`` (FLIP over the promise); of all together
    ``drawings`` and ``kept``; and ``held``: whether every share is at least `KEPT`.
    """
    if seed == frontier.seed:
        raise ValueError(f"seed {seed} made the promises; verify with another")
    torch.set_num_threads(1)
    model, manifest = open_model(base), load_manifest(base)
    points = {p.name: p for p in frontier.points if p.offered and p.flip is not None}
    ways = [w for w in ways_of(base, 1) if w.name in points and not w.side and w.backend == "neural"]
    cases = {}
    for case in CASES:
        scene_at = scenes_of(model, case.set or usual_set(manifest), seed, SIDE)
        count = case.scenes(scenes, manifest.dimension)
        ratios: dict[str, list[float]] = {way.name: [] for way in ways}
        for index in range(count):
            scene = case.on(scene_at(index))
            exact = over_white(exact_of(scene, manifest, kept))
            scale = error_scale(scene.canvas, len(compile_scene(scene, model=base)))
            for way in ways:
                point = points[way.name]
                if point.ms.median > 500 and (case.set or case.canvas or index >= SLOW):
                    continue
                result = point.flip
                assert result is not None
                promise = result.bound * scale
                error = flip(over_white(way.prepare(scene)()), exact)
                ratios[way.name].append(error / promise if promise > 0 else (1.0 if error <= 0 else 2.0))
            report(case.name, index + 1, count)
        cases[case.name] = {
            name: {
                "scenes": len(values),
                "kept": round(sum(value <= 1.0 for value in values) / len(values), 4),
                "worst": round(max(values), 3),
            }
            for name, values in ratios.items()
            if values
        }
    rows = [row for case in cases.values() for row in case.values()]
    drawings = sum(row["scenes"] for row in rows)
    return {
        "format": 1,
        "set": usual_set(manifest),
        "seed": seed,
        "frontier_seed": frontier.seed,
        "frontier_revision": frontier.revision,
        **about(),
        "drawings": drawings,
        "kept": round(sum(row["kept"] * row["scenes"] for row in rows) / drawings, 4),
        "held": all(row["kept"] >= KEPT for row in rows),
        "cases": cases,
    }
