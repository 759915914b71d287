"""Materials and textures that files of meshes name: which are read, and that trimesh asks for no others."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("igl")
trimesh = pytest.importorskip("trimesh")

from scenelang.drawing.exact.mesh import read_solids, whole
from scenelang.inverse import sandbox
from scenelang.inverse.sandbox import files_beside
from tests.inverse.test_looks import ONE, PICTURE, by_hand, made

POINTS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0.3 0.6\n"
FACES = "usemtl red\nf 1/1 3/1 2/1\nf 1/1 2/1 4/1\nusemtl tex\nf 2/1 3/1 4/1\nf 1/1 4/1 3/1\n"
MATERIALS = "newmtl red\nKd 1 0.2 0\nnewmtl tex\nKd 0.5 0.5 0.5\nmap_Kd t/pic.png\n"
TEXT = f"mtllib a.mtl\n{POINTS}{FACES}"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "below/t").mkdir(parents=True)
    for place in (tmp_path, tmp_path / "below"):
        (place / "a.mtl").write_text(MATERIALS)
    Image.fromarray(PICTURE).save(tmp_path / "below/t/pic.png")
    return tmp_path / "below"


def read(folder: Path, text: str | bytes, suffix: str = ".obj") -> tuple[Any, list[str]]:
    """The look of a file, and what is said of it."""
    data = text.encode() if isinstance(text, str) else text
    solids, notes = read_solids(data, suffix, files_beside(data, suffix, folder))
    return whole(solids).look, notes


@pytest.mark.parametrize("name", ["a.mtl", "./a.mtl", "/a.mtl", "t\\..\\a.mtl", "  a.mtl \r"])
def test_materials_of_obj_lie_beside_it(folder: Path, name: str) -> None:
    look, notes = read(folder, TEXT.replace("a.mtl", name))
    found = {tuple(np.round(look.at(ONE + k, np.eye(3)[:1])[0], 3)) for k in range(4)}
    assert found == {(1, 0.2, 0), tuple(np.round(by_hand(PICTURE, 0.3, 0.6), 3))}
    assert notes == []
    assert read_solids(TEXT.encode(), ".obj")[0][0].look is None


@pytest.mark.parametrize(
    "name", ["../a.mtl", "t/../../a.mtl", "link.mtl", "loop.mtl", "pipe.mtl", "t", "b.mtl", "a\0.mtl"]
)
def test_what_is_elsewhere_or_no_file_is_not_read(folder: Path, name: str) -> None:
    if sys.platform == "win32" and name in ("link.mtl", "loop.mtl", "pipe.mtl"):
        pytest.skip("has no such files")
    (folder / "link.mtl").symlink_to("../a.mtl")
    (folder / "loop.mtl").symlink_to("loop.mtl")
    os.mkfifo(folder / "pipe.mtl")
    look, notes = read(folder, TEXT.replace("a.mtl", name))
    shown = name.replace("\0", "")
    assert (look, notes) == (None, [f"`{shown}` not found beside it"])


def test_other_spellings_of_materials(folder: Path) -> None:
    """A comment, tabs, no line's end; and a material that is not there."""
    (folder / "a.mtl").write_text("# map_Kd no.png\nnewmtl tex\n\tMAP_KD\tt/pic.png\nmap_Kd\nmap_kd gone.png")
    look, notes = read(folder, TEXT)
    assert look is not None
    assert len(look.images) == 1
    assert notes == ["`gone.png` not found beside it"]


def test_textures_of_ply_and_of_gltf(folder: Path) -> None:
    box = made("texture")
    Image.fromarray(PICTURE).save(folder / 'ü "pic".png')
    uv = "property float s\nproperty float t\n"
    head = "ply\nformat ascii 1.0\ncomment TextureFile t/pic.png\nelement vertex 4\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz") + uv
    head += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    rows = "0 0 0 0.3 0.6\n1 0 0 0.3 0.6\n0 1 0 0.3 0.6\n0 0 1 0.3 0.6\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"
    look, notes = read(folder, head + rows, ".ply")
    assert (len(look.images), notes) == (1, [])

    data = box.export(file_type="glb")
    length = int.from_bytes(data[12:16], "little")
    header = json.loads(data[20 : 20 + length])
    (image,) = header["images"]
    del image["bufferView"]
    for uri, found in (('ü "pic".png', []), ("../a.mtl", ["`../a.mtl` not found beside it"])):
        image["uri"] = uri
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 4)
        sizes = (len(data) - length + len(text)).to_bytes(4, "little") + len(text).to_bytes(4, "little")
        look, notes = read(folder, data[:8] + sizes + data[16:20] + text + data[20 + length :], ".glb")
        assert notes == found
        assert len(look.images) == (not found)


def test_sizes_are_bounded(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    size = (folder / "a.mtl").stat().st_size
    picture = (folder / "t/pic.png").stat().st_size
    data = TEXT.encode()
    for name, most, left in (
        ("MOST_BYTES", max(size, picture), {"a.mtl", "t/pic.png"}),
        ("MOST_BYTES", size - 1, set()),
        ("MOST_TOGETHER", size + picture, {"a.mtl", "t/pic.png"}),
        ("MOST_TOGETHER", size + picture - 1, {"a.mtl"}),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(sandbox, name, most)
            assert files_beside(data, ".obj", folder).keys() == left
    many = "".join(f"map_Kd {k}.png\n" for k in range(2000))
    (folder / "a.mtl").write_text(many + "map_Kd t/pic.png")
    assert files_beside(data, ".obj", folder).keys() == {"a.mtl"}
