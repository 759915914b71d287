"""Which values a sweep has, as text."""

from __future__ import annotations

import itertools
from collections import Counter

import pytest

from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Evaluation, ParamError, Source, param_named
from scenelang.output.sweep import Rows, rows_of, text_of, values_of

TEXT = """\
param k = 0.5 in 0..1;
param n = 3 in 1..9 step 2;
param turn = 30deg in 0deg..360deg;
param wait = 1s in 0s..4s;
param ink = #d33;
param fine = true;
param word = "a" in ["a", "b, c"];
param side = [0.1, 0.2] in 0..0.5;
param free = 7;
param wide = 0 in -1.7e308..1.7e308;
param fine_steps = 0 in 0..1 step 5e-324;
star;
"""


@pytest.fixture
def scene() -> Evaluation:
    found = Diagnostics()
    evaluation = Source(text=SourceFile("a.nsg", TEXT)).evaluation(found)
    assert evaluation.run(0)[0] is not None, found.items
    return evaluation


def test_values(scene: Evaluation) -> None:
    for name, text, expected in (
        ("k", "0..1/5", ["0", "0.25", "0.5", "0.75", "1"]),
        ("k", "0..<1/4", ["0", "0.25", "0.5", "0.75"]),
        ("k", "../3", ["0", "0.5", "1"]),
        ("k", "0.4../3", ["0.4", "0.7", "1"]),
        ("k", "1..0/3", ["1", "0.5", "0"]),
        ("k", "0.1..0.1/1", ["0.1"]),
        ("k", "0.1, 0.9,0..1/2", ["0.1", "0.9", "0", "1"]),
        ("k", "0..1 step 0.25", ["0", "0.25", "0.5", "0.75", "1"]),
        ("n", "", ["1", "3", "5", "7", "9"]),
        ("n", "..", ["1", "3", "5", "7", "9"]),
        ("n", "3..5", ["3", "4", "5"]),
        ("n", "3..<5", ["3", "4"]),
        ("turn", "0deg..90deg/3", ["0deg", "45deg", "90deg"]),
        ("turn", "0..<1turn/4", ["0deg", "90deg", "180deg", "270deg"]),
        ("wait", "0..2/3", ["0s", "1s", "2s"]),
        ("ink", "#000, rgb(1, 0, 0)", ["#000", "rgb(1, 0, 0)"]),
        ("fine", "", ["false", "true"]),
        ("word", "", ["a", "b, c"]),
        ("side", "[0.1, 0.2],[0.3,0.4]", ["[0.1, 0.2]", "[0.3,0.4]"]),
        ("free", "1..2/2", ["1", "2"]),
    ):
        assert list(values_of(scene, param_named(scene, name), text)) == expected


def test_what_cannot_be_asked(scene: Evaluation) -> None:
    for grid, drawn, count, said in (
        ({"q": "1"}, {}, None, "no param `q`"),
        ({"k": ""}, {}, None, "say how many"),
        ({"k": "0..1/0"}, {}, None, "no values"),
        ({"k": "0..1 step 0"}, {}, None, "more than"),
        ({"k": "0..1 step 1e-9"}, {}, None, "more than"),
        ({"k": "0..1 step 5e-324"}, {}, None, "more than"),
        ({"k": "0..1 step -5e-324"}, {}, None, "more than"),
        ({"k": "0..1/1000001"}, {}, None, "more than"),
        ({"k": "0..1/600000,0..1/600000"}, {}, None, "more than"),
        ({"k": ",".join(["0"] * 10_001)}, {}, None, "more than 10,000 values"),
        ({"free": "-1.7e308..1.7e308/3"}, {}, None, "too wide"),
        ({"free": "0..1e308/3"}, {}, None, "too wide"),
        ({"turn": "0deg..1e306turn/3"}, {}, None, "too wide"),
        ({}, {"free": "-1.7e308..1.7e308"}, 3, "too wide"),
        ({}, {"wide": ""}, 3, "too wide"),
        ({"wide": "../3"}, {}, None, "too wide"),
        ({"fine_steps": ""}, {}, None, "more than 1,000 steps"),
        ({"k": "0deg..1/3"}, {}, None, "`0deg` is not a value of `k`"),
        ({"ink": "#000..#fff/3"}, {}, None, "not a number"),
        ({"k": "0..1/3"}, {"k": ""}, None, "both"),
        ({}, {}, 3, "no param to change"),
        ({}, {"k": ""}, None, "a count is needed"),
        ({"k": "0..1/3"}, {}, 2, "the grid has 3"),
        ({"k": "0..1/3"}, {}, 4, "nothing is drawn"),
        ({"k": "0..1/2000", "n": "1..2000"}, {}, None, "can be made"),
        ({}, {"free": ""}, 3, "has no range"),
        ({}, {"k": "5"}, 3, "not a range"),
    ):
        with pytest.raises(ParamError, match=said):
            rows_of(scene, grid, drawn, count)


def test_a_grid_is_every_combination_once(scene: Evaluation) -> None:
    rows = list(rows_of(scene, {"k": "0..1/3", "fine": ""}, {}))
    assert [tuple(row.values()) for row in rows] == [
        (k, fine) for k in ("0", "0.5", "1") for fine in ("false", "true")
    ]


DRAWN = dict.fromkeys(("k", "n", "turn", "ink", "fine", "word", "side"), "")


def test_random_values_are_values_of_their_params(scene: Evaluation) -> None:
    """Each row evaluates, which checks units, ranges, steps and choices."""
    for row in rows_of(scene, {}, DRAWN, 40):
        scene.inputs.values = row
        assert scene.run(0)[0] is not None, scene.diagnostics.items


def test_random_values_hang_on_seed_number_and_name(scene: Evaluation) -> None:
    def columns(count: int, seed: int, *names: str) -> list[tuple[str, ...]]:
        rows = list(rows_of(scene, {}, dict.fromkeys(names, ""), count, seed))
        return [tuple(row[name] for row in rows) for name in names]

    assert columns(5, 1, "k")[0] == columns(9, 1, "turn", "k")[1][:5]
    assert columns(5, 1, "k") != columns(5, 2, "k")
    assert len(set(columns(200, 1, "k")[0])) == 200


def test_random_values_are_uniform(scene: Evaluation) -> None:
    rows = list(rows_of(scene, {}, {"k": "", "n": "", "free": "10..20"}, 3000))
    tenths = Counter(int(10 * float(row["k"])) for row in rows)
    assert all(230 < tenths[tenth] < 370 for tenth in range(10))  # 300, six standard deviations
    assert all(480 < number < 720 for number in Counter(row["n"] for row in rows).values())
    assert all(10 <= float(row["free"]) <= 20 for row in rows)


def test_a_grid_and_random_values(scene: Evaluation) -> None:
    """The grid is gone through again and again, and what is drawn differs each time."""
    rows = list(rows_of(scene, {"n": "1,3"}, {"k": ""}, 6))
    assert [row["n"] for row in rows] == ["1", "3"] * 3
    assert len({row["k"] for row in rows}) == 6


def test_values_without_end(scene: Evaluation) -> None:
    with pytest.raises(ParamError, match="more than 1,000,000 values of `k`"):
        rows_of(scene, {"k": itertools.count()}, {})


def test_values_of_python() -> None:
    assert [text_of(v) for v in (True, 0.5, 3, "30deg", (0.1, 2))] == [
        "true",
        "0.5",
        "3",
        "30deg",
        "[0.1, 2]",
    ]
    with pytest.raises(ParamError, match="not a value"):
        text_of(None)


def test_given_rows() -> None:
    rows = Rows({}, given=({"a": "1"}, {"b": "2"}))
    assert (rows.names, len(rows), rows[1]) == (("a", "b"), 2, {"b": "2"})
