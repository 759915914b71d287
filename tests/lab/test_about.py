"""What records say of the command that made them."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from scenelang.lab.about import command_line


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            "lab eval shapes2d --set chains --scenes 300 -o /tmp/x",
            "lab eval shapes2d --set chains --scenes 300",
        ),
        ("lab eval solids3d --kept=/tmp/k --side 256 --out /tmp/x", "lab eval solids3d --side 256"),
        ("lab eval solids3d --originals /tmp/x -o y", "lab eval solids3d --originals FOLDER"),
        ("lab stability solids3d -o", "lab stability solids3d"),
        ("lab eval 'a b.safetensors'", "lab eval 'a b.safetensors'"),
    ],
)
def test_folders_are_left_out(given: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules["__main__"], "__spec__", None)
    assert command_line(["/usr/bin/scenelang", *shlex.split(given)]) == f"scenelang {said}"


@pytest.mark.parametrize(
    ("way", "said"),
    [(["-m", "part.of"], "python -m part.of -n 2"), (["part/of.py"], "python part/of.py -n 2")],
)
def test_modules_and_files_are_run_as_they_were(way: list[str], said: str, tmp_path: Path) -> None:
    (tmp_path / "part").mkdir()
    source = "import sys\nfrom scenelang.lab.about import command_line\nprint(command_line(sys.argv))\n"
    (tmp_path / "part" / "of.py").write_text(source, "utf-8")
    asked = [sys.executable, *way, "-n", "2", "-o", "x"]
    done = subprocess.run(asked, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == said
