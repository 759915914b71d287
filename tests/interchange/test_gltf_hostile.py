"""glTF files that mean harm, and files that are none."""

from __future__ import annotations

import json
import struct
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenelang.interchange.gltf import GltfError, import_gltf, load_gltf
from scenelang.interchange.gltf_file import MOST_BYTES, parse_gltf
from tests.interchange.documents import Json, document, read, write
from tests.work import ends

GOOD = document([{"name": "star", "mesh": 0}])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"nodes": [{"children": [0]}]}, "met a second time"),
        ({"nodes": [{"children": [1]}, {"children": [0]}]}, "met a second time"),
        ({"nodes": [{"children": [1, 1]}, {"name": "star"}]}, "met a second time"),
        ({"nodes": [{"children": [1, 2]}, {"children": [2]}, {"name": "star"}]}, "met a second time"),
        ({"nodes": [{"children": [1]}, {"children": [0]}], "scenes": [], "scene": None}, "cycle"),
        ({"nodes": [{"children": [7]}]}, "names node 7"),
        ({"nodes": [{"children": [-1]}]}, "greater than or equal"),
        ({"nodes": [{"children": [1e300]}]}, "not glTF: nodes[0].children[0]"),
        ({"nodes": [{"mesh": 3}]}, "names mesh 3"),
        ({"nodes": [{"mesh": True}]}, "nodes[0].mesh"),
        ({"nodes": "star"}, "not glTF: nodes"),
        ({"nodes": [None]}, "not glTF: nodes[0]"),
        ({"nodes": [{"name": 3}]}, "nodes[0].name"),
        ({"nodes": [{"name": "star", "translation": [1, 2]}]}, "translation"),
        ({"nodes": [{"name": "star", "translation": [1, 2, "3"]}]}, "translation"),
        ({"nodes": [{"name": "star", "rotation": [0, 0, 0, 0]}]}, "/star: a quaternion of length 0"),
        ({"nodes": [{"name": "star", "matrix": [1] * 15}]}, "matrix"),
        ({"nodes": [{"name": "star", "matrix": [1] * 16}]}, "last row"),
        ({"scene": 4}, "scene 4"),
        ({"scenes": [{"nodes": [9]}]}, "names node 9"),
        ({"asset": {}}, "asset.version"),
        ({"asset": {"version": "1.0"}}, "version '1.0'"),
        ({"materials": [{"pbrMetallicRoughness": {"baseColorFactor": [2, 0, 0, 1]}}]}, "baseColorFactor"),
        ({"nodes": [{"children": [at + 1]} for at in range(999)] + [{}]}, "deeper than 150"),
        ({"nodes": [{}] * 100_001}, "at most 100000"),
    ],
)  # fmt: skip
def test_hostile_documents(change: Json, said: str) -> None:
    with pytest.raises(GltfError) as caught:
        read({**GOOD, **change})
    assert said in str(caught.value)
    assert len(str(caught.value)) < 500


def glb(text: bytes, length: int | None = None, version: int = 2, kind: bytes = b"JSON") -> bytes:
    size = len(text) if length is None else length
    return b"glTF" + struct.pack("<III4s", version, 20 + len(text), size, kind) + text


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "not glTF"),
        (b"\xff\xfe", "not glTF"),
        (b"[" * 100_000, "deeper than"),
        (b'{"a": 1, "a": 2}', "given twice"),
        (b'{"a": NaN}', "NaN"),
        (b'{"a": ' + b"9" * 5000 + b"}", "not glTF"),
        (b'"' + b'\\"' * 400_000, "not glTF"),
        (b" " * (MOST_BYTES + 1), "10 MB"),
        (b"glTF", "ends in its header"),
        (glb(b"{}", version=1), "version 1"),
        (glb(b"{}", kind=b"BIN\0"), "begin with JSON"),
        (glb(b"{}", length=100), "ends within"),
        (glb(b"{}", length=0xFFFFFFFF), "10 MB"),
        (glb(b"{}"), "asset"),
    ],
)
def test_hostile_bytes(data: bytes, said: str) -> None:
    with pytest.raises(GltfError) as caught:
        parse_gltf(data)
    assert said in str(caught.value)


KEYS = ["asset", "version", "nodes", "scenes", "children", "mesh", "meshes", "name", "matrix", "rotation"]
KEYS += ["scale", "materials", "primitives"]
ATOMS = st.none() | st.booleans() | st.floats() | st.integers(-3, 9) | st.text(max_size=5)


@settings(max_examples=200)
@given(
    st.recursive(
        ATOMS,
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(KEYS), inner, max_size=5),
    )
)
def test_any_json_is_a_scene_or_an_error(value: Any) -> None:
    for data in (value, {**GOOD, **value} if isinstance(value, dict) else {**GOOD, "nodes": value}):
        try:
            import_gltf(parse_gltf(json.dumps(data).encode()))
        except GltfError:
            continue


def test_no_uri_is_followed(tmp_path: Path) -> None:
    """Whatever URIs a file has, only the file itself is opened."""
    uris = ["../secret.bin", "/etc/passwd", "file:///etc/passwd", "http://localhost:1/x", "data:,x", "pipe"]
    data = document([{"name": "star", "mesh": 0}], buffers=[{"byteLength": 1, "uri": uri} for uri in uris])
    data["images"] = [{"uri": uri} for uri in uris]
    path = write(tmp_path, data)
    opened: list[str] = []
    watching = True

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if watching and event in ("open", "socket.connect", "socket.getaddrinfo"):
            opened.append(str(arguments[0]))

    sys.addaudithook(watch)
    try:
        load_gltf(path, model="shapes2d")
    finally:
        watching = False
    assert [name for name in opened if not name.isdigit() and "manifest.json" not in name] == [str(path)]


def test_names_of_many_endings_are_read_soon() -> None:
    ends("""if True:
        from scenelang.interchange.gltf import geometry_of
        odd = ["1" * 40 + "x", "1" * 10**6 + "x", ".copy" * 10**6 + "x", "1x" * 10**6, "_1" * 100 + "x"]
        assert geometry_of([*odd, "star" + ".1" * 98], ["star"]) == "star"
    """)
