"""Solids: frames, field and pictures against closed forms, differences and the other library."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from scenelang.compiler.spaces import Camera, Light, Stage
from scenelang.compiler.steps import Displace, Twist, Warp
from scenelang.drawing.exact.field import combine, leaf_distance
from scenelang.drawing.exact.solid import solid_image
from scenelang.drawing.neural.load import Solids
from scenelang.drawing.solid import draw
from scenelang.drawing.solid.draw import draw_solids
from scenelang.drawing.solid.field import Meeting, SolidField
from scenelang.drawing.solid.network import EMPTY, SolidArrays, Wanted
from scenelang.drawing.solid.passes import (
    BEGIN,
    END,
    INF,
    OBJECT,
    RATE,
    SLACK,
    SLOT,
    WAY,
    Passes,
    read_solid_frame,
)
from scenelang.language.words import TOKENS
from tests.drawing.solids import (
    LEAVES,
    MIXED,
    Object,
    field,
    graph,
    moved,
    network,
    psnr,
    scaled,
    turned,
    vector,
    weights,
)

rng = np.random.default_rng(7)


def everywhere(solids: SolidField, p: np.ndarray, gradient: bool = False) -> Meeting:
    """What a field answers where every object is met."""
    xp, like, count = solids.xp, solids.network.codes, len(solids.solids)
    slots = np.zeros((SLOT, count, p.shape[1]), np.float32)
    drawn = np.array([solid.draws for solid in solids.solids])
    slots[OBJECT] = np.where(drawn, np.arange(count), -1 - np.arange(count))[::-1, None]
    slots[WAY] = np.einsum("ijn,jp->inp", xp.to_numpy(solids.linear), p)[:, ::-1]
    slots[END] = INF
    passes = Passes(xp.array(slots, like), solids.shift)
    with xp.inference():
        return solids.meet(passes, xp.array(np.ones_like(p[0]), like), Wanted.ALL, gradient)


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
    small = (scaled(0.3, 0.3, 0.3), moved(0.9, 0, 0))
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


def sphere_picture(canvas: tuple[int, int], radius: float, stage: Stage) -> np.ndarray:
    """A grey sphere at the origin over the ground, in closed form."""
    width, height = canvas
    y, x = np.mgrid[0 : 2 * height, 0 : 2 * width] / 2 + 0.25
    forward, right, up = np.array(stage.camera.axes())
    way = 3 * forward[:, None, None] + np.multiply.outer(right, (x - width / 2) * 2 / min(canvas))
    way = way - np.multiply.outer(up, (y - height / 2) * 2 / min(canvas))
    way /= np.linalg.norm(way, axis=0)
    eye, lamp = np.array(stage.camera.eye)[:, None, None], np.array(stage.light.position)[:, None, None]

    def first(o: np.ndarray, d: np.ndarray) -> np.ndarray:
        b, c = (o * d).sum(0), (o * o).sum(0) - radius**2
        root = b * b - c
        t = -b - np.sqrt(np.maximum(root, 0))
        return np.where((root > 0) & (t > 1e-6), t, np.inf)

    high = np.clip(2 * way[1], 0, 1)
    sky = np.array(stage.horizon)[:, None, None] * (1 - high) + np.array(stage.zenith)[:, None, None] * high
    t = first(eye + 0 * way, way)
    down = np.where(way[1] < 0, (-1 - eye[1]) / np.minimum(way[1], -1e-9), np.inf)
    ball = t < down
    p = eye + way * np.where(ball, t, np.where(down < np.inf, down, 0))
    n = np.where(ball, p / radius, np.array([0.0, 1, 0])[:, None, None])
    to = lamp - p
    r = np.linalg.norm(to, axis=0)
    shadow = first(p + 1e-4 * n, to / r) < r
    light = stage.light.power * np.maximum((n * to).sum(0) / r, 0) / r**2 * ~shadow + 0.12 + 0.06 * n[1]
    fade = np.exp(-(p[0] ** 2 + p[2] ** 2) / 64)
    floor = np.array([0.5, 0.48, 0.45])[:, None, None] * light
    floor = fade * floor + (1 - fade) * np.array(stage.horizon)[:, None, None]
    seen = np.where(ball, 0.5 * light, np.where(down < np.inf, floor, sky))
    linear = np.clip(seen.reshape(3, height, 2, width, 2).mean((2, 4)), 0, 1)
    return np.moveaxis(
        np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055), 0, 2
    )


@pytest.mark.parametrize("canvas", [(96, 96), (120, 60)])
def test_a_sphere_is_drawn_as_in_closed_form(canvas: tuple[int, int]) -> None:
    stage = Stage(light=Light((2.0, 3.0, 2.5), 20.0))
    solids = field([Object("sphere", (scaled(0.8, 0.8, 0.8),), rgb=(0.5, 0.5, 0.5))])
    exact = sphere_picture(canvas, 0.8, stage)
    assert psnr(draw_solids(solids, stage, canvas, samples="four")[0], exact) > 50
    assert psnr(draw_solids(solids, stage, canvas)[0], exact) > 48


@pytest.mark.parametrize("first", ["diffuse", "volumetric"])
@pytest.mark.parametrize("last", [*TOKENS])
def test_pictures_are_those_of_the_reference(first: str, last: str) -> None:
    """Warps, blends, holes, media and solids in one another, from a light close by."""
    small = Object(
        "torus", (scaled(0.5, 0.4, 0.5), turned(0.7), moved(0.4, 0.2, 0.4)), "volumetric", token=last
    )
    objects = [MIXED[0]._replace(material=first), MIXED[1], small, Object("sphere", (scaled(0.3, 0.3, 0.3),))]
    stage = Stage(light=Light((1.0, 2.5, 2.0), 12.0, (1.0, 0.9, 0.8)))
    exact = solid_image(graph(objects), stage, (48, 40))
    assert psnr(draw_solids(field(objects), stage, (48, 40))[0], exact) > 38


def test_both_libraries_draw_the_same() -> None:
    net = network()
    other = Solids(net.config, 2, 2)
    names = dict(other.named_parameters())
    with torch.no_grad():
        for name, parameter in names.items():
            group, _, index = name.partition(".")
            value = getattr(net, group)
            parameter.copy_(torch.from_numpy(value[int(index)] if index else value))
    objects = [*MIXED[:2], Object("sphere", (scaled(0.4, 0.4, 0.4), moved(-0.8, 0, 0.4)), "volumetric")]
    mine, *_ = draw_solids(field(objects), Stage(), (48, 48))
    theirs, *_ = draw_solids(field(objects, other), Stage(), (48, 48))
    assert psnr(mine, theirs) > 60


@pytest.mark.parametrize("samples", ["adaptive", "quick"])
def test_tiles_and_threads_leave_no_trace(samples: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing but what products of matrices round, whose sizes differ."""
    mist = Object("torus", (scaled(0.8, 0.6, 0.8), moved(0.3, 0.2, 0.5)), "volumetric", (0.2, 0.4, 0.9))
    solids = field([*MIXED, mist, Object("sphere", (scaled(0.3, 0.3, 0.3), moved(0.8, 0, 0)), "volumetric")])
    whole, work = draw_solids(solids, Stage(), (48, 40), samples=samples)
    for tile, threads in ((48 * 7, 1), (48 * 11, 3), (draw.TILE, 5)):
        monkeypatch.setattr(draw, "TILE", tile)
        found, parts = draw_solids(solids, Stage(), (48, 40), threads=threads, samples=samples)
        assert abs(found - whole).max() < 2e-4
        assert parts.refined == work.refined


def test_what_is_drawn_is_in_codes_and_cell() -> None:
    """Swapped codes swap shapes; random weights of the cell draw noise."""
    step = (scaled(0.8, 0.8, 0.8),)
    ball, ring = (draw_solids(field([Object(leaf, step)]), Stage(), (32, 32))[0] for leaf in LEAVES)
    g = vector(Object("sphere", step), network())
    g[:4] = network().codes[1]
    swapped, *_ = draw_solids(SolidField(network(), g[None], np.zeros(1, np.int8)), Stage(), (32, 32))
    assert psnr(swapped, ring) > 90
    assert psnr(swapped, ball) < 40
    noise = SolidArrays(network().config, weights())
    noise.cell_lines = rng.normal(size=noise.cell_lines.shape).astype(np.float32)
    noise.cell_gain = noise.cell_gain * 0
    drawn, good = (draw_solids(field(MIXED, net), Stage(), (32, 32))[0] for net in (noise, network()))
    assert psnr(drawn, good) < 30


def test_objects_meet_in_the_cell_alone() -> None:
    """A cell that takes nothing in leaves nothing, one that always does the last; tokens choose weights."""
    p = rng.uniform(-1, 1, (3, 500)).astype(np.float32)
    ball, ring = Object("sphere", (scaled(0.8, 0.8, 0.8),)), Object("torus", (moved(0.3, 0, 0),))
    for bias in (-1.0, 2.0):
        net = SolidArrays(network().config, weights())
        net.cell_lines, net.cell_bias = 0 * net.cell_lines, 0 * net.cell_bias + np.float32(bias)
        net.candidate = np.ones_like(net.candidate)
        found = everywhere(field([ball, ring], net), p).distance
        last = everywhere(field([ring], net), p).distance
        assert found == pytest.approx(last if bias > 0 else np.full(500, EMPTY), abs=1e-5)
        if bias < 0:
            empty, *_ = draw_solids(field([]), Stage(), (24, 24))
            assert psnr(draw_solids(field([ball, ring], net), Stage(), (24, 24))[0], empty) > 100
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
