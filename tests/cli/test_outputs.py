"""`scenelang render --output`: which files are written, what they say, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.cli.conftest import Folder

SOLIDS = "canvas(24, 16);\nsphere { scale(0.5); }\nsphere { translate(1, 0, 0); }\n"
ORBIT = "animate(1, 3); camera(eye = [6 * sin(1turn * u), 1, 6 * cos(1turn * u)]);\n" + SOLIDS
DEPTH, OBJECT = ("--output", "depth"), ("--output", "object")


def said(path: str) -> dict:
    with Image.open(path) as picture:
        return json.loads(picture.text["scenelang"])


@pytest.mark.parametrize("backend", ["neural", "reference"])
def test_files_beside_the_picture(folder: Folder, backend: str) -> None:
    name = folder.write("a.nsg", SOLIDS)
    ran = folder.run("render", name, "-o", "p.png", *DEPTH, *OBJECT, *DEPTH, "--backend", backend)
    assert (ran.exit_code, ran.stderr.count("\n")) == (0, 2)
    near, far = said("p.depth.png")["near"], said("p.depth.png")["far"]
    assert f"p.depth.png: depth from {near:.6g} to {far:.6g} scene units" in ran.stderr
    assert [entry["line"] for entry in said("p.object.png")["objects"]] == [2, 3]
    assert sorted(path.name for path in folder.path.iterdir()) == [
        "a.nsg",
        "p.depth.png",
        "p.object.png",
        "p.png",
    ]
    assert folder.run("render", name, "-o", "q.png", "--backend", backend).exit_code == 0
    assert Path("p.png").read_bytes() == Path("q.png").read_bytes()


def test_a_compiled_program_and_several_scenes(folder: Folder) -> None:
    names = folder.write("a.nsg", SOLIDS), folder.write("b.nsg")
    assert folder.run("compile", names[0], "-o", "a.safetensors").exit_code == 0
    assert folder.run("render", "a.safetensors", "-o", "p.png", *OBJECT).exit_code == 0
    assert folder.run("render", *names, "-o", "all/", *OBJECT).exit_code == 0
    assert said("p.object.png") == said("all/a.object.png")
    assert [entry["geometry"] for entry in said("all/b.object.png")["objects"]] == ["square", "star"]


def test_frames_have_outputs(folder: Folder) -> None:
    name = folder.write("a.nsg", ORBIT)
    assert folder.run("render", name, "-o", "f-%d.png", *OBJECT, "--frames", "1..").exit_code == 0
    assert sorted(path.name for path in folder.path.glob("f*")) == [
        f"f-{n}{kind}.png" for n in (1, 2) for kind in (".object", "")
    ]
    assert folder.run("render", name, "-o", "one.png", *OBJECT, "--frame", "2").exit_code == 0
    assert Path("one.object.png").read_bytes() == Path("f-2.object.png").read_bytes()
    assert folder.run("render", name, "-o", "g-%d.png").exit_code == 0
    assert np.array_equal(*(np.asarray(Image.open(f"{stem}-2.png")) for stem in "fg"))


def test_a_link_where_an_output_goes_is_refused(folder: Folder) -> None:
    folder.write("mine.txt", "mine")
    Path("p.depth.png").symlink_to("mine.txt")
    ran = folder.run("render", folder.write("a.nsg", SOLIDS), "-o", "p.png", *DEPTH)
    assert (ran.exit_code, Path("mine.txt").read_text()) == (2, "mine")
    assert not Path("p.png").exists()


def test_exr_without_its_library_is_refused_before_anything_is_drawn(folder: Folder, monkeypatch) -> None:
    monkeypatch.setattr("scenelang.drawing.image.find_spec", lambda name: None)
    ran = folder.run("render", folder.write("a.nsg", SOLIDS), "-o", "p.exr", *DEPTH)
    assert ran.exit_code == 2
    assert "pip install 'scenelang[exr]'" in ran.stderr
