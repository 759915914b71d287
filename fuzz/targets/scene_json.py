"""Any bytes as the JSON of a Scene, and Scenes back to JSON and to text."""

from __future__ import annotations

from functools import cache
from random import Random
from typing import Any

from fuzz import text, trees
from fuzz.oracles import check_compiling, check_diagnostics
from fuzz.target import Failure, Target, hold
from scenelang.assets.records import deep_stack
from scenelang.compiler.manifest import available, load_manifest
from scenelang.language.evaluation import loads
from scenelang.language.reports import SceneError
from scenelang.language.scene import Scene, to_readable_json
from scenelang.language.words import OPERATIONS, TRANSFORMS


def check(data: bytes) -> None:
    """A Scene that comes out equals itself after JSON and after text, and compiles or is refused."""
    try:
        scene = Scene.from_json(data)
    except SceneError as error:
        found = error.diagnostics
        hold(found and all(d.code == "E0313" for d in found), "what is no Scene is E0313", found)
        check_diagnostics(found, None)
        return
    written = scene.to_json()
    with deep_stack():
        again = Scene.from_json(written)
        hold(again == scene, "Scene to JSON and back")
        hold(again.to_json() == written, "the same JSON each time")
        hold(Scene.from_json(to_readable_json(scene)) == scene, "Scene to readable JSON and back")
    _check_text(scene)
    check_compiling(scene)


def _check_text(scene: Scene) -> None:
    """Text of a Scene that some model can draw reads back as that Scene."""
    written = scene.to_nsg()
    try:
        read = loads(written)
    except SceneError as error:
        # Names that no model knows are refused; nothing else may be wrong with text of our own.
        names = {d.code for d in error.diagnostics}
        if not _known(scene):
            return
        raise Failure("Scene to text that reads", (sorted(names), written[:500])) from None
    with deep_stack():
        hold(read == scene, "Scene to text and back", written[:500])


def _known(scene: Scene) -> bool:
    """Whether one model has all names in a Scene; the texts of others are refused."""
    words = _words(scene)
    for name in available():
        manifest = load_manifest(name)
        offered = {("geometry", word) for word in manifest.geometries}
        offered |= {("material", word) for word in manifest.materials}
        if words <= offered and scene.model in (None, name):
            return True
    return False


def _words(scene: Scene) -> set[tuple[str, str]]:
    """Geometries and materials that a Scene names."""
    found: set[tuple[str, str]] = set()
    todo: list[Any] = list(scene.nodes)
    while todo:
        node = todo.pop()
        if node.kind == "object":
            found.add(("geometry", node.geometry))
        elif node.kind == "chain":
            todo += [link.node for link in node.children]
        else:
            todo += node.children
        if node.material is not None:
            found.add(("material", node.material.name))
    return found


@cache
def _scenes() -> tuple[bytes, ...]:
    found = []
    for source in text.texts():
        try:
            scene = loads(source)
        except SceneError:
            continue
        written = scene.to_json().encode()
        if len(written) < 6000:
            found.append(written)
    return tuple(dict.fromkeys(found))


@cache
def _values() -> tuple[Any, ...]:
    return tuple(trees.load(data) for data in _scenes())


def seeds() -> list[bytes]:
    """JSON of all small scenes, of a Scene of everything, and of what is nearly one."""
    transforms = [
        {"kind": "translate", "x": 1, "y": 2, "z": 3},
        {"kind": "rotate", "angle": 0.5, "axis": [0, 0, 1]},
        {"kind": "scale", "x": 1, "y": 2, "z": 1},
        {"kind": "shear", "axes": "xy", "k": 0.5},
        {"kind": "matrix", "rows": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]},
        {"kind": "twirl", "k": 1},
        {"kind": "bend", "k": 1},
        {"kind": "twist", "k": 1},
        {"kind": "displace", "amount": 0.1, "frequency": 3},
    ]
    ops = [
        {"kind": "flip"},
        {"kind": "color", "rgb": [1, 0.5, 0]},
        {"kind": "grayscale", "amount": 0.5},
        {"kind": "hue", "angle": 0.5},
    ]
    leaf = {
        "kind": "object",
        "geometry": "square",
        "transforms": transforms,
        "material": {"name": "flat", "ops": ops},
    }
    link = {"op": "smooth", "node": {"kind": "object", "geometry": "star"}}
    everything = {
        "version": 1,
        "model": "shapes2d",
        "canvas": [16, 16],
        "background": None,
        "animation": {"seconds": 2, "fps": 24, "loop": False},
        "nodes": [
            leaf,
            {"kind": "chain", "children": [{"node": leaf}, link]},
            {"kind": "group", "children": [leaf]},
        ],
    }
    deep: Any = {"kind": "object", "geometry": "star"}
    for _ in range(90):
        deep = {"kind": "group", "children": [deep]}
    odd = [
        everything,
        {"nodes": [deep]},
        {},
        [],
        {"nodes": {}},
        {"canvas": [0, 0]},
        {"model": '"'},
        {"version": 2},
    ]
    return [*_scenes(), *(trees.dump(value) for value in odd), b"", b"\xff", b'{"nodes": [', b"[" * 3000]


def mutate(data: bytes, generator: Random) -> bytes:
    """A change of the tree, or now and then of the bytes."""
    if generator.random() < 0.1:
        return trees.flip(data, generator)
    try:
        value = trees.load(data)
        return trees.dump(trees.mutate(value, generator, _values()))
    except (ValueError, RecursionError):
        return trees.flip(data, generator)


def dictionary() -> list[bytes]:
    """Field names and values of the schema."""
    fields = (
        "version model canvas background animation nodes kind object group boolean chain geometry transforms "
        "material ops name children op node union smooth subtract intersect x y z angle axis axes k rows "
        "amount frequency rgb seconds fps loop"
    )
    words = (*fields.split(), *TRANSFORMS, *OPERATIONS)
    return [
        *(f'"{word}"'.encode() for word in dict.fromkeys(words)),
        b"null",
        b"true",
        b"1e308",
        b"NaN",
        b"-0.0",
        b"\\ud800",
    ]


TARGET = Target(
    name="scene_json",
    summary="any bytes are a Scene or E0313; a Scene equals itself after JSON and, where a model has its "
    "names, after text; compiling raises only SceneError",
    check=check,
    seeds=seeds,
    mutate=mutate,
    dictionary=dictionary,
    most_bytes=6000,
)
