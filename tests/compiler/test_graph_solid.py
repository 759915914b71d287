"""Chains in space: what trades places, levels, and bounds, by carrying points back after the definition."""

from __future__ import annotations

import random

import numpy as np
import pytest

from scenelang.compiler import steps as affine
from scenelang.compiler.chain import LevelsError, merged, normal, slots, split_levels
from scenelang.compiler.graph import Leaf, Look, Move
from scenelang.compiler.lifting import SOLID_LAYOUT, lift_many
from scenelang.compiler.spaces import SPACES
from scenelang.compiler.steps import IDENTITY, Affine, Displace, Step, Twist, Warp
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.exact.solid import Body
from scenelang.drawing.solid.passes import read_solid_frame

SOLID = SPACES[3]
LIMITS = {"inner_warps": 2, "outer_warps": 2}
CODE = (0.5, -1.0, 2.0, 3.0)


def back(steps: list[Step], p: np.ndarray) -> np.ndarray:
    """World points (3, M) carried back through a chain, by the definition."""
    for step in reversed(steps):
        if isinstance(step, Affine):
            rows = np.reshape(step.rows, (3, 4))
            p = np.linalg.solve(rows[:, :3], p - rows[:, 3:])
        elif isinstance(step, Warp | Twist):
            j, a = 2, p[1]
            if isinstance(step, Warp):
                j, a = 1, step.twirl * np.linalg.norm(p, axis=0) + step.bend[0] * p[0]
            else:
                a = step.twist * a
            q = p.copy()
            q[0], q[j] = np.cos(a) * p[0] + np.sin(a) * p[j], np.cos(a) * p[j] - np.sin(a) * p[0]
            p = q
    return p


def random_step(rng: random.Random) -> Step:
    k = rng.uniform(-1.5, 1.5)
    s = rng.uniform(0.5, 1.4)
    y = (0.0, rng.choice([1.0, -1.0]), 0.0)
    maps = (
        affine.rotation(k),
        affine.rotation(k, y),
        affine.rotation(rng.choice([np.pi, np.pi / 2]), rng.choice([(1.0, 0, 0), y, (0.0, 0, 1.0)])),
        affine.scaling(s, s, s),
        affine.scaling(-s, s, rng.choice([-s, s, 0.7])),
        affine.scaling(s, 0.7, rng.choice([s, -s])),
        affine.translation(*(rng.choice([0.0, k]) for _ in range(3))),
        affine.rotation(k, (1.0, 2.0, -1.0)),
    )
    turns = Warp(k, (0.0, 0.0)), Warp(0.0, (k, 0.0)), Twist(k), Twist(-k)
    return Affine(rng.choice(maps)) if rng.random() < 0.5 else rng.choice(turns)


def steps_of(moves: tuple[Move, ...]) -> list[Step]:
    return [move.step for move in moves]


@pytest.mark.parametrize(
    ("rows", "turn", "wanted"),
    [
        (affine.rotation(0.8), Warp(0.7, (0, 0)), Warp(0.7, (0, 0))),
        (affine.scaling(2, 2, 2), Warp(0.7, (0.3, 0)), Warp(1.4, (0.6, 0))),
        (affine.scaling(-2, 2, 2), Warp(0.7, (0, 0)), Warp(-1.4, (0, 0))),
        (affine.scaling(2, 2, 5), Warp(0.0, (0.3, 0)), Warp(0.0, (0.6, 0))),
        (affine.scaling(2, 2, 5), Warp(0.7, (0, 0)), None),
        (affine.rotation(0.8), Warp(0.0, (0.3, 0)), None),
        (affine.rotation(0.8, (0, 1, 0)), Warp(0.7, (0, 0)), None),
        (affine.translation(0, 0, 1), Warp(0.0, (0.3, 0)), Warp(0.0, (0.3, 0))),
        (affine.translation(0, 0, 1), Warp(0.3, (0.0, 0)), None),
        (affine.rotation(0.8, (0, 1, 0)), Twist(0.7), Twist(0.7)),
        (affine.scaling(3, 2, 3), Twist(0.7), Twist(1.4)),
        (affine.scaling(3, 2, -3), Twist(0.7), Twist(-1.4)),
        (affine.translation(0, 1, 0), Twist(0.7), None),
        (affine.scaling(3, 2, 1), Twist(0.7), None),
    ],
)
def test_what_trades_places(rows: affine.Rows, turn: Warp | Twist, wanted: Warp | Twist | None) -> None:
    found = SOLID.before(rows, turn)
    assert (found is None) == (wanted is None)
    if found is not None and wanted is not None:
        assert [found.idle, type(found)] == [False, type(wanted)]
        assert np.allclose(slots([found], 3), slots([wanted], 3))
        p = np.random.default_rng(1).uniform(-1, 1, (3, 40))
        assert np.allclose(back([found, Affine(rows)], p), back([Affine(rows), turn], p))
        again = SOLID.after(rows, found)
        assert again is not None
        assert np.allclose(slots([again], 3), slots([turn], 3))


def test_normal_form_and_levels_keep_the_map() -> None:
    rng, p = random.Random(3), np.random.default_rng(3).uniform(-1.5, 1.5, (3, 30))
    fitting = 0
    for _ in range(800):
        chain = [random_step(rng) for _ in range(rng.randrange(9))]
        short = normal(map(Move, chain), SOLID)
        wanted = back(chain, p)
        assert back(steps_of(short), p) == pytest.approx(wanted, abs=1e-8)
        assert back(steps_of(merged(map(Move, chain))), p) == pytest.approx(wanted, abs=1e-8)
        assert len(short) <= len(chain)
        try:
            levels = split_levels(steps_of(short), LIMITS, SOLID)
        except LevelsError:
            continue
        fitting += 1
        flat = [*levels.inner, Affine(levels.middle), *levels.outer, Affine(levels.affine)]
        assert back(flat, p) == pytest.approx(wanted, abs=1e-8)
        frame = read_solid_frame(lift_many([levels], [CODE], SOLID_LAYOUT)[0])
        assert frame.local(NUMPY, frame.outer(NUMPY, p)) == pytest.approx(wanted, abs=1e-3)
    assert fitting > 300


def test_the_longest_chain_fits() -> None:
    """A displacement, two deformations, a map, two deformations and a map, whatever trades places."""
    rng = random.Random(4)
    turns = Warp(0.3, (0.0, 0.0)), Warp(0.0, (0.4, 0.0)), Twist(0.5)
    bulge = Displace(0.1, 4.0)
    for _ in range(200):
        chain = [bulge, *rng.choices(turns, k=2), random_map(rng), *rng.choices(turns, k=2), random_map(rng)]
        levels = split_levels(steps_of(normal(map(Move, chain), SOLID)), LIMITS, SOLID)
        assert levels.bulge == bulge
    with pytest.raises(LevelsError, match="stand first"):
        split_levels([Affine(affine.scaling(2, 2, 2)), bulge], LIMITS, SOLID)


def random_map(rng: random.Random) -> Affine:
    while True:
        step = random_step(rng)
        if isinstance(step, Affine) and step.rows != IDENTITY:
            return step


def test_a_twist_and_a_warp_share_a_slot() -> None:
    run = [Twist(0.5), Warp(0.3, (0.0, 0.0)), Twist(0.2), Warp(0.0, (0.1, 0.0))]
    assert slots(run, 3) == [(0.3, 0.0, 0.5), (0.0, 0.1, 0.2)]
    assert len(slots(run[1:], 3)) == 2


@pytest.mark.parametrize("geometry", ["sphere", "torus"])
@pytest.mark.parametrize("level", [0.0, 0.3])
def test_boxes_and_balls_hold_leaves(geometry: str, level: float) -> None:
    rng, draw = random.Random(7), np.random.default_rng(7)
    hits = 0
    for _ in range(150):
        chain = [random_step(rng) for _ in range(rng.randrange(6))]
        if rng.random() < 0.5:
            chain.insert(0, Displace(rng.uniform(-0.3, 0.3), 4.0))
        moves = normal(map(Move, chain), SOLID)
        leaf = Leaf(geometry, Look("diffuse"), moves)
        xmin, ymin, xmax, ymax, zmin, zmax = SOLID.box(geometry, leaf.steps, level)
        low, high = np.array([xmin, ymin, zmin]), np.array([xmax, ymax, zmax])
        *centre, radius = SOLID.bound(geometry, leaf.steps, level)
        middle, half = (low + high) / 2, (high - low) / 2
        p = (middle + 1.5 * half * draw.uniform(-1, 1, (3000, 3))).T
        near = Body(leaf, leaf.steps, 10.0).distance(p)[0] < level
        hits += near.sum()
        assert (abs(p.T - middle) <= half)[near].all()
        assert (np.linalg.norm(p.T - centre, axis=1) <= radius)[near].all()
    assert hits > 5000


def test_balls_of_straight_leaves_are_tight() -> None:
    steps = (Affine(affine.scaling(0.5, 0.25, 0.5)), Affine(affine.translation(1, 2, 3)))
    assert SOLID.box("sphere", steps, 0.0) == pytest.approx((0.5, 1.75, 1.5, 2.25, 2.5, 3.5))
    assert SOLID.bound("sphere", steps, 0.0) == pytest.approx((1, 2, 3, 0.5))
    assert SOLID.bound("sphere", steps, 0.1) == pytest.approx((1, 2, 3, 0.7))
