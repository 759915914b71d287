"""Files that would take minutes or gigabytes to read: refused by what is counted in them first."""

from __future__ import annotations

import io
import json
import struct
import time
from typing import Any

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("igl")
pytest.importorskip("svgelements")

from scenelang.drawing.exact.mesh import FitError, mesh_of, read_solids
from scenelang.drawing.exact.outline import read_outline, read_picture

POINTS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
FACES = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def glb(**said: Any) -> bytes:
    text = json.dumps({"asset": {"version": "2.0"}, **said}).encode()
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<IIII", 2, 20 + len(text), len(text), 0x4E4F534A) + text


def svg(body: str) -> bytes:
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">{body}</svg>'.encode()


def uses(deep: int, wide: int) -> str:
    """Each group so many times what the one before is."""
    groups = '<rect id="a0" width="3" height="3"/>'
    for k in range(1, deep):
        inner = "".join(f'<use href="#a{k - 1}" x="{x}"/>' for x in range(wide))
        groups += f'<g id="a{k}">{inner}</g>'
    return f'<defs>{groups}</defs><use href="#a{deep - 1}"/>'


@pytest.mark.parametrize(
    ("data", "suffix", "words"),
    [
        (POINTS + "f" + " 1 2 3" * 400, ".obj", "a face of more than 1,000 corners"),
        (POINTS + "usemtl a\nusemtl b\n" * 5_001 + FACES, ".obj", "changes of material"),
        (POINTS + "o a\nf 1 3 2\n" * 10_001, ".obj", "more than 10,000 objects"),
        (glb(accessors=[{"count": 200_000_000, "sparse": {}}]), ".glb", "accessors of more than 40,000,000"),
        (glb(nodes=[{}] * 10_001), ".glb", "more than 10,000 nodes and primitives"),
        (glb(meshes=[{"primitives": [{}] * 10_001}]), ".glb", "more than 10,000 nodes and primitives"),
        (glb(nodes=[{"children": [k + 1]} for k in range(200)]), ".glb", "more than 100 deep"),
        (glb(nodes=[{"children": [0]}]), ".glb", "more than 100 deep"),
        (svg(uses(14, 3)), ".svg", "more than 50,000 elements"),
        (svg(uses(3000, 1)), ".svg", "more than 50,000 elements"),
        (svg('<g id="a"><use href="#a"/></g>'), ".svg", "more than 50,000 elements"),
        (svg(f"<style>{'.a{fill:red}' * 9000}</style>"), ".svg", "style sheets of more than 100,000 letters"),
        (svg(f'<path d="M0 0{"l1 0 0 1z" * 120_000}"/>'), ".svg", "more than 1,000,000 letters"),
    ],
    ids=range(13),
)
def test_what_is_refused_before_it_is_read(data: str | bytes, suffix: str, words: str) -> None:
    data = data.encode() if isinstance(data, str) else data
    started = time.process_time()
    with pytest.raises(FitError, match=words):
        read_outline(data, suffix) if suffix == ".svg" else read_solids(data, suffix)
    assert time.process_time() - started < 5


def test_what_is_used_a_few_times_is_drawn() -> None:
    assert read_outline(svg(uses(4, 3)), ".svg").notes[0].startswith("27 areas")


def test_a_jpeg_of_many_scans() -> None:
    """Each goes over all of its pixels again."""
    file = io.BytesIO()
    Image.new("RGB", (4000, 4000)).save(file, "JPEG", progressive=True)
    data = file.getvalue()
    last = data.rfind(b"\xff\xda")
    assert read_picture(data, 8).colours.shape == (8, 8, 3)
    with pytest.raises(FitError, match=r"a picture of 1.. scans"):
        read_picture(data[:last] + data[last:-2] * 100 + data[-2:])


def test_soup_is_refused_before_all_of_it_is_asked() -> None:
    """Triangles across all of the ball leave winding numbers nothing to sum up: a point took 70 ms."""
    corners = np.random.default_rng(0).uniform(-1, 1, (300_000, 3))
    mesh = mesh_of(corners, np.arange(300_000).reshape(-1, 3))
    started = time.process_time()
    with pytest.raises(FitError, match=r"overlap so much|encloses no solid"):
        mesh.surface(200_000)
    assert time.process_time() - started < 30
