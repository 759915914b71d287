"""`scenelang learn`: what becomes of files, whatever stops it, and what is said of mistakes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

pytest.importorskip("igl")
trimesh = pytest.importorskip("trimesh")

import scenelang as nsg
from scenelang.assets.zoo import load_zoo
from scenelang.cli.main import cli
from scenelang.drawing.exact.mesh import FitError
from scenelang.inverse import learn as learning
from scenelang.inverse.learn import LearnOptions, learn_files


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    trimesh.creation.icosphere(3).export("a-ball.ply")
    trimesh.creation.box((1, 2, 3)).export("2 boxes.stl")
    Path("star.svg").write_text('<svg><path d="M50 0 L79 91 2 35 98 35 21 91Z"/></svg>')
    Path("bad.ply").write_text("no mesh")
    Path("bad.safetensors").write_text("no elements")
    return tmp_path


def run(*arguments: Any) -> tuple[int, str]:
    done = CliRunner().invoke(cli, ["learn", *map(str, arguments)])
    return done.exit_code, done.output


def test_python_learns_what_the_command_does(folder: Path) -> None:
    heard: list[str] = []
    zoo = nsg.learn("star.svg", "zoo.safetensors", name="sun", license="CC0", steps=1, say=heard.append)
    assert (
        run("star.svg", "-o", "other.safetensors", "--name", "sun", "--license", "CC0", "--steps", 1)[0] == 0
    )
    assert Path("zoo.safetensors").read_bytes() == Path("other.safetensors").read_bytes()
    assert any("sun" in line for line in heard)
    scene = nsg.Scene(elements=zoo, nodes=nsg.Object("zoo.sun", nsg.Scale(0.5)))
    assert len(nsg.compile(scene)) == 1
    with pytest.raises(nsg.FitError, match=r"bad\.ply"):
        nsg.learn(["bad.ply"], "zoo.safetensors")


def test_a_preview_is_of_the_whole_file_however_it_came_about(folder: Path) -> None:
    """What had been made before a run was killed was not in the picture of the run that went on."""
    Path("flag.svg").write_text(
        '<svg><rect width="9" height="9" fill="#f00"/><circle r="5" fill="#00f"/></svg>'
    )
    asked = ("--steps", 1, "--preview")
    assert run("flag.svg", "star.svg", "-o", "whole.safetensors", *asked, "whole.png")[0] == 0
    assert run("flag.svg", "-o", "zoo.safetensors", *asked, "part.png")[0] == 0
    for _ in range(2):
        assert run("flag.svg", "star.svg", "-o", "zoo.safetensors", *asked, "again.png")[0] == 0
        assert Path("again.png").read_bytes() == Path("whole.png").read_bytes()
    with Image.open("whole.png") as whole, Image.open("part.png") as part:
        assert (whole.size, part.size) == ((512, 512), (512, 512))  # of four and three elements


def test_learn_adds_to_a_file_and_a_scene_draws_it(folder: Path) -> None:
    about = ("--license", "CC0", "--source", "https://example.org")
    assert run("a-ball.ply", "-o", "zoo.safetensors", *about)[0] == 0
    before = load_zoo("zoo.safetensors").geometries["a_ball"]
    asked = ("--max-error", "0.01", "--preview", "preview.png")
    code, output = run("2 boxes.stl", "star.svg", "-o", "zoo.safetensors", *asked)
    assert (code, Path("preview.png").stat().st_size > 1000) == (0, True), output
    zoo = load_zoo("zoo.safetensors").geometries
    assert list(zoo) == ["_2_boxes", "a_ball", "star"]
    assert (zoo["a_ball"], zoo["a_ball"].about) == (before, before.about)
    assert (before.about["license"], before.about["source"]) == ("CC0", "https://example.org")
    Path("scene.nsg").write_text('import "zoo.safetensors" as zoo; zoo.a_ball { scale(0.5); }')
    program = nsg.compile(nsg.load("scene.nsg"))
    assert [element.about for element in program.elements] == [before.about]
    for device in ("auto", "cpu"):
        nsg.render(program, device=device).save("credited.png")
        with Image.open("credited.png") as opened:
            assert opened.info["Copyright"] == "a_ball: CC0, https://example.org"
    pictures = [nsg.render(nsg.load("scene.nsg")), nsg.render(nsg.loads("sphere { scale(0.5); }"))]
    assert abs(pictures[0] - pictures[1]).mean() < 2e-3


def test_a_picture_becomes_a_texture_or_an_outline(folder: Path) -> None:
    """Both under one name, a material and a geometry; a second time neither is made again."""
    shades = np.linspace(0, 255, 300 * 200 * 3).reshape(200, 300, 3).astype(np.uint8)
    Image.fromarray(shades).save("wall.png")
    for given in ((), ("--as", "outline", "--steps", "1")):
        code, output = run("wall.png", "-o", "zoo.safetensors", *given, "--preview", "preview.png")
        assert (code, Path("preview.png").stat().st_size > 100) == (0, True), output
        assert "made before" in run("wall.png", "-o", "zoo.safetensors", *given)[1]
    zoo = load_zoo("zoo.safetensors")
    assert zoo.materials["wall"].sizes == (171, 256)
    assert zoo.geometries["wall"].dimension == 2
    assert run("wall.png", "-o", "zoo.safetensors", "--texels", "64")[0] == 0
    assert load_zoo("zoo.safetensors").materials["wall"].sizes == (43, 64)


def test_a_budget_is_recorded_as_steps(folder: Path) -> None:
    for out, given in (("a", ("--budget", "1e-9")), ("b", ("--steps", "1")), ("c", ("--steps", "2"))):
        assert run("star.svg", "-o", f"{out}.safetensors", *given)[0] == 0
    a, b, c = (Path(f"{out}.safetensors").read_bytes() for out in "abc")
    assert a == b != c


def test_what_was_finished_is_kept_and_not_made_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make, fitted = learning.SandboxProcess.__call__, []

    def stopped(self: Any, request: Any, *given: Any) -> bytes:
        fitted.append(request["name"])
        if request["name"] == stops:
            raise KeyboardInterrupt
        return make(self, request, *given)

    monkeypatch.setattr(learning.SandboxProcess, "__call__", stopped)
    files, stops = ["star.svg", "a-ball.ply"], "a_ball"
    with pytest.raises(KeyboardInterrupt):
        learn_files(files, "z.safetensors")
    assert list(load_zoo("z.safetensors").geometries) == ["star"]
    stops = ""
    learn_files(files, "z.safetensors")
    assert fitted == ["star", "a_ball", "a_ball"]
    whole = Path("z.safetensors").read_bytes()
    for options, again in (
        (LearnOptions(), 0),
        (LearnOptions(steps=1), 0),
        (LearnOptions(license="MIT"), 1),
        (LearnOptions(max_error=0.02), 1),
        (LearnOptions(max_error=0.02), 0),
        (LearnOptions(max_error=1e-9, steps=1), 1),
        (LearnOptions(max_error=1e-9, steps=1), 0),
        (LearnOptions(), 1),
    ):
        fitted.clear()
        learn_files(["a-ball.ply"], "z.safetensors", options)
        assert len(fitted) == again, options
    assert Path("z.safetensors").read_bytes() == whole
    Path("a-ball.ply").write_bytes(Path("2 boxes.stl").read_bytes())
    with pytest.raises(FitError, match="damaged"):
        learn_files(["a-ball.ply"], "z.safetensors")


def test_a_file_that_fails_does_not_stop_the_others(folder: Path) -> None:
    code, output = run("bad.ply", "missing.svg", "notes.txt", "star.svg", "-o", "z.safetensors")
    assert code == 2
    for line in (
        "Error: bad.ply: damaged or not a mesh",
        "Error: missing.svg: no such file",
        "Error: notes.txt: not one of .obj, .ply",
    ):
        assert line in output
    assert list(load_zoo("z.safetensors").geometries) == ["star"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("a-ball.ply -o zoo.st", "does not end in .safetensors"),
        ("a-ball.ply star.svg -o z.safetensors --name x", "a name is for one file"),
        ("a-ball.ply x/a-ball.obj -o z.safetensors", "would both be `a_ball`"),
        ("star.svg -o z.safetensors --name 1st", "`1st` is not a name"),
        ("ö.svg -o z.safetensors", "`` is not a name"),
        ("star.svg -o z.safetensors --license \x1b[2J", "all of them printable"),
        ("star.svg -o bad.safetensors", "not a file of elements"),
        ("star.svg -o missing/z.safetensors", "there is no folder `missing`"),
        ("star.svg -o z.safetensors --preview p.txt", "suffix `.txt`"),
        ("star.svg -o z.safetensors --preview missing/p.png", "there is no folder `missing`"),
    ],
)
def test_mistakes_are_found_before_the_work(arguments: str, words: str, folder: Path) -> None:
    code, output = run(*arguments.split())
    assert code == 2
    assert words in output
    assert " tried" not in output
    assert Path("bad.safetensors").read_text() == "no elements"
    assert not Path("z.safetensors").exists()
