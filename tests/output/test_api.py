"""Sweeps: pictures, table, what is wrong with rows, what a folder has from before."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import scenelang as nsg
from scenelang.language.evaluation import ParamError
from scenelang.output.animate import Progress
from scenelang.output.sweep import MOST_SIDE, Line, TableError, render_many, write_sheet

TEXT = """\
canvas(24, 16);
param k = 0.5 in 0..1;
param n = 1 in 1..3 step 1;
param size = 0.4 in -0.2..0.5;
for (i in 0..<n) { star { scale(size); rotate(90deg * k); translate(0.3 * i, 0); } }
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "a.nsg"
    path.write_text(TEXT)
    return path


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


def test_a_scene_with_errors_of_syntax_has_no_pictures(tmp_path: Path) -> None:
    path = tmp_path / "a.nsg"
    path.write_text(TEXT.replace("rotate(90deg * k);", "rotate(90deg * k)"))
    with pytest.raises(nsg.SceneError, match="E0102"):
        render_many(path, tmp_path / "out", grid={"k": "0..1/3"})
    assert not (tmp_path / "out").exists()


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
        assert (tmp_path / "out" / line.picture).read_bytes() == (
            tmp_path / "whole" / line.picture
        ).read_bytes()
    assert not list((tmp_path / "out").glob(".*"))


def test_more_of_what_is_there(scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    render_many(scene, out, random=["k"], count=3)
    before = {path: path.read_bytes() for path in out.glob("*.png")}
    (out / "a-000001.png").unlink()
    made = render_many(scene, out, random=["k"], count=5)
    assert (made.made.resumed, made.made.drawn) == (2, 3)
    assert {path: path.read_bytes() for path in before} == before
    assert len(table(out / "a.csv")) == 5


@pytest.mark.parametrize("change", ["scene", "size", "fewer", "params", "no table"])
def test_pictures_of_another_sweep_are_left_alone(scene: Path, tmp_path: Path, change: str) -> None:
    out = tmp_path / "out"
    ask: dict[str, object] = {"random": {"k": ""}, "count": 3}
    render_many(scene, out, **ask)  # type: ignore[arg-type]
    if change == "scene":
        scene.write_text(TEXT.replace("star", "square"))
    elif change == "no table":
        (out / "a.csv").unlink()
    else:
        ask |= {"size": {"size": (8, 8)}, "fewer": {"count": 2}, "params": {"random": {"n": ""}}}[change]
    before = {path: path.read_bytes() for path in out.iterdir() if path.is_file()}
    with pytest.raises(TableError):
        render_many(scene, out, **ask)  # type: ignore[arg-type]
    assert {path: path.read_bytes() for path in out.iterdir() if path.is_file()} == before


SOLID = "canvas(24, 16); param x = 0 in -0.5..0.5; sphere { scale(0.4); translate(x, 0, 0); } torus;"


@pytest.mark.parametrize("jobs", [1, 2])
def test_all_that_is_known_of_a_picture(tmp_path: Path, jobs: int) -> None:
    """Each file is the one that its own call gives, also where other processes drew."""
    path, out = tmp_path / "s.nsg", tmp_path / "out"
    path.write_text(SOLID)
    outputs = ("depth", "normal", "object", "alpha", "scene", "program")
    made = render_many(path, out, grid={"x": "../2"}, outputs=outputs, jobs=jobs)
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
    again = render_many(path, out, grid={"x": "../2"}, outputs=outputs, jobs=jobs)
    assert (again.made.drawn, again.made.resumed) == (0, 2)
    assert len(list(out.iterdir())) == 15


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        ({"values": [{"q": 1}]}, "no param `q`"),
        ({"values": [{"k": 1}], "count": 3}, "given as they are"),
        ({"grid": {"k": "0,1"}, "params": {"k": 0.5}}, "one value for all"),
    ],
)
def test_what_cannot_be_asked(scene: Path, tmp_path: Path, ask: dict[str, object], said: str) -> None:
    with pytest.raises(ParamError, match=said):
        render_many(scene, tmp_path / "out", **ask)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def test_a_contact_sheet(scene: Path, tmp_path: Path) -> None:
    """A picture stands in each cell, a row of the grid in a row of the sheet."""
    ask = {"grid": {"n": "1,2", "k": "0..0.5/3"}, "size": (80, 80)}
    made = render_many(scene, tmp_path / "out", **ask, sheet=tmp_path / "sheet.png")  # type: ignore[arg-type]
    with Image.open(tmp_path / "sheet.png") as sheet, Image.open(tmp_path / "out/a-000004.png") as picture:
        assert sheet.width > sheet.height
        side = (sheet.width - 4) // 3 - 4
        at = (4 + 1 * (side + 4), 4 + (sheet.height - 4) // 2)  # the second of the second row
        cell = np.asarray(sheet.crop((*at, at[0] + side, at[1] + side)), float)
        assert (
            abs(cell - np.asarray(picture.resize((side, side), Image.Resampling.LANCZOS), float)).max() <= 1
        )
    assert made.errors == 0


def test_a_sheet_of_many_is_bounded(tmp_path: Path) -> None:
    Image.new("RGB", (90, 30), "red").save(tmp_path / "p.png")
    lines = [Line("p.png", ("1",), "digest"), Line("", ("2",), "", "E0309: …")] * 3000
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
