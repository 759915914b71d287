"""Params as a box, and what is found as text."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scenelang.drawing.exact.mesh import FitError
from scenelang.inverse.problem import Moment
from scenelang.inverse.search import SearchBox, space_of
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source, rewritten
from scenelang.language.parser import parse
from scenelang.language.values import Vec, unpack

TEXT = """\
nsg 1;  // all kinds of params
param k =  0.5  in -1..1;   /* a number */
param a = PI * 1rad / 3 in 0rad..PI * 1rad;
param turn = 10deg in -180deg..180deg; param n = 3 in 1..9 step 2;
param word = "ä" in ["ä", "b\\"c"]; param on = true;
param ink = #204060; param soft = [0.1, 0.2] in 0..0.25;
param open = 0.2 in 0..<0.3;
square { translate(k, soft[0]); rotate(a + turn); }
"""
EVERY = ("k", "a", "turn", "n", "word", "on", "ink", "soft", "open")


def source(text: str = TEXT) -> Moment:
    return Moment(Source(text=SourceFile("a.nsg", text)).parsed(Diagnostics()))


def box(text: str = TEXT, names: tuple[str, ...] = ()) -> SearchBox:
    return space_of(source(text).evaluated({})[0], names)


def plain(value: object) -> object:
    if isinstance(value, Vec):
        return [plain(item) for item in value.items]
    return value if isinstance(value, bool | str) else unpack(value)[0]


def test_params_with_a_range_are_searched_unless_named() -> None:
    assert box().names == ("k", "a", "turn", "n", "word", "soft", "open")
    assert [axis.wraps for axis in box(names=("turn", "a")).axes] == [True, False]
    assert [axis.label for axis in box(names=("ink",)).axes] == ["ink.1", "ink.2", "ink.3"]


def test_points_and_values_are_inverses() -> None:
    space = box(names=EVERY)
    evaluation = source().evaluated({})[0]
    start = {knob.name: knob.value for knob in space.knobs}
    again = space.values(space.point(start))
    for name in EVERY:
        slot = evaluation.context.scope.names[name].slot
        assert plain(again[name]) == pytest.approx(plain(evaluation.context.env[slot]))


@pytest.mark.parametrize("seed", range(20))
def test_a_scene_is_written_with_what_was_found_and_nothing_else_changes(seed: int) -> None:
    rng, space = np.random.default_rng(seed), box(names=EVERY)
    u = rng.random(len(space.axes)) if seed else np.ones(len(space.axes))
    u = np.where(space.smooth, u, np.floor(u * 0.999 * (space.most + 1)))
    literals = space.literals(u)
    text = rewritten(source().tree, literals)
    found = space_of(source(text).evaluated({})[0], EVERY)  # in its range, or this would be an error
    gap = space.gap(found.point({}), u)
    inks = np.array([axis.label.startswith("ink") for axis in space.axes])
    assert (gap[~inks] <= 1e-4).all()
    assert (gap[inks] <= 0.5 / 255 + 1e-9).all()
    assert rewritten(parse(SourceFile("a.nsg", text), Diagnostics()), space.literals(space.point({}))).count(
        "/* a number */"
    )
    lines = zip(TEXT.splitlines(), text.splitlines(), strict=True)
    assert [a.partition("=")[0] for a, _ in lines] == [b.partition("=")[0] for b in text.splitlines()]
    assert "deg" in literals["turn"]
    assert literals["ink"].startswith("#")
    assert literals["a"].endswith("rad")


def test_ends_of_a_full_turn_are_one_place() -> None:
    space = box(names=("turn", "k"))
    assert space.gap(np.array([0.01, 0.0]), np.array([0.99, 1.0])) == pytest.approx([0.02, 1.0])
    assert space.inside(np.array([1.25, 1.25])) == pytest.approx([0.25, 1.0])


def test_what_cannot_be_searched_is_said() -> None:
    for names, text, fact in (
        (("kk",), TEXT, "no param `kk`"),
        (("free",), "param free = 2; square { scale(free); }", "param `free` has no range"),
        ((), "square { }", "no param to fit"),
        (("n",), "param n = 0 in 0..1000000 step 1; square { rotate(n * 1deg); }", "more than 1,000 steps"),
    ):
        with pytest.raises(FitError, match=fact):
            box(text, names)


def test_digits_are_those_that_a_range_asks_for() -> None:
    text = "param a = 0 in 0..1000; param b = 0 in 0..0.001; square { translate(a * 0.0001, b); }"
    literals = box(text).literals(np.array([1 / 3, 1 / math.pi]))
    assert literals == {"a": "333.3", "b": "0.0003183"}
