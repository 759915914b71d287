"""The framed renderer against a slow loop, and what its shortcuts may leave out: pixels, objects, frames."""

from __future__ import annotations

import copy
import dataclasses
import threading

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Program, ProgramError
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.neural.draw import Drawing, draw
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.load import load_model
from tests.compiler.random_scenes import blob_scene, random_scene
from tests.drawing.slow import Slow, sample_points
from tests.pictures import Array, premultiplied

SLOW = Slow()
EQUAL = 2e-3
"""Of a channel: float32 against float64 on an outline that is a few hundredths of a pixel wide."""
BLENDED = 0.04
"""Of a channel: what one look at a pixel's centre misses of a colour that runs across the pixel."""


def leaf(geometry: str, colour: str, moves: str) -> str:
    return f"{geometry} {{ material flat {{ color({colour}); }} {moves} }}"


SMALL = " ".join(
    leaf(
        "star",
        f"hsv({i / 60}, 1, 1)",
        f"scale({0.03 + 0.002 * (i % 9)}); rotate({29 * i}deg); translate("
        f"{0.2 * (i % 10) + 0.013 * (i // 10) - 0.9}, {0.31 * (i // 10) + 0.007 * (i % 10) - 0.8});",
    )
    for i in range(60)
)
PARTS = (
    ("square", "#e04020", "scale(0.6, 0.4); rotate(20deg);"),
    ("star", "#30b050", "scale(0.5); translate(0.3, 0.2);"),
    ("pentagon", "#fff", "scale(0.3); translate(-0.4, 0.1);"),
    ("triangle", "#2050d0", "scale(0.5, 0.9); rotate(-70deg); translate(0, -0.3);"),
)
LEAVES = [leaf(*part) for part in PARTS]
BENT = "twirl(1.4); bend(-0.7); scale(1.2, 0.7); rotate(1rad); translate(0.2, 0); bend(0.6); twirl(0.5);"


def deformed(before: str, after: str) -> str:
    return " ".join(leaf(geometry, colour, f"{before} {moves} {after}") for geometry, colour, moves in PARTS)


SCENES = {
    "unions": " ".join(LEAVES),
    "subtract": "subtract { " + " ".join(LEAVES) + " }",
    "intersect": "intersect { " + " ".join(LEAVES[:2]) + " } " + leaf("pentagon", "#fff", "scale(0.3);"),
    "smooth": "smooth { " + " ".join(LEAVES) + " }",
    "smooth after a cut": f"smooth {{ subtract {{ {LEAVES[0]} {LEAVES[1]} }} {LEAVES[2]} {LEAVES[3]} }}",
    "deformed": deformed(BENT, ""),
    "deformed blends": "smooth { " + deformed("", "twirl(0.8); bend(0.5);") + " }",
    # where blends' errors add up: a pixel holds an outline that is told to be more than half a pixel away
    "blends upon blends": "smooth { "
    "pentagon { scale(0.24, 0.55); rotate(44deg); translate(-0.26, 0.36); } "
    "star { scale(0.47, 0.60); rotate(243deg); translate(-0.16, -0.36); } "
    "pentagon { scale(0.13, 0.33); rotate(36deg); translate(-0.24, -0.50); } "
    "triangle { scale(0.51, 0.56); rotate(63deg); translate(-0.02, -0.17); } "
    "triangle { scale(0.22, 0.14); rotate(218deg); translate(-0.21, 0.35); } "
    "square { scale(0.38, 0.59); rotate(168deg); translate(-0.19, 0.23); } }",
    "small": SMALL,
    "blends of small": f"smooth {{ {SMALL} }}",
    "thin": leaf("star", "#fff", "scale(1, 0.02);") + leaf("square", "#ff0", "scale(0.01, 2); rotate(6deg);"),
    "large": leaf("square", "#456", "scale(3e9);") + LEAVES[1],
    "far from the leaf": "star { translate(400, 0); scale(0.9); translate(-360, 0.1); }",
}  # fmt: skip


NETWORKS = {"torch": load_model("shapes2d").framed, "numpy": load_arrays("shapes2d").network}


@pytest.fixture(params=NETWORKS)
def network(request: pytest.FixtureRequest):
    return NETWORKS[request.param]


def program(scene: nsg.Scene | str, canvas: tuple[int, int] = (36, 28)) -> Program:
    scene = nsg.loads(scene) if isinstance(scene, str) else scene
    return compile_scene(scene.model_copy(update={"canvas": canvas, "background": None}))


def drawn(network, p: Program, **options: object) -> tuple[Array, Drawing]:
    drawing = draw(network, p, **options)
    return premultiplied(np.asarray(drawing.image)), drawing


def random_programs(make, count: int) -> list[Program]:
    found = []
    for seed in range(10_000):
        try:
            p = program(make(seed), (24, 26))
        except nsg.SceneError:
            continue
        if len(p) > 1 and not p.extended and np.ptp(SLOW.picture(p.vectors, p.tokens, (12, 13))) > 0.2:
            found.append(p)
        if len(found) == count:
            break
    return found


def assert_drawn(p: Program) -> None:
    """Sampled four times everywhere the loop's picture; adaptively the same, but for running colours."""
    exact = SLOW.picture(p.vectors, p.tokens, p.canvas)
    assert np.ptp(exact) > 0.2
    for network in NETWORKS.values():
        everywhere, _ = drawn(network, p, samples="four")
        np.testing.assert_allclose(everywhere, exact, rtol=0, atol=EQUAL)
        some, _ = drawn(network, p)
        np.testing.assert_allclose(some, exact, rtol=0, atol=BLENDED if 1 in p.tokens else EQUAL)


@pytest.mark.parametrize("name", SCENES)
def test_the_loop_draws_the_same(name: str) -> None:
    assert_drawn(program(SCENES[name], (56, 40) if name == "blends upon blends" else (36, 28)))


def test_the_loop_draws_random_scenes_the_same() -> None:
    for p in random_programs(random_scene, 6) + random_programs(blob_scene, 6):
        assert_drawn(p)


def test_over_a_background_and_as_straight_alpha(network) -> None:
    p = program(SCENES["unions"])
    exact = SLOW.picture(p.vectors, p.tokens, p.canvas)
    over, blue = (
        np.asarray(draw(network, dataclasses.replace(p, background=b)).image) for b in (None, (0, 0.5, 1))
    )
    np.testing.assert_allclose(blue, exact[..., :3] + (1 - exact[..., 3:]) * [0, 0.5, 1], rtol=0, atol=EQUAL)
    covered = exact[..., 3] > 0.2
    straight = exact[covered][:, :3] / exact[covered][:, 3:]
    np.testing.assert_allclose(over[covered][:, :3], straight, rtol=0, atol=5 * EQUAL)


def test_a_blend_shows_lines_between_colours_that_are_no_outlines(network) -> None:
    """Between two squares the nearer one's colour counts; a third one blends over the gap."""
    sides = [
        leaf("square", c, f"scale(0.3); translate({x}, 0);") for c, x in (("#f00", -0.34), ("#0f0", 0.35))
    ]
    p = program(
        f"chain {{ {' '.join(sides)} smooth {leaf('square', '#fff', 'scale(0.2); translate(0, 0.26);')} }}"
    )
    found, drawing = drawn(network, p)
    assert network.xp is not NUMPY or 0 < drawing.refined < drawing.met / 2
    np.testing.assert_allclose(found, drawn(network, p, samples="four")[0], rtol=0, atol=0.01)


def test_without_refining_a_pixel_is_its_centre(network) -> None:
    for name in ("unions", "smooth"):
        p = program(SCENES[name])
        points = sample_points(p.canvas).mean(2).reshape(-1, 2)
        state, shown, _ = SLOW.at(p.vectors, p.tokens, points)
        clear = (np.abs(state) > 1e-4).reshape(p.canvas[::-1])
        exact = np.concatenate([shown, np.ones((len(shown), 1))], 1) * (state < 0)[:, None]
        hard, drawing = drawn(network, p, samples="one")
        np.testing.assert_allclose(hard[clear], exact.reshape(hard.shape)[clear], rtol=0, atol=EQUAL)
        assert drawing.refined == 0
        assert 0 < drawing.pairs <= len(p) * len(points)


def test_strips_are_told_and_threads_change_nothing(network) -> None:
    p = program(SCENES["unions"], (36, 224))
    one, drawing = drawn(network, p)
    for threads in (1, 2, 3):
        told: list[float] = []
        by: set[int] = set()

        def progress(share: float, told: list[float] = told, by: set[int] = by) -> None:
            told.append(share)
            by.add(threading.get_ident())

        parts, again = drawn(network, p, progress=progress, threads=threads)
        assert (threading.get_ident() in by) == (threads == 1)
        assert sorted(told) == [0.25, 0.5, 0.75, 1.0]
        assert np.array_equal(parts, one)
        assert (again.pairs, again.refined, again.met) == (drawing.pairs, drawing.refined, drawing.met)


def test_vectors_that_nobody_can_draw(network) -> None:
    p = program(SCENES["unions"])
    first, second = slice(5, 11), slice(20, 26)
    for at, numbers in (
        (first, 0.0),  # a frame without an inverse
        (first, (1, 0, 0, 2, 0, 0)),
        (second, (1, 0, 0, 2, 0, 0)),
        (first, (3e31, 0, 0, 0, 3e31, 0)),  # one that float32 cannot follow
        (first, (3e-32, 0, 0, 0, 3e-32, 0)),
        (first, (3e-32, 0, 0, 0, 1, 0)),
        (11, 2e31),
        (45, np.nan),  # a colour that is not a number, of one object among others
        (5, np.nan),
    ):
        vectors = p.vectors.copy()
        vectors[1, at] = numbers
        forged = copy.copy(p)
        object.__setattr__(forged, "vectors", vectors)  # a Program itself refuses what is not a number
        with pytest.raises(ProgramError):
            draw(network, forged)


def test_vectors_at_the_edge_of_what_can_be_drawn(network) -> None:
    p = program(LEAVES[0])
    for numbers in (
        (1e30, 0, 0, 0, 1e30, 0),
        (1e-30, 0, 0, 0, 1e-30, 0),
        (1e-30, 0, 0, 0, 1e30, 0),
        (1e-24, 0, 1e15, 0, 1e-24, 0),
        (1, 0, 1e25, 0, 1, 1e25, 0.5, 1, 0),
    ):
        vectors = p.vectors.copy()
        vectors[0, 5 : 5 + len(numbers)] = numbers
        for skip in (True, False):
            edge = dataclasses.replace(p, vectors=vectors)
            assert np.isfinite(drawn(network, edge, skip=skip)[0]).all()
