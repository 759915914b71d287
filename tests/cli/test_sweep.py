"""`scenelang sweep`: what is written and said, and how it exits."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

import scenelang as nsg
from tests.cli.conftest import Folder

TEXT = """\
import "lib.nsg" as l;
canvas(16, 12);
animate(seconds = 1, fps = 4);
param k = 0.5 in 0..1;
param ink = #d33;
param lift = 0.1 in -0.5..0.5;
group { l.petal(k); translate(u, lift); }
square { material flat { color(ink); } }
"""


@pytest.fixture
def scenes(folder: Folder) -> Folder:
    folder.write("lib.nsg", "module petal(k) { star { scale(0.2 + 0.3 * k); } }")
    folder.write("a.nsg", TEXT)
    return folder


def rows(path: str) -> list[dict[str, str]]:
    with Path(path).open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_frame_of_an_animation_with_imports(scenes: Folder) -> None:
    wanted = ("--grid", "k=0..1/2", "--random", "lift,ink", "--count", "4", "--frame", "2")
    done = scenes.run("sweep", "a.nsg", "-o", "o", "-v", *wanted, code=0)
    assert done.output.startswith("o/a.csv: 4 pictures, ")
    for row in rows("o/a.csv"):
        values = {name: row[name] for name in ("k", "lift", "ink")}
        expected = nsg.render(nsg.load("a.nsg", params=values, frame=2))
        assert Path("o", row["picture"]).read_bytes() == expected.encode()
    assert len({row["ink"] for row in rows("o/a.csv")}) == 4


def test_rows_with_mistakes(scenes: Folder) -> None:
    arguments = ("sweep", "a.nsg", "--grid", "k=0.5,7,8,9,10", "-o", "o/")
    done = scenes.run(*arguments, "--sheet", "sheet.png", code=1)
    assert "1 picture, 4 rows whose values give no scene" in done.output
    assert done.output.count("E0309") == 3  # of the first three; the table has all
    assert "row 1: k=7" in done.output
    assert [row["error"][:5] for row in rows("o/a.csv")] == ["", *["E0309"] * 4]
    assert Path("sheet.png").exists()
    assert "1 kept from a run before" in scenes.run(*arguments, code=1).output


REFUSED = """
--grid k=0..1/2 -D k=0.5 -o o                           | param `k` with one value for all pictures
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
--grid k=0.5,1 -o old          | `old/a.csv` has other values in row 0: 0 where 0.5 are asked for
"""


def test_what_cannot_be_done(scenes: Folder) -> None:
    scenes.run("sweep", "a.nsg", "--grid", "k=0,1", "-o", "old", code=0)
    for row in REFUSED.strip().splitlines():
        arguments, said = (part.strip() for part in row.split(" | "))
        done = scenes.run("sweep", "a.nsg", *arguments.split())
        assert (done.exit_code, said in done.output) == (2, True), f"{arguments}: {done.output}"
        assert not list(Path("o").glob("*.png")), arguments
    scenes.write("b.nsg", "param k = 0.5 in 0..1; star { scale(what); }")
    assert "E02" in scenes.run("sweep", "b.nsg", "--grid", "k=0,1", "-o", "new", code=1).output
    assert not Path("new").exists()
