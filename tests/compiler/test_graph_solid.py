"""Chains in space, the stage, and the table of geometries, by their definitions."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from scenelang.compiler import spaces
from scenelang.compiler import steps as affine
from scenelang.compiler.chain import LevelsError, merged, normal, slots, split_levels
from scenelang.compiler.geometries import GEOMETRIES
from scenelang.compiler.graph import Leaf, Look, Move
from scenelang.compiler.groups import read_groups
from scenelang.compiler.lifting import SOLID_LAYOUT, lift_many
from scenelang.compiler.spaces import SPACES, Camera, Ground, Light, Stage, decoded
from scenelang.compiler.steps import IDENTITY, Affine, Displace, Grow, Shell, Skin, Step, Twist, Warp
from scenelang.drawing.exact.solid import ExactBody
from scenelang.drawing.tables import MAP, TURN_Z, Objects, read_objects
from scenelang.language import words

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


def at_leaf(objects: Objects, p: np.ndarray) -> np.ndarray:
    """Leaf coordinates of points (3, M) by the table of an object."""

    def mapped(numbers: np.ndarray, q: np.ndarray) -> np.ndarray:
        return np.asarray(numbers[:9].reshape(3, 3) @ q + numbers[9:, None])

    q = mapped(objects.rows["map"][0], p)
    for step in objects.steps:
        if step["kind"] == MAP:
            q = mapped(step["map"], q)
            continue
        j = 1 if step["kind"] == TURN_Z else 2
        angle = step["rate"] * q[j - 1] + step["twirl"] * np.linalg.norm(q, axis=0)
        turn = np.exp(-1j * angle) * (q[0] + 1j * q[j])
        q = np.array([turn.real, q[1], turn.imag] if j == 2 else [turn.real, turn.imag, q[2]])
    return q


def test_normal_form_and_levels_keep_the_map() -> None:
    rng, p = random.Random(3), np.random.default_rng(3).uniform(-1.5, 1.5, (3, 30))
    fitting = 0
    for _ in range(250):
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
        vectors = lift_many([levels], [CODE], SOLID_LAYOUT)
        objects = read_objects(vectors, SOLID_LAYOUT, read_groups(np.zeros(1, np.int8)), np.zeros(1))
        assert at_leaf(objects, p) == pytest.approx(wanted, abs=1e-3)
    assert fitting > 90


def test_the_longest_chain_fits() -> None:
    """What changes the leaf's distance, two deformations, a map, and both again, whatever trades places."""
    rng = random.Random(4)
    turns = Warp(0.3, (0.0, 0.0)), Warp(0.0, (0.4, 0.0)), Twist(0.5)
    own = Shell(0.2), Displace(0.1, 4.0), Grow(0.3)
    for _ in range(80):
        chain = [*own, *rng.choices(turns, k=2), random_map(rng), *rng.choices(turns, k=2), random_map(rng)]
        levels = split_levels(steps_of(normal(map(Move, chain), SOLID)), LIMITS, SOLID)
        assert levels.skin == Skin(0.3, 0.2, 3, 0.1, 4.0)
    with pytest.raises(LevelsError, match="stand first"):
        split_levels([Affine(affine.scaling(2, 2, 2)), own[0]], LIMITS, SOLID)


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
    for _ in range(50):
        chain = [random_step(rng) for _ in range(rng.randrange(6))]
        own = [Displace(rng.uniform(-0.3, 0.3), 4.0), Grow(rng.uniform(-0.2, 1)), Shell(rng.uniform(0.1, 1))]
        chain = rng.sample(own, rng.randrange(3)) + chain
        moves = normal(map(Move, chain), SOLID)
        leaf = Leaf(geometry, Look("diffuse"), moves)
        xmin, ymin, xmax, ymax, zmin, zmax = SOLID.box(geometry, leaf.steps, level)
        low, high = np.array([xmin, ymin, zmin]), np.array([xmax, ymax, zmax])
        *centre, radius = SOLID.bound(geometry, leaf.steps, level)
        middle, half = (low + high) / 2, (high - low) / 2
        p = (middle + 1.5 * half * draw.uniform(-1, 1, (3000, 3))).T
        near = ExactBody(leaf, leaf.steps, 10.0).distance(p)[0] < level
        hits += near.sum()
        assert (abs(p.T - middle) <= half)[near].all()
        assert (np.linalg.norm(p.T - centre, axis=1) <= radius)[near].all()
    assert hits > 1500


def test_balls_of_straight_leaves_are_tight() -> None:
    steps = (Affine(affine.scaling(0.5, 0.25, 0.5)), Affine(affine.translation(1, 2, 3)))
    assert SOLID.box("sphere", steps, 0.0) == pytest.approx((0.5, 1.75, 1.5, 2.25, 2.5, 3.5))
    assert SOLID.bound("sphere", steps, 0.0) == pytest.approx((1, 2, 3, 0.5))
    assert SOLID.bound("sphere", steps, 0.1) == pytest.approx((1, 2, 3, 0.7))


def test_axes_of_the_camera() -> None:
    for eye, right, up in (
        ((0, 0, 6), (1, 0, 0), (0, 1, 0)),
        ((6, 0, 0), (0, 0, -1), (0, 1, 0)),
        ((0, 5, 0), (1, 0, 0), (0, 0, -1)),
        ((0, -5, 0), (-1, 0, 0), (0, 0, -1)),
        ((3e-16, 5, 0), (1, 0, 0), (0, 0, -1)),
    ):
        forward, *found = Camera(eye=eye).axes()
        np.testing.assert_allclose(found, (right, up), atol=1e-12)
        np.testing.assert_allclose(np.cross(found[0], forward), found[1], atol=1e-12)


def test_axes_are_orthonormal_wherever_the_camera_stands() -> None:
    for eye in np.random.default_rng(1).normal(size=(50, 3)).tolist():
        axes = np.array(Camera(eye=tuple(eye), target=(0.1, -0.2, 0.3)).axes())
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert axes[2, 1] > 0  # up is up


def test_faults() -> None:
    for value, fault in (
        (Camera(), None),
        (Camera(eye=(1, 2, 3), target=(1, 2, 3)), "the eye is the target"),
        (Camera(fov_rad=0.0), "a field of view of 0° is not between 0° and 180°"),
        (Camera(fov_rad=math.radians(180)), "a field of view of 180° is not between 0° and 180°"),
        (Camera(fov_rad=math.nan), "a field of view of nan° is not between 0° and 180°"),
        (Light(power=0.0), None),
        (Light(power=-2.0), "a power of -2 is negative"),
    ):
        part = {"camera": value} if isinstance(value, Camera) else {"lights": (value,)}
        assert Stage(**part).fault() == fault


def test_colours_are_decoded_from_srgb() -> None:
    # 188/255 is the 8-bit value nearest to half of the light.
    assert decoded((0.0, 188 / 255, 1.0)) == pytest.approx((0.0, 0.5029, 1.0), abs=1e-4)
    assert decoded((0.04, 0.0404, 0.0405))[0] == pytest.approx(0.04 / 12.92)


def test_constants_are_those_of_the_language() -> None:
    """Other tests draw with whatever they are."""
    camera, light = Camera((0, 1.2, 6), (0, 0, 0), math.radians(36.8699)), Light((2.5, 4, 3), 28, (1, 1, 1))
    written = Stage(camera, (light,), Ground(-1, (0.50, 0.48, 0.45)), (0.80, 0.86, 0.92), (0.30, 0.50, 0.85))
    assert Stage() == replace(written, camera=replace(camera, fov_rad=Camera().fov_rad))
    assert Camera().fov_rad == pytest.approx(camera.fov_rad, abs=1e-6)
    assert (spaces.AMBIENT, spaces.EXTINCTION, spaces.FADE) == ((0.12, 0.06), 3, 8)
    assert (spaces.NEAREST, spaces.LIFT) == (1e-3, 1e-4)


SOLID_OF_GEOMETRIES, FLAT = words.LEAVES[3], words.LEAVES[2]
RNG = np.random.default_rng(1)


def test_every_geometry_of_the_language_has_a_row() -> None:
    assert GEOMETRIES.keys() == words.GEOMETRIES.keys()


@pytest.mark.parametrize("name", GEOMETRIES)
def test_bounds_hold_the_leaf(name: str) -> None:
    row, d = GEOMETRIES[name], 2 if name in FLAT else 3
    p = RNG.uniform(-1.1, 1.1, (d, 20_000))
    inside = p[:, row.distance(p) < 0]
    assert np.linalg.norm(inside, axis=0).max() <= 1.0
    assert (row.distance(p[:, np.linalg.norm(p, axis=0) < row.inner]) < 0).all()
    if d == 3:
        assert (abs(inside).max(1) <= row.half).all()
    for (ax, ay), (bx, by) in zip(row.corners, (*row.corners[1:], *row.corners[:1]), strict=True):
        left = (bx - ax) * (inside[1] - ay) - (by - ay) * (inside[0] - ax)
        assert (left > -1e-12).all()


@pytest.mark.parametrize("name", SOLID_OF_GEOMETRIES)
def test_gradients_are_those_of_the_distance(name: str) -> None:
    row = GEOMETRIES[name]
    assert row.slopes is not None
    p, step = RNG.uniform(-1, 1, (3, 1000)), 1e-6
    d, *slopes = row.slopes(p)
    np.testing.assert_allclose(d, row.distance(p))
    for axis, slope in enumerate(slopes):
        move = step * np.eye(3)[:, axis, None]
        change = (row.distance(p + move) - row.distance(p - move)) / (2 * step)
        assert (abs(slope - change) < 1e-3).mean() > 0.999  # the others lie at a crease
    assert row.distance([0.1, 0.2, 0.3]) == pytest.approx(row.distance(np.array([[0.1], [0.2], [0.3]]))[0])
    assert row.thickness <= 2 * min(row.half) + 1e-12


LEVELS: dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = {
    "disc": lambda x, y, z: np.hypot(x, y) - 1,
    "hexagon": lambda x, y, z: np.maximum(abs(x), abs(x) / 2 + abs(y) * 3**0.5 / 2) - 3**0.5 / 2,
    "box": lambda x, y, z: np.maximum(np.maximum(abs(x), abs(y)), abs(z)) - 3**-0.5,
    "cylinder": lambda x, y, z: np.maximum(np.hypot(x, z), abs(y)) - 2**-0.5,
    "cone": lambda x, y, z: np.maximum(np.hypot(x, z) - (1 - y) * 3**-0.5, -0.5 - y),
    "capsule": lambda x, y, z: np.sqrt(x * x + (y - y.clip(-0.5, 0.5)) ** 2 + z * z) - 0.5,
    "octahedron": lambda x, y, z: abs(x) + abs(y) + abs(z) - 1,
}
"""Something that is below 0 in a leaf, and 0 on its outline, as the language defines it."""


@pytest.mark.parametrize("name", LEVELS)
def test_distances_are_to_the_shape_that_the_language_defines(name: str) -> None:
    """A point as far as the distance says is on the outline, and no nearer one can be, as the distances of
    two points differ by no more than these are apart.
    """
    row, d = GEOMETRIES[name], 2 if name in FLAT else 3
    p, q = RNG.uniform(-2, 2, (2, d, 20_000))
    if d == 3:
        assert row.slopes is not None
        distance, *gradient = map(np.asarray, row.slopes(p))
    else:
        step, distance = 1e-6, row.distance(p)
        moves = step * np.eye(2)[:, :, None]
        gradient = [(row.distance(p + move) - row.distance(p - move)) / (2 * step) for move in moves]
    inside = LEVELS[name](*p, *[0 * p[0]] * (3 - d)) < 0
    assert ((distance < 0) == inside).all()
    feet = p - distance * np.array(gradient)
    off = abs(LEVELS[name](*feet, *[0 * p[0]] * (3 - d)))
    assert np.percentile(off, 99.9) < 1e-8  # the others lie between two nearest points
    np.testing.assert_allclose(distance, row.distance(p), atol=1e-12)
    assert (abs(distance - row.distance(q)) <= np.linalg.norm(p - q, axis=0) + 1e-12).all()
