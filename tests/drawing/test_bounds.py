"""Blocks of pixels that are ruled out: bounds attacked at random, and pictures against those without it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

import scenelang as nsg
from lab.probes import FLAT, rng_of
from lab.sets.plane import GEOMETRIES, SETS, random_scene
from scenelang.assets.element_file import ElementFile
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Program
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.closed import closed_forms
from scenelang.drawing.neural.assets import GridShape
from scenelang.drawing.neural.coverage import Coverage
from scenelang.drawing.neural.draw import draw
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.network import RADIUS
from scenelang.drawing.neural.units import FEATURES, UP, LeafUnits
from scenelang.drawing.solid.norms import norms
from scenelang.language.words import COMBINE
from tests.assets.shapes import element, noise, square
from tests.compiler.random_scenes import blob_scene
from tests.compiler.random_scenes import random_scene as random_tree
from tests.pictures import Array, premultiplied

RNG = np.random.default_rng
NETWORK = load_arrays("shapes2d").network
BEFORE = "bb3fe72417a92d611df31e12529f9ca7527d73717b8b521820ddc1520656629b"


def discs(rng: np.random.Generator, count: int) -> tuple[Array, Array, Array]:
    """Points (2, M) of the disc that a decoder sees, radii of all sizes, and points within these."""
    angle, length = rng.uniform(0, 2 * np.pi, count), RADIUS * np.sqrt(rng.uniform(0, 1, count))
    p = length * np.stack([np.cos(angle), np.sin(angle)])
    radius = 10 ** rng.uniform(-4, 0.5, count)
    angle, share = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(0, 1, count))
    return p, radius, p + share * radius * np.stack([np.cos(angle), np.sin(angle)])


def left_of(decoder: LeafUnits, rng: np.random.Generator) -> float:
    """How much of a decoder's rise is left at the worst of random pairs of points, and of a climb from it."""
    p, radius, q = discs(rng, 100_000)
    worst = np.inf
    for _ in range(12):
        left = decoder.rise(p, radius) - abs(decoder.distance(p) - decoder.distance(q))
        worst = min(worst, left.min())
        best = np.argsort(left / radius)[:1000]
        p, radius, q = (np.repeat(part[..., best], 10, -1) for part in (p, radius, q))
        p = p + 0.03 * radius * rng.standard_normal(p.shape)
        q = q + 0.03 * radius * rng.standard_normal(q.shape)
        radius = np.hypot(*(q - p)) + 1e-12
    return float(worst)


@pytest.mark.parametrize("index", range(6))
def test_no_point_breaks_the_rise_of_a_shipped_geometry(index: int) -> None:
    decoder, rng = NETWORK.decoders(NETWORK.codes)[index], RNG(index)
    assert left_of(decoder, rng) >= -1e-12
    p, radius, _ = discs(rng, 10_000)  # away from outlines it is that of a true distance, or little more
    share = (decoder.rise(p, radius) / radius)[abs(decoder.distance(p)) > 1.5 * radius]
    assert np.mean(share) < 1.02
    assert share.max() < 1.6


def test_a_rise_holds_for_units_of_any_kind() -> None:
    """Of random lines in all features, some of which are nowhere above zero."""
    for seed in range(5):
        rng = RNG(seed)
        lines = rng.standard_normal((12, FEATURES)) * (rng.random((12, FEATURES)) < 0.5)
        decoder = LeafUnits(NUMPY, norms(NUMPY, lines, np.float64(0.3), RADIUS, UP, notched=True))
        assert left_of(decoder, rng) >= -1e-12
    assert np.isinf(decoder.rise(np.full((2, 1), np.nan), np.ones(1)))
    assert decoder.rise(np.zeros((2, 1)), np.full(1, np.inf)) > 1e6


@pytest.mark.parametrize("side", [5, 33, 70])
def test_no_point_breaks_the_slopes_of_an_element(side: int) -> None:
    rng = RNG(side)
    axis = np.linspace(-1, 1, side)
    grid = np.hypot(*np.meshgrid(axis, axis)) - 0.6 + rng.uniform(0, 0.02, (side, side))
    shape = GridShape(NUMPY, grid.reshape(-1), side, 2)
    p, radius, q = discs(rng, 100_000)
    assert (shape.slopes().rise(p, radius) - abs(shape.distance(p) - shape.distance(q))).min() >= -1e-9
    ends = GridShape(NUMPY, (grid - 2).reshape(-1), side, 2)  # inside up to its border, where it jumps
    assert np.isinf(ends.slopes().rise(p, radius)).all()


def program(scene: nsg.Scene | str, canvas: tuple[int, int] = (96, 80)) -> Program:
    scene = nsg.loads(scene) if isinstance(scene, str) else scene
    return compile_scene(scene.model_copy(update={"canvas": canvas, "background": None}))


def test_what_is_hidden_costs_nothing() -> None:
    """Objects of all colours behind one that covers the canvas, which is bent: the compiler cannot tell."""
    hidden = " ".join(
        f"star {{ scale(0.3); material flat {{ color(hsv({i / 40}, 1, 1)); }} rotate({7 * i}deg); }}"
        for i in range(40)
    )
    drawing = draw(NETWORK, program(f"{hidden} square {{ bend(0.1); scale(4); }}", (256, 256)))
    assert drawing.met == drawing.refined == 0
    assert np.ptp(premultiplied(np.asarray(drawing.image)), axis=(0, 1)).max() < 1e-4


def test_nothing_is_ruled_out_of_which_nothing_is_proved() -> None:
    """Of decoders that others replaced it is not known how fast they change."""
    p = program("square { scale(0.5); } star { scale(0.3); }", (128, 128))
    before = load_arrays("shapes2d", BEFORE).network
    known, unknown = (draw(net, p) for net in (NETWORK, before))
    assert unknown.met > 1.5 * known.met
    off = abs(np.asarray(known.image) - np.asarray(unknown.image))
    assert (off > 1 / 255).mean() < 0.001


EGG = element(lambda x, y: np.hypot(x, y / 0.6) - 0.5, "egg", d=2)
ZOO = nsg.Elements.of(
    "zoo", "zoo.safetensors", ElementFile.of([element(square, "tile", d=2), EGG, noise(9, 7)])
)


def wild(rng: np.random.Generator) -> nsg.Scene:
    """Sizes, places, blends and warps of all magnitudes, warps first and last, elements and textures."""

    def some(*moves: nsg.Twirl | nsg.Bend) -> list[nsg.Twirl | nsg.Bend]:
        return [*moves[: rng.integers(len(moves) + 1)]]

    links = []
    for at in range(rng.integers(1, 9)):
        x, y, k, turn, across, up, twirl, bend = rng.normal(0, 1, 8).tolist()
        size = 10 ** rng.uniform(-2, 0.5, 2)
        moves = [
            *some(nsg.Twirl(3 * twirl), nsg.Bend(2 * bend)),
            nsg.Scale(float(size[0]), float(size[1]), 1.0),
            nsg.Rotate(angle=3 * turn),
            nsg.Shear("xy", k),
            nsg.Translate(0.5 * x, 0.5 * y),
            *some(nsg.Bend(across), nsg.Twirl(up)),
        ]
        worn = nsg.Material(
            "zoo.bark" if rng.random() < 0.2 else "flat", nsg.Color(tuple(rng.uniform(0, 1, 3).tolist()))
        )
        shape = str(rng.choice([*GEOMETRIES, "zoo.tile", "zoo.egg"]))
        joined = str(rng.choice([*COMBINE])) if at else "union"
        widths = [float(10 ** rng.uniform(-2, 0.5))] if joined == "smooth" else []
        links.append(nsg.Link(joined, nsg.Object(shape, moves, worn), *widths))
    return nsg.Scene(elements=ZOO, nodes=nsg.Chain(links))


def of_sets(seed: int) -> Iterator[tuple[str, nsg.Scene]]:
    for name, config in SETS.items():
        side = 64 if max(config.objects) > 16 else 88
        yield name, random_scene(rng_of(seed, 0), config).sized((side, 80))


def of_probes(seed: int) -> Iterator[tuple[str, nsg.Scene]]:
    for name, probe in FLAT.probes.items():
        for value in (probe.values[0], probe.values[-1]):
            if value <= 16 or name not in ("objects", "blends", "canvas"):
                yield f"{name} {value}", probe.make(rng_of(seed, 0), value).sized((88, 80))


def of_all_kinds(seed: int) -> Iterator[tuple[str, nsg.Scene]]:
    for at in range(8 * seed, 8 * seed + 8):
        yield f"tree {at}", random_tree(at).sized((88, 80))
        yield f"blob {at}", blob_scene(at).sized((88, 80))
        yield f"wild {at}", wild(rng_of(at, 0)).sized((88, 80))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", [of_sets, of_probes, of_all_kinds])
def test_nothing_that_shows_is_ruled_out(
    kind: Callable[[int], Iterator[tuple[str, nsg.Scene]]], seed: int
) -> None:
    """By the network and, of every other scene, by formulas: true distances' bounds have no slack."""
    met = np.zeros(2)
    for at, (name, scene) in enumerate(kind(seed)):
        model = "shapes2d"
        try:
            p = nsg.compile(scene.model_copy(update={"background": None}), model=model)
        except nsg.SceneError:
            continue
        for net in (load_arrays(model).network, *[closed_forms(model)][at % 2 :]):
            field = Field(net, p.vectors, p.tokens, p.brought(), p.paints())  # type: ignore[arg-type]
            ways = [
                Coverage(field, skip=skip).tile(p.canvas, range(p.canvas[1]), "four")
                for skip in (True, False)
            ]
            off = abs(ways[0].picture - ways[1].picture).max()
            assert off < 1 / 255, (name, type(net).__name__, off)
            met += [way.met for way in ways]
    assert met[0] < 0.7 * met[1]


def test_what_is_out_of_reach_moves_no_outline_by_long_rows_of_blends() -> None:
    """A row of 32, one sample of which lies 10⁻⁵ from the outline."""
    p = nsg.compile(FLAT.probes["blends"].make(rng_of(2021, 1), 32), model="shapes2d")
    field = Field(load_arrays("shapes2d").network, p.vectors, p.tokens)
    ways = [Coverage(field, skip=skip).tile(p.canvas, range(160, 168), "four") for skip in (True, False)]
    assert abs(ways[0].picture - ways[1].picture).max() < 1 / 255
    assert ways[0].pairs < 0.7 * ways[1].pairs
