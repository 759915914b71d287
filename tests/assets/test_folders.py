"""Folders of strangers and outputs that are inputs: nothing is lost, inside or outside."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from scenelang.output.frames import Store, put_frame
from tests.assets.processes import leavings, one_line, run
from tests.assets.test_writing import WRITERS, scenes
from tests.cli.conftest import Folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
__all__ = ["scenes"]
WORK = Path(".out.gif.frames")


@pytest.fixture
def outside(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that the hostile one has links to, with files named like those of a store."""
    place = tmp_path_factory.mktemp("outside")
    for name in ("lock", "film.gif", f"{'a' * 40}.png", "mine"):
        (place / name).write_bytes(b"somebody's")
    return place


def unharmed(outside: Path) -> bool:
    return len(leavings(outside)) == 4 and {p.read_bytes() for p in outside.iterdir()} == {b"somebody's"}


@pytest.mark.parametrize("plant", ["folder", "lock", "hard lock", "film.gif"])
def test_a_work_folder_with_links(scenes: Folder, outside: Path, plant: str) -> None:
    if plant == "folder":
        WORK.symlink_to(outside)
    else:
        WORK.mkdir()
        name = plant.split()[-1]
        (os.link if "hard" in plant else os.symlink)(outside / name, WORK / name)
    result = scenes.run("render", "moving.nsg", "-o", "out.gif", "--size", "16x16", "--backend", "reference")
    assert unharmed(outside)
    if plant in ("folder", "lock"):
        assert result.exit_code == 2
        assert "is a link" in result.stderr
        assert not Path("out.gif").exists()
    else:
        assert result.exit_code == 0
        assert not WORK.exists()


def test_what_is_not_the_stores_stays(scenes: Folder) -> None:
    WORK.mkdir()
    for name in ("diary.png", ".notes.part", "film"):
        (WORK / name).write_bytes(b"somebody's")
    arguments = ("render", "moving.nsg", "-o", "out.gif", "--size", "16x16", "--backend", "reference")
    assert scenes.run(*arguments).exit_code == 0
    assert sorted(os.listdir(WORK)) == [".notes.part", "diary.png", "film"]


def test_a_kept_frame_that_is_a_link(tmp_path: Path, outside: Path) -> None:
    import numpy as np

    from scenelang.drawing.image import Image

    key = "a" * 40
    with Store(tmp_path / "work") as store:
        store.file(key).symlink_to(outside / f"{key}.png")
        put_frame({store.file(key): np.zeros((2, 3, 3), np.float32).view(Image).encode()})
        assert store.has(key, (3, 2))
    assert unharmed(outside)


@pytest.mark.parametrize(
    "arguments",
    [
        ("render", "a.nsg", "moving.nsg", "-o", "./", "--size", "16x16", "--backend", "reference"),
        ("compare", "a.nsg", "--size", "32x32"),
        ("watch", "a.nsg", "--size", "16x16"),
    ],
)
def test_names_that_the_user_did_not_write(scenes: Folder, outside: Path, arguments: tuple[str, ...]) -> None:
    Path("a-compare.png" if "compare" in arguments else "a.png").symlink_to(outside / "mine")
    result = scenes.run(*arguments)
    assert result.exit_code == 2
    assert "is a link" in result.stderr
    assert unharmed(outside)


# ---------------------------------------------------------------- one file for input and output


@pytest.mark.parametrize("link", [os.symlink, os.link])
@pytest.mark.parametrize("name", sorted(WRITERS.keys() - {"schema"}))
def test_an_output_that_is_the_input(scenes: Folder, name: str, link: object) -> None:
    source = Path("moving.nsg" if name == "render-animation" else "a.nsg")
    arguments = [word.format("") for word in WRITERS[name]]
    link(source, arguments[3])  # type: ignore[operator]
    before, there = source.read_bytes(), leavings(scenes.path)
    result = scenes.run(*arguments)
    assert result.exit_code == 2
    assert result.stderr.splitlines()[-1].endswith(
        f"cannot write `{arguments[3]}`: it is an input of the same command"
    )
    assert source.read_bytes() == before
    assert leavings(scenes.path) == there


@pytest.mark.parametrize(
    "command",
    [("convert", "--to", "nsg"), ("convert", "--to", "json"), ("dump",), ("dump", "--format", "dot")],
)
@pytest.mark.parametrize("out", ["a.nsg", "./a.nsg", "lib.nsg"])
def test_outputs_by_the_inputs_own_names(folder: Folder, command: tuple[str, ...], out: str) -> None:
    folder.write("lib.nsg", "let k = 0.5;\n")
    folder.write("a.nsg", 'import "lib.nsg" as l;\nsquare { scale(l.k); }\n')
    before = Path(out).read_bytes()
    result = folder.run(*command, "a.nsg", "-o", out)
    assert result.exit_code == 2
    assert "is an input" in result.stderr
    assert Path(out).read_bytes() == before


def test_an_output_that_is_standard_input(folder: Folder) -> None:
    before = Path(folder.write("a.nsg")).read_bytes()
    with open("a.nsg") as file:
        said = one_line(run("convert", "-", "-o", "a.nsg", stdin=file))
    assert "is an input" in said
    assert Path("a.nsg").read_bytes() == before


def test_commands_that_work_in_place(folder: Folder) -> None:
    """Those that are there to change a file do, also behind a link."""
    folder.write("a.nsg", "square   { scale(1) }\n")
    os.symlink("a.nsg", "link.nsg")
    assert folder.run("check", "--fix", "link.nsg").exit_code == 0
    assert folder.run("fmt", "link.nsg").exit_code == 0
    assert Path("a.nsg").read_text() == "square { scale(1); }\n"
    assert os.path.islink("link.nsg")
