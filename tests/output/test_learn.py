"""Elements made by workers: the same file as without them, whatever is done first and whoever ends."""

from __future__ import annotations

import re
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
from scenelang.output.workers import GivenUp, Link

FILES = ["ball.ply", "star.svg", "tent.obj"]
TENT = "mtllib tent.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl tex\n"
TENT += "f 1/1 3/3 2/2\nf 1/1 2/2 4/3\nf 2/2 3/3 4/1\nf 1/1 4/2 3/3\n"


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


def test_libraries_of_learning_are_compared(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))["project"]
    needed = {re.split("[><=]", line)[0] for line in project["optional-dependencies"]["learn"]}
    assert needed | {"pillow"} == {*LIBRARIES}
    asked: list[Any] = []
    monkeypatch.setattr(learning, "by_workers", lambda *given: iter(asked.append(given[3]) or ()))
    learning.learn_files(["star.svg"], "z.safetensors", cluster="tcp://there")
    assert asked == [LIBRARIES]
