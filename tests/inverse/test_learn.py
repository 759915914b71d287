"""`scenelang learn`: what becomes of files, their parts, the process that reads them, and mistakes."""

from __future__ import annotations

import json
import signal
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import scenelang as nsg
from scenelang.assets.element import Part
from scenelang.assets.element_file import load_element_file
from scenelang.cli.main import cli
from scenelang.drawing.exact import originals
from scenelang.drawing.exact.mesh import FitError, Mesh, read_solids
from scenelang.inverse import learn as learning
from scenelang.inverse import sandbox
from scenelang.inverse.learn import LearnOptions, learn_files
from scenelang.inverse.sandbox import SandboxProcess

pytest.importorskip("igl")
trimesh = pytest.importorskip("trimesh")


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


def test_learn_adds_to_a_file_and_a_scene_draws_it(folder: Path) -> None:
    about = ("--license", "CC0", "--source", "https://example.org")
    assert run("a-ball.ply", "-o", "zoo.safetensors", "--max-error", "0.001", *about)[0] == 0
    before = load_element_file("zoo.safetensors").geometries["a_ball"]
    asked = ("--max-error", "0.01", "--preview", "preview.png")
    code, output = run("2 boxes.stl", "star.svg", "-o", "zoo.safetensors", *asked)
    assert (code, Path("preview.png").stat().st_size > 1000) == (0, True), output
    zoo = load_element_file("zoo.safetensors").geometries
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


def test_what_is_learned_keeps_the_size_of_its_file(folder: Path) -> None:
    code, output = run("2 boxes.stl", "-o", "zoo.safetensors", "--name", "box")
    assert code == 0
    assert "box_size is 1.87083, box_centre is [0, 0, 0]" in output
    assert load_element_file("zoo.safetensors").geometries["box"].size == pytest.approx(14**0.5 / 2)
    Path("scene.nsg").write_text('import "zoo.safetensors" as zoo; zoo.box { scale(zoo.box_size); }')
    mesh = nsg.to_mesh("scene.nsg", resolution=32)
    assert abs(np.ptp(mesh.vertices, 0) - [1, 2, 3]).max() < 0.02


def test_a_picture_becomes_a_texture_or_an_outline(folder: Path) -> None:
    """Both under one name, a material and a geometry; a second time neither is made again."""
    shades = np.linspace(0, 255, 300 * 200 * 3).reshape(200, 300, 3).astype(np.uint8)
    Image.fromarray(shades).save("wall.png")
    for given in ((), ("--as", "outline", "--steps", "1")):
        code, output = run("wall.png", "-o", "zoo.safetensors", *given, "--preview", "preview.png")
        assert (code, Path("preview.png").stat().st_size > 100) == (0, True), output
        assert "made before" in run("wall.png", "-o", "zoo.safetensors", *given)[1]
    zoo = load_element_file("zoo.safetensors")
    assert zoo.materials["wall"].sizes == (171, 256)
    assert zoo.geometries["wall"].dimension == 2
    assert run("wall.png", "-o", "zoo.safetensors", "--texels", "64")[0] == 0
    assert load_element_file("zoo.safetensors").materials["wall"].sizes == (43, 64)


def test_what_was_finished_is_kept_and_not_made_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make, fitted = learning.SandboxProcess.__call__, []

    def stopped(self: Any, request: Any, *given: Any) -> bytes:
        fitted.append(request["name"])
        if request["name"] == stops:
            raise KeyboardInterrupt
        return make(self, request, *given)

    monkeypatch.setattr(learning.SandboxProcess, "__call__", stopped)
    files, stops = ["star.svg", "a-ball.ply"], "a_ball"
    usual = LearnOptions(max_error=0.01)
    with pytest.raises(KeyboardInterrupt):
        learn_files(files, "z.safetensors", usual)
    assert list(load_element_file("z.safetensors").geometries) == ["star"]
    stops = ""
    learn_files(files, "z.safetensors", usual)
    assert fitted == ["star", "a_ball", "a_ball"]
    whole = Path("z.safetensors").read_bytes()
    for options, again in (
        (usual, 0),
        (LearnOptions(license="MIT", max_error=0.02), 1),
        (LearnOptions(max_error=1e-9, steps=1), 1),
        (usual, 1),
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
    assert list(load_element_file("z.safetensors").geometries) == ["star"]


def test_mistakes_are_found_before_the_work(folder: Path) -> None:
    for arguments, words in (
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
    ):
        code, output = run(*arguments.split())
        assert code == 2
        assert words in output
        assert " tried" not in output
        assert Path("bad.safetensors").read_text() == "no elements"
        assert not Path("z.safetensors").exists()


RED, BLUE = [255, 0, 0, 255], [0, 0, 255, 255]


def coloured(mesh: Any, factor: list[int]) -> Any:
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=factor)
    mesh.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(mesh.vertices), 2)), material=material)
    return mesh


def moved(angle: float = 0, scale: float = 1, at: tuple[float, ...] = (0, 0, 0), flip: bool = False) -> Any:
    turn = trimesh.transformations.rotation_matrix(angle, (0, 0, 1))
    turn[:3, :3] *= scale
    if flip:
        turn[:, 0] *= -1
    turn[:3, 3] = at
    return turn


def wedge() -> Any:
    """A solid without symmetry."""
    points = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)]
    return trimesh.Trimesh(points, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)], process=False)


PLACES = [
    moved(at=(3, 0, 0)),
    moved(0.7, 1, (-3, 0, 0)),
    moved(2.0, 0.5, (0, 4, 0)),
    moved(1.0, 1, (0, -4, 1), flip=True),
]


@pytest.fixture
def car() -> bytes:
    scene = trimesh.Scene()
    scene.add_geometry(
        coloured(trimesh.creation.box((4, 2, 1)), BLUE), node_name="the body", geom_name="body"
    )
    for k, place in enumerate(PLACES):
        shape = coloured(wedge(), RED)
        scene.add_geometry(shape, node_name=f"wheel {k}", geom_name="wheel", transform=place)
    data: bytes = scene.export(file_type="glb")
    return data


def lies(part: Part, p: np.ndarray) -> np.ndarray:
    """Points of a part's own unit ball, where they lie in that of the whole."""
    turn = np.array(part.turn) if part.turn else np.eye(3)
    return np.asarray(part.size * p @ turn.T + part.place)


def test_parts_lie_where_they_were_and_copies_share_a_shape(car: bytes) -> None:
    solids, _ = read_solids(car, ".glb", {})
    assert {solid.name for solid in solids} == {"the body", *(f"wheel {k}" for k in range(4))}
    found = originals.solid_parts(solids, "car", "auto", True)
    wheel = next(name for name in found.shapes if "wheel" in name)
    assert list(found.shapes) == [*dict.fromkeys(part.geometry for part in found.group), "car"]
    assert sorted(part.geometry for part in found.group) == ["car_the_body", *[wheel] * 4]
    assert sum(part.turn == () for part in found.group) in (2, 3)  # of the wheels the first, and its shift
    together = found.shapes["car"]
    assert isinstance(together, Mesh)
    for solid, part in zip(solids, found.group, strict=True):
        shape = found.shapes[part.geometry]
        assert isinstance(shape, Mesh)
        there = lies(part, shape.vertices)
        true = (solid.vertices - together.centre) / together.size
        away = np.linalg.norm(there[:, None] - true[None], axis=2)
        assert away.min(0).max() < 1e-5
        assert away.min(1).max() < 1e-5
        assert abs(np.linalg.norm(shape.vertices, axis=1).max() - 1) < 1e-9
    assert {part.color for part in found.group} == {(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)}


def test_what_is_learned_says_which_part_it_is(car: bytes, tmp_path: Path) -> None:
    (tmp_path / "car.glb").write_bytes(car)
    out = tmp_path / "zoo.safetensors"
    said: list[str] = []
    made = learn_files([tmp_path / "car.glb"], out, LearnOptions(steps=1, parts=True), say=said.append)
    zoo = load_element_file(out)
    assert {*zoo.geometries} == {"car", *(part.geometry for part in zoo.groups["car"])}
    assert {element.name for element in made} == {*zoo.geometries}
    for name, element in zoo.geometries.items():
        shape = originals.shape_in(car, ".glb", "auto", int(element.about.get("part", 0)))
        points, *_ = shape.surface(100)
        assert abs(shape.distances(points)).max() < 1e-6
        assert shape.size == pytest.approx(element.about["size"]), name
    learn_files([tmp_path / "car.glb"], out, LearnOptions(steps=1, parts=True), say=said.append)
    assert said[-1] == "car: made before of this file"
    learn_files([tmp_path / "car.glb"], out, LearnOptions(steps=1))
    assert load_element_file(out).groups["car"] == (Part("car", (0, 0, 0), 1.0, (), (), "car"),)
    with pytest.raises(FitError, match="no part 9"):
        originals.shape_in(car, ".glb", "auto", 9)


def test_a_part_that_encloses_nothing_is_left_out() -> None:
    scene = trimesh.Scene([trimesh.creation.box()])
    sheet = trimesh.Trimesh([(2, 0, 0), (3, 0, 0), (2, 1, 0)], [(0, 1, 2)], process=False)
    scene.add_geometry(sheet, node_name="sheet")
    said: list[Any] = []
    request: dict[str, Any] = {"suffix": ".glb", "name": "a", "about": {}, "files": {}}
    options = {"steps": 1, "parts": True}
    made = learning.make(
        {**request, "options": options}, scene.export(file_type="glb"), lambda *told: said.append(told)
    )
    assert any("a_sheet: left out" in told[1] for told in said if told[0] == "say")
    assert b"a_geometry_0" in made


def test_a_drawing_is_parts_in_its_colours(tmp_path: Path) -> None:
    rows = ("#f00", 0, 0, 8), ("#00f", 2, 2, 4), ("#f00", 20, 0, 4)
    shapes = "".join(f'<rect fill="{c}" x="{x}" y="{y}" width="{a}" height="{a}"/>' for c, x, y, a in rows)
    (tmp_path / "logo.svg").write_text(f"<svg>{shapes}</svg>")
    out = tmp_path / "zoo.safetensors"
    learn_files([tmp_path / "logo.svg"], out, LearnOptions(steps=1))
    zoo = load_element_file(out)
    assert list(zoo.geometries) == ["logo", "logo_1", "logo_2"]
    first, second = zoo.groups["logo"]
    half = (24**2 + 8**2) ** 0.5 / 2
    assert first == Part("logo_1", (0, 0), 1.0, (), (1, 0, 0))  # both red squares reach as far as the whole
    assert second.place == pytest.approx(((4 - 12) / half, (4 - 4) / half))
    assert second.size == pytest.approx(8**0.5 / half)
    shape = originals.shape_in((tmp_path / "logo.svg").read_bytes(), ".svg", "auto", 2)
    assert shape.size == pytest.approx(8**0.5)
    learn_files([tmp_path / "logo.svg"], out, LearnOptions(steps=1, parts=False))
    assert "logo" not in load_element_file(out).groups


CODE = sandbox._CODE


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Any:
    """What code makes of bytes in such a process."""
    if sys.platform == "win32":
        pytest.skip("has no such bounds")

    def ask(code: str, cpu_s: float = 60.0, read_s: float = 60.0) -> tuple[bytes, list[Any]]:
        start, *_ = CODE.partition("sandbox.serve")
        work = f"def make(request, data, tell):\n    import os\n    {code}\nsandbox.serve(make)\n"
        monkeypatch.setattr(
            sandbox, "_CODE", f"{start}sandbox.READ_S = {read_s}\nsandbox.MEGABYTE_S = 0\n{work}"
        )
        heard: list[Any] = []
        with SandboxProcess() as process:
            answers = [process({"cpu_s": cpu_s}, b"abc", {"say": heard.append}) for _ in range(2)]
        assert answers[0] == answers[1]
        return answers[0], heard

    return ask


def test_what_was_read_has_longer(made: Any) -> None:
    assert made("print('noise', flush=True); tell('say', 'a'); return data * 2") == (b"abcabc", ["a", "a"])
    work = "import time; end = time.process_time() + 2.2\n    while time.process_time() < end: pass"
    assert made(f"tell('say', 'read')\n    {work}\n    return data", 60.0, 1.0)[0] == b"abc"
    with pytest.raises(FitError, match="takes too much processor time"):
        made(f"{work}\n    return data", 60.0, 1.0)


def test_what_ends_it_is_an_error_of_the_file(made: Any) -> None:
    for code, words in (
        ("while True: pass", "takes too much processor time"),
        ("return bytes(sandbox.MEMORY)", r"more than 1,024 MiB of memory"),
        (f"os.kill(os.getpid(), {int(signal.SIGSEGV)})", f"has failed .signal {int(signal.SIGSEGV)}"),
        ("os._exit(3)", "has failed .status 3"),
        ("raise sandbox.FitError('what is wrong')", "^what is wrong$"),
        ("return 1 / 0", "has failed .ZeroDivisionError: division by zero"),
        ("import socket; socket.create_connection(('127.0.0.1', 9))", "has failed .PermissionError: socket"),
        ("os.system('true')", "has failed .PermissionError: os.system"),
    ):
        with pytest.raises(FitError, match=words):
            made(code, 1.0)


def test_what_workers_of_dask_set_does_not_slow_it_down(made: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("MALLOC_TRIM_THRESHOLD_", "65536"), ("OMP_NUM_THREADS", "1")):
        monkeypatch.setenv(name, value)
    names = "'MALLOC_TRIM_THRESHOLD_', 'IGL_NUM_THREADS', 'OPENBLAS_NUM_THREADS'"
    found, _ = made(f"return repr([os.environ.get(name) for name in ({names})]).encode()")
    assert found == b"[None, '1', '1']"


def test_what_of_gltf_is_refused_and_what_left_out(car: bytes) -> None:
    length = struct.unpack("<I", car[12:16])[0]
    rest = car[20 + length :]

    def changed(change: dict[str, Any]) -> bytes:
        text = json.dumps(json.loads(car[20 : 20 + length]) | change).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
        return head + text + rest

    for extension, words in (
        ("KHR_draco_mesh_compression", "compressed.*KHR_draco_mesh_compression"),
        ("EXT_meshopt_compression", "EXT_meshopt_compression; export it without"),
        ("KHR_mesh_quantization", "KHR_mesh_quantization"),
    ):
        with pytest.raises(FitError, match=words):
            read_solids(changed({"extensionsRequired": [extension]}), ".glb")
    for change, notes in (
        ({"skins": [{"joints": [0]}]}, ["skins left out"]),
        ({"cameras": [{"type": "perspective"}]}, ["cameras left out"]),
        ({"extensions": {"KHR_lights_punctual": {"lights": []}}}, ["lights left out"]),
        ({"extensionsRequired": ["KHR_materials_unlit"]}, []),
        ({"extensionsUsed": ["KHR_texture_transform"]}, ["moves of textures left out"]),
    ):
        solids, said = read_solids(changed(change), ".glb")
        assert (len(solids), said) == (5, notes)
