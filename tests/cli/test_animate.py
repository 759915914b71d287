"""`scenelang render` of animations: names, options, what is said."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from PIL import Image

from tests.cli.conftest import GOOD, Folder

MOVING = (
    "animate(seconds = 1, fps = 4); canvas(16, 16); background(#246);\n"
    "star { scale(0.6); rotate(0.1turn * u); }\n"
)


def frames(name: str) -> int:
    with Image.open(name) as image:
        return getattr(image, "n_frames", 1)


def test_names_of_sequences(folder: Folder) -> None:
    name = folder.write("a.nsg", MOVING)
    result = folder.run("render", name, "-o", "out/", "--frames", "1..2")
    assert result.exit_code == 0
    assert "out/a-0001.png … a-0002.png: 2 frames" in result.stderr
    assert sorted(os.listdir("out")) == ["a-0001.png", "a-0002.png"]
    result = folder.run("render", name, "-o", "out/a-%04d.png", "--frames", "0..<1")
    assert "also holds 2 such files of another run, `a-0001.png` among them" in result.stderr
    assert sorted(os.listdir("out")) == ["a-0000.png", "a-0001.png", "a-0002.png"]


def test_one_frame_as_a_picture(folder: Folder) -> None:
    name = folder.write("a.nsg", MOVING)
    for out in ("a.png", "a.gif"):
        assert folder.run("render", name, "-o", out, "--frame", "3").exit_code == 0
        assert frames(out) == 1
    assert folder.run("render", name, "-o", "f-%d.png", "--frames", "3").exit_code == 0
    assert Path("f-3.png").read_bytes() == Path("a.png").read_bytes()
    assert folder.run("render", name, "-o", "zero.png").exit_code == 0
    assert frames("zero.png") == 1


def test_rates(folder: Folder) -> None:
    name = folder.write("a.nsg", MOVING)
    result = folder.run("render", name, "-o", "a.gif", "--fps", "10", "-v")
    assert frames("a.gif") == 10
    assert "10 pictures drawn by 1 process, 0 kept" in result.stderr
    assert "compile " in result.stderr


def test_still_scenes(folder: Folder) -> None:
    name = folder.write("a.nsg", "canvas(16, 16);" + GOOD)
    assert folder.run("render", name, "-o", "a.gif").exit_code == 0
    assert frames("a.gif") == 1
    assert folder.run("render", name, "-o", "out/").exit_code == 0
    assert os.listdir("out") == ["a.png"]
    result = folder.run("render", "-", "-o", "b.webp", stdin="canvas(16, 16);" + GOOD)
    assert result.exit_code == 0
    assert frames("b.webp") == 1


def test_standard_input(folder: Folder) -> None:
    assert folder.run("render", "-", "-o", "f-%d.png", stdin=MOVING).exit_code == 0
    assert sorted(os.listdir()) == [f"f-{n}.png" for n in range(4)]


def test_films_are_drawn_as_stills_are(folder: Folder) -> None:
    name = folder.write("a.nsg", MOVING)
    for options in (("--samples", "one"), ("--samples", "draft"), ("--backend", "exact")):
        assert folder.run("render", name, "-o", "f-%d.png", *options).exit_code == 0
        film = Path("f-1.png").read_bytes()
        if "draft" in options:
            assert folder.run("render", name, "-o", "g-%d.png", "--jobs", "2", *options).exit_code == 0
            assert film == Path("g-1.png").read_bytes()
        assert folder.run("render", name, "-o", "f.png", "--frame", "1", *options).exit_code == 0
        assert film == Path("f.png").read_bytes()
    assert folder.run("render", name, "-o", "f-%d.png").exit_code == 0
    assert film != Path("f-1.png").read_bytes()


def test_params_and_reference(folder: Folder) -> None:
    name = folder.write("a.nsg", "param k = 0.5;" + MOVING.replace("0.6", "k"))
    for backend in ("neural", "reference"):
        arguments = ("-o", f"{backend}.gif", "-D", "k=0.3", "--backend", backend)
        assert folder.run("render", name, *arguments).exit_code == 0
    result = folder.run("render", name, "-o", "b.gif", "-D", "q=0.3")
    assert result.exit_code == 1
    assert "E0211" in result.stderr
    assert not Path("b.gif").exists()


def test_strict(folder: Folder) -> None:
    text = MOVING + "square { material flat { color([1 + frame, 0, 0]); } scale(0.1); }"
    name = folder.write("a.nsg", text)
    result = folder.run("render", name, "-o", "a.gif", "--strict")
    assert result.exit_code == 1
    assert "W0301" in result.stderr
    assert not Path("a.gif").exists()
    result = folder.run("render", name, "-o", "a.gif")
    assert (result.exit_code, "W0301" in result.stderr) == (0, True)


def test_without_ffmpeg(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    from scenelang.output import encoders

    encoders.find_ffmpeg.cache_clear()
    monkeypatch.setenv("PATH", "")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    result = folder.run("render", folder.write("a.nsg", MOVING), "-o", "a.mp4")
    encoders.find_ffmpeg.cache_clear()
    assert result.exit_code == 2
    assert result.stderr == f"Error: {encoders.MISSING}\n"
    assert os.listdir() == ["a.nsg"]
