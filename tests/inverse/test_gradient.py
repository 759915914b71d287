"""Derivatives of soft pictures, against differences of these in float64 and against what else draws them."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from scenelang.compiler.program import Program
from scenelang.drawing.neural.draw import draw_objects
from scenelang.inverse.problem import FitProblem, Moment, Rates, SoftPlane, numbers_of, softened
from scenelang.inverse.search import Point, TargetPicture, over, space_of
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source

STAR = "star { scale(s, 0.6); rotate(a); translate(x, 0.1); material flat { color(#3366aa); } }"
SCENES = {
    "moves": "background(none); param x = 0.1 in -1..1; param s = 0.5 in 0.2..0.8;"
    "param a = 20deg in 0deg..90deg;" + STAR,
    "warps": "background(none); param k = 0.4 in -1..1; param b = 0.3 in -1..1; param x = 0.1 in 0..1;"
    "square { twirl(k); scale(0.5, 0.7); translate(x, 0.2); bend(b); material flat { color(#aa3322); } }",
    "booleans": "background(none); param x = 0.1 in -1..1; param y = 0.1 in -1..1; param s = 0.3 in 0.1..0.6;"
    "chain { square { scale(0.8); translate(y, 0); material flat { color(#228833); } }"
    "subtract star { scale(s); translate(x, 0.3); } intersect pentagon { scale(0.8); translate(x, y); } }",
    "skins": "background(none); param r = 0.2 in -0.4..1; param w = 0.3 in 0.1..0.9; param x = 0.3 in 0..1;"
    "triangle { grow(r); shell(w); scale(0.3, 0.4); translate(x, 0.1); material flat { color(#aa3322); } }"
    "star { shell(w); grow(r); scale(0.3); translate(-0.4, x); material flat { color(#2288dd); } }",
    "blends": "background(none); param x = 0.5 in 0..1; param k = 0.2 in 0.05..0.4; param r = 0.3 in 0..1;"
    "smooth(k = k) { star { scale(0.4); translate(-0.2, 0); material flat { color([r, 0.2, 0.1]); } }"
    "square { scale(0.3); translate(x, 0); material flat { color(#2288dd); } } }",
    "glass": "background([0.9, 0.8, 0.5]); param x = 0.1 in -1..1; param a = 0.6 in 0..1;"
    "param r = 0.3 in 0..1;"
    "chain { square { scale(0.6); material flat { color([r, 0.2, 0.1]); opacity(1 - a); } }"
    "pentagon { scale(0.4); translate(x, 0.1); material flat { color([0.1, r, 0.9]); opacity(a); } }"
    "smooth star { scale(0.3); translate(-0.3, x); } }",
    "occlusion": "param x = 0.1 in -1..1; param r = 0.3 in 0..1; param g = 0.4 in 0..1;"
    "background([g, 0.5, 0.2]); square { scale(0.6); material flat { color([r, 0.2, 0.1]); } }"
    "pentagon { scale(0.4); translate(x, 0.1); material flat { color([0.1, r, 0.9]); } }",
}


def problem(text: str, frames: int = 1) -> FitProblem:
    source = Moment(Source(text=SourceFile("a.nsg", text)).parsed(Diagnostics()))
    rng = np.random.default_rng(3)
    target = TargetPicture(rng.random((40, 48, 3)), rng.random((40, 48)), (0.2, 0.9, 0.4))
    space = space_of(source.evaluated({})[0])
    return FitProblem([source] * frames, space, [target] * frames, (48, 40), soft=True)


def here(drawn: FitProblem) -> Point:
    return drawn.space.point({})


def residuals_change(drawn: FitProblem, twice: FitProblem) -> None:
    """As slopes say: from params on, through evaluation, compilation and the levels of the pyramid.

    A decoder has kinks closer to each other than the ends of these differences.
    """
    u = here(drawn)
    found = drawn.slopes(u)
    assert found is not None
    assert drawn(u) is not None
    expected = np.zeros_like(found[0])
    for axis in range(3):
        ends = [drawn(u + sign * 3e-4 * np.eye(3)[axis]) for sign in (1, -1)]
        assert ends[0] is not None
        assert ends[1] is not None
        expected[:, axis] = (ends[0] - ends[1]) / 6e-4
    both = twice.slopes(u)
    assert both is not None
    assert np.square(both[0]).sum(0) == pytest.approx(np.square(found[0]).sum(0))
    off = abs(found[0] - expected)
    assert np.linalg.norm(off) < 0.25 * np.linalg.norm(expected)
    assert (off > 0.02 * abs(expected).max(0)).mean() < 0.02


@pytest.mark.parametrize("name", SCENES)
def test_slopes_are_what_differences_of_the_same_picture_are(name: str) -> None:
    """All but some pixels on a kink of a decoder or a clamp, which lie between both ends of a difference."""
    drawn = problem(SCENES[name])
    (program,) = drawn.programs(here(drawn))
    assert program is not None
    rates, known = Rates(lambda u: drawn.programs(u)[0], drawn.space).at(here(drawn), program)
    assert known.all()
    soft, base, step = SoftPlane(program, dtype=torch.float64), numbers_of(program), 1e-7
    found = soft(base, rates)[1]
    high, low = (
        np.stack([soft(base + sign * rate, rates[:, :0])[0] for rate in rates.T], 3) for sign in (step, -step)
    )
    expected = (high - low) / (2 * step)
    off = abs(found - expected) > 1e-6 * abs(expected).max((0, 1, 2))
    assert off.mean() < 1e-3
    assert (abs(expected).max((0, 1, 2)) > 0.1).all()
    picture = SoftPlane(program, drawn.under)(base, np.zeros((len(base), 0)))[0]
    network = draw_objects(softened(program.model, 2 / 40), program, samples="one", skip=False).image
    assert picture == pytest.approx(over(network, drawn.under), abs=2e-5)
    residuals_change(drawn, problem(SCENES[name], frames=2))


def test_of_groups_and_cuts_of_a_width_there_are_no_slopes() -> None:
    for width, inner, none in (
        ("", "star;", False),
        ("(k = 0.1 + x)", "star;", True),
        ("", "subtract { star; square { scale(x); } }", True),
    ):
        drawn = problem(f"param x = 0.1 in 0.05..1; subtract{width} {{ square; {inner} }}")
        assert (drawn.slopes(here(drawn)) is None) == none


def test_params_that_move_different_numbers_are_compiled_together() -> None:
    drawn, compiled = problem(SCENES["occlusion"]), []

    def program(u: Point) -> Program | None:
        compiled.append(u)
        return drawn.programs(u)[0]

    rates, u = Rates(program, drawn.space), here(drawn)
    (found,) = drawn.programs(u)
    assert found is not None
    apart, together = (rates.at(u, found)[0] for _ in range(2))
    assert len(compiled) == 3 + 1
    assert together == pytest.approx(apart, abs=1e-6 * abs(apart).max())


def test_where_objects_come_and_go_nothing_is_known() -> None:
    text = (
        "param n = 2.0005 in 1..3; param x = 0.1 in 0..1; for (i in 0..<1 + abs(floor(1000 * n) - 2000)) {"
        "square { scale(0.2); translate(0.3 * i + x, 0); material flat { color(#111111); } } }"
    )
    drawn = problem(text)
    found = drawn.slopes(here(drawn))
    assert found is not None
    assert found[1].tolist() == [False, True]
    assert not found[0][:, 0].any()
    to_one_side = problem(text.replace("abs(floor(1000 * n) - 2000)", "max(0, floor(1000 * n) - 2000)"))
    found = to_one_side.slopes(here(to_one_side))
    assert found is not None
    assert found[1].all()
