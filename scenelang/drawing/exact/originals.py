"""Files that elements were made from: the shapes in them, from which the exact picture is drawn.

Parts that are copies of each other, turned, mirrored or scaled, share the shape of the first one.
"""

from __future__ import annotations

import hashlib
import os
from functools import lru_cache
from itertools import chain, count
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from scenelang.assets.element import MOST_PARTS, Element, Group, Painted, Part
from scenelang.assets.files import read_regular
from scenelang.compiler.graph import Graph, leaves
from scenelang.drawing.exact import mesh as meshes
from scenelang.drawing.exact import outline
from scenelang.drawing.exact.mesh import FitError, Mesh, NamedMesh, Points, Sign, Tints
from scenelang.drawing.exact.outline import Outline
from scenelang.language import library
from scenelang.language.scene import Scene

Shape = Mesh | Outline
MOST_OF: Final = {**meshes.MOST_OF_MESH, **outline.MOST_OF_DRAWING, **outline.MOST_OF_PICTURE}
"""Bytes of a file, by the suffixes that are read."""
_ALIKE: Final = 1e-4  # of a part's size: how far its points may lie off those of a copy


class OriginalShapes(NamedTuple):
    """The shapes of a file."""

    shapes: dict[str, Shape]  # what each element is made of, by its name; the whole comes last
    numbers: dict[str, int]  # of the parts in the file, from 1, by the names of their elements
    group: Group  # the parts, none where nothing is known of them but their shape
    notes: tuple[str, ...]  # what there is to say of the file


def shape_in(data: bytes, suffix: str, sign: Sign, number: int) -> Shape:
    """A part by its number, or the whole for 0."""
    if suffix in outline.MOST_OF_DRAWING:
        drawn = outline.read_outline(data, suffix)
        if number == 0:
            return drawn
        if layers := [layers for _, layers in drawn.painted()][number - 1 :]:
            return Outline(layers[0])
    else:
        result, _ = meshes.read_solids(data, suffix)
        if number <= len(result):
            return meshes.whole(result[number - 1 : number] if number else result, sign)
    raise FitError(f"it has no part {number}")


def said(text: str) -> str:
    """A text as part of a name that scenes can say: letters, digits and _ between them."""
    return "".join(c if c.isascii() and c.isalnum() else "_" for c in text).strip("_")


def solid_parts(parts: list[NamedMesh], name: str, sign: Sign, apart: bool) -> OriginalShapes:
    """Shapes of a file of meshes, ``apart`` if its solids are elements of their own."""
    whole = meshes.whole(parts, sign)
    if not apart or len(parts) < 2:
        alone = Part(name, (0.0, 0.0, 0.0), 1.0, (), *_worn(whole.look, name))
        return OriginalShapes({name: whole}, {}, () if whole.look is None else (alone,), whole.notes)
    _few(len(parts))
    shapes: dict[str, Shape] = {}
    numbers = {}
    firsts: list[tuple[NamedMesh, Mesh, str]] = []
    group = []
    for number, solid in enumerate(parts, 1):
        mesh = meshes.whole([solid], sign)
        rows, centre, size = np.eye(3), np.array(mesh.centre), mesh.size
        for first, like, called in firsts:  # noqa: B007, a copy goes by the first one's name
            if (copy := _copy(first, solid)) is not None:
                larger, rows, shift = copy
                centre, size = larger * rows @ like.centre + shift, larger * like.size
                break
        else:
            word = said(f"{name}_{solid.name}")
            tried = chain([word], (f"{word}_{k}" for k in count(2)))
            called = next(other for other in tried if other not in shapes and other != name)
            shapes[called], numbers[called] = mesh, number
            firsts.append((solid, mesh, called))
        turn = () if abs(rows - np.eye(3)).max() < _ALIKE else tuple(map(tuple, rows.tolist()))
        place = tuple(((centre - whole.centre) / whole.size).tolist())
        group.append(Part(called, place, size / whole.size, turn, *_worn(mesh.look, called)))
    return OriginalShapes({**shapes, name: whole}, numbers, tuple(group), whole.notes)


def _worn(look: Tints | None, name: str) -> tuple[Painted, str]:
    """The one colour of a look, or the name that its material is to have."""
    if look is None:
        return (), ""
    return ((), name) if look.plain is None else (look.plain, "")


def _few(count: int) -> None:
    if count > MOST_PARTS:
        raise FitError(f"{count:,} parts, at most {MOST_PARTS}; without --parts it is one element")


def _copy(first: NamedMesh, other: NamedMesh) -> tuple[float, Points, Points] | None:
    """Size s, rotation or reflection R and shift t that make one solid another, s R p + t."""
    from trimesh.registration import procrustes

    same = len(first.vertices) == len(other.vertices) and np.array_equal(first.triangles, other.triangles)
    if not same or not _alike(first.look, other.look):
        return None
    matrix, moved, _ = procrustes(first.vertices, other.vertices)
    reach = abs(other.vertices - other.vertices.mean(0)).max()
    if not abs(moved - other.vertices).max() <= _ALIKE * reach:
        return None
    size = float(np.linalg.norm(matrix[:3, 0]))
    return size, matrix[:3, :3] / size, matrix[:3, 3]


def _alike(one: Tints | None, other: Tints | None) -> bool:
    """True where copies may share an element: both have one colour each, or they look the same."""
    if one is None or other is None:
        return one is other
    if one.plain is not None or other.plain is not None:
        return one.plain is not None and other.plain is not None
    pairs = ((one.tint, other.tint), (one.linear, other.linear), (one.uv, other.uv), (one.image, other.image))
    images = len(one.images) == len(other.images) and all(map(np.array_equal, one.images, other.images))
    return images and all(np.array_equal(a, b) for a, b in pairs)


def drawn_parts(whole: Outline, name: str, apart: bool | None) -> OriginalShapes:
    """Shapes of a drawing: areas of one colour, in the order in which they are painted."""
    painted = [(colour, Outline(layers)) for colour, layers in whole.painted()]
    if len(painted) < 2 or apart is False or (apart is None and len(painted) > MOST_PARTS):
        colours = {colour for colour, _ in painted if colour}
        group = tuple(Part(name, (0.0, 0.0), 1.0, (), colour) for colour in colours if len(colours) == 1)
        return OriginalShapes({name: whole}, {}, group, whole.notes)
    _few(len(painted))
    parts = []
    names = {f"{name}_{k}": k for k in range(1, len(painted) + 1)}
    for called, (colour, part) in zip(names, painted, strict=True):
        x, y = ((a - b) / whole.size for a, b in zip(part.centre, whole.centre, strict=True))
        parts.append(Part(called, (x, y), part.size / whole.size, (), colour))
    shapes = dict(zip(names, (part for _, part in painted), strict=True))
    return OriginalShapes({**shapes, name: whole}, names, tuple(parts), whole.notes)


FOLDER: Final = "SCENELANG_ORIGINALS"


def originals_of(scene: Scene, graph: Graph) -> dict[str, Shape]:
    """The true shapes of a scene's elements but outlines, by geometry, from files in the folder that the
    environment's `FOLDER` names, or beside the file of elements. Raises `FitError` and `OSError`.
    """
    shown = {leaf.geometry for leaf in leaves(graph.root)} & graph.elements.keys()
    shown = {name for name in shown if not graph.elements[name].curved}
    beside = {file.name: file.zoo.folder for file in scene.elements if file.zoo is not None}
    folders = {name: os.environ.get(FOLDER) or beside[name.partition(".")[0]] for name in sorted(shown)}
    return {name: _original(name, graph.elements[name], folder) for name, folder in folders.items()}


def _original(name: str, element: Element, folder: str | Path | None) -> Shape:
    file, digest = str(element.about.get("original", "")), str(element.about.get("sha256", ""))
    if not file or not digest or folder is None:
        raise FitError(f"the exact shape of `{name}` is not known: it does not say what it was made from")
    if "font" in element.about:
        raise FitError(f"the exact shape of `{name}` is not known: its texts are in a font of their own")
    path = Path(folder, file)
    origin = f"`{name}` was made from `{file}`"
    if path.name != file or path.suffix.lower() not in MOST_OF or not path.is_file():
        ships = library.owns(Path(folder, file).resolve())
        means = ", which `python -m lab docs meshes` of the repository makes" if ships else ""
        advice = f"`--originals FOLDER` ({FOLDER}) says where it is{means}"
        raise FitError(f"{origin}, which is not in `{folder}`; {advice}")
    version = path.stat().st_mtime_ns, path.stat().st_size
    part = element.about.get("part", 0)
    if not isinstance(part, int) or part < 0:
        raise FitError(f"the exact shape of `{name}` is not known: it is part `{part}` of its file")
    if (shape := _shape(path, digest, element.about.get("sign") == "closed", part, *version)) is None:
        raise FitError(f"{origin}, and `{path}` is another file of that name")
    return shape


@lru_cache(maxsize=8)
def _shape(path: Path, digest: str, closed: bool, part: int, *version: int) -> Shape | None:
    """The shape in a file, None if that is another one; frames of an animation ask again and again."""
    suffix = path.suffix.lower()
    data = read_regular(path, MOST_OF[suffix])
    if hashlib.sha256(data).hexdigest() != digest:
        return None
    return shape_in(data, suffix, "closed" if closed else "auto", part)
