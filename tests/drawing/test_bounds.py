"""What blocks of pixels are ruled out by: attacked at random, and against pictures without it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import scenelang as nsg
from lab.slopes import distances, proved_slack
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Program
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.neural.assets import GridShape
from scenelang.drawing.neural.draw import draw
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.meetings import Interval, Pairs, flat_nesting, meetings_of, shown
from scenelang.drawing.neural.network import RADII, RADIUS, Cell, Slopes
from tests.pictures import Array, premultiplied

RNG = np.random.default_rng
NETWORK = load_arrays("shapes2d").network


def discs(rng: np.random.Generator, count: int) -> tuple[Array, Array, Array]:
    """Points (2, M) of the disc that a decoder sees, radii of all sizes, and points within these."""
    angle, length = rng.uniform(0, 2 * np.pi, count), RADIUS * np.sqrt(rng.uniform(0, 1, count))
    p = length * np.stack([np.cos(angle), np.sin(angle)])
    radius = 10 ** rng.uniform(-4, 0.5, count)
    angle, share = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(0, 1, count))
    return p, radius, p + share * radius * np.stack([np.cos(angle), np.sin(angle)])


def seen(layers, q: Array) -> Array:
    """What the network answers anywhere, in float64."""
    length = np.hypot(*q)
    at = q * (RADIUS / np.maximum(length, RADIUS))
    return distances(layers, at.T) + (length - RADIUS).clip(0) * float(NETWORK.far[0])


def layers_of(code: Array):
    return [(w[0].astype(float), b[0].astype(float)) for w, b in NETWORK.decoder_weights(code[None]).layers]


@pytest.mark.parametrize("index", range(4))
def test_no_point_breaks_the_slopes_of_a_shipped_geometry(index: int) -> None:
    """Random pairs of points, and a climb from the worst of them."""
    code, rng = NETWORK.codes[index], RNG(index)
    slopes, layers = NETWORK.slopes[code.tobytes()], layers_of(code)
    p, radius, q = discs(rng, 200_000)
    worst = np.inf
    for _ in range(12):
        left = slopes.rise(p, radius) - abs(seen(layers, p) - seen(layers, q))
        worst = min(worst, left.min())
        best = np.argsort(left / radius)[:2000]
        p, radius, q = (np.repeat(part[..., best], 10, -1) for part in (p, radius, q))
        p = p + 0.03 * radius * rng.standard_normal(p.shape)
        q = q + 0.03 * radius * rng.standard_normal(q.shape)
        radius = np.hypot(*(q - p)) + 1e-12
    assert worst >= 0


def test_slopes_are_of_use() -> None:
    """Nine of ten places of a small radius allow for less than a twentieth of a leaf unit beside the root."""
    for code in NETWORK.codes:
        p, _, _ = discs(RNG(0), 2000)
        radius = np.full(2000, RADII[0] / 2)
        assert np.quantile(NETWORK.slopes[code.tobytes()].rise(p, radius), 0.9) < 1.1 * radius[0] + 0.05


def test_a_proof_holds_for_networks_of_any_kind() -> None:
    """Random ones are steep and full of corners."""
    rng = RNG(3)
    layers = [
        (rng.standard_normal((6, 2)), rng.standard_normal(6)),
        (0.5 * rng.standard_normal((6, 6)), rng.standard_normal(6)),
        (0.5 * rng.standard_normal((1, 6)), rng.standard_normal(1)),
    ]
    slopes = Slopes(proved_slack(layers, near=0.05), 0.0)
    p, radius, q = discs(rng, 200_000)
    inside = np.hypot(*q) <= RADIUS
    off = abs(distances(layers, p.T) - distances(layers, q.T))
    left = (slopes.rise(p, radius) - off)[inside]
    assert left.min() >= 0
    assert np.median((left / off[inside].clip(1e-3))[radius[inside] < 0.2]) < 40


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


@pytest.mark.parametrize("seed", range(3))
def test_no_point_breaks_intervals_through_the_cell(seed: int) -> None:
    """Streams of all tokens: distances and colours at random, folded one by one, all objects and some."""
    rng, blocks, most = RNG(seed), 300, 7
    count = rng.integers(1, most, blocks)
    block = np.repeat(np.arange(blocks), count)
    tokens = rng.integers(0, 4, len(block))
    kind = NETWORK.cell_weights()
    table = [np.moveaxis(np.asarray(part)[tokens], 0, -1) for part in kind]
    cell = Cell(*table[:3], table[3][:, 0])
    middle = rng.normal(0, 0.4, len(block)) * rng.choice([0.02, 1], len(block))
    rise = np.where(rng.uniform(0, 1, len(block)) < 0.05, 1e9, 10 ** rng.uniform(-4, -0.3, len(block)))
    dark = rng.choice(2, (3, len(block))).astype(float)
    bright = np.where(rng.uniform(0, 1, len(block)) < 0.3, 1.0, dark)  # of textures nothing is known
    never = np.zeros(len(block), bool)
    meetings, source = meetings_of(Pairs(block, np.arange(len(block)), never, never, rise))
    part = Cell(*(p[..., source] for p in cell))
    slope = float(np.exp(NETWORK.read_slope)) / 4
    ends = Interval(*((middle + side * rise)[source].astype(np.float32) for side in (-1, 1)))
    tints = Interval(*(tint[:, source].astype(np.float32) for tint in (dark, bright)))
    with np.errstate(all="ignore"):
        found = shown(meetings, ends, part, tints, 1.0, slope, flat_nesting(meetings), part)
    shut, opened = np.empty((2, len(block)), bool)
    shut[source], opened[source] = found.shut, found.open
    assert 0.05 < shut.mean() < 0.95
    assert opened.any()
    low, high = np.empty((2, 4, blocks))
    low[:, meetings.columns], high[:, meetings.columns] = found.picture
    for _ in range(60):
        d = middle + np.minimum(rise, 0.5) * rng.choice([-1, 1, 0, rng.uniform(-1, 1)], len(block))
        colours = dark + rng.choice([0, 1, rng.uniform(0, 1)], dark.shape) * (bright - dark)
        state, shade = np.ones(blocks), np.zeros((3, blocks))
        less, dull = state.copy(), shade.copy()  # without what is said not to matter
        for i in np.lexsort((block, np.arange(len(block)))):
            b = block[i]
            for values, paint, does, given in (
                (state, shade, True, False),
                (less, dull, ~shut[i], opened[i]),
            ):
                if not does:
                    continue
                levels = cell.lines[:, 0, i] * d[i] + cell.lines[:, 1, i] * values[b] + cell.bias[:, i]
                gates = np.ones(3) if given else levels.clip(0, 1)
                take = gates[0]
                values[b] += take * (cell.candidate[0, 0, i] * d[i] - values[b]) - cell.bump[0, i] * take * (
                    1 - take
                )
                paint[:, b] += gates[1:].max() * (colours[:, i] - paint[:, b])
        alpha = (0.5 - slope * state).clip(0, 1)
        picture = np.vstack([shade * alpha, alpha])
        assert (picture >= low - 1e-5).all()
        assert (picture <= high + 1e-5).all()
        np.testing.assert_allclose(less, state, rtol=0, atol=1e-6)
        np.testing.assert_allclose(dull, shade, rtol=0, atol=1e-4)


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
    p = program("square { scale(0.5); } star { scale(0.3); }", (128, 128))
    unproved = load_arrays("shapes2d").network
    bare = type(unproved).__new__(type(unproved))
    bare.__dict__.update(vars(unproved), slopes={})
    known, unknown = (draw(net, p) for net in (NETWORK, bare))
    assert unknown.met > 1.5 * known.met
    np.testing.assert_allclose(np.asarray(known.image), np.asarray(unknown.image), rtol=0, atol=1 / 1000)
    other = p.vectors.copy()
    other[0, 0] += 1e-3  # a code that nobody proved anything of
    drawing = draw(NETWORK, dataclasses.replace(p, vectors=other))
    assert known.met < drawing.met
