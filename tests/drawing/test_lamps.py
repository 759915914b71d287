"""Lamps, glow and media of several densities, against float64 sums over the exact field."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import pytest

from scenelang.compiler.lifting import SOLID_LAYOUT
from scenelang.compiler.spaces import Ground, Light, Stage, Triple
from scenelang.compiler.steps import Shell
from scenelang.drawing.closed import closed_forms
from scenelang.drawing.solid.draw import Lighting, Points
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.plain import solid_field
from tests.drawing.light_oracle import Oracle
from tests.drawing.solids import (
    Object,
    everywhere,
    graph,
    moved,
    network,
    scaled,
    torch_network,
    turned,
    vector,
)

PLACES = SOLID_LAYOUT.places


def field_of(
    objects: list[Object], density: Sequence[float] = (), glow: Sequence[Triple] = (), net: Any = None
) -> SolidField:
    net = net or closed_forms("solids3d")
    vectors = np.array([vector(o, net) for o in objects], np.float32)
    if density:
        vectors[:, PLACES.density] = density
    if glow:
        vectors[:, PLACES.glow] = glow
    tokens = np.array([{"union": 0, "smooth": 1, "subtract": 2, "intersect": 3}[o.token] for o in objects])
    return solid_field(net, vectors, tokens.astype(np.int8))


def some_ways(stage: Stage, count: int, spread: float = 1.1) -> np.ndarray:
    """Unit directions (3, count) from the eye to about the origin."""
    to = np.random.default_rng(1).uniform(-spread, spread, (3, count)) - np.reshape(stage.camera.eye, (3, 1))
    return np.asarray(to / np.linalg.norm(to, axis=0), np.float32)


def compared(
    objects: list[Object],
    stage: Stage,
    count: int,
    density: Sequence[float] = (),
    glow: Sequence[Triple] = (),
    net: Any = None,
    points: int = 1000,
) -> tuple[np.ndarray, np.ndarray]:
    """Light (3, count) along rays by the renderer and by the oracle."""
    field = field_of(objects, density, glow, net)
    way = some_ways(stage, count)
    with field.xp.inference():
        shade = Lighting(field, stage).shade(field.xp.array(way, field.network.codes))
        ours = field.xp.to_numpy(shade.radiance)
    return ours, summed(tuple(objects), stage, count, tuple(density), tuple(glow), points)


@cache
def summed(
    objects: tuple[Object, ...],
    stage: Stage,
    count: int,
    density: tuple[float, ...],
    glow: tuple[Triple, ...],
    points: int,
) -> np.ndarray:
    """Light along the same rays by the oracle, to which all libraries are held."""
    oracle = Oracle(graph(objects), stage, density, glow, points)
    return np.array([oracle.radiance(d) for d in some_ways(stage, count).T.astype(float)]).T


MIST = [
    Object("sphere", (scaled(0.9),), "volumetric", (0.3, 0.5, 0.9)),
    Object("box", (scaled(0.6), moved(0.5, 0.2, 0.3)), "volumetric", (0.9, 0.5, 0.3)),
    Object("sphere", (scaled(0.3), moved(-0.3, 0.1, 0.5)), "volumetric", (0.9, 0.5, 0.3)),
]
SOLIDS = [
    Object("sphere", (scaled(0.7), moved(-0.3, 0.0, 0.0))),
    Object("box", (scaled(0.6, 0.9, 0.5), moved(0.6, 0.3, 0.4)), rgb=(0.3, 0.8, 0.5)),
]
TWO = (Light((2.5, 4.0, 3.0), 12.0, (1.0, 0.8, 0.6)), Light((-3.0, 2.0, 1.0), 9.0, (0.4, 0.6, 1.0)))


@pytest.mark.parametrize("library", ["closed", "numpy", "torch"])
def test_media_of_several_densities_and_what_glows(library: str) -> None:
    net = {"closed": None, "numpy": network(), "torch": torch_network()}[library]
    density, glow = [1.5, 8.0, 0.7], [(0.0, 0.0, 0.0), (0.5, 0.1, 0.0), (0.0, 0.0, 0.8)]
    ours, exact = compared(MIST, Stage(lights=TWO), 6, density, glow, net)
    off = abs(ours - exact).max(0)
    assert np.median(off) < 4e-3
    assert off.max() < 0.03


@pytest.mark.parametrize("library", ["closed", "torch"])
def test_a_dense_ball_in_thin_media_is_as_deep_as_its_chords(library: str) -> None:
    """At its rim too, where these are short beside the whole way."""
    box = Object("box", (scaled(3.0**0.5 * 2),), "volumetric")
    ball = Object("sphere", (scaled(0.3), moved(0.1, 0.2, 0.25)), "volumetric")
    field = field_of([box, ball], [0.1, 5.0], net=torch_network() if library == "torch" else None)
    off, like = np.linspace(0.0, 0.29, 30), field.network.codes
    begin = np.stack([0.1 + off, 0 * off + 0.2, 0 * off + 5.0]).astype(np.float32)
    way = np.tile(np.float32([[0], [0], [-1]]), 30)
    with field.xp.inference():
        rays = (field.xp.array(part, like) for part in (begin, way, np.full(30, 10, np.float32)))
        depth = field.xp.to_numpy(field.march(*rays, gap=0.009).depth)
    assert depth == pytest.approx(0.1 * 4 + 4.9 * 2 * np.sqrt(0.09 - off * off), abs=0.05)


def test_solids_glow_and_lamps_add_up() -> None:
    glow = [(0.0, 0.4, 0.0), (0.0, 0.0, 0.0)]
    ours, exact = compared(SOLIDS, Stage(lights=TWO), 60, glow=glow)
    assert np.quantile(abs(ours - exact).max(0), 0.95) < 3e-3
    none, dark = compared(SOLIDS, Stage(lights=(), ground=Ground()), 30)
    assert abs(none - dark).max() < 3e-3


def test_materials_are_told_where_they_hold() -> None:
    field = field_of(MIST, [1.5, 8.0, 0.7], [(0.0, 0.0, 0.0), (0.5, 0.1, 0.0), (0.0, 0.0, 0.8)])
    found = field.material(everywhere(field, np.array([[-0.6, 0.0, 0.0], [0.5, 0.2, 0.3]], np.float32).T))
    assert found.density == pytest.approx([1.5, 8.0])
    assert pytest.approx(np.array([[0, 0, 0], [0.5, 0.1, 0]])) == found.glow.T
    assert found.medium.all()
    assert not found.roughness.any()


def soft(radius: float, at: Triple = (2.0, 3.0, 2.0), power: float = 20.0) -> Light:
    return Light(at, power, (1.0, 0.9, 0.8), radius)


@pytest.mark.parametrize("radius", [0.15, 0.7])
@pytest.mark.parametrize("library", ["closed", "torch"])
def test_a_lamp_of_a_radius_gives_soft_shadows(radius: float, library: str) -> None:
    net = None if library == "closed" else torch_network()
    ours, exact = compared(SOLIDS, Stage(lights=(soft(radius),)), 60, net=net, points=800)
    off = abs(ours - exact).max(0)
    assert np.sort(off)[-4] < 0.03
    assert off.mean() < 4e-3


def test_soft_light_goes_through_mist_and_past_solids() -> None:
    ours, exact = compared([*MIST[:2], SOLIDS[1]], Stage(lights=(soft(0.4),)), 3, [1.5, 6.0, 3.0], points=60)
    assert abs(ours - exact).max() < 0.04


FAR = Object("sphere", (scaled(0.1), moved(50.0, 0.0, 0.0)))


def received(objects: list[Object], lamp: Light, p: np.ndarray, n: np.ndarray) -> np.ndarray:
    """Light that points (3, K) receive of a lamp, by the renderer."""
    lighting = Lighting(field_of(objects or [FAR]), Stage(lights=(lamp,)))
    colour = np.ones((3, p.shape[1]), np.float32)
    points = Points(p.astype(np.float32), n.astype(np.float32), 0 * colour, colour)
    with lighting.xp.inference():
        return np.asarray(lighting._lit(points, p[0, :0])[0])


def test_a_sphere_partly_below_the_horizon() -> None:
    angle = np.linspace(0, np.pi, 50)
    n = np.stack([np.sin(angle), np.cos(angle), 0 * angle])
    p, lamp = np.zeros((3, 50)), soft(0.8, (0.0, 1.5, 0.0))
    oracle = Oracle(graph([]), Stage(lights=(lamp,)), points=40_000)
    exact = [oracle.arriving(lamp, np.zeros(3), each) for each in n.T]
    assert received([], lamp, p, n)[0] == pytest.approx(exact, abs=2e-3)
    assert received([], lamp, np.array([[0.0], [1.0], [0.5]]), n[:, :1])[0] == 0.0  # within it


def test_what_is_thin_or_around_a_lamp_hides_it() -> None:
    up = np.zeros((3, 9))
    up[1] = 1
    floor = np.stack([np.linspace(-0.4, 0.4, 9), np.full(9, -1.0), np.zeros(9)])
    lamp = soft(0.4, (0.0, 3.0, 0.0))
    plate = Object("box", (scaled(2.0, 0.02, 2.0), turned(0.5, 1.0, 0.0, 0.3), moved(0.0, 1.0, 0.0)))
    assert received([plate], lamp, floor, up).max() < 0.02
    around = Object("sphere", (scaled(0.6), moved(0.0, 3.0, 0.0)))
    assert received([around], lamp, floor, up).max() < 0.02
    shell = Object("sphere", (Shell(0.1), scaled(0.8), moved(0.0, 3.0, 0.0)))
    assert received([shell], lamp, floor, up).max() < 0.02
    within = Object("sphere", (scaled(0.3), moved(0.0, 3.0, 0.0)))
    assert received([within], lamp, floor, up) == pytest.approx(received([], lamp, floor, up), rel=0.02)


def test_light_changes_little_where_things_move_little() -> None:
    rng = np.random.default_rng(3)
    p = np.stack([rng.uniform(-2, 1, 4000), np.full(4000, -1.0), rng.uniform(-2, 1, 4000)])
    up, lamp = np.zeros((3, 4000)), soft(0.4)
    up[1] = 1
    first, second = (
        received([o._replace(steps=(*o.steps, moved(by, 0, 0))) for o in SOLIDS], lamp, p, up)[0]
        for by in (0.0, 1e-4)
    )
    assert abs(first - second).max() < 0.02
    assert abs(first - second).mean() < 3e-4
