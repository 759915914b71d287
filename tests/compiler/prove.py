"""Hold every pass to the exact picture on random scenes, at every sample of a small canvas.

python -m tests.compiler.prove --scenes 1000 --out docs/results/passes.json

The reference draws the graph before and after each pass. Samples count where no outline of a leaf or of the
whole is within `EDGE`, as the language has it. Scenes of less than two objects and those that cover less
than `LEAST` of the samples are drawn again.
"""

from __future__ import annotations

import argparse
import json
import platform
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from scenelang.assets.files import write_whole
from scenelang.compiler.graph import Graph, Leaf
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.passes import PASSES
from scenelang.compiler.rewrites import Context
from scenelang.compiler.steps import Step
from scenelang.drawing.exact.field import carry_back, distance_scale, evaluate, leaf_distance, sample_points
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import Scene
from scenelang.language.words import TOKENS
from scenelang.output.frontier import stages as sizes
from tests.compiler.random_scenes import full_scene

EDGE = 1e-9  # world units
LEAST = 0.01
MOST = 1e-7  # of a colour in [0, 1]: what rounding may change
# these report, and never change a graph
CHECKS = {"check_eye", "check_levels", "check_media", "check_seen", "check_trained"}
MANIFEST = load_manifest("shapes2d")


@dataclass(slots=True)
class Tally:
    """Effects of a pass on the scenes."""

    changed: int = 0  # scenes
    objects: int = 0  # taken away, as matrices and folds
    matrices: int = 0
    folds: int = 0
    differing: int = 0  # samples that are covered before and not after, or the other way round
    largest: float = 0.0  # difference of a colour at a covered sample


@dataclass(slots=True)
class Proof:
    """Counts over all scenes, of objects and matrices as written, and results by pass."""

    scenes: int = 0
    bare: int = 0  # scenes that showed too little, drawn again
    samples: int = 0
    covered: int = 0
    aside: int = 0  # samples within `EDGE` of an outline
    objects: int = 0
    matrices: int = 0
    words: dict[str, int] = field(default_factory=lambda: dict.fromkeys(TOKENS, 0))
    groups: int = 0
    passes: dict[str, Tally] = field(default_factory=lambda: {step.name: Tally() for step in PASSES})
    # seed and pass where a picture changed
    failures: list[str] = field(default_factory=list)


def stages(scene: Scene) -> list[tuple[str, Graph]]:
    """The graph as lowered and after each pass.

    Checks report what a model cannot draw, which does not matter here.
    """
    diagnostics = Diagnostics()
    graph = lower(scene, MANIFEST, None, diagnostics)
    assert not diagnostics.errors
    found = [("lower", graph)]
    for step in PASSES:
        graph = step.run(graph, Context(MANIFEST, Diagnostics() if step.name in CHECKS else diagnostics))
        found.append((step.name, graph))
    assert not diagnostics.errors
    return found


def nearest_outline(graph: Graph, p: np.ndarray) -> np.ndarray:
    """World distance (M,) of points (2, M) to the outline of the nearest leaf, drawn or not."""
    nearest = np.full(p.shape[1], np.inf)

    def leaves(node: Any, outer: tuple[Step, ...]) -> Iterator[tuple[Leaf, tuple[Step, ...]]]:
        steps = (*(move.step for move in node.moves), *outer)
        if isinstance(node, Leaf):
            yield node, steps
        else:
            for link in node.links:
                yield from leaves(link.node, steps)

    for leaf, steps in leaves(graph.root, ()):
        d = leaf_distance(leaf.geometry, carry_back(steps, p)) * distance_scale(steps)
        nearest = np.minimum(nearest, np.abs(d))
    return nearest


def prove(scenes: int, first: int = 0) -> Proof:
    """Compile so many random scenes, from a seed on, and compare the pictures around every pass."""
    proof = Proof()
    seed = first
    while proof.scenes < scenes:
        compare(stages(full_scene(seed)), seed, proof)
        seed += 1
    return proof


def compare(found: list[tuple[str, Graph]], seed: int, proof: Proof) -> None:
    graph = found[0][1]
    _, height = graph.canvas
    points = sample_points(graph.canvas, range(height), 2)
    distance, colour = evaluate(graph.root, points)
    clear = nearest_outline(graph, points) > EDGE
    size, *smaller = sizes(dict(found))
    covered = int((distance < 0).sum())
    if size["objects"] < 2 or covered < LEAST * len(distance):
        proof.bare += 1
        return
    proof.scenes += 1
    proof.samples += len(distance)
    proof.covered += covered
    proof.aside += int((~clear).sum())
    proof.objects += size["objects"]
    proof.matrices += size["matrices"]
    for row in found[-1][1].rows():
        proof.words[row.op] += 1
        proof.groups += row.begins
    for (name, after), less in zip(found[1:], smaller, strict=True):
        if not less["changed"]:
            continue  # the same graph has the same picture
        tally = proof.passes[name]
        tally.changed += 1
        tally.objects += size["objects"] - less["objects"]
        tally.matrices += size["matrices"] - less["matrices"]
        tally.folds += size["folds"] - less["folds"]
        size = less
        now, painted = evaluate(after.root, points)
        look = clear & (np.abs(distance) > EDGE) & (np.abs(now) > EDGE)
        differing = int(((distance < 0) != (now < 0))[look].sum())
        largest = float(np.abs(colour - painted)[look & (distance < 0) & (now < 0)].max(initial=0.0))
        tally.differing += differing
        tally.largest = max(tally.largest, largest)
        if differing or not largest < MOST:
            proof.failures.append(f"seed {seed}, {name}: {differing} samples, colour by {largest:.2g}")
        distance, colour = now, painted


def main() -> None:
    """Prove, print and record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0, help="of the first scene")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    proof = prove(arguments.scenes, arguments.seed)
    for name, tally in proof.passes.items():
        print(f"{name:16} changed {tally.changed:5,}, largest difference {tally.largest:.2g}")
    print(*proof.failures, sep="\n")
    if arguments.out is not None:
        record = {"seed": arguments.seed, "machine": platform.machine(), "edge": EDGE, **asdict(proof)}
        write_whole(arguments.out, (json.dumps(record, indent=1) + "\n").encode())
    raise SystemExit(bool(proof.failures))


if __name__ == "__main__":
    main()
