"""`scenelang render` and `compile`: where pictures go, what is refused, that pictures repeat."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.cli.conftest import GOOD, Folder


def picture(path: str | Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image).astype(int)


def test_one_scene(folder: Folder) -> None:
    result = folder.run("render", folder.write("a.nsg"), "-o", "a.png")
    assert (result.exit_code, result.output) == (0, "")
    pixels = picture("a.png")
    assert pixels.shape == (256, 256, 3)
    assert np.abs(pixels[128, 128] - (0xDD, 0x33, 0x33)).max() <= 1
    assert np.abs(pixels[3, 3] - 255).max() <= 1


def test_formulas_in_place_of_the_network(folder: Folder) -> None:
    name = folder.write("a.nsg")
    assert folder.run("render", name, "-o", "a.png", "--backend", "reference").exit_code == 0
    done = folder.run("render", name, "-o", "b.png", "--backend", "exact", "--samples", "four", "-v")
    assert done.exit_code == 0
    assert "formulas in the network's place" in done.stderr
    assert (np.abs(picture("a.png") - picture("b.png")).max(-1) > 1).sum() <= 2


def test_formats_and_sizes(folder: Folder) -> None:
    name = folder.write("a.nsg", "background(none);" + GOOD)
    for suffix, channels in (("png", 4), ("jpg", 3), ("webp", 4), ("TIFF", 4)):
        assert folder.run("render", name, "-o", f"a.{suffix}", "--size", "48x32").exit_code == 0
        assert picture(f"a.{suffix}").shape == (32, 48, channels)
    assert picture("a.png")[0, 0, 3] == 0
    assert picture("a.jpg")[0, 0].min() >= 254


def test_many_scenes_alone_or_together(folder: Folder) -> None:
    names = [folder.write("a.nsg"), folder.write("b.nsg", "star { scale(0.4); twirl(1); }")]
    assert folder.run("render", *names, "-o", "out").exit_code == 0
    assert sorted(os.listdir("out")) == ["a.png", "b.png"]
    for name in ("a", "b"):
        assert folder.run("render", f"{name}.nsg", "-o", f"{name}.png").exit_code == 0
        assert Path(f"{name}.png").read_bytes() == Path(f"out/{name}.png").read_bytes()


def test_one_scene_into_a_folder(folder: Folder) -> None:
    name = folder.write("a.nsg")
    assert folder.run("render", name, "-o", "new/").exit_code == 0
    assert folder.run("render", name, "-o", "new").exit_code == 0
    assert os.listdir("new") == ["a.png"]


def test_scenes_with_errors_are_left_out(folder: Folder) -> None:
    bad, good = folder.write("bad.nsg", "square { scale(foo); }"), folder.write("good.nsg")
    result = folder.run("render", bad, good, "-o", "out")
    assert result.exit_code == 1
    assert "bad.nsg:1:16" in result.stderr
    assert "^^^" in result.stderr
    assert os.listdir("out") == ["good.png"]
    missing = folder.run("render", "none.nsg", good, bad, "-o", "more")
    assert missing.exit_code == 2
    assert os.listdir("more") == ["good.png"]


def test_warnings_are_shown_and_strict_refuses(folder: Folder) -> None:
    name = folder.write("a.nsg", "square { material flat { color([2, 0, 0]); } }")
    result = folder.run("render", name, "-o", "a.png", "--size", "16x16")
    assert result.exit_code == 0
    assert "W0301" in result.stderr
    assert folder.run("render", name, "-o", "b.png", "--strict").exit_code == 1
    assert not Path("b.png").exists()


def test_an_unused_define_draws_nothing(folder: Folder) -> None:
    used, other = folder.write("a.nsg", "param k = 0.5; square { scale(k); }"), folder.write("b.nsg")
    small = ("--size", "16x16")
    assert folder.run("render", used, other, "-o", "out", "-D", "k=0.2", *small).exit_code == 0
    result = folder.run("render", used, other, "-o", "none", "-D", "q=0.2", *small)
    assert result.exit_code == 1
    assert "E0211" in result.stderr
    assert not os.listdir("none")


def test_what_cannot_be_written(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", ".a.png.x.part")

    monkeypatch.setattr(os, "replace", full)
    result = folder.run("render", folder.write("a.nsg"), "-o", "a.png", "--size", "16x16")
    assert result.exit_code == 2
    assert result.stderr == "Error: cannot write `a.png`: no space left on device\n"
    assert os.listdir() == ["a.nsg"]


def test_cuda_that_is_not_there(folder: Folder) -> None:
    import torch

    if torch.cuda.is_available():
        pytest.skip("it is there")
    result = folder.run("render", folder.write("a.nsg"), "-o", "a.png", "--device", "cuda")
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: CUDA is asked for")


def test_verbose(folder: Folder) -> None:
    result = folder.run("render", folder.write("a.nsg"), "-o", "a.png", "-v")
    said = result.stderr
    assert "objects: 2 (1 square, 1 star)" in said
    assert "tokens: 2 union" in said
    assert "model shapes2d (the usual one of its dimension)" in said
    assert "drawn by numpy on one core: about " in said
    for stage in ("parse", "evaluate", "compile", "draw", "save"):
        assert f"{stage} " in said.rpartition("time (ms):")[2]
    said = folder.run("render", "a.nsg", "-o", "b.png", "-v", "--device", "cpu").stderr
    assert "drawn by torch on cpu: asked for by device cpu" in said
    for stage in ("load torch", "load model", "draw"):
        assert f"{stage} " in said.rpartition("time (ms):")[2]


def test_programs(folder: Folder) -> None:
    name = folder.write("a.nsg")
    assert folder.run("compile", name, "-o", "a.safetensors").exit_code == 0
    assert folder.run("render", "a.safetensors", "-o", "p.png").exit_code == 0
    assert folder.run("render", name, "-o", "s.png").exit_code == 0
    assert Path("p.png").read_bytes() == Path("s.png").read_bytes()
    assert folder.run("render", "a.safetensors", "-o", "p.png", "--size", "64x64").exit_code == 0
    assert folder.run("render", name, "-o", "s.png", "--size", "64x64").exit_code == 0
    assert Path("p.png").read_bytes() == Path("s.png").read_bytes()


def test_what_programs_cannot(folder: Folder) -> None:
    folder.run("compile", folder.write("a.nsg"), "-o", "a.safetensors")
    for arguments, said in (
        (("--size", "64x32"), "another shape"),
        (("--backend", "reference"), "the reference draws scenes"),
        (("--frame", "3"), "a single frame"),
        (("--model", "other"), "not `other`"),
        (("-D", "k=1"), "E0211"),
        (("--prove",), "a proof is of a scene"),
    ):
        result = folder.run("render", "a.safetensors", "-o", "p.png", *arguments)
        assert (result.exit_code, said in result.stderr) == (1, True), arguments
        assert not Path("p.png").exists()


def test_damaged_programs(folder: Folder) -> None:
    folder.run("compile", folder.write("a.nsg"), "-o", "a.safetensors")
    Path("b.safetensors").write_bytes(Path("a.safetensors").read_bytes()[:200])
    result = folder.run("render", "a.safetensors", "b.safetensors", "-o", "out")
    assert result.exit_code == 1
    assert result.stderr.startswith("Error: b.safetensors: not a program")
    assert os.listdir("out") == ["a.png"]


def test_without_torch_what_it_draws_is_refused(folder: Folder) -> None:
    """Small pictures are drawn by numpy alone; the others say what is missing."""
    folder.write("a.nsg", "for (i in 0..<20) { star { scale(0.5); translate(rand(i), 0); } }")
    code = "import sys; sys.modules['torch'] = None\nfrom scenelang.cli.main import main; main(sys.argv[1:])"
    command = (sys.executable, "-c", code, "render", "a.nsg", "-o", "a.png")
    assert subprocess.run(command, check=True).returncode == 0
    for options in (("--size", "4096x4096"), ("--max-ms", "5")):
        done = subprocess.run([*command, *options], capture_output=True, text=True, check=False)
        assert done.returncode == 2
        assert done.stderr == "Error: this needs torch, which is not installed; pip install torch\n"


def test_a_picture_of_one_colour_is_told(folder: Folder) -> None:
    """White on white, which no warning of the compiler tells; once where one does."""
    result = folder.run(
        "render", folder.write("a.nsg", "square { scale(0.5); }"), "-o", "a.png", "--size", "16x16"
    )
    assert result.exit_code == 0
    assert result.stderr.startswith("a.png: one colour throughout")
    away = folder.write("b.nsg", "square { scale(0.5); translate(4, 0); }")
    result = folder.run("render", away, "-o", "b.png", "--size", "16x16")
    assert "W0402" in result.stderr
    assert "throughout" not in result.stderr


def test_why_a_picture_has_one_colour(folder: Folder) -> None:
    """Another reason where the background is not white; and a scene may have no objects."""
    for text, said in (
        ("background(#222); square { scale(0.001); }", "smaller than a pixel"),
        ("background(#222); subtract { star; star; }", "cut away"),
        ("background(#222); module part() { star; }", "no objects to draw"),
        ("group { scale(0.5); }", "no objects to draw"),
    ):
        result = folder.run("render", folder.write("a.nsg", text), "-o", "a.png", "--size", "16x16")
        assert (result.exit_code, said in result.stderr) == (0, True), text
        assert "white" not in result.stderr
