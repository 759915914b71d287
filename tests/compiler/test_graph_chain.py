"""The algebra of chains in the plane, and boxes: by evaluating both sides, and by sampling."""

from __future__ import annotations

import itertools
import random
from dataclasses import replace
from math import cos, hypot, sin

import numpy as np
import pytest

from scenelang.compiler import steps
from scenelang.compiler import steps as affine
from scenelang.compiler.chain import Levels, LevelsError, merged, normal, split_levels
from scenelang.compiler.graph import Leaf, Look, Move, leaf_box
from scenelang.compiler.spaces import EVERYWHERE, PLANE, SPACES, Plane, flattened
from scenelang.compiler.steps import IDENTITY, Affine, Grow, Rows, Shell, Skin, Step, Warp, composed


def back(steps: list[Step], x: float, y: float) -> tuple[float, float]:
    """A world point carried back through a chain, by the definition."""
    for step in reversed(steps):
        if isinstance(step, Warp):
            a = step.twirl * hypot(x, y) + step.bend[0] * x + step.bend[1] * y
            x, y = cos(a) * x + sin(a) * y, -sin(a) * x + cos(a) * y
        else:
            a, b, _, u, c, d, _, v, *_ = step.rows
            x, y, det = x - u, y - v, a * d - b * c
            x, y = (d * x - b * y) / det, (a * y - c * x) / det
    return x, y


def random_step(rng: random.Random) -> Step:
    kind = rng.randrange(8)
    k = rng.uniform(-1.5, 1.5)
    if kind == 0:
        return Warp(k, (0.0, 0.0))
    if kind <= 2:
        return Warp(rng.choice([0.0, k]), (rng.uniform(-1, 1), rng.choice([0.0, k])))
    if kind == 3:
        return Affine(affine.rotation(k))
    if kind == 4:
        return Affine(affine.scaling(-1.3, 1.3))
    if kind == 5:
        return Affine(affine.scaling(0.7, 0.7))
    if kind == 6:
        return Affine(affine.translation(k, -k))
    return Affine(affine.compose(affine.shearing("xy", 0.3), affine.scaling(0.6, 1.2)))


def same(first: list[Step], second: list[Step], rng: random.Random) -> None:
    for _ in range(20):
        x, y = rng.uniform(-1.5, 1.5), rng.uniform(-1.5, 1.5)
        assert back(first, x, y) == pytest.approx(back(second, x, y), abs=1e-9)


def steps_of(moves: tuple[Move, ...]) -> list[Step]:
    return [move.step for move in moves]


def test_normal_form_keeps_the_map_and_is_one() -> None:
    rng = random.Random(3)
    for _ in range(150):
        chain = [random_step(rng) for _ in range(rng.randrange(9))]
        short = normal(map(Move, chain), PLANE)
        same(chain, steps_of(short), rng)
        same(chain, steps_of(merged(map(Move, chain))), rng)
        assert normal(short, PLANE) == short
        assert len(short) <= len(chain)


def test_what_merges_trades_places_and_vanishes() -> None:
    """The property above holds that the map stays."""
    twirl, bend = Warp(0.7, (0.0, 0.0)), Warp(0.0, (0.5, 0.0))
    grow, shrink = Affine(affine.scaling(2, 2)), Affine(affine.scaling(0.5, 0.5))
    for chain, expected in (
        ([twirl, Warp(-1.1, (0.4, 0.2))], [Warp(0.7 - 1.1, (0.4, 0.2))]),
        ([bend, bend], [bend, bend]),
        ([Warp(0.0, (0.0, 0.0))], []),
        ([grow, twirl, Warp(-0.7, (0.0, 0.0)), shrink], []),
    ):
        assert steps_of(normal(map(Move, chain), PLANE)) == expected
    for mirror in (1.0, -1.0):
        rows = affine.compose(affine.rotation(0.8), affine.scaling(0.4 * mirror, 0.4))
        first = steps_of(normal([Move(Affine(rows)), Move(Warp(0.9, (0.5, -0.3)))], PLANE))[0]
        assert isinstance(first, Warp)
        assert first.twirl == pytest.approx(mirror * 0.4 * 0.9)


LIMITS = {"inner_warps": 2, "outer_warps": 3}
STRETCH = Affine(affine.scaling(0.5, 0.8))
BENT = Warp(0.2, (0.3, 0.0))


def test_levels() -> None:
    for warps in range(6):
        levels = split_levels([BENT] * warps + [STRETCH], LIMITS)
        outer = (BENT,) * max(warps - 2, 0)
        assert levels == Levels((BENT,) * min(warps, 2), IDENTITY, outer, STRETCH.rows)
    levels = split_levels([BENT, STRETCH, BENT, BENT, STRETCH], LIMITS)
    assert levels == Levels((BENT,), STRETCH.rows, (BENT, BENT), STRETCH.rows)
    assert split_levels([STRETCH, BENT], LIMITS) == Levels((), STRETCH.rows, (BENT,), IDENTITY)
    assert split_levels([], LIMITS) == Levels()
    for chain in (
        [BENT] * 6,
        [BENT] * 3 + [STRETCH, BENT],
        [BENT, STRETCH] + [BENT] * 4,
        [BENT, STRETCH, BENT, STRETCH, BENT],
        [STRETCH, BENT, STRETCH, BENT, STRETCH],
    ):
        with pytest.raises(LevelsError):
            split_levels(chain, LIMITS)


def test_levels_keep_the_map() -> None:
    rng = random.Random(4)
    kept = 0
    while kept < 60:
        chain = [random_step(rng) for _ in range(rng.randrange(7))]
        try:
            levels = split_levels(steps_of(normal(map(Move, chain), PLANE)), LIMITS)
        except LevelsError:
            continue
        kept += 1
        flat = [*levels.inner, Affine(levels.middle), *levels.outer, Affine(levels.affine)]
        same(chain, flat, rng)


def test_what_is_singular() -> None:
    for rows, usable in (
        (affine.scaling(1, 1e-11), True),
        (affine.scaling(1, 1e-13), False),
        (affine.scaling(1e-20, 1e-20), True),
        (affine.scaling(1e-31, 1e-31), False),
        (affine.scaling(1e31, 1e31), False),
        (affine.scaling(0, 0), False),
        (affine.translation(1e29, 0), True),
        ((0.1, 0.2, 0, 0, 0.3, 0.6, 0, 0, 0, 0, 1, 0), False),
        ((float("nan"), 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0), False),
        ((1, 0, 0, float("inf"), 0, 1, 0, 0, 0, 0, 1, 0), False),
    ):
        assert PLANE.usable(rows) is usable, rows


RNG = np.random.default_rng(11)
MAPS = [tuple(RNG.normal(size=12).tolist()) for _ in range(20)]
SOLID = SPACES[3]


def matrix(rows: Rows) -> np.ndarray:
    return np.vstack([np.array(rows).reshape(3, 4), [0, 0, 0, 1]])


def random_turn(plane: bool = False) -> Rows:
    """A rotation by a random angle, about a random axis or about z."""
    axis = (0.0, 0.0, 1.0) if plane else tuple(RNG.normal(size=3).tolist())
    return steps.rotation(float(RNG.uniform(-4, 4)), axis)


def test_maps_compose_and_invert_as_matrices_do() -> None:
    for outer, inner in itertools.pairwise(MAPS):
        np.testing.assert_allclose(matrix(steps.compose(outer, inner)), matrix(outer) @ matrix(inner))
        flat = matrix(flattened(outer))
        np.testing.assert_array_equal(flat[:2][:, [0, 1, 3]], matrix(outer)[:2][:, [0, 1, 3]])
        np.testing.assert_array_equal(flat[2], [0, 0, 1, 0])
        np.testing.assert_array_equal(flat[:2, 2], [0, 0])
        disc = Plane().disc("square", (Affine(flattened(outer)),))
        assert disc is not None
        np.testing.assert_allclose(matrix(disc[1]), np.linalg.inv(flat), rtol=1e-9, atol=1e-12)


def test_a_rotation_is_the_exponential_of_its_axis() -> None:
    for _ in range(20):
        axis, angle = RNG.normal(size=3), float(RNG.uniform(-4, 4))
        x, y, z = axis / np.linalg.norm(axis)
        turn = angle * np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        term, total = np.eye(3), np.eye(3)
        for n in range(1, 60):
            term = term @ turn / n
            total = total + term
        found = matrix(steps.rotation(angle, tuple(axis.tolist())))
        np.testing.assert_allclose(found[:3, :3], total, atol=1e-10)
        np.testing.assert_array_equal(found[:3, 3], 0)


def test_scales_shifts_and_shears() -> None:
    np.testing.assert_array_equal(matrix(steps.scaling(2, 3, 5)), np.diag([2, 3, 5, 1]))
    np.testing.assert_array_equal(matrix(steps.translation(2, 3, 5))[:, 3], [2, 3, 5, 1])
    np.testing.assert_array_equal(matrix(steps.translation(2, 3, 5))[:, :3], np.eye(4)[:, :3])
    for row, column in itertools.permutations(range(3), 2):
        expected = np.eye(4)
        expected[row, column] = 0.7
        np.testing.assert_array_equal(matrix(steps.shearing("xyz"[row] + "xyz"[column], 0.7)), expected)


@pytest.mark.parametrize("ratio", [1.0, 1e-3, 1e-6])
def test_stretches_of_maps_made_of_known_ones(ratio: float) -> None:
    for _ in range(20):
        scales = steps.scaling(2.0, 2.0 * ratio, 2.0 * ratio**0.5)
        rows = steps.compose(random_turn(), steps.compose(scales, random_turn()))
        assert SOLID.stretches(rows) == pytest.approx((2.0 * ratio, 2.0), rel=1e-6)
        scales = steps.scaling(-2.0, 2.0 * ratio, 9.0)
        rows = steps.compose(random_turn(True), steps.compose(scales, random_turn(True)))
        assert PLANE.stretches(rows) == pytest.approx((2.0 * ratio, 2.0), rel=1e-6)
    for space in (PLANE, SOLID):
        assert space.stretches(steps.scaling(0, 0, 0)) == (0, 0)


def test_what_is_a_similarity() -> None:
    """As it shows in what a twirl of 1 becomes before the map."""

    def twirl(rows: Rows) -> float | None:
        result = PLANE.before(rows, Warp(1.0, (0.0, 0.0)))
        return None if result is None else result.twirl

    for _ in range(20):
        rows = steps.compose(random_turn(True), steps.scaling(0.3, 0.3))
        assert twirl(rows) == pytest.approx(0.3)
        assert twirl(steps.compose(rows, steps.scaling(-1, 1))) == pytest.approx(-0.3)
        assert twirl(steps.compose(steps.translation(1e-14, -1e-14), rows)) == pytest.approx(0.3)
        for other in (
            *(steps.translation(x, y) for x, y in ((1e-3, 0), (0, 1e-3), (-1e-3, 0), (0, -1e-11))),
            *(steps.scaling(x, y) for x, y in ((1, 1.001), (1.001, 1), (-1, 1.001))),
            *(steps.shearing(axes, 1e-3) for axes in ("xy", "yx")),
        ):
            assert twirl(steps.compose(other, rows)) is None


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
        if isinstance(step, Grow | Shell):
            continue
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
    for _ in range(50):
        own = [Grow(rng.uniform(0.0, 1.0)), Shell(rng.uniform(0.1, 1.0))][: rng.randrange(3)]
        chain = [*own, *(random_step(rng) for _ in range(rng.randrange(6)))]
        moves = normal(map(Move, chain), PLANE)
        block = np.array(composed(move.step for move in moves)).reshape(3, 4)[:2, :2]
        reach = level / np.linalg.svd(block, compute_uv=False)[-1] + Skin.of(own).reach
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
    for _ in range(90):
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
