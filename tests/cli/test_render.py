"""`scenelang render` and `compile`: files, what they say, what is refused, that pictures repeat."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import scenelang as nsg
from scenelang.cli import say
from scenelang.drawing import work
from scenelang.drawing.image import PROVED
from scenelang.drawing.neural import draw
from scenelang.output import encoders
from tests.cli.conftest import GOOD, Folder

MOVING = (
    "animate(seconds = 1, fps = 4); canvas(16, 16); background(#246);\n"
    "star { scale(0.6); rotate(0.1turn * u); }\n"
)


SOLIDS = "canvas(24, 16);\nsphere { scale(0.5); }\nsphere { translate(1, 0, 0); }\n"
ORBIT = "animate(1, 3); camera(eye = [6 * sin(1turn * u), 1, 6 * cos(1turn * u)]);\n" + SOLIDS


def picture(path: str | Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image).astype(int)


def same(*paths: str) -> bool:
    first, *others = (Path(path).read_bytes() for path in paths)
    return all(other == first for other in others)


# ---------------------------------------------------------------- stills
def test_work_that_tells_nothing_shows_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once it has taken a while, and nothing of it is left at the end; elsewhere nothing is written."""
    for terminal in (True, False):
        stream = io.StringIO()
        monkeypatch.setattr(stream, "isatty", lambda terminal=terminal: terminal)
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setattr(say, "PATIENCE_S", 0.05)
        with say.Bar() as bar:
            bar("drawing", 0.25, 1.0)
            assert not stream.getvalue()
            until = time.monotonic() + (20 if terminal else 0.3)
            while "25%" not in stream.getvalue() and time.monotonic() < until:
                time.sleep(0.02)
        assert ("drawing" in stream.getvalue() and "25%" in stream.getvalue()) == terminal
        assert stream.getvalue().endswith("\x1b[2K" if terminal else "")


def test_who_is_patient_gets_all_of_a_picture(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stills and films alike; a frame that was kept coarser is drawn again."""
    rings = "for (i in 0..<40) { disc { scale(1 - i / 40); material flat { color(hsv(i / 9, 1, 1)); } } }\n"
    still = folder.write("still.nsg", "canvas(64, 64);\n" + rings)
    film = folder.write("film.nsg", "animate(seconds = 1, fps = 2); canvas(64, 64);\n" + rings)
    ways = (still, "still.png"), (film, "film-%02d.png")
    for name, out in ways:
        folder.run("render", name, "-o", out, "--patient", code=0)
    whole = [picture(folder.path / name) for name in ("still.png", "film-01.png")]
    for name in ("LEAST_S", "BOUND_S"):
        monkeypatch.setattr(work, name, 0.0075)
    monkeypatch.setattr(draw, "until_s", lambda *_: float("inf"))
    for name, out in ways:
        with pytest.warns(UserWarning, match=f"{name}: about .* drawn at .* x .*; --patient draws all of it"):
            folder.run("render", name, "-o", out, code=0)
    coarse = [picture(folder.path / name) for name in ("still.png", "film-01.png")]
    for name, out in ways:
        folder.run("render", name, "-o", out, "--patient", code=0)
    again = [picture(folder.path / name) for name in ("still.png", "film-01.png")]
    for one, less, other in zip(whole, coarse, again, strict=True):
        assert one.shape == less.shape
        assert (one != less).any()
        assert (one == other).all()
    monkeypatch.setattr(work, "SURE", 1e-9)
    result = folder.run("render", still, "-o", "none.png", code=2)
    assert (
        "are allowed at 64 x 64; draw it smaller, with fewer objects or lamps, or with --patient"
        in result.stderr
    )
    assert not (folder.path / "none.png").exists()


def test_one_scene(folder: Folder) -> None:
    name = folder.write("a.nsg")
    assert folder.run("render", name, "-o", "a.png", code=0).output == ""
    pixels = picture("a.png")
    assert pixels.shape == (256, 256, 3)
    assert np.abs(pixels[128, 128] - (0xDD, 0x33, 0x33)).max() <= 1
    assert np.abs(pixels[3, 3] - 255).max() <= 1
    folder.run("render", name, "-o", "r.png", "--backend", "reference", code=0)
    done = folder.run("render", name, "-o", "b.png", "--backend", "exact", "--samples", "four", "-v", code=0)
    assert "formulas in the network's place" in done.stderr
    assert (np.abs(picture("r.png") - picture("b.png")).max(-1) > 1).sum() <= 2
    for _ in range(2):  # into a new folder, and one that is there
        folder.run("render", name, "-o", "new/", code=0)
    assert os.listdir("new") == ["a.png"]


def test_standard_output_takes_what_a_file_would(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    name, film = folder.write("a.nsg", "canvas(16, 16);" + GOOD), folder.write("film.nsg", MOVING)
    for command, suffix, form in (
        (f"render {name}", "png", ""),
        (f"render {name} -v", "jpg", "--format .JPG"),
        (f"render {name}", "svg", "--format svg"),
        (f"render {film} --frames 0..1", "gif", "--format gif"),
        (f"compile {name} -v", "safetensors", ""),
        (f"export {name} --title T", "html", ""),
    ):
        folder.run(*command.split(), "-o", f"file.{suffix}", code=0)
        for out in ("-", "/dev/stdout"):
            sent = folder.run(*command.split(), "-o", out, *form.split(), code=0)
            assert sent.stdout_bytes == Path(f"file.{suffix}").read_bytes(), command
            assert ("standard output" in sent.stderr) == ("-v" in command or suffix == "gif")
    wrong = folder.write("wrong.nsg", "star { sclae(1); }")
    assert folder.run("render", wrong, "-o", "-", code=1).stdout_bytes == b""
    monkeypatch.setattr("click.testing._NamedTextIOWrapper.isatty", lambda self: True, raising=False)
    assert "is a terminal" in folder.run("render", name, "-o", "-", code=2).stderr


@pytest.mark.skipif(sys.platform == "win32", reason="no named pipes")
def test_devices_and_pipes_take_what_a_file_would(folder: Folder) -> None:
    name = folder.write("a.nsg", "canvas(16, 16);" + GOOD)
    folder.run("render", name, "-o", "file.png", code=0)
    os.mkfifo("pipe")
    end = os.open("pipe", os.O_RDWR)
    folder.run("render", name, "-o", "pipe", code=0)
    assert os.read(end, 1 << 16) == Path("file.png").read_bytes()
    os.close(end)
    folder.run("render", name, "-o", os.devnull, code=0)


def test_formats_and_sizes(folder: Folder) -> None:
    name = folder.write("a.nsg", "background(none);" + GOOD)
    for suffix, channels in (("png", 4), ("jpg", 3), ("webp", 4), ("TIFF", 4)):
        folder.run("render", name, "-o", f"a.{suffix}", "--size", "48x32", code=0)
        assert picture(f"a.{suffix}").shape == (32, 48, channels)
    assert picture("a.png")[0, 0, 3] == 0
    assert picture("a.jpg")[0, 0].min() >= 254


def test_many_scenes(folder: Folder) -> None:
    """They are drawn as alone; those with errors are left out."""
    names = [folder.write("a.nsg"), folder.write("b.nsg", "star { scale(0.4); twirl(1); }")]
    bad = folder.write("bad.nsg", "square { scale(foo); }")
    result = folder.run("render", bad, *names, "-o", "out", code=1)
    assert "bad.nsg:1:16" in result.stderr
    assert "^^^" in result.stderr
    assert sorted(os.listdir("out")) == ["a.png", "b.png"]
    for name in ("a", "b"):
        folder.run("render", f"{name}.nsg", "-o", f"{name}.png", code=0)
        assert same(f"{name}.png", f"out/{name}.png")
    folder.run("render", "none.nsg", names[0], bad, "-o", "more", code=2)
    assert os.listdir("more") == ["a.png"]


def test_warnings_are_shown_and_strict_refuses(folder: Folder) -> None:
    name = folder.write("a.nsg", "square { material flat { color([2, 0, 0]); } }")
    assert "W0301" in folder.run("render", name, "-o", "a.png", "--size", "16x16", code=0).stderr
    folder.run("render", name, "-o", "b.png", "--strict", code=1)
    late = folder.write(
        "b.nsg", MOVING + "square { material flat { color([1 + frame, 0, 0]); } scale(0.1); }"
    )
    assert "W0301" in folder.run("render", late, "-o", "b.gif", "--strict", code=1).stderr
    assert not {"b.png", "b.gif"} & set(os.listdir())
    assert "W0301" in folder.run("render", late, "-o", "b.gif", code=0).stderr


def test_an_unused_define_draws_nothing(folder: Folder) -> None:
    used, other = folder.write("a.nsg", "param k = 0.5; square { scale(k); }"), folder.write("b.nsg")
    small = ("--size", "16x16")
    folder.run("render", used, other, "-o", "out", "-D", "k=0.2", *small, code=0)
    result = folder.run("render", used, other, "-o", "none", "-D", "q=0.2", *small, code=1)
    assert "E0211" in result.stderr
    assert not os.listdir("none")


def test_what_is_not_there(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    """CUDA, a library of EXR, ffmpeg."""
    import torch

    name = folder.write("a.nsg", MOVING)
    if not torch.cuda.is_available():
        result = folder.run("render", name, "-o", "a.png", "--device", "cuda", code=2)
        assert result.stderr.startswith("Error: CUDA is asked for")
    monkeypatch.setattr("scenelang.drawing.image.find_spec", lambda name: None)
    result = folder.run("render", name, "-o", "p.exr", code=2)
    assert "pip install 'scenelang[exr]'" in result.stderr
    encoders.find_codec.cache_clear()
    monkeypatch.setenv("PATH", "")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert folder.run("render", name, "-o", "a.mp4", code=2).stderr == f"Error: {encoders.MISSING}\n"
    encoders.find_codec.cache_clear()
    assert os.listdir() == ["a.nsg"]


def test_verbose(folder: Folder) -> None:
    said = folder.run("render", folder.write("a.nsg"), "-o", "a.png", "-v").stderr
    for fact in (
        "objects: 2 (1 square, 1 star)",
        "tokens: 2 union",
        "model shapes2d (the usual one of its dimension)",
        " by the kernel\n",
    ):
        assert fact in said
    for stage in ("parse", "evaluate", "compile", "draw", "save"):
        assert f"{stage} " in said.rpartition("time (ms):")[2]
    said = folder.run("render", "a.nsg", "-o", "b.png", "-v", "--device", "cpu").stderr
    assert "drawn on cpu by torch: asked for by device cpu" in said
    for stage in ("load torch", "load model", "draw"):
        assert f"{stage} " in said.rpartition("time (ms):")[2]


def test_programs(folder: Folder) -> None:
    """They draw what their scenes do, and refuse what they cannot; damaged ones are reported."""
    name = folder.write("a.nsg")
    folder.run("compile", name, "-o", "a.safetensors", code=0)
    for options in ((), ("--size", "64x64")):
        folder.run("render", "a.safetensors", "-o", "p.png", *options, code=0)
        folder.run("render", name, "-o", "s.png", *options, code=0)
        assert same("p.png", "s.png")
    for arguments, said in (
        (("--size", "64x32"), "another shape"),
        (("--backend", "reference"), "the reference draws scenes"),
        (("--frame", "3"), "a single frame"),
        (("--model", "other"), "not `other`"),
        (("-D", "k=1"), "E0211"),
        (("--prove",), "a proof is of a scene"),
    ):
        assert said in folder.run("render", "a.safetensors", "-o", "q.png", *arguments, code=1).stderr
        assert not Path("q.png").exists()
    Path("b.safetensors").write_bytes(Path("a.safetensors").read_bytes()[:200])
    result = folder.run("render", "a.safetensors", "b.safetensors", "-o", "out", code=1)
    assert result.stderr.startswith("Error: b.safetensors: not a program")
    assert os.listdir("out") == ["a.png"]


def test_without_torch_what_it_draws_is_refused(folder: Folder) -> None:
    """Pictures need none, of any size; a device does, and says what is missing."""
    folder.write(
        "a.nsg", "background(#246); for (i in 0..<20) { star { scale(0.5); translate(rand(i), 0); } }"
    )
    code = """import sys
sys.modules["torch"] = None
from scenelang.cli.main import main
for options in ["--size", "1024x1024"], ["--device", "cpu"]:
    try:
        main(["render", "a.nsg", "-o", "a.png", *options])
    except SystemExit as end:
        print(end.code)"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "0\n2\n"
    assert done.stderr == "Error: this needs torch, which is not installed; pip install torch\n"


def test_why_a_picture_has_one_colour(folder: Folder) -> None:
    """Unless a warning of the compiler tells it; and a scene may have no objects."""
    for text, said in (
        ("square { scale(0.5); }", "a.png: one colour throughout; flat objects are white"),
        ("background(#222); square { scale(0.001); }", "smaller than a pixel"),
        ("background(#222); subtract { star; star; }", "cut away"),
        (
            "sky(); light(none); ground(none); camera([0, 0, 0.1]); sphere { shell(0.5); scale(3); }",
            "black throughout: no light reaches what the eye sees",
        ),
        ("background(#222); module part() { star; }", "no objects to draw"),
        ("group { scale(0.5); }", "no objects to draw"),
        ('import "std/solids" as s; s.wedge(-1);', "no objects to draw"),
        ("square { scale(0.5); translate(4, 0); }", "W0402"),
    ):
        name = folder.write("a.nsg", text)
        shown = folder.run("render", name, "-o", "a.png", "--size", "16x16", code=0).stderr
        assert said in shown, text
        assert ("throughout" in shown) == (said not in ("W0402", "no objects to draw")), text


# ---------------------------------------------------------------- animations


def frames(name: str) -> int:
    with Image.open(name) as image:
        return getattr(image, "n_frames", 1)


def test_names_of_sequences(folder: Folder) -> None:
    name = folder.write("a.nsg", MOVING)
    result = folder.run("render", name, "-o", "out/", "--frames", "1..2", code=0)
    assert "out/a-0001.png … a-0002.png: 2 frames" in result.stderr
    assert sorted(os.listdir("out")) == ["a-0001.png", "a-0002.png"]
    result = folder.run("render", name, "-o", "out/a-%04d.png", "--frames", "0..<1")
    assert "also holds 2 such files of another run, `a-0001.png` among them" in result.stderr
    assert sorted(os.listdir("out")) == ["a-0000.png", "a-0001.png", "a-0002.png"]
    folder.run("render", "-", "-o", "f-%d.png", stdin=MOVING, code=0)
    assert sorted(Path().glob("f-*")) == [Path(f"f-{n}.png") for n in range(4)]


def test_pictures_of_animations_and_films_of_stills(folder: Folder) -> None:
    name = folder.write("a.nsg", MOVING)
    for out in ("a.png", "a.gif"):
        folder.run("render", name, "-o", out, "--frame", "3", code=0)
        assert frames(out) == 1
    folder.run("render", name, "-o", "f-%d.png", "--frames", "3", code=0)
    assert same("f-3.png", "a.png")
    folder.run("render", name, "-o", "zero.png", code=0)
    assert frames("zero.png") == 1
    name = folder.write("b.nsg", "canvas(16, 16);" + GOOD)
    for source, out in ((name, "b.gif"), ("-", "b.webp")):
        folder.run("render", source, "-o", out, stdin=folder.read(name), code=0)
        assert frames(out) == 1
    folder.run("render", name, "-o", "out/", code=0)
    assert os.listdir("out") == ["b.png"]


def test_params_and_rates(folder: Folder) -> None:
    name = folder.write("a.nsg", "param k = 0.5;" + MOVING.replace("0.6", "k"))
    result = folder.run("render", name, "-o", "a.gif", "--fps", "10", "-v", "-D", "k=0.3", code=0)
    assert frames("a.gif") == 10
    assert "10 pictures drawn by 1 process, 0 kept" in result.stderr
    assert "compile " in result.stderr
    assert "E0211" in folder.run("render", name, "-o", "b.gif", "-D", "q=0.3", code=1).stderr
    assert not Path("b.gif").exists()


def test_films_are_drawn_as_stills_are(folder: Folder) -> None:
    """By other processes too, here of solids, which load no torch."""
    flat, solid = folder.write("flat.nsg", MOVING), folder.write("solid.nsg", ORBIT)
    for name, options in (
        (flat, ("--samples", "one")),
        (flat, ("--backend", "exact")),
        (flat, ("--backend", "reference")),
        (solid, ("--samples", "draft", "--jobs", "2")),
    ):
        folder.run("render", name, "-o", "f-%d.png", *options, code=0)
        folder.run("render", name, "-o", "f.png", "--frame", "1", *options[:2], code=0)
        folder.run("render", name, "-o", "p.png", "--frame", "1", code=0)
        assert same("f-1.png", "f.png"), options
        assert not same("f-1.png", "p.png"), options


# ---------------------------------------------------------------- outputs and proofs

DEPTH, OBJECT = ("--output", "depth"), ("--output", "object")


def told(path: str) -> dict:
    with Image.open(path) as picture:
        return json.loads(picture.text["scenelang"])


def test_outputs_beside_the_picture(folder: Folder) -> None:
    name = folder.write("a.nsg", SOLIDS)
    for backend in ("neural", "reference"):
        options = ("--backend", backend)
        ran = folder.run("render", name, "-o", "p.png", *DEPTH, *OBJECT, *DEPTH, *options, code=0)
        assert ran.stderr.count("\n") == 2
        near, far = told("p.depth.png")["near"], told("p.depth.png")["far"]
        assert f"p.depth.png: depth from {near:.6g} to {far:.6g} scene units" in ran.stderr
        assert [entry["line"] for entry in told("p.object.png")["objects"]] == [2, 3]
        folder.run("render", name, "-o", "q.png", *options, code=0)
        assert same("p.png", "q.png")
        assert sorted(os.listdir()) == ["a.nsg", "p.depth.png", "p.object.png", "p.png", "q.png"]


def test_outputs_of_programs_and_several_scenes(folder: Folder) -> None:
    names = folder.write("a.nsg", SOLIDS), folder.write("b.nsg")
    folder.run("compile", names[0], "-o", "a.safetensors", code=0)
    folder.run("render", "a.safetensors", "-o", "p.png", *OBJECT, code=0)
    folder.run("render", *names, "-o", "all/", *OBJECT, code=0)
    assert told("p.object.png") == told("all/a.object.png")
    assert [entry["geometry"] for entry in told("all/b.object.png")["objects"]] == ["square", "star"]


def test_outputs_of_frames(folder: Folder) -> None:
    name = folder.write("a.nsg", ORBIT)
    folder.run("render", name, "-o", "f-%d.png", *OBJECT, "--frames", "1..", code=0)
    assert sorted(path.name for path in folder.path.glob("f*")) == [
        f"f-{n}{kind}.png" for n in (1, 2) for kind in (".object", "")
    ]
    folder.run("render", name, "-o", "one.png", *OBJECT, "--frame", "2", code=0)
    assert same("one.object.png", "f-2.object.png")
    assert np.array_equal(picture("one.png"), picture("f-2.png"))
    Path("p.depth.png").symlink_to("a.nsg")
    folder.run("render", name, "-o", "p.png", *DEPTH, "--frame", "0", code=2)
    assert (folder.read("a.nsg"), Path("p.png").exists()) == (ORBIT, False), "no link is followed"


def test_proofs(folder: Folder) -> None:
    """They are told and written, and what is not proved is drawn again where that is asked for."""
    stars = "star { scale(0.8); twirl(0.7); material flat { color(#d33); } } smooth star { scale(0.7); }"
    name = folder.write("a.nsg", f"canvas(90, 60);\nchain {{ {stars} }}\n")
    scene = nsg.load(name)
    _, proof = nsg.prove(scene)
    assert proof.share < 1
    assert folder.run("render", name, "-o", "p.png", code=0).stderr == ""
    ran = folder.run("render", name, "-o", "q.png", "--prove")
    left = int((proof.bound > PROVED).sum())
    assert ran.stderr == f"q.png: {proof.told()}\n"
    assert f"{left} are not, by at most {255 * proof.worst:.0f}/255" in ran.stderr
    assert same("q.png", "p.png")
    ran = folder.run("render", name, "-o", "r.png", "--output", "proof", "--output", "alpha", code=0)
    assert ran.stderr.count("\n") == 3
    assert told("r.proof.png") == {"output": "proof", **proof.facts(), "stored": "65535 bound"}
    stored = np.asarray(Image.open("r.proof.png"), np.float64)
    np.testing.assert_array_equal(stored, np.ceil(65535.0 * proof.bound.astype(np.float64)))
    ran = folder.run("render", name, "-o", "p.png", "--redraw", "-v", code=0)
    assert "p.png: 100 % of pixels proved right to 1/255" in ran.stderr
    exact = nsg.render(scene, backend="reference").to_uint8().astype(int)
    assert abs(picture("p.png") - exact).max() <= 1


def test_a_picture_of_an_animation_says_that_it_is_one_frame(folder: Folder) -> None:
    name = folder.write("a.nsg", "animate(seconds = 1, fps = 4); star { rotate(1turn * u); }")
    shown = folder.run("render", name, "-o", "a.png", "--size", "16x16", code=0).stderr
    assert "frame 0 of 4; `-o NAME.webp`" in shown
    assert "frame 0 of" not in folder.run("render", name, "-o", "a.png", "--frame", "1", code=0).stderr
