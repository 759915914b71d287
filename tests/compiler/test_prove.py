"""Passes keep the exact picture of random scenes at every sample; what is drawn over whole is dropped."""

from __future__ import annotations

import contextlib
import json
import math
import random
from pathlib import Path

import pytest

import scenelang as nsg
from scenelang.compiler.graph import Fold, Graph
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.passes import PASSES, Pass, check_scene
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
        assert proof.passes[name].changed >= max(1, scenes // 50), name
    for name in CHECKS:
        assert proof.passes[name].changed == 0


def test_passes_keep_the_picture() -> None:
    holds(prove(30), 30)


@pytest.mark.slow
def test_passes_keep_the_picture_of_a_thousand_scenes() -> None:
    holds(prove(1000), 1000)


def test_the_recorded_run_is_whole() -> None:
    record = json.loads(RECORD.read_text("utf-8"))
    assert record["scenes"] >= 1000
    assert record["failures"] == []
    # these look at solids alone, and the record is of flat scenes; `check_seen` came after it
    later = {"check_eye", "check_media", "check_seen"}
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
    failures = prove(8).failures
    assert failures
    assert all("without_last" in line for line in failures)


def test_smooth_blobs_keep_their_picture() -> None:
    """Two composites in one stream, and rows off the canvas, where `smooth` reaches beyond each leaf."""
    proof = Proof()
    for seed in range(80):
        scene = blob_scene(seed).model_copy(update={"canvas": (40, 32)})
        with contextlib.suppress(nsg.SceneError):
            nsg.compile(scene)
            module.compare(stages(scene), seed, proof)
    assert proof.scenes > 20
    assert not proof.failures


def test_passes_are_idempotent() -> None:
    for seed in range(25):
        for name, graph in stages(full_scene(seed)):
            if name in WORKING:
                (step,) = (step for step in PASSES if step.name == name)
                assert step.run(graph, Context(module.MANIFEST, Diagnostics())) == graph, name


INNER = {
    "square": math.sqrt(0.5),
    "triangle": 0.5,
    "pentagon": math.cos(math.pi / 5),
    "star": (3 - math.sqrt(5)) / 2,  # its inner corners
}
SMALL, LARGE = (
    "square { scale(0.02); rotate(7deg); translate(0.8, -0.7); }",
    "square { scale(0.1); translate(%s); }",
)


def others(geometry: str, size: float, count: int) -> str:
    """Covers of about one size, apart from what is to be covered."""
    return "".join(
        f"{geometry} {{ scale({size + i / 100}); rotate({i}rad); translate(-0.7, {i / 5 - 1}); }}"
        for i in range(count)
    )


def rows(text: str) -> int:
    graph = check_scene(nsg.loads(text), None, Diagnostics(), load_manifest("shapes2d"))
    return len(graph.root.links)


@pytest.mark.parametrize("geometry", INNER)
def test_a_disc_inside_the_cover_decides(geometry: str) -> None:
    rng, dropped, kept = random.Random(3), 0, 0
    for _ in range(80):
        size, x, y = rng.uniform(0.2, 0.6), rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)
        away, towards, small = rng.uniform(0, 0.5), rng.uniform(0, 7), rng.uniform(0.02, 0.1)
        at = f"{x + away * math.cos(towards)}, {y + away * math.sin(towards)}"
        wide = rng.uniform(1, 1.4)
        cover = f"scale({size * wide}, {size}); rotate({rng.uniform(0, 6)}rad); translate({x}, {y});"
        found = rows(f"star {{ scale({small}); translate({at}); }} {geometry} {{ twirl(0.7); {cover} }}")
        radius = size * INNER[geometry]
        if away + math.sqrt(2) * small < 0.999 * radius:
            assert found == 1
            dropped += 1
        elif away > wide * radius:
            assert found == 2
            kept += 1
    assert dropped > 5
    assert kept > 5


def test_what_covers() -> None:
    for text, count in (
        (SMALL + LARGE % "0.8, -0.7", 1),
        (LARGE % "0.8, -0.7" + SMALL, 2),  # it is drawn first, and covers nothing
        (SMALL + SMALL, 1),  # the very same place
        (SMALL + SMALL.replace("square", "star"), 2),
        (f"smooth {{ {SMALL} {LARGE % '0.8, -0.7'} }}", 2),  # a blend looks at distances
        (f"subtract {{ {LARGE % '0, 0'} {SMALL} }} {LARGE % '0.8, -0.7'}", 2),
        # eight covers are tried, the largest: one more that is smaller, and one that is larger, than it
        (SMALL + LARGE % "0.8, -0.7" + "square { scale(0.3); }" + others("star", 0.01, 8), 10),
        (SMALL + LARGE % "0.8, -0.7" + others("square", 0.2, 9), 11),
    ):
        assert rows(text) == count, text
