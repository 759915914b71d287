"""Solids: frames, field, rays, media and pictures against closed forms, differences and the reference."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from scenelang.assets.pyramid import unpacked
from scenelang.compiler.spaces import Camera, Light, Stage
from scenelang.compiler.steps import Displace, Twist, Warp
from scenelang.drawing.exact.field import combine, leaf_distance
from scenelang.drawing.exact.solid import solid_image
from scenelang.drawing.solid import draw
from scenelang.drawing.solid.draw import draw_solids
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import march
from scenelang.drawing.solid.network import EMPTY, SolidArrays, Wanted, element_box, surrounding
from scenelang.drawing.solid.passes import (
    BEGIN,
    END,
    RATE,
    SLACK,
    read_solid_frame,
)
from scenelang.language.words import TOKENS
from tests.assets.shapes import element, torus
from tests.drawing.solids import (
    LEAVES,
    MIXED,
    Object,
    everywhere,
    field,
    graph,
    moved,
    network,
    one_ball,
    scaled,
    turned,
    vector,
    weights,
)
from tests.pictures import psnr_db

rng = np.random.default_rng(7)


def test_frames_lead_back_step_by_step() -> None:
    inner = (Twist(0.8), Warp(0.5, (0.3, 0.0)), scaled(0.9, 0.7, 0.8), turned(1.0))
    steps = (*inner, Warp(-0.4, (0, 0)), moved(1, 2, 3))
    p = rng.normal(size=(3, 50))
    q = p - np.array([[1.0], [2], [3]])
    for step in reversed(steps[:-1]):
        if isinstance(step, Warp | Twist):
            if isinstance(step, Twist):
                j, a = 2, step.twist * q[1]
            else:
                j, a = 1, step.twirl * np.linalg.norm(q, axis=0) + step.bend[0] * q[0]
            new = q.copy()
            new[0], new[j] = np.cos(a) * q[0] + np.sin(a) * q[j], np.cos(a) * q[j] - np.sin(a) * q[0]
            q = new
        else:
            rows = np.reshape(step.rows, (3, 4))
            q = np.linalg.solve(rows[:, :3], q - rows[:, 3:])
    net = network()
    frame = read_solid_frame(vector(Object("torus", steps), net))
    assert frame.local(net.xp, frame.outer(net.xp, p.astype(np.float32))) == pytest.approx(q, abs=1e-4)
    assert frame.scale == pytest.approx(0.7, rel=1e-6)


@pytest.mark.parametrize("leaf", LEAVES)
def test_leaves_are_exact_near_their_surfaces(leaf: str) -> None:
    q = rng.uniform(-1.2, 1.2, (3, 20000))
    exact = leaf_distance(leaf, q)
    q, exact = q[:, abs(exact) < 0.05], exact[abs(exact) < 0.05]
    found = everywhere(field([Object(leaf)]), q.astype(np.float32), gradient=True)
    assert abs(found.distance - exact).mean() < 6e-4
    h = 1e-5
    normal = np.stack([leaf_distance(leaf, q + h * e[:, None]) - exact for e in np.eye(3)]) / h
    across = np.cross(normal, found.gradient, axis=0)
    angle = np.degrees(np.arctan2(np.linalg.norm(across, axis=0), (normal * found.gradient).sum(0)))
    assert np.median(angle) < 0.2


@pytest.mark.parametrize("token", TOKENS)
def test_the_cell_is_the_fold(token: str) -> None:
    net, n = network(), 4000
    past, own = rng.normal(size=(2, n)).astype(np.float32) * 10 ** rng.uniform(-2, 0, n).astype(np.float32)
    own[::2] = past[::2] + own[::2] / 10
    depth, paint = combine(past, np.zeros((n, 1)), own, np.ones((n, 1)), TOKENS[token])
    clear = (abs(own - past) > 3e-3) & (abs(own) > 1e-3) & (abs(past) < 2)
    for width in (0.15, 0.05, 0.6):
        scale = np.float32(width / 0.15)
        memory = np.concatenate([past[None] * scale, np.zeros((4, n), np.float32)])
        look = np.ones((4, 1), np.float32)
        for wanted, rows in ((Wanted.DISTANCE, [0]), (Wanted.KIND, [0, 4]), (Wanted.ALL, [0, 1, 2, 3, 4])):
            cell = net.cell(TOKENS[token], width)[wanted]
            found, _ = net.join(own * scale, memory[rows], look, cell, wanted)
            assert found[0] == pytest.approx(depth * scale, abs=2e-4, rel=3e-4)
            if wanted != Wanted.DISTANCE:
                assert found[-1, clear] == pytest.approx(paint[clear, 0].round(), abs=2e-3)
        assert found[1, clear] == pytest.approx(paint[clear, 0], abs=2e-3)


def test_gradients_are_those_of_the_distance() -> None:
    solids, p, h = field(MIXED), rng.uniform(-1, 1, (3, 400)).astype(np.float32), 2e-3
    found = everywhere(solids, p, gradient=True)
    steps = h * np.eye(3, dtype=np.float32)[..., None]
    slopes = [
        (everywhere(solids, p + step).distance - everywhere(solids, p - step).distance) / (2 * h)
        for step in steps
    ]
    wrong = np.linalg.norm(np.stack(slopes) - found.gradient, axis=0)
    assert np.median(wrong) < 2e-3
    assert (wrong > 0.05).mean() < 0.05  # at creases the differences see both sides


def test_objects_change_nothing_out_of_their_reach() -> None:
    """Signs, colours and kinds are those of the whole fold; so no surface is missed."""
    small = (scaled(0.3), moved(0.9, 0, 0))
    solids = field([*MIXED, Object("sphere", small, "volumetric", token="smooth")])
    origin = np.array([0.3, 1.0, 4.0], np.float32)
    p = rng.uniform(-1.5, 1.5, (3, 20000)).astype(np.float32)
    t = np.linalg.norm(p - origin[:, None], axis=0)
    met, passes = solids.passes(origin, (p - origin[:, None]) / t, t + 10)
    near = solids.meet(passes, t[met], Wanted.ALL)
    every, p = p, p[:, met]
    whole = everywhere(solids, p)
    inside = whole.distance < -1e-4
    assert ((near.distance < 0) == inside)[abs(whole.distance) > 1e-4].all()
    assert near.register[:, inside] == pytest.approx(whole.register[:, inside], abs=1e-3)
    assert inside.sum() > 500
    assert inside.sum() == (everywhere(solids, every).distance < -1e-4).sum()  # the other rays met nothing


def test_steps_pass_no_surface() -> None:
    """Along rays the distance changes at most as fast as the bound says."""
    solids = field(MIXED[:3])
    origin = np.array([0.3, 1.0, 4.0], np.float32)
    way = rng.normal(size=(3, 3000)).astype(np.float32) * 0.1 - origin[:, None]
    way /= np.linalg.norm(way, axis=0)
    t = rng.uniform(3, 5, 3000).astype(np.float32)
    met, passes = solids.passes(origin, way, t + 10)
    a, b = (everywhere(solids, (origin[:, None] + way * at)[:, met]).distance for at in (t, t + 0.02))
    begin, end, rate = passes.slots[BEGIN], passes.slots[END], passes.slots[RATE]
    assert len(met) > 1000
    inside = (begin <= t[met]) & (t[met] + 0.02 <= end)
    bound = (rate * inside).max(0)
    assert (abs(a - b) / 0.02 <= bound + 1e-3)[bound > 0].all()


@pytest.mark.parametrize(
    ("material", "canvas"), [("diffuse", (64, 64)), ("diffuse", (90, 45)), ("volumetric", (20, 16))]
)
def test_a_ball_is_drawn_as_in_closed_form(material: str, canvas: tuple[int, int]) -> None:
    stage, rgb = Stage(light=Light((2.0, 3.0, 2.5), 20.0)), (0.5, 0.5, 0.5)
    solids = field([Object("sphere", (scaled(0.8),), material, rgb)])
    exact = one_ball((0.0, 0.0, 0.0), 0.8, material == "volumetric", rgb, stage, canvas)
    assert psnr_db(draw_solids(solids, stage, canvas, samples="four")[0], exact) > 50
    assert psnr_db(draw_solids(solids, stage, canvas)[0], exact) > 48


@pytest.mark.parametrize("first", ["diffuse", "volumetric"])
@pytest.mark.parametrize("last", [*TOKENS])
def test_pictures_are_those_of_the_reference(first: str, last: str) -> None:
    """Warps, blends, holes, media and solids in one another, from a light close by."""
    small = Object(
        "torus", (scaled(0.5, 0.4, 0.5), turned(0.7), moved(0.4, 0.2, 0.4)), "volumetric", token=last
    )
    objects = [MIXED[0]._replace(material=first), MIXED[1], small, Object("sphere", (scaled(0.3),))]
    stage = Stage(light=Light((1.0, 2.5, 2.0), 12.0, (1.0, 0.9, 0.8)))
    exact = solid_image(graph(objects), stage, (48, 40))
    assert psnr_db(draw_solids(field(objects), stage, (48, 40))[0], exact) > 38


def test_tiles_and_threads_leave_no_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing but what products of matrices round, whose sizes differ."""
    mist = Object("torus", (scaled(0.8, 0.6, 0.8), moved(0.3, 0.2, 0.5)), "volumetric", (0.2, 0.4, 0.9))
    solids = field([*MIXED, mist, Object("sphere", (scaled(0.3), moved(0.8, 0, 0)), "volumetric")])
    whole, work = draw_solids(solids, Stage(), (48, 40))
    for tile, threads in ((48 * 7, 1), (48 * 11, 3)):
        monkeypatch.setattr(draw, "TILE", tile)
        found, parts = draw_solids(solids, Stage(), (48, 40), threads=threads)
        assert abs(found - whole).max() < 2e-4
        assert parts.refined == work.refined


def test_what_is_drawn_is_in_codes_and_cell() -> None:
    """Swapped codes swap shapes; random weights of the cell draw noise."""
    step = (scaled(0.8),)
    ball, ring = (draw_solids(field([Object(leaf, step)]), Stage(), (32, 32))[0] for leaf in LEAVES)
    g = vector(Object("sphere", step), network())
    g[:4] = network().codes[1]
    swapped, *_ = draw_solids(SolidField(network(), g[None], np.zeros(1, np.int8)), Stage(), (32, 32))
    assert psnr_db(swapped, ring) > 90
    assert psnr_db(swapped, ball) < 40
    noise = SolidArrays(network().config, weights())
    noise.cell_lines = rng.normal(size=noise.cell_lines.shape).astype(np.float32)
    noise.cell_gain = noise.cell_gain * 0
    drawn, good = (draw_solids(field(MIXED, net), Stage(), (32, 32))[0] for net in (noise, network()))
    assert psnr_db(drawn, good) < 30


def test_objects_meet_in_the_cell_alone() -> None:
    """A cell that takes nothing in leaves nothing, one that always does the last; tokens choose weights."""
    p = rng.uniform(-1, 1, (3, 500)).astype(np.float32)
    ball, ring = Object("sphere", (scaled(0.8),)), Object("torus", (moved(0.3, 0, 0),))
    for bias in (-1.0, 2.0):
        net = SolidArrays(network().config, weights())
        net.cell_lines, net.cell_bias = 0 * net.cell_lines, 0 * net.cell_bias + np.float32(bias)
        net.candidate = np.ones_like(net.candidate)
        found = everywhere(field([ball, ring], net), p).distance
        last = everywhere(field([ring], net), p).distance
        assert found == pytest.approx(last if bias > 0 else np.full(500, EMPTY), abs=1e-5)
        if bias < 0:
            empty, *_ = draw_solids(field([]), Stage(), (24, 24))
            assert psnr_db(draw_solids(field([ball, ring], net), Stage(), (24, 24))[0], empty) > 100
    net = SolidArrays(network().config, weights())
    for name in ("cell_lines", "cell_gain", "cell_bias", "candidate", "bump"):
        setattr(net, name, getattr(net, name)[[0, 1, 3, 2]])
    for token, other in (("subtract", "intersect"), ("intersect", "subtract")):
        swapped = everywhere(field([ball, ring._replace(token=token)], net), p)
        wanted = everywhere(field([ball, ring._replace(token=other)]), p)
        assert swapped.distance == pytest.approx(wanted.distance, abs=1e-6)
        assert swapped.register == pytest.approx(wanted.register, abs=1e-6)


def test_nothing_is_an_empty_stage() -> None:
    image, work = draw_solids(field([]), Stage(), (16, 16))
    assert (work.rays, work.near, work.steps, work.met) == (256 + 4 * work.refined, 0, 0, 0)
    assert image[0, 8, 2] > image[0, 8, 0]


@pytest.mark.parametrize("threads", [1, 3])
def test_what_a_sphere_takes(threads: int) -> None:
    """A ray is near where it meets the ball; one object is met once a step, and once more for its normal."""
    stage = Stage(camera=Camera((0.0, 0.0, 6.0)), light=Light((0.0, 0.0, 9.0)), ground=None)
    square = ((np.arange(60) - 29.5) / 60) ** 2 + ((np.arange(40)[:, None] - 19.5) / 60) ** 2
    sine = np.sqrt(square / (1 + square))  # of the angle between a ray and the axis
    image, work = draw_solids(field([Object("sphere")]), stage, (60, 40), threads=threads, samples="one")
    assert image.shape == (40, 60, 3)
    assert (work.rays, work.refined) == (2400, 0)
    ball, seen = int((6 * sine <= 1 + SLACK).sum()), int((6 * sine < 1).sum())
    assert work.lights == pytest.approx(seen, abs=8)  # the light behind the eye sees what the eye sees
    assert work.near == pytest.approx(ball + work.lights, abs=8)
    assert work.near < work.steps < 12 * work.near
    assert work.met == pytest.approx(work.steps + seen, abs=8)


def test_displacement_moves_the_surface() -> None:
    p = np.array([[0.5], [0.5], [0.7071]], np.float32)
    plain, bumpy = (
        everywhere(field([Object("sphere", steps)]), p).distance[0] for steps in ((), (Displace(0.1, 3.0),))
    )
    wanted = 0.1 * np.sin(1.5) ** 2 * np.sin(3 * 0.7071)
    assert bumpy - plain == pytest.approx(wanted, abs=1e-5)


APART = [
    Object("torus", (scaled(0.9, 0.6, 0.9), turned(0.7), moved(-0.8, 0.2, 0))),
    Object("sphere", (Displace(0.05, 5.0), scaled(0.5), moved(0.9, 0.3, 0.4)), "volumetric"),
    Object("torus", (Twist(0.8), scaled(0.6), moved(0.2, -0.4, 0.9)), rgb=(0.2, 0.5, 0.8)),
]


@pytest.mark.parametrize("leaf", LEAVES)
def test_boxes_are_those_of_the_leaf(leaf: str) -> None:
    net = network()
    found = net.box(net.decoder(net.codes[LEAVES.index(leaf)]))
    half = [1.0, 0.3 if leaf == "torus" else 1.0, 1.0]
    assert (abs(found) >= np.array(half) - 0.002).all()
    assert (abs(found) <= np.array(half) + 0.03).all()


def test_boxes_hold_what_lies_apart_and_askew() -> None:
    centres = np.array([[0.4, -0.6, 0.3], [-0.5, 0.1, 0.35], [0.0, 0.7, 0.0]])
    radii = np.array([0.2, 0.15, 0.1])
    low, high = surrounding(
        lambda q: (np.linalg.norm(q.T[:, None] - centres, axis=2) - radii).min(1).astype(np.float32)
    )
    for box, sides in ((low, centres.T - radii), (-high, -centres.T - radii)):
        assert (box <= sides.min(1)).all()
        assert (box >= sides.min(1) - 0.03).all()


def test_boxes_of_elements_hold_all_nodes_inside() -> None:
    ring = element(torus, levels=3)
    grid, box = unpacked(ring), element_box(ring)
    places = np.stack(np.nonzero(grid <= 0)) * (2 / (len(grid) - 1)) - 1
    assert (places.min(1) >= box[0]).all()
    assert (places.max(1) <= box[1]).all()
    assert (box[1] - box[0]).min() < 1.5


@pytest.mark.parametrize("objects", [APART, MIXED])
def test_asking_a_decoder_alone_is_asking_the_cell(objects: list[Object]) -> None:
    """Pictures are the same where nothing is known of the cell, so that it is asked for each object."""
    alone, asked = field(objects), field(objects)
    assert alone.open
    assert (alone.group >= 0).any()
    asked.open, asked.group = False, 0 * asked.group - 1
    (mine, work), (other, more) = (draw_solids(solids, Stage(), (64, 48)) for solids in (alone, asked))
    assert abs(mine - other).max() < 2e-4
    assert work.met == pytest.approx(more.met, rel=0.05)


def test_gates_that_may_not_be_open_are_asked() -> None:
    net, reach = network(), np.ones(1, np.float32)
    cell = net.cell(0, 0.15)[Wanted.ALL]
    assert net.alone(reach, cell) > 0
    for gates in (slice(0, 1), slice(1, 3), slice(3, 5)):  # of distance, colour and medium
        bias = cell.bias.copy()
        bias[gates] -= 1e9
        assert net.alone(reach, cell._replace(bias=bias)) == 0
    assert net.alone(1e9 * reach, cell) == 0


@pytest.mark.parametrize(
    ("radius", "away", "power"), [(0.5, 3.0, 40.0), (1.0, 2.0, 300.0), (1.4, 3.0, 1500.0)]
)
def test_a_medium_glows_where_the_light_is_behind_it(radius: float, away: float, power: float) -> None:
    """Along the axis: the deeper a point lies, the more light arrives and the less of it gets out."""
    camera, dark = Camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0)), (0.0, 0.0, 0.0)
    light = Light((0.0, 0.0, -away), power)
    stage = Stage(camera=camera, light=light, ground=None, horizon=dark, zenith=dark)
    step = scaled(radius)
    image, *_ = draw_solids(
        field([Object("sphere", (step,), "volumetric", (1.0, 1.0, 1.0))]), stage, (65, 65)
    )
    z = np.linspace(-radius, radius, 20_001)
    arrived, left = np.exp(-3 * (z + radius)), np.exp(-3 * (radius - z))
    sent = 2 * radius * np.mean(3 * left * (power / (4 * (z + away) ** 2) * arrived + 0.12))
    linear = ((image[32, 32] + 0.055) / 1.055) ** 2.4
    assert linear == pytest.approx(sent, rel=0.02)


@pytest.mark.parametrize(
    ("other", "least"),
    [
        (Object("torus", (scaled(0.9), moved(0, 0, -0.4)), "volumetric", (0, 0.1, 0.9)), 57),
        (Object("sphere", (scaled(0.5, 0.9, 0.5), moved(0.5, 0.2, 0)), "volumetric", (0, 0.1, 0.9)), 57),
        (Object("torus", (scaled(0.6), turned(0.7), moved(0.9, 1.2, 0.9))), 52.5),
    ],
)  # fmt: skip
def test_colours_and_shadows_change_within_media(other: Object, least: float) -> None:
    """A later medium in another, and a shadow that falls into one: three nodes a ray do not tell where."""
    objects = [Object("sphere", (scaled(0.9),), "volumetric", (0.9, 0.5, 0.1)), other]
    exact = solid_image(graph(objects), Stage(), (40, 40))
    assert psnr_db(draw_solids(field(objects), Stage(), (40, 40))[0], exact) > least


def test_what_is_cut_out_of_a_medium_is_not_in_it() -> None:
    """Ways in a ball that two others cut, from outside and from inside it, against intervals."""
    cuts = [((-0.2, 0.0, 0.3), 0.6), ((0.3, 0.0, -0.2), 0.5)]
    ball = Object("sphere", (scaled(1),), "volumetric")
    holes = [Object("sphere", (scaled(r), moved(*c)), token="subtract") for c, r in cuts]
    solids = field([ball, *holes])
    for eye in ([0.0, 0.5, 5.0], [0.0, 0.95, 0.0]):
        origin = np.array(eye, np.float32)
        way = np.random.default_rng(1).normal(0, 0.4, (3, 400)).astype(np.float32) - origin[:, None]
        way /= np.linalg.norm(way, axis=0)
        trail = march(solids, origin, way, np.full(400, 9.0, np.float32))
        t = np.linspace(0, 7, 7001)
        inside = _within(origin, way, (0, 0, 0), 1.0, t)
        for centre, radius in cuts:
            inside &= ~_within(origin, way, centre, radius, t)
        assert trail.length == pytest.approx(inside.sum(1) * 1e-3, abs=0.02)  # ends to within 0.009


def _within(
    origin: np.ndarray, way: np.ndarray, centre: Sequence[float], radius: float, t: np.ndarray
) -> np.ndarray:
    """Whether points of rays are in a ball, (M, len(t))."""
    to = np.array(centre) - origin
    along = to @ way
    half = np.sqrt(np.maximum(radius**2 - (to @ to - along**2), 0))
    return abs(t - along[:, None]) < half[:, None]
