"""Boxes contain what they say, by sampling; the grid finds what a plain loop finds."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest

from scenelang.compiler import steps as affine
from scenelang.compiler.chain import normal
from scenelang.compiler.graph import Leaf, Look, Move, leaf_box
from scenelang.compiler.spaces import EVERYWHERE, PLANE, SPACES
from scenelang.compiler.steps import Affine, Step, Warp, composed
from tests.compiler.test_graph_chain import random_step

CORNERS = {
    "square": np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) / np.sqrt(2),
    "triangle": np.array([[0, 1], [-np.sqrt(0.75), -0.5], [np.sqrt(0.75), -0.5]]),
}


def hull_points(name: str, reach: float, rng: np.random.Generator) -> np.ndarray:
    """Points of the leaf dilated by ``reach``, most of them on its border."""
    corners = CORNERS[name]
    weights = rng.dirichlet(np.full(len(corners), 0.3), size=600)
    turn = rng.uniform(0, 2 * np.pi, 600)
    return weights @ corners + reach * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def forward(points: np.ndarray, steps) -> np.ndarray:
    """Leaf points into the world; a warp is undone by turning by the angle at the world point."""
    for step in steps:
        if isinstance(step, Affine):
            rows = np.array(step.rows).reshape(3, 4)
            points = points @ rows[:2, :2].T + rows[:2, 3]
            continue
        # Lengths are kept, so only the angle is unknown: iterate p = R(-angle(p)) q by bisection on phi,
        # phi = phi_q + twirl r + r |b| cos(phi - phi_b), whose right side is continuous and bounded.
        r, phi_q = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
        most, at = np.hypot(*step.bend) * r, np.arctan2(step.bend[1], step.bend[0])
        middle = phi_q + step.twirl * r
        low, high = middle - most - 1e-9, middle + most + 1e-9
        for _ in range(80):
            phi = (low + high) / 2
            above = middle + most * np.cos(phi - at) - phi > 0
            low, high = np.where(above, phi, low), np.where(above, high, phi)
        points = np.stack([r * np.cos(low), r * np.sin(low)], axis=1)
    return points


@pytest.mark.parametrize("level", [0.0, 0.15, 0.6])
@pytest.mark.parametrize("name", ["square", "triangle"])
def test_boxes_contain_the_leaf(name: str, level: float) -> None:
    rng, draw = random.Random(7), np.random.default_rng(7)
    shares = []
    for _ in range(150):
        chain = [random_step(rng) for _ in range(rng.randrange(6))]
        moves = normal(map(Move, chain), PLANE)
        block = np.array(composed(move.step for move in moves)).reshape(3, 4)[:2, :2]
        reach = level / np.linalg.svd(block, compute_uv=False)[-1]
        box = leaf_box(Leaf(name, Look("flat"), moves), level, PLANE)
        points = forward(hull_points(name, reach * (1 - 1e-9), draw), [move.step for move in moves])
        assert (points >= np.array(box[:2])).all()
        assert (points <= np.array(box[2:4])).all()
        extent = np.ptp(points, axis=0)
        shares.append(np.prod(extent) / ((box[2] - box[0]) * (box[3] - box[1])))
    assert np.median(shares) > 0.4, "boxes are far too wide"


def test_boxes_contain_leaves_that_are_bent_away_from_the_origin() -> None:
    """There a leaf is a sector of a ring, narrow enough for the direction of a bend to count."""
    rng, draw = random.Random(9), np.random.default_rng(9)
    for _ in range(300):
        chain: list[Step] = []
        for _ in range(rng.choice([1, 1, 2])):
            angle, away = rng.uniform(-4, 4), rng.uniform(0.8, 3)
            shift = affine.translation(away * np.cos(angle), away * np.sin(angle))
            size = rng.uniform(0.05, 0.4)
            chain.append(Affine(affine.compose(shift, affine.scaling(size, size * rng.uniform(0.5, 1)))))
            chain.append(Warp(rng.uniform(-0.5, 0.5), (rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5))))
        moves = normal(map(Move, chain), PLANE)
        box = leaf_box(Leaf("square", Look("flat"), moves), 0.0, PLANE)
        points = forward(hull_points("square", 0.0, draw), [move.step for move in moves])
        assert (points >= np.array(box[:2])).all()
        assert (points <= np.array(box[2:4])).all()


def test_boxes_of_straight_leaves_are_tight() -> None:
    leaf = Leaf("square", Look("flat"), (Move(Affine((0.5, 0, 0, 0.2, 0, 0.25, 0, 0, 0, 0, 1, 0))),))
    half = 2**-0.5
    expected = (0.2 - half / 2, -half / 4, 0.2 + half / 2, half / 4)
    assert leaf_box(leaf, 0.0, PLANE)[:4] == pytest.approx(expected, abs=1e-8)
    # an element is only known to lie in the unit disc
    assert leaf_box(replace(leaf, geometry="zoo.square"), 0.0, PLANE)[:4] == pytest.approx(
        (-0.3, -0.25, 0.7, 0.25), abs=1e-8
    )
    # the distance scale is 0.25, so a level of 0.1 reaches 0.4 in the leaf, 0.2 and 0.1 in the world
    wider = (expected[0] - 0.2, expected[1] - 0.1, expected[2] + 0.2, expected[3] + 0.1)
    assert leaf_box(leaf, 0.1, PLANE)[:4] == pytest.approx(wider, abs=1e-8)


def test_boxes_that_cannot_be_known() -> None:
    huge = Leaf("square", Look("flat"), (Move(Affine((1e308, 1e308, 0, 1e308, 0, 1, 0, 0, 0, 0, 1, 0))),))
    flat = Leaf("square", Look("flat"), (Move(Affine((0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0))),))
    far = Leaf(
        "star",
        Look("flat"),
        (Move(Affine((1, 0, 0, 1e308, 0, 1, 0, 1e308, 0, 0, 1, 0))), Move(Warp(1e300, (1e300, 0)))),
    )
    assert leaf_box(huge, 1.0, PLANE) == EVERYWHERE
    assert leaf_box(flat, 1.0, PLANE) == EVERYWHERE
    assert leaf_box(flat, 1.0, SPACES[3]) == EVERYWHERE
    assert leaf_box(huge, 0.0, SPACES[3]) == EVERYWHERE
    assert not any(np.isnan(leaf_box(far, 0.1, PLANE)))
