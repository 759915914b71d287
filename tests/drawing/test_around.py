"""Light from everywhere against closed forms, and how little it changes where little moves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.spaces import Sky, Stage
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.kernel import load_kernel
from scenelang.drawing.neural import draw
from scenelang.drawing.solid.around import FURTHER, GOLDEN, TURNS, Around, disc
from scenelang.drawing.solid.draw import Lighting
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.soft import ASIDE, WIDE
from tests.drawing.solids import Object, field, moved, scaled

BALL = Object("sphere", (scaled(0.7),), rgb=(0.8, 0.5, 0.3))
EVEN = Stage(lights=(), ground=None, sky=Sky(0.6, (0.5, 0.8, 1.0), (0.5, 0.8, 1.0)))


def on_ball(count: int, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Points of a ball about the origin and their normals (3, K)."""
    n = np.random.default_rng(1).normal(size=(3, count))
    n = (n / np.linalg.norm(n, axis=0)).astype(np.float32)
    return n * np.float32(radius), n


def received(objects: list[Object], stage: Stage, p: np.ndarray, n: np.ndarray) -> np.ndarray:
    """What points receive of an even sky and of each other."""
    solids = field(objects)
    with solids.xp.inference():
        return Around(solids, stage, Lighting(solids, stage).received).surface(p, n)


def around_of(text: str) -> Around:
    """The light of a scene that is drawn once."""
    kept: list[Around] = []
    before = Around.look
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(draw, "sized", lambda program: program)  # points are those of the scene
        patch.setattr(Around, "look", lambda around, *more: (kept.append(around), before(around, *more)))
        nsg.render(nsg.compile(nsg.loads(text)))
    return kept[0]


def test_all_of_an_even_sky_comes_to_what_is_convex() -> None:
    """(1/π) ∫ L cos θ dω is L."""
    light = received([BALL], EVEN, *on_ball(300, 0.7))
    assert light == pytest.approx(np.tile([[0.3], [0.48], [0.6]], 300), rel=0.025)


def test_a_ball_below_a_sphere_is_hidden_by_a_form_factor() -> None:
    """A black sphere of radius a at a distance d above a level point hides (a / d)² of the light."""
    black = Object("sphere", (scaled(0.5), moved(0.0, 1.3, 0.0)), rgb=(0.0, 0.0, 0.0))
    plate = Object("box", (scaled(5.0, 0.1, 5.0), moved(0.0, -0.1 / 3**0.5, 0.0)), rgb=(0.0, 0.0, 0.0))
    p, n = np.zeros((3, 1), np.float32), np.array([[0.0], [1.0], [0.0]], np.float32)
    light = received([black, plate], EVEN, p, n)
    assert light[2, 0] == pytest.approx(0.6 * (1 - (0.5 / 1.3) ** 2), rel=0.03)


@pytest.mark.parametrize("off", [-1e-7, 0.0, 1e-7, 1e-3])
def test_a_corner_sees_half_of_the_sky(off: float) -> None:
    """On black ground, where a black wall begins, half of (1/π) ∫ L cos θ dω is left."""
    black = {"rgb": (0.0, 0.0, 0.0)}
    floor = Object("box", (scaled(20.0, 1.0, 20.0), moved(0.0, -1 / 3**0.5, 0.0)), **black)
    wall = Object("box", (scaled(1.0, 20.0, 20.0), moved(-1 / 3**0.5, 0.0, 0.0)), **black)
    p = np.stack([np.full(64, off), np.zeros(64), np.linspace(-1, 1, 64)]).astype(np.float32)
    n = np.tile(np.float32([[0.0], [1.0], [0.0]]), 64)
    assert received([floor, wall], EVEN, p, n).mean(1) == pytest.approx([0.15, 0.24, 0.3], rel=0.05)


def test_fields_are_asked_in_single_precision(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mask times a number is double in numpy, and all that it joins; that takes half as long again."""
    found: set[str] = set()
    before = SolidField.near

    def near(field: SolidField, *args: Any, **more: Any) -> Any:
        result = before(field, *args, **more)
        found.add(str(result.distance.dtype))
        return result

    monkeypatch.setattr(SolidField, "near", near)
    nsg.render(
        nsg.compile(
            nsg.loads("""nsg 1; canvas(64, 64); sky(1); light([2, 3, 1], 9, radius = 0.5);
        light([-2, 3, 1], 9); sphere { scale(0.6); material glossy { color(#888); } }
        box { scale(0.4); translate(0.4, 0, 0.9); material metal { color(#a85); roughness(0.1); } }
        sphere { scale(0.8); translate(-0.9, 0, 0); material volumetric { color(#ccc); density(2); } }""")
        )
    )
    assert found == {"float32"}


def test_light_goes_on_beyond_the_last_point_of_a_surface() -> None:
    """Linear light on the lattice is so between its points, and half a step beyond the last on a plate."""
    around = around_of("""nsg 1; canvas(128, 128); ground(none); sky(1); camera([0, 4, 0.1], [0, 0, 0]);
        box { scale(1.3); material diffuse { color(#888); } }""")
    there = np.flatnonzero(around.seen.p[0] < 100)
    row, column = np.divmod(np.arange(around.rows * around.columns, dtype=np.float32), around.columns)
    plane = np.stack([10 + column, 10 + row, 50 + row - column / 2])
    with NUMPY.inference():
        parts = [around._evened(plane, part=part) for part in range(3)]
        assert parts[0][:, there] == pytest.approx(plane[:, there], abs=0.2)
        lattice = np.ascontiguousarray(np.concatenate([*around.seen, plane, *parts[1:]]).T, np.float32)
        x = np.linspace(-0.74, 0.74, 150, dtype=np.float32)  # the top's sides are at 0.75
        p = np.stack([np.tile(x, 150), np.full(22500, 1.3 / 3**0.5, np.float32), np.repeat(x, 150)])
        u, v = around._places(p)
        n = np.float32([[0], [1], [0]]) + 0 * p
        found, fits = load_kernel().between(p, n, around.view, lattice)
    assert fits.all()
    assert found == pytest.approx(np.stack([10 + u, 10 + v, 50 + v - u / 2]), abs=0.15)


@pytest.mark.parametrize("wide", [0.3, 0.02])
def test_a_thin_ring_that_glows_sends_what_all_of_it_does(wide: float) -> None:
    """By an integral over the surface of a tube around the point's normal; its far side hides nothing."""
    scene = nsg.loads(f"""nsg 1; canvas(16, 16); ground(none); light(none); sky(0);
        torus {{ grow({wide / 2 - 0.3}); material diffuse {{ glow(#fff); }} }}
        sphere {{ translate(0, -40, 0); }}""")
    shown: list[np.ndarray] = []
    before, p, n = (
        Around.look,
        np.array([[0.1], [-1.2], [0.0]], np.float32),
        np.eye(3, dtype=np.float32)[:, 1:2],
    )

    def look(around: Around, *more: object) -> None:
        light, free = around.glow(p, n)
        shown.append(np.asarray(light * free))
        before(around, *more)  # type: ignore[arg-type]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Around, "look", look)
        nsg.render(nsg.compile(scene))
    turn, roll = (np.linspace(0, 2 * np.pi, 512, endpoint=False) for _ in range(2))
    turn, roll = turn[:, None], roll[None]
    out = np.stack([np.cos(roll) * np.cos(turn), np.sin(roll) + 0 * turn, np.cos(roll) * np.sin(turn)])
    ring = 0.7 * np.stack([np.cos(turn), 0 * turn, np.sin(turn)]) + wide / 2 * out
    area = wide / 2 * (0.7 + wide / 2 * np.cos(roll)) * (2 * np.pi / 512) ** 2
    to = ring - p[:, :, None]
    far = np.linalg.norm(to, axis=0)
    facing = (-(to * out).sum(0) / far).clip(0)
    assert shown[0][0, 0] == pytest.approx((to[1] / far * facing / far**2 * area).sum() / np.pi, rel=0.03)


@pytest.mark.parametrize("high", [0.05, 0.1, 0.3, 1.0])
def test_a_plate_that_glows_is_as_bright_nearby_as_its_form_factor(high: float) -> None:
    """a² / (a² + h²) of a disc of radius a above a level point; between its nodes too."""
    around = around_of("""nsg 1; canvas(16, 16); ground(none); light(none); sky(0);
        cylinder { scale(1.41421356, 0.1, 1.41421356); material diffuse { glow(#fff); } }""")
    emitters = around.emitters
    low = float(np.asarray(emitters.p)[1][np.asarray(emitters.n)[1] < -0.9].mean())
    x, z = np.random.default_rng(3).uniform(-0.1, 0.1, (2, 200))
    p, n = np.stack([x, 0 * x + low - high, z]), np.tile([[0.0], [1.0], [0.0]], 200)
    light = around.glow(p.astype(np.float32), n.astype(np.float32), np.inf)[0]
    assert light[0].mean() == pytest.approx(1 / (1 + high * high), rel=0.12)


@pytest.mark.parametrize("worth", [0.0, 1e9])  # with all rays and with the fewest
def test_an_edge_hides_the_half_of_what_glows(worth: float) -> None:
    """A plate over the ground below a bar that glows from side to side hides what is beyond its edge."""
    around = around_of("""nsg 1; canvas(16, 16); light(none); sky(0); ground(-1);
        box { scale(2, 0.02, 0.1); translate(0, 1, 0); material diffuse { glow(#fff); } }
        box { scale(1.732, 0.02, 1); translate(1, 0, 0); material diffuse { color(#000); } }""")
    shift = np.random.default_rng(5).uniform(-0.01, 0.01, (2, 400))
    p = np.stack([shift[0], 0 * shift[0] - 1 + 1e-3, shift[1]]).astype(np.float32)
    n = np.tile(np.float32([[0], [1], [0]]), 400)
    free = around.glow(p, n, worth)[1]
    assert free.mean() == pytest.approx(0.5, abs=0.02)  # the edge is above the point
    assert free.std() < 0.1


def test_a_colour_whose_glow_is_hidden_does_not_come() -> None:
    """A black wall hides a bright red bar from the ground beyond, and nothing hides a dim blue one."""
    around = around_of("""nsg 1; canvas(16, 16); light(none); sky(0); ground(-1);
        box { scale(0.2, 0.2, 2); translate(-1.5, 0, 0); material diffuse { glow(#f00, 20); } }
        box { scale(0.2, 0.2, 2); translate(1.5, 0, 0); material diffuse { glow(#00f, 1); } }
        box { scale(0.1, 9, 9); material diffuse { color(#000); } }""")
    x, z = np.random.default_rng(6).uniform([[0.5], [-1]], [[2.5], [1]], (2, 200))
    p, n = np.stack([x, 0 * x - 1 + 1e-3, z]).astype(np.float32), np.tile(np.float32([[0], [1], [0]]), 200)
    light, free = around.glow(p, n)
    assert light[0].mean() > light[2].mean()
    assert (free[0] < 0.02).all()
    assert free[2] == pytest.approx(1.0, abs=0.05)


BOWL = """sphere { shell(0.09); scale(1.1); translate(0, 0.12, 0); material diffuse { color(#fff); } }
    capsule { scale(0.3); rotate(90deg); translate(1.4, -0.85, 0.5); material diffuse { color(#fff); } }"""
GREY = "material diffuse { color(#ccc); }"
SIX = "".join(
    f"box {{ scale({', '.join('0.087' if i == axis else '1.82' for i in range(3))}); "
    f"translate({', '.join(str(side * (i == axis)) for i in range(3))}); {GREY} }}"
    for axis in range(3)
    for side in (-1, 1)
)


@pytest.mark.parametrize("closed", [BOWL, SIX], ids=["shell", "boxes"])
def test_no_light_leaves_what_is_closed(closed: str) -> None:
    """A ball glows within a shell, or within six boxes, and all else is dark."""
    text = f"""nsg 1; canvas(64, 48); light(none); sky(0); background(#000); ground(-1.05, #fff);
        camera([2, 1.5, 5], [0, -0.3, 0], 40deg); {closed}
        sphere {{ scale(0.4); translate(0.3, -0.3, 0); material diffuse {{ glow(#fff, 5); }} }}
        sphere {{ scale(0.15); translate(-1.3, -0.8, 0.3); material diffuse {{ color(#fff); }} }}"""
    assert np.asarray(nsg.render(nsg.compile(nsg.loads(text))))[..., :3].max() < 0.01


@pytest.mark.parametrize("sky", ["#fff", "#222, #fff"], ids=["even", "graded"])
def test_no_light_comes_into_what_is_closed(sky: str) -> None:
    """Nodes on the inside of a shell receive nothing of a sky (below 0 is not nothing either, and asked for
    more and more rays), and points that are seen there neither.
    """
    around = around_of(f"""nsg 1; canvas(24, 24); ground(none); light(none); sky(2, {sky});
        camera([0, 0.1, 0.2]); sphere {{ shell(0.2); scale(1.5); {GREY} }}""")
    inside = (around.nodes.n * around.nodes.p).sum(0) < 0
    assert inside.sum() > 100
    assert np.all(around.exchange[1][:, inside] == 0)
    assert np.all(around.lattice[:, 6:] == 0)


@pytest.mark.parametrize("ground", ["ground(none);", ""])
def test_no_light_comes_into_a_room_of_slabs(ground: str) -> None:
    """Few of its nodes lie inside; they take nothing from those of the outsides."""
    walls = " ".join(
        f"box {{ scale({', '.join(['2.6'] * axis + ['0.26'] + ['2.6'] * (2 - axis))}); "
        f"translate({', '.join(['0'] * axis + [side] + ['0'] * (2 - axis))}); {GREY} }}"
        for axis in range(3)
        for side in ("1", "-1")
    )
    eye = "canvas(24, 24); camera([0.2, 0.1, 0.3], [-1, -0.2, -1]);"
    text = f"nsg 1; {eye} sky(3); light(none); {ground} {walls}"
    assert np.asarray(nsg.render(nsg.compile(nsg.loads(text)))).mean() < 0.02


def test_nodes_on_the_outside_of_a_thin_slab_see_all_of_the_sky() -> None:
    """There distances are small for their gradient, and rays that begin too near met their own surface."""
    around = around_of(f"""nsg 1; canvas(24, 24); ground(none); light(none); sky(2, #fff, #fff);
        box {{ scale(1, 0.03, 1); {GREY} }}""")
    assert around.exchange[1] == pytest.approx(np.full_like(around.exchange[1], 2.0), rel=0.01)


@pytest.mark.parametrize("rgb", ["#808080", "#f0f0f0"])
def test_in_a_hollow_all_bounces_add_up(rgb: str) -> None:
    """Within a closed hollow of albedo a that glows with e there is e / (1 - a) everywhere."""
    albedo = ((int(rgb[1:3], 16) / 255 + 0.055) / 1.055) ** 2.4
    glow = 0.3 * (1 - albedo)
    text = f"""nsg 1; canvas(24, 24); ground(none); light(none); sky(0); camera([0, 0.1, 0.2]);
        sphere {{ shell(0.2); scale(1.5); material diffuse {{ color({rgb}); glow(#fff, {glow}); }} }}"""
    shown = np.asarray(nsg.render(nsg.compile(nsg.loads(text))))
    light = ((shown + 0.055) / 1.055) ** 2.4
    assert light == pytest.approx(np.full_like(light, 0.3), rel=0.06)


@pytest.mark.parametrize("high", [0.5, 0.005])
def test_the_edge_of_a_shadow_is_sharp_for_what_sees_it_in_a_hollow_or_close(high: float) -> None:
    """Ground below a roof's edge and a lamp above: power cos / r² on one side of a plane, 0 on the other."""
    hollow = "subtract { sphere { shell(0.2); scale(0.4); } box { scale(0.2); } translate(-6, 0, -6); }"
    around = around_of(f"""nsg 1; canvas(16, 16); light([0, 2, 0], 20); sky(0); camera([0, 2, 9], [0, 0, 0]);
        box {{ scale(1.732, 0.05, 3); translate(1, 1, 0); material diffuse {{ color(#000); }} }}
        {hollow if high > 0.1 else ""}""")
    x = np.array([-0.3, -0.1, -0.03, 0.03, 0.1, 0.3], np.float32)  # the roof's edge is at 0, below the lamp
    p, way = np.stack([x, high - 1 + 0 * x, 0 * x]), np.tile(np.float32([[1e-4], [-1.0], [1e-4]]), len(x))
    with NUMPY.inference():
        light, far = around.arriving(p, way, True)
        nodes = around.arriving(p, way)[0]
    assert far == pytest.approx(high, abs=5e-7)
    square = x * x + 9
    exact = around.nodes.colour[0, -1] * 20 * 3 / square**1.5 * (x < 0)
    most = float(exact.max())
    assert light[0] == pytest.approx(exact, abs=0.02 * most)
    assert abs(nodes[0] - exact).max() > 0.1 * most


MOVED = """nsg 1; canvas(64, 64); sky(0.6);
    box { scale(0.6); rotate(20deg, axis = Y); translate(-0.6, -0.3, 0); material diffuse { color(#c44); } }
    torus { scale(0.8); translate(%r, 0.2, 0.3); material diffuse { color(#4c8); glow(#fff, 0.5); } }"""


def test_what_moves_little_changes_little() -> None:
    """By 1e-4 world units; and any number of threads draws the same, but for last bits."""
    first, second = (nsg.compile(nsg.loads(MOVED % x)) for x in (0.5, 0.5001))
    before = np.asarray(nsg.render(first, threads=1))
    change = abs(before - np.asarray(nsg.render(second, threads=1))).max(2)
    assert change.mean() < 5e-4
    assert np.percentile(change, 99) < 4e-3
    assert abs(before - np.asarray(nsg.render(first, threads=2))).max() < 1e-6


def test_what_is_kept_for_the_next_picture_changes_nothing() -> None:
    """Light is kept where the camera or lamps alone move."""

    def drawn(stage: str) -> np.ndarray:
        text = (MOVED % 0.5).replace("sky(0.6);", f"sky(0.6); {stage}")
        return np.asarray(nsg.render(nsg.compile(nsg.loads(text))))

    moved_on = "light([1, 3, 2], 20); camera([1, 1, 5]);"
    alone = drawn(moved_on)
    for before in ("light([1, 3, 2], 20);", "light([-1, 3, 2], 20);", "light([1, 3, 2], 9, radius = 0.3);"):
        drawn(before)
        assert (drawn(moved_on) == alone).all()


THREE = [((0.3, -0.05, 1.0), 0.3), ((-0.34, 0.02, 1.8), 0.3), ((0.0, 0.33, 2.6), 0.3)]
OPPOSITE = [((0.9, 0.0, 1.2), 0.9), ((-0.9, 0.0, 2.2), 0.95)]


@pytest.mark.parametrize(("balls", "off"), [(THREE, 0.08), (OPPOSITE, 0.02)], ids=["three", "opposite"])
def test_a_soft_lamp_behind_several_things_is_hidden_by_all(balls: list[Any], off: float) -> None:
    """Shares of a lamp beside balls on the way, by straight lines to points of its disc."""
    objects = [Object("sphere", (scaled(size), moved(*at)), rgb=(0.5, 0.5, 0.5)) for at, size in balls]
    lamp, radius = np.array([0.0, 0.0, 4.0]), 0.15
    p = np.stack([np.linspace(-0.1, 0.1, 21), 0 * np.arange(21.0), 0 * np.arange(21.0)])
    n = np.tile([[0.0], [0.0], [1.0]], 21)
    solids = field(objects).opaque((ASIDE + WIDE) * radius)
    with solids.xp.inference():
        share = solids.shown(np.float32(lamp), radius, np.float32(p), np.float32(n))[0]
    r, turn = np.sqrt((np.arange(4000) + 0.5) / 4000), 2.399963 * np.arange(4000)
    disc = lamp[:, None] + radius * np.stack([r * np.cos(turn), r * np.sin(turn), 0 * r])
    way = disc[:, None] - p[:, :, None]  # (3, 21, 4000)
    way /= np.linalg.norm(way, axis=0)
    free = np.ones(way.shape[1:], bool)
    for at, size in balls:
        to = np.array(at)[:, None, None] - p[:, :, None]
        along = (to * way).sum(0)
        free &= (to * to).sum(0) - along**2 > size * size
    assert share == pytest.approx(free.mean(1), abs=off)
    assert abs(share - free.mean(1)).mean() < 0.03


@pytest.mark.parametrize("radius", [0.3, 0.04, 0.015])
def test_a_sharp_rim_hides_small_lamps_too(radius: float) -> None:
    """Shares of a lamp past the edge of a flat octahedron that rays cross shortly, by straight lines."""
    size, lamp = np.array([0.8, 0.25, 0.8]), np.array([-1.5, 3.0, 0.2])
    flat = Object("octahedron", (scaled(*size), moved(0.0, 1.0, 0.0)), rgb=(0.5, 0.5, 0.5))
    p = np.stack([np.linspace(-0.8, 2.2, 301), 0 * np.arange(301.0), 0 * np.arange(301.0)])
    n = np.tile([[0.0], [1.0], [0.0]], 301)
    solids = field([flat]).opaque((ASIDE + WIDE) * radius)
    with solids.xp.inference():
        share = solids.shown(np.float32(lamp), radius, np.float32(p), np.float32(n))[0]
    r, turn = radius * np.sqrt((np.arange(2000) + 0.5) / 2000), 2.399963 * np.arange(2000)
    free = []
    for at in p.T:
        axis = (lamp - at) / np.linalg.norm(lamp - at)
        u = np.cross(axis, (0.0, 0.0, 1.0)) / np.linalg.norm(np.cross(axis, (0.0, 0.0, 1.0)))
        v = np.cross(axis, u)
        to = (lamp + np.outer(r * np.cos(turn), u) + np.outer(r * np.sin(turn), v) - at) / size  # (K, 3)
        begin = (at - (0.0, 1.0, 0.0)) / size
        places = begin + (-begin / to)[:, :, None] * to[:, None]  # where coordinates are 0 (K, 3, 3)
        free.append((abs(places).sum(2).min(1) > 1).mean())  # |x| + |y| + |z| is least at one of these
    assert share == pytest.approx(np.array(free), abs=0.06)
    assert abs(share - free).mean() < 0.01


def test_noise_of_rays_goes_and_edges_stay() -> None:
    """Twice as bright on a ball as on the ground, and brighter at one place."""
    around = around_of("nsg 1; canvas(128, 128); sky(0.5); sphere { scale(0.8); translate(0, 0.3, 0); }")
    p, n = (np.asarray(part, np.float64) for part in around.seen[:2])
    there = p[0] < 1e5
    spot = np.exp(-((p[0] - 1) ** 2 + p[2] ** 2) / 0.1) * (n[1] > 0.999)
    light = np.where(n[1] > 0.999, 1.0 + spot, 2.0) * np.ones((3, 1))
    noise = np.random.default_rng(3).normal(0, 0.1, light.shape)
    with around.xp.inference():
        kept, even = (np.asarray(around._smoothed(np.float32(values))) for values in (light, light + noise))
    assert (kept - light)[:, there].std() < 0.01
    assert (even - light)[:, there].std() < 0.03


def test_a_small_bright_place_is_found_by_points_next_to_each_other() -> None:
    """Eight turns of 24 rays, shared with eight neighbours, have half of random turns' square error."""
    rows, rng = np.stack(np.divmod(np.arange(30 * 30), 30)), np.random.default_rng(4)
    errors: list[list[float]] = [[], []]
    for _ in range(10):
        angle, r = rng.uniform(0, 6.28), rng.uniform(0, 0.7)
        middle = r * np.array([np.cos(angle), np.sin(angle)])[:, None, None]
        for which, found in enumerate(errors):
            light = np.zeros((30, 30))
            for turn in range(8):
                even = (TURNS @ (rows + turn * FURTHER) + 0.5) % 1.0
                shift, turned = rng.random((2, 900)) if which else even
                at = np.arange(24)[:, None] + shift
                way = disc(np.sqrt(at / 24), GOLDEN * at + 2 * np.pi * turned)[:2]
                light += (((way - middle) ** 2).sum(0) < 0.04).mean(0).reshape(30, 30) / 8
            wide = (light[:, :-2] + 2 * light[:, 1:-1] + light[:, 2:]) / 4
            wide = (wide[:-2] + 2 * wide[1:-1] + wide[2:]) / 4
            found.append(float(((wide - 0.04) ** 2).mean()))
    assert np.mean(errors[0]) < np.mean(errors[1]) / 2
