"""Every output of every example and case of conformance: a file, or a diagnostic that says why not."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from scenelang.cli.main import cli
from tests.conformance.cases import FOLDER
from tests.output.scenes import ROOT

SCENES = sorted([*(ROOT / "examples").glob("*.nsg"), *FOLDER.glob("*.nsg")])
SMALL = "--size 32x32"
# of each output what is written, and how
OUTPUTS = {
    "outlines": ("render", "a.svg", "--frame 0"),
    "stl": ("render", "a.stl", "--frame 0 --resolution 16 --up z"),
    "ply": ("render", "a.ply", "--frame 0 --resolution 16"),
    "obj": ("render", "a.obj", "--frame 0 --resolution 16"),
    "glb": ("render", "a.glb", "--frame 0 --resolution 16 --backend exact"),
    "page": ("export", "a.html", SMALL),
    "picture": (
        "render",
        "a.png",
        f"{SMALL} --frame 0 --output depth --output normal --output object --output alpha",
    ),
    "exact": ("render", "a.webp", f"{SMALL} --frame 0 --backend exact --samples 4"),
    "layers": ("render", "a.exr", f"{SMALL} --frame 0 --output object"),
    "proof": ("render", "a.png", f"{SMALL} --frame 0 --redraw"),
    "frames": ("render", "a-%04d.png", f"{SMALL} --frames 0..2 --jobs 1"),
    "film": ("render", "a.gif", f"{SMALL} --frames 0..2 --jobs 1"),
    "program": ("compile", "a.safetensors", "--frame 0"),
}


@pytest.mark.slow
@pytest.mark.torch
@pytest.mark.parametrize("output", OUTPUTS)
@pytest.mark.parametrize("path", SCENES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_output_is_written_or_refused(path: Path, output: str, tmp_path: Path) -> None:
    command, name, options = OUTPUTS[output]
    result = CliRunner().invoke(cli, [command, str(path), "-o", str(tmp_path / name), *options.split()])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    written = [file for file in tmp_path.iterdir() if file.stat().st_size]
    assert bool(written) == (result.exit_code == 0), result.output
    if not written:
        assert "error[E" in result.output or "Error: " in result.output
