"""The frontier: its front, promises, costs of frames, and the choice of a point."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import scenelang as nsg
from lab.frontier.fit import fit_cost
from lab.frontier.measure import FEW_MARGIN, MARGIN, margin, promised
from lab.frontier.record import FrameErrors, Frontier, Point, Quality, Times, between, front
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.image import enlarged, from_samples
from scenelang.drawing.small import draw_small
from scenelang.drawing.work import Load, load_of
from scenelang.language.scene import Object, Scale, Scene, Twist
from scenelang.output import frontier as shipped
from scenelang.output.frontier import (
    Cost,
    Limits,
    NothingFits,
    choose,
    error_scale,
    machine_scale,
    offers,
    predicted_ms,
    refusal,
    yardstick,
)


def point(name: str, ms: float, flip: float | None, **more: object) -> Point:
    made = Point(
        name=name,
        backend="neural",
        model="shapes2d",
        renderer="framed",
        samples="adaptive",
        skip=True,
        spp=0,
        side=0,
        offered=True,
        why_not=None,
        scenes=10,
        ms=Times(float(ms), 1.2 * ms),
        ratio_to_streaming=1000 / ms,
        flip=None if flip is None else FrameErrors(flip, flip / 2, 0.9 * flip, 1.1 * flip),
        psnr=None if flip is None else Quality(40.0, 35.0, 30.0),
        cost=Cost(float(ms), 0.0, 0.0, 0.0, 0.0, 1.0),
        parameters=100,
        bytes=400,
        on_front=False,
        command=f"scenelang render scene.nsg -o scene.png --model {name}",
    )
    return replace(made, **more)  # type: ignore[arg-type]


def frontier(*points: Point) -> Frontier:
    return Frontier(
        set="shapes2d",
        seed=1,
        scenes=10,
        canvas=(256, 256),
        threads=1,
        clock="processor",
        machine="a machine",
        revision="0" * 40,
        torch="2.11.0",
        yardstick_ms=1.0,
        streaming_ms=1000.0,
        converged={"a": 0.001},
        points=points,
    )


figures = st.lists(
    st.tuples(st.integers(1, 6).map(float), st.integers(0, 6).map(float)), min_size=0, max_size=12
)


@given(figures)
def test_the_front_is_what_brute_force_finds(points: list[tuple[float, float]]) -> None:
    def beaten(i: int) -> bool:
        a = points[i]
        return any(
            (b[0] <= a[0] and b[1] <= a[1] and b != a) or (b == a and j < i)
            for j, b in enumerate(points)
            if j != i
        )

    assert front(points) == [not beaten(i) for i in range(len(points))]


def test_the_promise_is_a_high_order_statistic() -> None:
    for count, rank in ((39, 39), (40, 40), (79, 78), (100, 99), (1000, 976)):
        values = list(np.random.default_rng(count).permutation(count) + 1.0)
        assert promised(values) == rank
        assert rank == math.ceil(0.975 * (count + 1))
    assert promised([0.1, 0.2]) == pytest.approx(0.3)
    assert margin(117) == FEW_MARGIN > margin(118) == MARGIN


def test_promises_are_kept_by_new_values_of_the_same_kind() -> None:
    """Over many draws, 97.5 % of new values stay under the bound, whatever the distribution."""
    rng = np.random.default_rng(1)
    kept = []
    for _ in range(400):
        values = rng.lognormal(0, 1.5, 80)
        kept.append(np.mean(rng.lognormal(0, 1.5, 200) <= promised(values.tolist())))
    assert np.mean(kept) >= 0.972


LOAD = Load(2, 65536, 1e4, 100.0)
LADDER = [point("fast", 2, 0.05), point("middle", 10, 0.01), point("slow", 50, 0.001), point("bad", 60, 0.02)]


def chosen(limits: Limits, points: list[Point] = LADDER, scale: float = 1.0, load: Load = LOAD) -> str:
    return choose(offers(points, load, (256, 256), scale), limits, {})[0].point.name


def test_the_choice_is_the_cheapest_that_suffices() -> None:
    for limits, name in (
        (Limits(None, 0.06), "fast"),
        (Limits(None, 0.05), "fast"),
        (Limits(None, 0.03), "middle"),
        (Limits(None, 0.005), "slow"),
        (Limits(None, 1.0), "fast"),
        (Limits(2, None), "fast"),
        (Limits(30, None), "middle"),
        (Limits(100, None), "slow"),
        (Limits(20, 0.02), "middle"),
    ):
        assert chosen(limits) == name
    wide = [replace(p, cost=Cost(p.ms.median, 0, 0, 0, 0, 4.0)) for p in LADDER]
    assert chosen(Limits(30, None), wide) == "fast"
    points = [point("a", 10, 0.0100), point("b", 40, 0.0099)]
    assert chosen(Limits(100, None), points) == "a"  # nearly equal errors leave it to time
    assert between([*LADDER, point("timed", 4, None)]) == 1


def test_without_a_promise_the_choice_is_the_slowest_that_suffices() -> None:
    """A draft was chosen before one sample where no error is promised, as it was the faster."""
    sky = LOAD._replace(light=1.0)
    assert [chosen(Limits(ms, None), load=sky) for ms in (3, 30, 1000)] == ["fast", "middle", "bad"]


@given(
    st.lists(st.tuples(st.integers(1, 9), st.integers(0, 9)), min_size=1, max_size=8),
    st.none() | st.integers(0, 10),
    st.none() | st.integers(0, 10),
)
def test_the_choice_is_what_brute_force_finds(
    figures: list[tuple[int, int]], ms: int | None, flip: int | None
) -> None:
    points = [point(f"p{i}", t, e / 100) for i, (t, e) in enumerate(figures)]
    limits = Limits(ms, None if flip is None else flip / 100)
    good = [(t, e) for t, e in figures if (ms is None or t <= ms) and (flip is None or e <= flip)]
    if ms is None and flip is None:
        return
    if not good:
        with pytest.raises(NothingFits):
            chosen(limits, points)
        return
    best = min(good) if flip is not None else min(good, key=lambda g: (g[1], g[0]))
    assert figures[int(chosen(limits, points)[1:])] == best


def test_a_slower_machine_chooses_a_faster_way_and_a_larger_scene_too() -> None:
    assert chosen(Limits(30, None), scale=1.0) == "middle"
    assert chosen(Limits(30, None), scale=4.0) == "fast"
    per_object = [replace(p, cost=Cost(0, 1000 * p.ms.median, 0, 0, 0, 1.0)) for p in LADDER]
    assert chosen(Limits(30, None), per_object, load=Load(2, 65536, 0, 0)) == "middle"
    assert chosen(Limits(30, None), per_object, load=Load(12, 65536, 0, 0)) == "fast"
    assert chosen(Limits(None, 0.02), load=Load(16, 65536, 1e4, 100.0)) == "slow"  # more outlines
    assert error_scale((256, 256), 1) == error_scale((1024, 300), 4) == 1.0
    assert (error_scale((128, 512), 4), error_scale((64, 64), 8)) == (2.0, 8.0)
    assert machine_scale(frontier(), yardstick()) > 0


def test_what_nothing_draws_is_told_with_what_comes_nearest() -> None:
    with pytest.raises(NothingFits, match=r"within 1 ms; the fastest is fast: 2\.0 ms"):
        chosen(Limits(1, None))
    with pytest.raises(NothingFits, match=r"within FLIP 0\.0001; the most exact is slow"):
        chosen(Limits(None, 0.0001))
    with pytest.raises(NothingFits, match=r"within 20 ms and FLIP 0\.005; exact enough is slow: 50 ms"):
        chosen(Limits(20, 0.005))
    with pytest.raises(NothingFits, match=r"nothing on the frontier draws this scene \(a: has no `x`\)"):
        choose([], Limits(1, None), {"a": "has no `x`"})


def test_the_choice_tells_why_and_what_was_next() -> None:
    for limits, why, name, worse in (
        (Limits(None, 0.03), "the fastest of 3 that keep FLIP 0.03", "slow", "slower"),
        (Limits(30, None), "the most exact of 2 that keep 30 ms", "fast", "no more exact"),
    ):
        notes = choose(offers(LADDER, LOAD, (256, 256), 1.0), limits, {})[1]
        assert notes[0].endswith(why)
        assert notes[1].startswith(f"runner-up: {name}")
        assert notes[1].endswith(worse)


def test_points_that_cannot_draw_a_scene_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene(nodes=(Object(geometry="square", transforms=(Scale(x=0.5, y=0.5, z=1),)),))
    one, program = point("a", 1, 0.1), compile_scene(scene)
    assert refusal(one, scene, program) is None
    assert refusal(one, scene, program, "other") == "--model other"
    twisted = Scene(nodes=(Object(geometry="square", transforms=(Twist(k=0.3),)),))
    assert refusal(one, twisted, program) == "`twist` leaves the plane"
    assert refusal(one, None, program) is None
    other = replace(program, model="other")
    assert refusal(one, None, other) == "the program was compiled for `other`"
    exact = point("exact", 1, 0.0, backend="reference", model=None)
    assert refusal(exact, scene, program) is None
    assert refusal(exact, None, program) == "a compiled program keeps only what the network needs"
    assert refusal(point("x", 1, 0.1, offered=False, why_not="no"), scene, program) == "no"
    assert refusal(point("x", 1, 0.1, model="none"), scene, program) == "not installed"
    fixed = replace(load_manifest("shapes2d"), sizes=((64, 64),), white=True)
    monkeypatch.setattr("scenelang.output.frontier.load_manifest", lambda _: fixed)
    assert refusal(one, scene, program) == (
        "a canvas of 256 x 256 pixels; model `shapes2d` draws only 64 x 64"
    )
    small = scene.model_copy(update={"canvas": (64, 64)})
    assert refusal(one, small, program) is None
    grey = small.model_copy(update={"background": (0.5, 0.5, 0.5)})
    assert refusal(one, grey, program) == "model `shapes2d` draws only over white"


def test_the_file_comes_back() -> None:
    made = frontier(*LADDER, point("timed", 5, None, cost=None, model=None))
    text = made.to_json()
    again = Frontier.from_json(text.encode())
    assert again == Frontier.from_json(again.to_json().encode())
    assert again.to_json() == text
    assert [p.name for p in again.points] == [p.name for p in made.points]
    assert again.points[-1].flip is None


def test_damaged_files_are_refused() -> None:
    """By what chooses where it reads the field, and by what knows all fields."""
    own: dict[str, list[Any]] = {"format": [2], "points": [{}, [1]], "yardstick_ms": [None, "1"], "set": [3]}
    others = {"canvas": [[256], [0, 256], [256, "256"]], "seed": [-1, True], "machine": [3], "unknown": [1]}
    of_point = {"samples": ["two"], "backend": ["x"], "cost": [[1]], "offered": [1], "flip": [{"bound": -1}]}
    for fields, chosen_by in ((own, True), (of_point, True), (others, False), ({"ms": [None]}, False)):
        for key, value in ((key, value) for key, values in fields.items() for value in values):
            told = json.loads(frontier(*LADDER).to_json())
            (told["points"][1] if fields is of_point or key == "ms" else told)[key] = value
            data = json.dumps(told).encode()
            for reader in (Frontier, *[shipped.Frontier] * chosen_by):
                with pytest.raises(ValueError, match="frontier"):
                    reader.from_json(data)
            if not chosen_by:
                shipped.Frontier.from_json(data)


def test_enlarging_keeps_flat_colours_and_corners() -> None:
    small = from_samples(np.full((8, 8, 3), 0.25, np.float32), None)
    np.testing.assert_allclose(enlarged(small, (32, 32)), np.full((32, 32, 3), 0.25))
    halves = np.zeros((2, 2, 3), np.float32)
    halves[:, 1] = 1
    wide = np.asarray(enlarged(from_samples(halves, None), (64, 64)))
    assert (wide[:, 0] == 0).all()
    assert (wide[:, -1] == 1).all()
    assert enlarged(small, (8, 8)) is small


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


def test_the_load_of_a_scene_is_its_bounds_within_the_canvas() -> None:
    text = "canvas(200, 100); square { scale(0.1); } square { scale(0.5); translate(2, 0); }"
    program = compile_scene(nsg.loads(text))
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
