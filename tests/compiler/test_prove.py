"""Passes keep the exact picture of 1,000 random scenes at every sample (a part of them by default)."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

import pytest

import scenelang as nsg
from scenelang.compiler.graph import Fold, Graph
from scenelang.compiler.passes import PASSES, Pass
from scenelang.compiler.rewrites import Context
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.words import TOKENS
from tests.compiler import prove as module
from tests.compiler.prove import CHECKS, MOST, Proof, prove, stages
from tests.compiler.random_scenes import blob_scene, full_scene

RECORD = Path(__file__).parents[2] / "docs/results/passes.json"
WORKING = [step.name for step in PASSES if step.name not in CHECKS]


def holds(proof: Proof, scenes: int) -> None:
    assert not proof.failures
    assert proof.scenes == scenes
    assert proof.covered > 0.05 * proof.samples
    assert all(proof.words.values())
    assert proof.groups > scenes // 5
    assert proof.aside < 1e-3 * proof.samples
    for name in WORKING:
        assert proof.passes[name].changed >= scenes // 50, name
    for name in CHECKS:
        assert proof.passes[name].changed == 0


def test_passes_keep_the_picture() -> None:
    holds(prove(50), 50)


@pytest.mark.slow
def test_passes_keep_the_picture_of_a_thousand_scenes() -> None:
    holds(prove(1000), 1000)


def test_the_recorded_run_is_whole() -> None:
    record = json.loads(RECORD.read_text("utf-8"))
    assert record["scenes"] >= 1000
    assert record["failures"] == []
    # `check_eye` looks at solids alone, and the record is of flat scenes; `check_seen` came after it
    later = {"check_eye", "check_seen"}
    recorded = [name for name in record["passes"] if name not in later]
    assert recorded == [step.name for step in PASSES if step.name not in later]
    assert all(record["words"][word] > 100 for word in TOKENS)
    assert record["groups"] > 100
    for name in WORKING:
        tally = record["passes"][name]
        assert tally["changed"] > 0
        assert tally["differing"] == 0
        assert tally["largest"] < MOST


def without_last(graph: Graph, context: Context) -> Graph:
    """A wrong pass: the last row goes, seen or not."""
    links = graph.root.links[:-1]
    return graph.rooted(Fold("scene", links))


def test_a_wrong_pass_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PASSES", (*PASSES, Pass(without_last)))
    failures = prove(20).failures
    assert failures
    assert all("without_last" in line for line in failures)


def test_smooth_blobs_keep_their_picture() -> None:
    """Two composites in one stream, and rows off the canvas, where `smooth` reaches beyond each leaf."""
    proof = Proof()
    for seed in range(160):
        scene = blob_scene(seed).model_copy(update={"canvas": (40, 32)})
        with contextlib.suppress(nsg.SceneError):
            nsg.compile(scene)
            module.compare(stages(scene), seed, proof)
    assert proof.scenes > 40
    assert not proof.failures


def test_passes_are_idempotent() -> None:
    for seed in range(50):
        for name, graph in stages(full_scene(seed)):
            if name in WORKING:
                (step,) = (step for step in PASSES if step.name == name)
                assert step.run(graph, Context(module.MANIFEST, Diagnostics())) == graph, name


def test_scenes_have_what_passes_look_for() -> None:
    """Of 200 scenes some have groups, all booleans, identities, twins, and rows that nobody sees."""
    text = "".join(full_scene(seed).model_dump_json() for seed in range(200))
    for word in ("group", "chain", "union", "smooth", "subtract", "intersect", "matrix", "shear", "bend"):
        assert f'"{word}"' in text
    assert '"kind":"twirl","k":0.0' in text
    dropped = twins = 0
    for seed in range(200):
        found = dict(stages(full_scene(seed)))
        rows = [(row.leaf, row.op) for row in found["flatten"].rows()]
        twins += len(set(rows)) < len(rows)
        dropped += len(rows) > len(found["drop_hidden"].rows())
    assert twins > 5
    assert dropped > 20
