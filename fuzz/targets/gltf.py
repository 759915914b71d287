"""Any bytes as a glTF file, and what its nodes become."""

from __future__ import annotations

import struct
import zlib
from random import Random
from typing import Any

from fuzz import tensors, trees
from fuzz.target import Target, hold
from scenelang.deep import deep_stack
from scenelang.diagnostics.error import SceneError
from scenelang.evaluate.evaluation import loads
from scenelang.interchange.gltf import import_gltf
from scenelang.interchange.gltf_file import GltfError, parse_gltf
from scenelang.program.compile import compile_scene
from scenelang.scene.schema import Scene


def check(data: bytes) -> None:
    """A Scene that goes to JSON and text and back, or a GltfError; compiling raises only SceneError."""
    try:
        found = import_gltf(parse_gltf(data), plane="xz" if zlib.crc32(data) % 2 else "xy")
    except GltfError as error:
        hold(
            str(error).isprintable() and len(str(error)) < 1000, "errors are one short line", str(error)[:300]
        )
        return
    scene = found.scene
    for line in found.left_out:
        hold(line.isprintable() and len(line) < 2000, "what is left out is one short line", line[:300])
    hold(_objects(scene) == found.objects, "objects are counted", found.objects)
    with deep_stack():
        hold(Scene.from_json(scene.to_json()) == scene, "imported Scene to JSON and back")
        text = scene.to_nsg()
        hold(loads(text) == scene, "imported Scene to text and back", text[:500])
    try:
        compile_scene(scene)
    except SceneError as error:
        hold(error.diagnostics, "a refusal says why")


def _objects(scene: Scene) -> int:
    count = 0
    todo: list[Any] = list(scene.nodes)
    while todo:
        node = todo.pop()
        count += node.kind == "object"
        todo += getattr(node, "children", ())
    return count


def glb(value: Any) -> bytes:
    """A binary file of a JSON value."""
    text = trees.dump(value)
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


def _files() -> list[Any]:
    turned = {
        "rotation": [0, 0, 0.7071068, 0.7071068],
        "scale": [0.5, 0.5, 0.5],
        "translation": [0.1, 0.2, 0],
    }
    matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.5, 0.25, 0, 1]
    colour = {"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.1, 0.2, 1]}, "name": "red"}
    deep = [{"name": f"n{at}", "children": [at + 1], "translation": [0.01, 0, 0]} for at in range(120)]
    return [
        {"asset": {"version": "2.0"}},
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0, 3]}],
            "nodes": [
                {"name": "root", "children": [1, 2], **turned},
                {"name": "Star.001", "mesh": 0, "matrix": matrix},
                {"name": "square", "rotation": [0.7071068, 0, 0, 0.7071068]},
                {"name": "camera", "camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}},
            ],
            "meshes": [{"name": "pentagon", "primitives": [{"material": 0}]}],
            "materials": [colour],
        },
        {"asset": {"version": "2.0"}, "nodes": [*deep, {"name": "star"}]},
        {"asset": {"version": "2.0"}, "nodes": [{"children": [1]}, {"children": [0]}]},
        {"asset": {"version": "1.0"}, "nodes": {"a": {}}},
    ]


def seeds() -> list[bytes]:
    """Small files in both forms, and the beginnings of one."""
    files = _files()
    return [*map(trees.dump, files), *map(glb, files), b"", b"glTF", glb(files[1])[:40], b"{"]


def mutate(data: bytes, generator: Random) -> bytes:
    """A change of the JSON in either form, or of the bytes around it."""
    binary = data[:4] == b"glTF"
    if generator.random() < 0.1:
        return trees.flip(data, generator)
    try:
        value = trees.mutate(trees.load(data[20:] if binary else data), generator)
        return glb(value) if binary else trees.dump(value)
    except (ValueError, RecursionError):
        return trees.flip(data, generator)


def dictionary() -> list[bytes]:
    """Words of the format."""
    words = (
        "asset version scene scenes nodes name children mesh camera skin matrix translation rotation scale"
    )
    words += " extensions meshes primitives material materials pbrMetallicRoughness baseColorFactor"
    return [b"glTF", b"JSON", b'"2.0"', *tensors.quoted(words)]


TARGET = Target(
    name="gltf",
    summary="any bytes are a glTF file whose nodes become a Scene that JSON and text bring back, or "
    "a GltfError of one line",
    check=check,
    seeds=seeds,
    mutate=mutate,
    dictionary=dictionary,
    most_bytes=12_000,
)
