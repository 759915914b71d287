"""The files that elements were made from, where they are at hand: what the exact picture is drawn from."""

from __future__ import annotations

import hashlib
import os
from functools import lru_cache
from pathlib import Path
from typing import Final

from scenelang.elements.element import Element
from scenelang.files import read_regular
from scenelang.fitting.mesh import FitError, Shape
from scenelang.fitting.parts import MOST_OF, shape_in
from scenelang.graph.nodes import Graph, leaves
from scenelang.scene import library
from scenelang.scene.schema import Scene

FOLDER: Final = "SCENELANG_ORIGINALS"


def originals_of(scene: Scene, graph: Graph) -> dict[str, Shape]:
    """The true shapes of the elements that a scene shows, by geometry.

    Their files lie in the folder that the environment's `FOLDER` names, or beside the file of elements.

    Args:
        scene: where the elements are from.
        graph: of the scene.

    Raises:
        FitError: a file is not there or another, or what reads it is not installed.
        OSError: a file cannot be read.
    """
    shown = {leaf.geometry for leaf in leaves(graph.root)} & graph.elements.keys()
    beside = {file.name: file.zoo.folder for file in scene.elements if file.zoo is not None}
    folders = {name: os.environ.get(FOLDER) or beside[name.partition(".")[0]] for name in sorted(shown)}
    return {name: _original(name, graph.elements[name], folder) for name, folder in folders.items()}


def _original(name: str, element: Element, folder: str | Path | None) -> Shape:
    file, digest = str(element.about.get("original", "")), str(element.about.get("sha256", ""))
    if not file or not digest or folder is None:
        raise FitError(f"the exact shape of `{name}` is not known: it does not say what it was made from")
    path = Path(folder, file)
    made = f"`{name}` was made from `{file}`"
    if path.name != file or path.suffix.lower() not in MOST_OF or not path.is_file():
        ships = library.owns(Path(folder, file).resolve())
        means = ", which `python -m lab docs meshes` of the repository makes" if ships else ""
        raise FitError(
            f"{made}, which is not in `{folder}`; `--originals FOLDER` ({FOLDER}) says where it is{means}"
        )
    version = path.stat().st_mtime_ns, path.stat().st_size
    part = int(element.about.get("part", 0))
    shape = _shape(path, digest, element.about.get("sign") == "closed", part, *version)
    if shape is None:
        raise FitError(f"{made}, and `{path}` is another file of that name")
    return shape


@lru_cache(maxsize=8)
def _shape(path: Path, digest: str, closed: bool, part: int, *version: int) -> Shape | None:
    """The shape in a file, None if that is another one; frames of an animation ask again and again."""
    suffix = path.suffix.lower()
    data = read_regular(path, MOST_OF[suffix])
    if hashlib.sha256(data).hexdigest() != digest:
        return None
    return shape_in(data, suffix, "closed" if closed else "auto", part)
