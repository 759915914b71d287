"""Every example checks, and the network draws what the reference draws."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import scenelang as nsg
from tests.pictures import premultiplied, psnr_db

EXAMPLES = Path(__file__).parents[1] / "examples"
SCENES = sorted(EXAMPLES.glob("*.nsg"))
LEAST_DB = 40.0  # PSNR; a scene with a wrong object or operator comes out below 25


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_example_is_drawn(path: Path) -> None:
    found = nsg.Diagnostics()
    scene = nsg.load(path, diagnostics=found)
    program = nsg.compile(scene, diagnostics=found)
    assert {d.code for d in found} <= {"W0501"}  # more objects than in training
    picture, exact = nsg.render(program), nsg.render(scene, backend="reference")
    assert psnr_db(premultiplied(picture), premultiplied(exact)) > LEAST_DB


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_example_says_what_it_shows(path: Path) -> None:
    text = path.read_text("utf-8")
    assert text.startswith("// ")
    assert "nsg 1;" in text


def test_script_draws(tmp_path: Path) -> None:
    script, target = EXAMPLES / "spiral.py", tmp_path / "spiral.png"
    subprocess.run([sys.executable, "-W", "error", str(script), str(target)], check=True, capture_output=True)
    assert target.stat().st_size > 1000


def suggestions() -> list[tuple[str, dict[str, str]]]:
    """(file, values of params) of what the comments of examples suggest to try with -D."""
    found = []
    for path in SCENES:
        for line in path.read_text("utf-8").splitlines():
            if line.startswith("//") and "-D " in line:
                named = re.search(r"scenelang render (\S+) -o ", line)
                assert named is None or named[1] == path.name
                found.append((path.name, dict(re.findall(r"-D ([\w.]+)=(\S+)", line))))
    return found


@pytest.mark.parametrize(("name", "params"), suggestions())
def test_suggestions_of_comments_work(name: str, params: dict[str, str]) -> None:
    assert params
    assert nsg.compile(nsg.load(EXAMPLES / name, params=params)).digest()
