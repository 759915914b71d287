"""Sweeps: values as text, pictures, table, what is wrong with rows, what a folder has from before."""

from __future__ import annotations

import csv
import io
import itertools
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import scenelang as nsg
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Evaluation, ParamError, Source, param_named
from scenelang.output.animate import Progress
from scenelang.output.sweep import (
    MOST_SIDE,
    TableError,
    TableRow,
    render_many,
    rows_of,
    values_of,
    write_sheet,
)

TEXT = """\
canvas(24, 16);
param k = 0.5 in 0..1;
param n = 1 in 1..3 step 1;
param size = 0.4 in -0.2..0.5;
for (i in 0..<n) { star { scale(size); rotate(90deg * k); translate(0.3 * i, 0); } }
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "a.nsg").write_text(TEXT)
    return tmp_path / "a.nsg"


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_pictures_are_those_of_the_values_in_the_table(scene: Path, tmp_path: Path) -> None:
    made = render_many(scene, tmp_path / "out", grid={"k": "0..1/3", "n": ""}, params={"size": 0.3})
    rows = table(tmp_path / "out/a.csv")
    assert len(rows) == len(made.lines) == 9
    for row in rows:
        expected = nsg.render(nsg.load(scene, params={"k": row["k"], "n": row["n"], "size": "0.3"}))
        assert (tmp_path / "out" / row["picture"]).read_bytes() == expected.encode()
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        *(f"a-{number:06}.png" for number in range(9)),
        "a.csv",
    ]


def test_values_as_they_are_given(scene: Path, tmp_path: Path) -> None:
    made = nsg.render_many(scene, tmp_path / "%d.png", values=[{"k": 0.25}, {"n": 2}, {"k": "0.25"}])
    assert made.names == ("k", "n")
    assert [line.values for line in made.lines] == [("0.25", ""), ("", "2"), ("0.25", "")]
    assert made.made.drawn == 2
    assert (tmp_path / "0.png").read_bytes() == (tmp_path / "2.png").read_bytes()
    assert (tmp_path / "1.png").read_bytes() == nsg.render(nsg.load(scene, n=2)).encode()


def test_rows_without_a_scene_are_told_and_left_out(scene: Path, tmp_path: Path) -> None:
    """One of two mistakes twice at the same place; every other row is drawn."""
    values = [{"k": 0.5}, {"k": 2}, {"size": 0}, {"k": 3}, {"k": 0.6}]
    made = render_many(scene, tmp_path / "out", values=values)
    assert made.errors == 3
    assert [line.error[:5] for line in made.lines] == ["", "E0309", "E0312", "E0309", ""]
    assert [line.picture for line in made.lines] == ["a-000000.png", "", "", "", "a-000004.png"]
    assert [row["error"] for row in table(made.table)] == [line.error for line in made.lines]
    assert made.failed[3][0].code == "E0309"
    pictures = [tmp_path / f"out/a-00000{at}.png" for at in range(5)]
    assert [path.exists() for path in pictures] == [True, False, False, False, True]


class Enough(Exception):
    """Raised to stop a run."""


def stop(progress: Progress) -> None:
    if progress.done >= 2:
        raise Enough


def test_what_was_interrupted_goes_on(scene: Path, tmp_path: Path) -> None:
    ask = {"random": ["k", "size"], "count": 6, "seed": 3}
    with pytest.raises(Enough):
        render_many(scene, tmp_path / "out", **ask, progress=stop)
    assert [row["digest"] for row in table(tmp_path / "out/a.csv")] == [""] * 6
    with pytest.raises(TableError, match="other values in row 0"):
        render_many(scene, tmp_path / "out", **{**ask, "seed": 4})
    made = render_many(scene, tmp_path / "out", **ask)
    assert made.made.resumed > 0
    assert made.made.resumed + made.made.drawn == 6
    whole = render_many(scene, tmp_path / "whole", **ask)
    for line in whole.lines:
        one, other = (tmp_path / folder / line.picture for folder in ("out", "whole"))
        assert one.read_bytes() == other.read_bytes()
    assert not list((tmp_path / "out").glob(".*"))
    (tmp_path / "out/a-000001.png").unlink()
    more = render_many(scene, tmp_path / "out", **{**ask, "count": 8})
    assert (more.made.resumed, more.made.drawn) == (5, 3)
    assert len(table(tmp_path / "out/a.csv")) == 8


def test_pictures_of_another_sweep_are_left_alone(scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    ask: dict[str, Any] = {"random": {"k": ""}, "count": 3}
    render_many(scene, out, **ask)
    for change in ({"size": (8, 8)}, {"count": 2}, {"random": {"n": ""}}, "another scene", "no table"):
        if change == "another scene":
            scene.write_text(TEXT.replace("star", "square"))
        elif change == "no table":
            scene.write_text(TEXT)
            (out / "a.csv").unlink()
        before = {path: path.read_bytes() for path in out.iterdir() if path.is_file()}
        with pytest.raises(TableError):
            render_many(scene, out, **(ask | change if isinstance(change, dict) else ask))
        assert {path: path.read_bytes() for path in out.iterdir() if path.is_file()} == before


SOLID = "canvas(24, 16); param x = 0 in -0.5..0.5; sphere { scale(0.4); translate(x, 0, 0); } torus;"


def test_all_that_is_known_of_a_picture(tmp_path: Path) -> None:
    """Each file is the one that its own call gives, though other processes drew."""
    path, out = tmp_path / "s.nsg", tmp_path / "out"
    path.write_text(SOLID)
    outputs = ("depth", "normal", "object", "alpha", "scene", "program")
    made = render_many(path, out, grid={"x": "../2"}, outputs=outputs, jobs=2)
    for line in made.lines:
        file, scene = out / line.picture, nsg.load(path, x=line.values[0])
        known = nsg.render_outputs(scene, ("depth", "normal", "object", "alpha"))
        for name in known.names:
            alone = Image.open(io.BytesIO(known.png(name)))  # whose objects have no place in a text
            with Image.open(file.with_suffix(f".{name}.png")) as found:
                np.testing.assert_array_equal(np.asarray(found), np.asarray(alone))
        assert nsg.loads(file.with_suffix(".nsg").read_text()) == scene
        program = nsg.load_program(file.with_suffix(".safetensors"))
        assert program.digest() == nsg.compile(scene).digest()
        np.testing.assert_array_equal(nsg.render(program), nsg.render(scene))
    again = render_many(path, out, grid={"x": "../2"}, outputs=outputs)
    assert (again.made.drawn, again.made.resumed) == (0, 2)
    assert len(list(out.iterdir())) == 15


def test_what_python_cannot_ask(scene: Path, tmp_path: Path) -> None:
    asks: list[tuple[dict[str, Any], str]] = [
        ({"values": [{"q": 1}]}, "no param `q`"),
        ({"values": [{"k": 1}], "count": 3}, "given as they are"),
        ({"grid": {"k": "0,1"}, "params": {"k": 0.5}}, "one value for all"),
        ({"values": [{"k": None}]}, "not a value"),
    ]
    for ask, said in asks:
        with pytest.raises(ParamError, match=said):
            render_many(scene, tmp_path / "out", **ask)
        assert not (tmp_path / "out").exists()


def test_a_contact_sheet(scene: Path, tmp_path: Path) -> None:
    """A picture stands in each cell, a row of the grid in a row of the sheet."""
    ask: dict[str, Any] = {"grid": {"n": "1,2", "k": "0..0.5/3"}, "size": (80, 80)}
    made = render_many(scene, tmp_path / "out", **ask, sheet=tmp_path / "sheet.png")
    with Image.open(tmp_path / "sheet.png") as sheet, Image.open(tmp_path / "out/a-000004.png") as picture:
        assert sheet.width > sheet.height
        side = (sheet.width - 4) // 3 - 4
        at = (4 + 1 * (side + 4), 4 + (sheet.height - 4) // 2)  # the second of the second row
        cell = np.asarray(sheet.crop((*at, at[0] + side, at[1] + side)), float)
        assert (
            abs(cell - np.asarray(picture.resize((side, side), Image.Resampling.LANCZOS), float)).max() <= 1
        )
    assert made.errors == 0
    Image.new("RGB", (90, 30), "red").save(tmp_path / "p.png")
    lines = [TableRow("p.png", ("1",), "digest"), TableRow("", ("2",), "", "E0309: …")] * 3000
    shown = write_sheet(tmp_path / "sheet.png", tmp_path, ("k",), lines)
    with Image.open(tmp_path / "sheet.png") as sheet:
        assert max(sheet.size) <= MOST_SIDE
    assert 500 < shown <= 1024


def test_parquet(scene: Path, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    render_many(scene, tmp_path / "out", grid={"k": "0..1/3", "n": ""}, table=tmp_path / "t.parquet")
    found = parquet.read_table(tmp_path / "t.parquet").to_pydict()
    assert found["k"] == [0.0] * 3 + [0.5] * 3 + [1.0] * 3
    assert found["picture"][0] == "a-000000.png"


PARAMS = """\
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
def evaluation() -> Evaluation:
    found = Diagnostics()
    evaluation = Source(text=SourceFile("a.nsg", PARAMS)).evaluation(found)
    assert evaluation.run(0)[0] is not None, found.items
    return evaluation


def test_values(evaluation: Evaluation) -> None:
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
        assert list(values_of(evaluation, param_named(evaluation, name), text)) == expected


def test_what_cannot_be_asked(evaluation: Evaluation) -> None:
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
        ({"k": itertools.repeat("0")}, {}, None, "more than 1,000,000 values of `k`"),
    ):
        with pytest.raises(ParamError, match=said):
            rows_of(evaluation, grid, drawn, count)


def test_a_grid_is_every_combination_once(evaluation: Evaluation) -> None:
    rows = rows_of(evaluation, {"k": "0..1/3", "fine": ""}, {})[0]
    assert [tuple(row.values()) for row in rows] == [
        (k, fine) for k in ("0", "0.5", "1") for fine in ("false", "true")
    ]


DRAWN = dict.fromkeys(("k", "n", "turn", "ink", "fine", "word", "side"), "")


def test_random_values_are_values_of_their_params(evaluation: Evaluation) -> None:
    """Each row evaluates, which checks units, ranges, steps and choices."""
    for row in rows_of(evaluation, {}, DRAWN, 40)[0]:
        evaluation.inputs.values = row
        assert evaluation.run(0)[0] is not None, evaluation.diagnostics.items


def test_random_values_hang_on_seed_number_and_name(evaluation: Evaluation) -> None:
    def columns(count: int, seed: int, *names: str) -> list[tuple[str, ...]]:
        rows = rows_of(evaluation, {}, dict.fromkeys(names, ""), count, seed)[0]
        return [tuple(row[name] for row in rows) for name in names]

    assert columns(5, 1, "k")[0] == columns(9, 1, "turn", "k")[1][:5]
    assert columns(5, 1, "k") != columns(5, 2, "k")
    assert len(set(columns(200, 1, "k")[0])) == 200


def test_random_values_are_uniform(evaluation: Evaluation) -> None:
    rows = rows_of(evaluation, {}, {"k": "", "n": "", "free": "10..20"}, 3000)[0]
    tenths = Counter(int(10 * float(row["k"])) for row in rows)
    assert all(230 < tenths[tenth] < 370 for tenth in range(10))  # 300, six standard deviations
    assert all(480 < number < 720 for number in Counter(row["n"] for row in rows).values())
    assert all(10 <= float(row["free"]) <= 20 for row in rows)


def test_a_grid_and_random_values(evaluation: Evaluation) -> None:
    """The grid is gone through again and again, and what is drawn differs each time."""
    rows = rows_of(evaluation, {"n": "1,3"}, {"k": ""}, 6)[0]
    assert [row["n"] for row in rows] == ["1", "3"] * 3
    assert len({row["k"] for row in rows}) == 6
