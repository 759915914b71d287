"""Elements made by workers: the same file as without them, whatever is done first and whoever ends."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("igl")
trimesh = pytest.importorskip("trimesh")

import scenelang as nsg
from scenelang.assets.zoo import load_zoo
from scenelang.inverse import learn as learning
from scenelang.inverse.sandbox import LIBRARIES
from scenelang.output import workers
from scenelang.output.workers import GivenUp, Link
from tests.output.machines import started

FILES = ["ball.ply", "star.svg", "tent.obj"]
TENT = "mtllib tent.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl tex\n"
TENT += "f 1/1 3/3 2/2\nf 1/1 2/2 4/3\nf 2/2 3/3 4/1\nf 1/1 4/2 3/3\n"


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with started(tmp_path_factory.mktemp("cluster"), 2) as (found, _):
        yield found


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The first of `FILES` takes longest; the last has a texture."""
    monkeypatch.chdir(tmp_path)
    trimesh.creation.icosphere(4).export("ball.ply")
    Path("star.svg").write_text('<svg><path d="M50 0 L79 91 2 35 98 35 21 91Z"/></svg>')
    Path("tent.obj").write_text(TENT)
    Path("tent.mtl").write_text("newmtl tex\nmap_Kd skin.png\n")
    shades = np.linspace(0, 255, 16 * 16 * 3).reshape(16, 16, 3).astype(np.uint8)
    Image.fromarray(shades).save("skin.png")
    return tmp_path


def test_the_file_is_the_one_without_workers(
    folder: Path, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[str] = []
    nsg.learn(FILES, "one.safetensors", steps=2)
    nsg.learn(FILES, "two.safetensors", steps=2, cluster=address, say=heard.append)
    assert Path("one.safetensors").read_bytes() == Path("two.safetensors").read_bytes()
    assert load_zoo("two.safetensors").materials.keys() == {"tent"}
    said = [line.partition(":")[0] for line in heard if not line.startswith(" ")]
    assert said.index("star") < said.index("ball")
    assert [name for name, last in zip(said, [None, *said], strict=False) if name != last] in (
        ["star", "ball", "tent"],
        ["star", "tent", "ball"],
    )
    whole = Path("two.safetensors").read_bytes()
    monkeypatch.setattr(Link, "send", None)
    heard.clear()
    nsg.learn(FILES, "two.safetensors", steps=2, cluster=address, say=heard.append)
    assert heard == [f"{name}: made before of this file" for name in ("ball", "star", "tent")]
    assert Path("two.safetensors").read_bytes() == whole


def test_errors_are_of_their_files_alone(folder: Path, address: str) -> None:
    Path("bad.ply").write_text("no mesh")
    Path("skin.png").unlink()
    said: list[list[str]] = []
    for where in (None, address):
        said.append([])
        with pytest.raises(nsg.FitError) as caught:
            nsg.learn(
                ["bad.ply", "gone.svg", "tent.obj"], f"{where is None}.safetensors",
                steps=1, cluster=where, say=said[-1].append,
            )  # fmt: skip
        said[-1].append(str(caught.value))
    assert sorted(said[0]) == sorted(said[1])
    assert re.fullmatch(r"bad\.ply: damaged or not a mesh.*\ngone\.svg: no such file.*", said[1][-1])
    assert any("`skin.png` not found beside it" in line for line in said[1])
    assert Path("True.safetensors").read_bytes() == Path("False.safetensors").read_bytes()


def test_what_is_done_is_kept(folder: Path, address: str) -> None:
    def stop(line: str) -> None:
        if line.startswith("tent"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        nsg.learn(["star.svg", "tent.obj"], "z.safetensors", steps=1, cluster=address, say=stop)
    assert set(load_zoo("z.safetensors").geometries) <= {"star"}
    nsg.learn(["star.svg", "tent.obj"], "z.safetensors", steps=1, cluster=address)
    assert set(load_zoo("z.safetensors").geometries) == {"star", "tent"}


@pytest.mark.slow
def test_a_worker_that_is_killed(folder: Path) -> None:
    """Of two that are at work one ends; the other makes its file too."""
    files = [*FILES, "again.ply"]
    Path("again.ply").write_bytes(Path("ball.ply").read_bytes())
    with started(folder, 2) as (address, (_, first, _)):
        kills: list[Callable[[], None]] = [partial(os.kill, first.pid, signal.SIGKILL)]
        nsg.learn(
            files, "two.safetensors", steps=1, cluster=address, say=lambda _: kills.pop()() if kills else None
        )
        assert not kills
        assert first.wait() == -signal.SIGKILL
    nsg.learn(files, "one.safetensors", steps=1)
    assert Path("one.safetensors").read_bytes() == Path("two.safetensors").read_bytes()


def backwards(
    address: str, function: Callable[..., Any], items: Iterable[tuple[int, Any]], libraries: tuple[str, ...]
) -> Iterator[tuple[int, Callable[[], Any]]]:
    """`by_workers` of one that is done with the last first, and ends over a file called ``fatal``."""

    def lost() -> None:
        raise GivenUp("given up")

    for index, (request, data) in reversed([*items]):
        yield index, lost if request["name"] == "fatal" else partial(function, (request, data))


def test_who_is_first_has_no_say(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A part of one file has the name of another, which comes later and so takes its place."""
    scene = trimesh.Scene()
    for name, place in (("body", 0), ("roof", 5)):
        box = trimesh.creation.box((1, 2, 3 + place))
        scene.add_geometry(box.apply_translation((place, 0, 0)), node_name=name, geom_name=name)
    Path("car.glb").write_bytes(scene.export(file_type="glb"))
    trimesh.creation.icosphere(1).export("car_roof.ply")
    Path("fatal.svg").write_bytes(Path("star.svg").read_bytes())
    files = ["car.glb", "car_roof.ply", "fatal.svg", "star.svg"]
    nsg.learn([name for name in files if "fatal" not in name], "one.safetensors", steps=1, parts=True)
    found = load_zoo("one.safetensors").geometries
    assert found.keys() == {"car", "car_body", "car_roof", "star"}
    assert found["car_roof"].about["original"] == "car_roof.ply"
    monkeypatch.setattr(learning, "by_workers", backwards)
    with pytest.raises(nsg.FitError, match=r"^fatal\.svg: given up$"):
        nsg.learn(files, "two.safetensors", steps=1, parts=True, cluster="somewhere")
    assert Path("one.safetensors").read_bytes() == Path("two.safetensors").read_bytes()


def test_libraries_count_for_learning_alone(
    folder: Path, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))["project"]
    needed = {re.split("[><=]", line)[0] for line in project["optional-dependencies"]["learn"]}
    assert needed | {"pillow"} == {*LIBRARIES}
    here = workers.fingerprint
    changed = {"libigl": "0.1"}
    monkeypatch.setattr(
        workers, "fingerprint", lambda names=(): here(names) | (changed if "libigl" in names else {})
    )
    Link(address).close()
    with pytest.raises(nsg.RenderError, match=r"worker tcp\S+ has libigl \d\S+, where 0\.1 is here"):
        nsg.learn("star.svg", "z.safetensors", cluster=address)
    assert not Path("z.safetensors").exists()


@pytest.mark.slow
def test_workers_of_this_machine(folder: Path) -> None:
    command = [sys.executable, "-m", "scenelang", "learn", *FILES, "--steps", "1", "-o"]
    for out, more in (("one", ()), ("two", ("--cluster", "local"))):
        done = subprocess.run(
            [*command, f"{out}.safetensors", *more], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        assert "Traceback" not in done.stderr
    assert Path("one.safetensors").read_bytes() == Path("two.safetensors").read_bytes()
