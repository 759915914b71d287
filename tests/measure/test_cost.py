"""What a frame costs: loads of scenes, coefficients fitted to times, the yardstick."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from lab.frontier.fit import fit_cost
from scenelang.compiler.compile import compile_scene
from scenelang.drawing.small import Load, draw_small, load_of
from scenelang.language.scene import Object, Scale, Scene, Translate
from scenelang.output.frontier import Cost, predicted_ms, yardstick


def test_cost_is_found_again() -> None:
    rng = np.random.default_rng(3)
    true = Cost(2.0, 30.0, 40.0, 90.0, 0.5, 1.0)
    loads = [
        Load(int(n), int(p), float(m), float(o))
        for n, p, m, o in zip(
            rng.integers(1, 60, 50),
            rng.integers(1 << 12, 1 << 20, 50),
            rng.uniform(0, 2e6, 50),
            rng.uniform(0, 9e3, 50),
            strict=True,
        )
    ]
    found = fit_cost(loads, [predicted_ms(true, load, True) for load in loads], True)
    for load in loads:
        assert predicted_ms(found, load, True) == pytest.approx(predicted_ms(true, load, True), rel=1e-4)
    assert found.spread == pytest.approx(1.0, abs=1e-4)


def test_no_coefficient_is_negative_and_the_spread_covers() -> None:
    rng = np.random.default_rng(4)
    loads = [Load(int(n), 65536, float(n) * 9000, float(n) * 100) for n in rng.integers(1, 9, 80)]
    ms = [10 - 0.5 * load.objects + rng.uniform(0, 4) for load in loads]  # faster with more objects
    cost = fit_cost(loads, ms, True)
    terms = (cost.frame, cost.thousand_objects, cost.megapixel, cost.megameeting, cost.outline)
    assert min(terms) >= 0
    under = [
        t <= predicted_ms(cost, load, True) * cost.spread * 1.0001 for load, t in zip(loads, ms, strict=True)
    ]
    assert np.mean(under) >= 0.95


def test_a_fixed_canvas_costs_by_objects_alone() -> None:
    loads = [Load(n, 1 << 16, 1e5, 500.0) for n in range(1, 9)]
    cost = fit_cost(loads, [5.0 + 2 * n for n in range(1, 9)], True, fixed=True)
    assert cost.megapixel == cost.megameeting == cost.outline == 0
    assert predicted_ms(cost, Load(100, 1 << 16, 0, 0), True) == pytest.approx(205, rel=0.01)


def test_one_canvas_tells_nothing_of_a_constant() -> None:
    """A way that was measured on one canvas alone is taken to grow with the pixels."""
    loads = [Load(n, 1 << 16, 0.0, 0.0) for n in (1, 2, 3, 4, 2, 3)]
    cost = fit_cost(loads, [100.0 + 50 * load.objects for load in loads], False)
    large = predicted_ms(cost, Load(2, 1 << 18, 0.0, 0.0), False)
    assert large == pytest.approx(4 * predicted_ms(cost, loads[1], False))
    assert predicted_ms(cost, loads[1], False) == pytest.approx(200, rel=0.02)


def square(x: float, size: float) -> Object:
    return Object(geometry="square", transforms=(Scale(x=size, y=size, z=1), Translate(x=x, y=0)))


def test_the_load_of_a_scene_is_its_bounds_within_the_canvas() -> None:
    program = compile_scene(Scene(canvas=(200, 100), nodes=(square(0, 0.1), square(2, 0.5))))
    load = load_of(program)
    assert (load.objects, load.pixels) == (2, 20_000)
    boxes = program.bounds * 50  # half of the shorter side
    inside = [
        (min(b[2], 100) - max(b[0], -100)) * (min(b[3], 50) - max(b[1], -50)) for b in boxes.astype(float)
    ]
    assert load.meetings == pytest.approx(sum(inside), rel=1e-6)
    assert load.meetings < 2 * 20_000


def test_the_load_of_solids_is_counted_by_a_small_picture() -> None:
    """What a pixel takes does not change with the canvas; a solid takes less than mist, and than two."""
    loads = {}
    for text in ("sphere { }", "sphere { material volumetric; }", "sphere { } torus { translate(0, 1, 1); }"):
        for side in (64, 128):
            program = compile_scene(nsg.loads(f"canvas({side}, {side}); {text}"))
            loads[text, side] = load = load_of(program)
            drawn = draw_small(program, samples="one")
            assert load.meetings == pytest.approx(drawn.pairs, rel=0.35)
            assert load.outline == load.meetings / side
            assert load.pixels == side * side
    ball, mist, both = (load.meetings for (_, side), load in loads.items() if side == 128)
    assert ball < min(both, mist)


def test_the_yardstick_is_a_time() -> None:
    assert yardstick() > 0
