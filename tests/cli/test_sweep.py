"""`scenelang sweep`: what is written and said, and how it exits."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

import scenelang as nsg
from scenelang.cli.main import cli

LIB = "module petal(k) { star { scale(0.2 + 0.3 * k); } }"
TEXT = """\
import "lib.nsg" as l;
canvas(16, 12);
animate(seconds = 1, fps = 4);
param k = 0.5 in 0..1;
param ink = #d33;
param lift = 0.1 in -0.5..0.5;
group { l.petal(k); translate(u, lift); material_is(ink); }
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("lib.nsg").write_text(LIB)
    Path("a.nsg").write_text(
        TEXT.replace(" material_is(ink);", "") + "square { material flat { color(ink); } }"
    )
    return tmp_path


def run(*arguments: str) -> Result:
    return CliRunner().invoke(cli, ["sweep", "a.nsg", *arguments])


def rows(path: str) -> list[dict[str, str]]:
    with Path(path).open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_frame_of_an_animation_with_imports(folder: Path) -> None:
    done = run(
        "--grid", "k=0..1/2", "--random", "lift, ink", "--count", "4", "--seed", "7", "-D", "k=0.5", "-o", "o"
    )
    assert done.exit_code == 2
    assert "param `k` with one value for all pictures" in done.output
    done = run("--grid", "k=0..1/2", "--random", "lift, ink", "--count", "4", "--frame", "2", "-o", "o", "-v")
    assert done.exit_code == 0, done.output
    assert done.output.startswith("o/a.csv: 4 pictures, ")
    for row in rows("o/a.csv"):
        values = {name: row[name] for name in ("k", "lift", "ink")}
        expected = nsg.render(nsg.load("a.nsg", params=values, frame=2))
        assert Path("o", row["picture"]).read_bytes() == expected.encode()
    assert len({row["ink"] for row in rows("o/a.csv")}) == 4


def test_rows_with_mistakes(folder: Path) -> None:
    done = run("--grid", "k=0.5,7,8,9,10", "-o", "o/", "--sheet", "sheet.png")
    assert done.exit_code == 1
    assert "1 picture, 4 rows whose values give no scene" in done.output
    assert done.output.count("E0309") == 3  # of the first three; the table has all
    assert "row 1: k=7" in done.output
    assert [row["error"][:5] for row in rows("o/a.csv")] == ["", *["E0309"] * 4]
    assert Path("sheet.png").exists()
    again = run("--grid", "k=0.5,7,8,9,10", "-o", "o/")
    assert again.exit_code == 1
    assert "1 kept from a run before" in again.output
    Path("o/a-000000.png").unlink()
    assert run("--grid", "k=0.5,7,8,9,10", "-o", "o/").exit_code == 1
    assert Path("o/a-000000.png").exists()


REFUSED = """
--grid q=1 -o o                                         | no param `q`
--grid k -o o                                           | say how many
--grid k=0,1 --grid k=1 -o o                            | given twice
--grid 2=1 -o o                                         | not NAME=VALUES
-o o                                                    | no param to change
--random k -o o                                         | a count is needed
--grid k=0,1 -o o.png                                   | is one file
--grid k=0,1 -o o --table t.xls                         | not a table
--grid k=0,1 -o o --sheet s.what                        | no image format
--grid k=0,1 -o o --backend reference --cluster local   | draws by the network
--grid k=0,1 -o o --backend reference --output program  | no programs
"""


def test_what_cannot_be_done(folder: Path) -> None:
    for row in REFUSED.strip().splitlines():
        arguments, said = (part.strip() for part in row.split(" | "))
        done = run(*arguments.split())
        assert (done.exit_code, said in done.output) == (2, True), f"{arguments}: {done.output}"
        assert not list(Path("o").glob("*.png")), arguments


def test_a_scene_with_mistakes(folder: Path) -> None:
    Path("a.nsg").write_text("param k = 0.5 in 0..1; star { scale(what); }")
    done = run("--grid", "k=0,1", "-o", "o")
    assert done.exit_code == 1
    assert "E02" in done.output
    assert not Path("o").exists()


def test_another_sweep_in_the_folder(folder: Path) -> None:
    assert run("--grid", "k=0,1", "-o", "o").exit_code == 0
    done = run("--grid", "k=0.5,1", "-o", "o")
    assert done.exit_code == 2
    assert "`o/a.csv` has other values in row 0: 0 where 0.5 are asked for" in done.output
