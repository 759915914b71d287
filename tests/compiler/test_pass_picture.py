"""Every pass keeps the picture, on random trees against the oracle."""

from __future__ import annotations

import numpy as np

from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.passes import PASSES
from scenelang.compiler.rewrites import Context
from scenelang.language.diagnostics import Diagnostics
from tests.compiler.random_scenes import blob_scene, random_scene
from tests.compiler.tree_oracle import assert_same_picture, stream_picture, tree_picture

MANIFEST = load_manifest("shapes2d")
CHECKS = {"check_eye", "check_levels", "check_seen", "check_trained"}


def compiled(scene):
    """(graph after each pass by name, diagnostics); the model's limits on deformations do not matter here."""
    diagnostics = Diagnostics()
    graph = lower(scene, MANIFEST, None, diagnostics)
    assert not diagnostics.errors
    context = Context(MANIFEST, diagnostics)
    stages = {"lower": graph}
    for step in PASSES:
        if step.name not in CHECKS:
            graph = stages[step.name] = step.run(graph, context)
    return stages, diagnostics


def window_points(graph, seed: int, count: int = 400) -> np.ndarray:
    left, bottom, right, top = graph.window()[:4]
    return np.random.default_rng(seed).uniform((left, bottom), (right, top), (count, 2))


def test_random_trees_keep_their_picture() -> None:
    accepted = covered = 0
    for seed in range(400):
        scene = random_scene(seed, warps=seed % 3 > 0)
        stages, diagnostics = compiled(scene)
        if diagnostics.errors:
            continue
        accepted += 1
        final = list(stages.values())[-1]
        points = window_points(final, seed)
        covered += assert_same_picture(tree_picture(scene, points), stream_picture(final, points))
    assert accepted > 120
    assert covered > 2000


def test_smooth_blobs_keep_their_picture() -> None:
    """Two composites in one stream, and rows off the canvas, where `smooth` reaches beyond each leaf."""
    accepted = 0
    for seed in range(240):
        scene = blob_scene(seed)
        stages, diagnostics = compiled(scene)
        if diagnostics.errors:
            continue
        accepted += 1
        final = list(stages.values())[-1]
        points = window_points(final, seed)
        assert_same_picture(tree_picture(scene, points), stream_picture(final, points))
    assert accepted > 60


def test_passes_are_idempotent() -> None:
    for seed in range(6000, 6050):
        stages, diagnostics = compiled(random_scene(seed))
        if diagnostics.errors:
            continue
        for step in PASSES:
            if step.name not in CHECKS:
                once = stages[step.name]
                assert step.run(once, Context(MANIFEST, Diagnostics())) == once, step.name
