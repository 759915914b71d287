"""Programs of solids: what is lifted, balls, stages in files, and blends of any width."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from scenelang.compiler.emit import emit
from scenelang.compiler.graph import Fold, Graph, Leaf, Link, Look, Move
from scenelang.compiler.lifting import LAYOUTS
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.passes import PASSES
from scenelang.compiler.program import Program, ProgramError, parse_program, program_bytes
from scenelang.compiler.rewrites import Context
from scenelang.compiler.spaces import PLANE, SPACES, Camera, Light, Stage, read_stage, stage_data
from scenelang.compiler.steps import Displace, Twist, Warp
from scenelang.compiler.weights import load_codes
from scenelang.drawing.exact.solid import Body
from scenelang.language.diagnostics import Diagnostics
from tests.drawing.solids import MIXED, Object, graph, moved, network, scaled, turned, vector

STAGE = Stage(Camera((1.0, 2.0, 5.0)), Light(power=3.0), None, (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), True)
SOLIDS, CODES = load_manifest("solids3d"), load_codes("solids3d")


def program(root: Fold, stage: Stage = STAGE) -> Program:
    stream, context = Graph(root, (64, 48), None, SPACES[3], stage), Context(SOLIDS, Diagnostics())
    for step in PASSES:
        stream = step.run(stream, context)
    assert not context.diagnostics.errors
    return emit(stream, SOLIDS, CODES)


APART = MIXED[0]._replace(steps=(Displace(0.05, 6.0), Warp(0.5, (0.0, 0.0)), Twist(0.8), turned(1.0)))


@pytest.mark.parametrize("o", [APART, *MIXED[1:]])
def test_vectors_are_those_lifted_by_hand(o: Object) -> None:
    """Where nothing trades places or shares a slot; blends of the usual width leave 0."""
    found = program(graph([o._replace(token="union")])).vectors[0]
    wanted = vector(o._replace(k=0.0), network())
    wanted[44:50] = 1, 0, 0, 0, 1, 0  # the texture's frame
    assert found == pytest.approx(wanted, abs=1e-6)


def test_balls_hold_what_a_row_changes() -> None:
    made = program(graph([*MIXED, *MIXED]))
    *centre, radius = made.bounds[0].tolist()
    leaf = Leaf("torus", Look("diffuse"), tuple(map(Move, MIXED[0].steps)))
    p = np.random.default_rng(1).uniform(-4, 4, (3, 20000))
    near = Body(leaf, leaf.steps, 9.0).distance(p)[0] < 0.6  # the k of the two blends
    assert (np.linalg.norm(p.T - centre, axis=1) <= radius)[near].all()
    assert radius < 4
    around = np.linalg.norm(made.bounds[:3, :3], axis=1) + made.bounds[:3, 3]
    assert made.bounds[3, 3] >= around.max()


def test_widths_stand_in_the_vectors() -> None:
    solid = [Object("sphere"), Object("sphere", (moved(1, 0, 0),), token="smooth", k=0.3)]
    assert program(graph(solid)).vectors[:, LAYOUTS[3].places.width].tolist() == [0.0, np.float32(0.3)]
    links = [Link(op, Leaf("square", Look("flat")), k) for op, k in (("union", 0.3), ("smooth", 0.3))]
    flat = Graph(Fold("scene", tuple(links)), (64, 64), None, PLANE)
    wide = emit(flat, load_manifest("shapes2d"), load_codes("shapes2d")).vectors
    assert wide[:, LAYOUTS[2].places.width].tolist() == [0.0, np.float32(0.3)]


def test_files_keep_the_stage() -> None:
    made = program(graph(MIXED))
    again = parse_program(program_bytes(made))
    assert again.stage == STAGE
    assert again.digest() == made.digest()
    assert program_bytes(again) == program_bytes(made)
    assert program(graph(MIXED), Stage()).digest() != made.digest()


def changed(part: str, **fields: Any) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(json.dumps(stage_data(STAGE)))
    (data if part == "" else data[part]).update(fields)
    return data


@pytest.mark.parametrize(
    "data",
    [
        None,
        [],
        {},
        changed("", more=1),
        changed("", camera=None),
        changed("", transparent=1),
        changed("", zenith=[1, 2]),
        changed("", horizon=["1", 0, 0]),
        changed("", ground={"y": 0}),
        changed("camera", eye=[float("inf"), 0, 0]),
        changed("camera", fov_rad=[1.0]),
        changed("light", power=float("nan")),
        changed("light", power=True),
    ],
)
def test_damaged_stages(data: object) -> None:
    with pytest.raises(ValueError, match=r"\w"):
        read_stage(data)


def test_stages_that_draw_nothing_are_refused() -> None:
    with pytest.raises(ProgramError, match="negative"):
        program(graph(MIXED), Stage(light=Light(power=-1.0)))


def test_chains_that_do_not_fit_are_refused() -> None:
    steps = (Warp(0.5, (0.0, 0.0)), scaled(1, 2, 3), Twist(1.0), turned(1.0), Twist(1.0), moved(1, 1, 1))
    for chain in (steps, (scaled(1, 2, 3), Displace(0.1, 2.0))):
        context = Context(SOLIDS, Diagnostics())
        stream = Graph(graph([Object("sphere", chain)]), (64, 48), None, SPACES[3], STAGE)
        for step in PASSES:
            stream = step.run(stream, context)
        assert [d.code for d in context.diagnostics] == ["E0506"]
