"""Solids: frames, field, rays, media and textures against closed forms, differences and the reference."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.assets.picture import painted
from scenelang.assets.pyramid import unpacked
from scenelang.compiler.geometries import GEOMETRIES
from scenelang.compiler.program import Paint
from scenelang.compiler.spaces import EXTINCTION, Camera, Light, Stage
from scenelang.compiler.steps import Affine
from scenelang.drawing.arrays import Smooth
from scenelang.drawing.exact.field import combine, leaf_distance
from scenelang.drawing.exact.solid import ExactField, solid_image
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.solid import draw
from scenelang.drawing.solid.draw import draw_solids
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.network import EMPTY, SolidArrays, Wanted, element_box, surrounding
from scenelang.drawing.tables import SLACK
from scenelang.language.words import TOKENS
from tests.assets.shapes import element, noise, torus
from tests.drawing.solids import (
    LEAVES,
    MIXED,
    Object,
    everywhere,
    field,
    graph,
    moved,
    network,
    scaled,
    torch_network,
    turned,
    vector,
    weights,
)
from tests.pictures import psnr_db

rng = np.random.default_rng(7)


@pytest.mark.parametrize("leaf", LEAVES)
def test_leaves_are_exact_near_their_surfaces(leaf: str) -> None:
    q = rng.uniform(-1.2, 1.2, (3, 20000))
    exact = leaf_distance(leaf, q)
    q, exact = q[:, abs(exact) < 0.05], exact[abs(exact) < 0.05]
    found = everywhere(field([Object(leaf)]), q.astype(np.float32))
    assert abs(found.distance - exact).mean() < 6e-4
    h = 1e-5
    normal = np.stack([leaf_distance(leaf, q + h * e[:, None]) - exact for e in np.eye(3)]) / h
    across = np.cross(normal, found.gradient, axis=0)
    angle = np.degrees(np.arctan2(np.linalg.norm(across, axis=0), (normal * found.gradient).sum(0)))
    assert np.median(angle) < 0.2
    flat = leaf not in LEAVES[:2]
    assert np.percentile(angle, 99) < (0.5 if flat else 2)


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
    found = everywhere(solids, p)
    steps = h * np.eye(3, dtype=np.float32)[..., None]
    slopes = [
        (everywhere(solids, p + step).distance - everywhere(solids, p - step).distance) / (2 * h)
        for step in steps
    ]
    wrong = np.linalg.norm(np.stack(slopes) - found.gradient, axis=0)
    assert np.median(wrong) < 2e-3
    assert (wrong > 0.05).mean() < 0.05  # at creases the differences see both sides


def test_steps_pass_no_surface() -> None:
    """Along rays the distance changes at most as fast as the bound says."""
    solids = field(MIXED[:3])
    origin = np.array([0.3, 1.0, 4.0], np.float32)
    way = rng.normal(size=(3, 3000)).astype(np.float32) * 0.1 - origin[:, None]
    way /= np.linalg.norm(way, axis=0)
    t = rng.uniform(3, 5, 3000).astype(np.float32)
    a, b = (everywhere(solids, origin[:, None] + way * at).distance for at in (t, t + 0.02))
    bound = 0 * t
    for row in solids.objects.rows:
        linear, shift = row["map"][:9].reshape(3, 3), row["map"][9:, None]
        ends = [linear @ (origin[:, None] + way * at) + shift for at in (t, t + 0.02)]
        inside = np.linalg.norm(ends, axis=1).max(0) <= row["ball"]
        bound = np.maximum(bound, inside * row["rate"] * np.linalg.norm(linear @ way, axis=0))
    assert (bound > 0).sum() > 1000
    assert (abs(a - b) / 0.02 <= bound + 1e-3)[bound > 0].all()


@pytest.mark.parametrize(("last", "first"), [*zip(TOKENS, ["volumetric", "diffuse"] * 2, strict=True)])
def test_pictures_are_those_of_the_reference(first: str, last: str) -> None:
    """Warps, blends, holes, media and solids in one another, from a light close by."""
    small = Object(
        "torus", (scaled(0.5, 0.4, 0.5), turned(0.7), moved(0.4, 0.2, 0.4)), "volumetric", token=last
    )
    objects = [MIXED[0]._replace(material=first), MIXED[1], small, Object("sphere", (scaled(0.3),))]
    stage = Stage(lights=(Light((1.0, 2.5, 2.0), 12.0, (1.0, 0.9, 0.8)),))
    exact = solid_image(graph(objects), stage, (32, 26))
    assert psnr_db(draw_solids(field(objects), stage, (32, 26))[0], exact) > 38


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


def test_swapped_codes_swap_shapes() -> None:
    step = (scaled(0.8),)
    ball, ring = (draw_solids(field([Object(leaf, step)]), Stage(), (32, 32))[0] for leaf in LEAVES[:2])
    g = vector(Object("sphere", step), network())
    g[:4] = network().codes[1]
    swapped, *_ = draw_solids(SolidField(network(), g[None], np.zeros(1, np.int8)), Stage(), (32, 32))
    assert psnr_db(swapped, ring) > 90
    assert psnr_db(swapped, ball) < 40


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


def test_what_a_sphere_takes() -> None:
    """A ray is near where it meets the ball; one object is met once a step, and once more for its normal."""
    stage = Stage(camera=Camera((0.0, 0.0, 6.0)), lights=(Light((0.0, 0.0, 9.0)),), ground=None)
    square = ((np.arange(60) - 29.5) / 60) ** 2 + ((np.arange(40)[:, None] - 19.5) / 60) ** 2
    sine = np.sqrt(square / (1 + square))  # of the angle between a ray and the axis
    image, work = draw_solids(field([Object("sphere")]), stage, (60, 40), samples="one")
    assert image.shape == (40, 60, 3)
    assert (work.rays, work.refined) == (2400, 0)
    ball, seen = int((6 * sine <= 1 + SLACK).sum()), int((6 * sine < 1).sum())
    assert work.lights == pytest.approx(seen, abs=8)  # the light behind the eye sees what the eye sees
    assert work.near == pytest.approx(ball + work.lights, abs=8)
    assert work.near < work.steps < 12 * work.near
    assert work.met == pytest.approx(work.steps + seen, abs=8)


@pytest.mark.parametrize("leaf", LEAVES)
def test_boxes_are_those_of_the_leaf(leaf: str) -> None:
    net = network()
    found = net.box(net.decoder(net.codes[LEAVES.index(leaf)]))
    half = np.array(GEOMETRIES[leaf].half)
    beyond = np.stack([-half, half])
    beyond[0, 1] = -0.5 if leaf == "cone" else beyond[0, 1]
    beyond = (found - beyond) * [[-1], [1]]
    assert beyond.min() >= -0.002
    assert beyond.max() <= 0.03


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


@pytest.mark.parametrize(("radius", "away", "power"), [(0.5, 3.0, 40.0), (1.4, 3.0, 1500.0)])
def test_a_medium_glows_where_the_light_is_behind_it(radius: float, away: float, power: float) -> None:
    """Along the axis: the deeper a point lies, the more light arrives and the less of it gets out."""
    camera, dark = Camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0)), (0.0, 0.0, 0.0)
    light = Light((0.0, 0.0, -away), power)
    stage = Stage(camera=camera, lights=(light,), ground=None, horizon=dark, zenith=dark)
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
    exact = solid_image(graph(objects), Stage(), (28, 28))
    assert psnr_db(draw_solids(field(objects), Stage(), (28, 28))[0], exact) > least


TORUS = 0.7, 0.3  # radii of its circle and of its tube
LAMP = np.array([1.5, 2.6, 1.8], np.float32)
PLACE = (scaled(0.6, 0.5, 0.8), turned(0.7), moved(0.2, 0.1, -0.1))
MIST = Object("torus", PLACE, "volumetric", (0.9, 0.5, 0.2))


def rays(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions from the light to about the origin (3, count), and where they end."""
    rng = np.random.default_rng(4)
    way = rng.normal(size=(3, count)) * 0.4 - LAMP[:, None]
    reach = np.linalg.norm(way, axis=0)
    limit = reach * rng.uniform(0.7, 1.6, count)
    return (way / reach).astype(np.float32), limit.astype(np.float32)


def lengths(solids: SolidField) -> np.ndarray:
    way, limit = (solids.xp.array(a, solids.network.codes) for a in rays(2000))
    with solids.xp.inference():
        lamp = solids.xp.array(LAMP, solids.network.codes)
        return np.asarray(solids.march(lamp, way, limit, gap=0.009, whole=True).depth) / EXTINCTION


@pytest.mark.parametrize(("leaf", "near", "far"), [("sphere", 0.006, 0.025), ("torus", 0.015, 0.06)])
def test_lengths_are_those_of_closed_forms(leaf: str, near: float, far: float) -> None:
    """By the signs of the leaf's polynomial at 1000 points of each ray; of one object."""
    (way, limit), back = rays(2000), np.eye(4)
    for step in PLACE:
        back = np.vstack([np.reshape(step.rows, (3, 4)), (0, 0, 0, 1)]) @ back
    back = np.linalg.inv(back)
    share = (np.arange(1000) + 0.5) / 1000
    start = back[:3, :3] @ LAMP + back[:3, 3]
    q = start[:, None, None] + (back[:3, :3] @ way * limit)[:, :, None] * share
    square = (q * q).sum(0)
    ring = 4 * TORUS[0] ** 2 * (q[0] ** 2 + q[2] ** 2)
    inside = square < 1 if leaf == "sphere" else (square + TORUS[0] ** 2 - TORUS[1] ** 2) ** 2 < ring
    wrong = abs(lengths(field([MIST._replace(leaf=leaf)])) - inside.mean(1) * limit)
    wrong = wrong[inside.any(1)]
    assert len(wrong) > 500
    assert np.sqrt((wrong**2).mean()) < near
    assert np.quantile(wrong, 0.99) < far


def test_weights_of_before_draw_as_they_did() -> None:
    """Layers of SiLU units, which knew two leaves by codes that these still have."""
    digest = "bab13c03f05d30652d0d0c58a7508ae7072d798f881b7a17902d7f66f6384f0a"
    old, known = load_arrays("solids3d", digest)
    assert known == digest
    assert (old.codes == network().codes[:2]).all()
    q = rng.uniform(-1.2, 1.2, (3, 2000)).astype(np.float32)
    for leaf, code in zip(LEAVES, old.codes, strict=False):
        assert isinstance(old.decoder(code), Smooth)
        exact = leaf_distance(leaf, q)
        near = abs(exact) < 0.05
        assert abs(old.field(q, old.decoder(code), False)[0] - exact)[near].max() < 3e-3
    off = abs(lengths(field([MIST], old)) - lengths(field([MIST])))
    assert off.mean() < 0.01
    assert off.max() < 0.1


STEPS = (("hue", 0.2), ("grayscale", 0.3), ("color", 0.9, 0.6, 1.0))
COARSE, FINE, SPACE = noise(7, 5), noise(96, 96, seed=1), noise(5, 5, 5)
MOVED = (Affine((0.5, 0.3, 0, 0.2, -0.4, 0.7, 0, 0.1, 0, 0, 1, 0)),)


@pytest.mark.parametrize("library", ["numpy", "torch"])
@pytest.mark.parametrize("element", [COARSE, SPACE], ids=["picture", "space"])
def test_the_field_has_the_colours_of_the_reference(library: str, element) -> None:
    """At points in objects of every kind, blended and cut, with moves of pictures."""
    moves = MOVED if element is COARSE else ()
    objects = [o._replace(paint=Paint(element, STEPS), texture=moves) for o in MIXED]
    objects[1] = MIXED[1]._replace(paint=Paint(element))
    solids = field(objects, torch_network() if library == "torch" else None)
    p = np.random.default_rng(2).uniform(-1, 1, (3, 4000)).astype(np.float32)
    exact = ExactField(graph(objects)).at(p.astype(float))
    found = solids.xp.to_numpy(everywhere(solids, p).register[:3])
    inside = exact.d < -0.02
    assert inside.sum() > 100
    error = abs(found - exact.rgb)[:, inside]
    assert error.max() < 0.05  # in blends, whose shares are learned
    assert np.median(error) < 1e-4
    assert np.ptp(exact.rgb[:, inside], axis=1).min() > 0.2


SCENES = {
    "surfaces": (
        [
            Object("torus", (scaled(1.1), turned(0.8)), paint=Paint(COARSE, STEPS), texture=MOVED),
            Object("sphere", (scaled(0.6, 0.4, 0.6), moved(1, 0, 0.6)), token="smooth", paint=Paint(SPACE)),
            Object("sphere", (scaled(0.4), moved(-0.8, 0.5, 0.4)), token="subtract"),
        ],
        44,
    ),
    "media": (
        [
            Object("sphere", (turned(0.5),), "volumetric", paint=Paint(COARSE, STEPS)),
            Object("torus", (scaled(0.5), moved(1.3, 0, 0.5)), "volumetric", paint=Paint(SPACE)),
            Object("sphere", (scaled(0.5), moved(-1.2, 0, 0.5)), "volumetric", (0.1, 0.3, 0.9)),
        ],
        46,
    ),
    "solids in media": (
        [
            Object("sphere", (), "volumetric", (0.9, 0.9, 1.0)),
            Object("torus", (scaled(0.94), turned(0.6)), paint=Paint(COARSE)),
        ],
        40,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_pictures_are_those_of_the_reference_of_solid_textures(name: str) -> None:
    objects, least = SCENES[name]
    exact = solid_image(graph(objects), Stage(), (20, 20))
    found, _ = draw_solids(field(objects), Stage(), (20, 20))
    assert psnr_db(found, exact) > least
    plain, _ = draw_solids(field([o._replace(paint=None) for o in objects]), Stage(), (20, 20))
    assert psnr_db(plain, exact) < psnr_db(found, exact) - 6
    other, _ = draw_solids(field(objects, torch_network()), Stage(), (20, 20))
    assert abs(np.asarray(other) - found).max() < 2 / 255


def test_textures_are_looked_up_four_times_without_four_rays() -> None:
    objects = [Object("sphere", paint=Paint(FINE)), Object("torus", (turned(1.0),), paint=Paint(FINE))]
    solids = field(objects)
    four, _ = draw_solids(solids, Stage(), (64, 64), samples="four")
    some, work = draw_solids(solids, Stage(), (64, 64))
    one, _ = draw_solids(solids, Stage(), (64, 64), samples="one")
    assert psnr_db(one, four) < 25
    assert psnr_db(some, four) > 38
    plain = draw_solids(field([o._replace(paint=None) for o in objects]), Stage(), (64, 64))[1]
    assert work.refined < 1.2 * plain.refined


def test_many_lookups_are_made_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    objects = [Object("sphere", paint=Paint(FINE)), Object("torus", (), "volumetric", paint=Paint(COARSE))]
    whole, _ = draw_solids(field(objects), Stage(), (32, 32))
    for name in ("PIXELS", "CHUNK"):
        monkeypatch.setattr(draw, name, 17)
    np.testing.assert_allclose(draw_solids(field(objects), Stage(), (32, 32))[0], whole, rtol=0, atol=1e-5)


def test_light_in_a_medium_of_two_colours_is_the_sum_of_both_ways() -> None:
    """Seen along the axis on which they change: near and far half have closed forms of their own."""
    dark = (0.0, 0.0, 0.0)
    stage = Stage(
        camera=Camera((0.0, 0.0, 6.0), dark),
        lights=(Light(power=0.0),),
        ground=None,
        horizon=dark,
        zenith=dark,
    )
    halves = np.zeros((2, 1, 3), np.uint8)
    halves[0, 0, 0] = halves[1, 0, 1] = 255  # red over green, along the leaf's y
    paint = Paint(painted("halves", np.repeat(halves, 256, 0)))
    # the leaf's y along the world's z
    upright = Affine((1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0))
    image, _ = draw_solids(field([Object("sphere", (upright,), "volumetric", paint=paint)]), stage, (65, 65))
    linear = ((np.asarray(image)[32, 32] + 0.055) / 1.055) ** 2.4
    near, far = 0.12 * (1 - np.exp(-3)), 0.12 * (np.exp(-3) - np.exp(-6))
    assert linear[:2] == pytest.approx([near, far], abs=1e-3)
