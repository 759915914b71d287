"""Any bytes as an original of an element, of the kind that its first letter tells."""

from __future__ import annotations

import io
from functools import cache
from random import Random

import numpy as np
from PIL import Image

from fuzz import trees
from fuzz.target import Target, hold
from scenelang.assets.element_file import read_zoo
from scenelang.drawing.exact.mesh import FitError
from scenelang.drawing.exact.originals import MOST_OF
from scenelang.inverse.learn import make

KINDS = tuple(MOST_OF)


def check(data: bytes) -> None:
    """A file of elements with their errors, or a FitError of one line."""
    suffix = KINDS[data[0] % len(KINDS)] if data else KINDS[0]
    options = {"steps": 1, "license": "CC0", "max_error": 0.5}
    request = {"suffix": suffix, "name": "x", "options": options, "about": {"license": "CC0"}, "files": {}}
    told: list[str] = []
    try:
        made = make(request, data[1:], lambda kind, *what: told.append(str(what)))
    except FitError as error:
        hold(len(str(error)) < 1000 and "\n" not in str(error), "errors are one short line", str(error)[:300])
        return
    elements = read_zoo(made).elements
    hold(elements and told, "an element and what was tried")
    for element in elements:
        hold(element.about.get("license") == "CC0", "licenses stay", element.about)
        hold(float(element.about["error"]) < 10, "its error is told", element.about)


def _of(suffix: str, data: bytes) -> bytes:
    return bytes([KINDS.index(suffix)]) + data


@cache
def seeds() -> list[bytes]:
    """A tetrahedron in every format, drawings, and pictures."""
    import trimesh

    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.0)])
    faces = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    solid = trimesh.Trimesh(corners, faces)
    meshes = [_of(f".{kind}", bytes(_exported(solid, kind))) for kind in ("ply", "stl", "glb", "obj")]
    text = _exported(solid, "ply", encoding="ascii")
    drawings = (
        '<path d="M0 0h8v8h-8z M2 2v4h4v-4z" fill-rule="evenodd" transform="rotate(30)"/>',
        '<g stroke="red" stroke-width="2"><circle r="5"/><path d="M0 0q3 3 5 0a2 2 0 0 1 3"/></g>',
        '<defs><rect id="r" width="3" height="2" rx=".5"/></defs><use href="#r" x="3"/><text>a</text>',
    )
    svgs = [_of(".svg", f'<svg viewBox="0 0 9 9">{body}</svg>'.encode()) for body in drawings]
    pixels = np.random.default_rng(0).integers(0, 255, (6, 5, 4), np.uint8)
    pictures = []
    for suffix, mode in (
        (".png", "RGBA"),
        (".png", "P"),
        (".png", "I;16"),
        (".jpg", "RGB"),
        (".jpg", "CMYK"),
    ):
        file = io.BytesIO()
        Image.fromarray(pixels).convert("L" if mode == "I;16" else "RGB").convert(mode).save(
            file, "PNG" if suffix == ".png" else "JPEG"
        )
        pictures.append(_of(suffix, file.getvalue()))
    return [
        *meshes,
        _of(".ply", bytes(text)),
        *svgs,
        *pictures,
        b"",
        *(bytes([k]) for k in range(len(KINDS))),
    ]


def _exported(solid: object, kind: str, **options: str) -> bytes:
    found = solid.export(file_type=kind, **options)  # type: ignore[attr-defined]
    return found.encode() if isinstance(found, str) else bytes(found)


def mutate(data: bytes, generator: Random) -> bytes:
    """A piece cut, doubled, moved or exchanged for a number; or bytes changed."""
    if len(data) < 3 or generator.random() < 0.4:
        return data[:1] + trees.flip(data[1:], generator)
    first, last = sorted(generator.sample(range(1, len(data)), 2))
    piece = data[first:last]
    numbers = (b"-1", b"1e999", b"nan", b"4294967295", b"999999999999", b"\xff\xff\xff\xff", b"\0\0\0\0")
    new = generator.choice((b"", piece * 2, piece[::-1], generator.choice(numbers)))
    return data[:first] + new + data[last:]


def dictionary() -> list[bytes]:
    """Words of the formats."""
    words = "element vertex face property list uchar int float end_header solid facet path fill stroke d= use"
    return [word.encode() for word in (*words.split(), "POSITION", "bufferView", "matrix", "href", "IHDR")]


TARGET = Target(
    name="learn",
    summary="any bytes become elements that say their license and error, or are refused in one line",
    check=check,
    seeds=seeds,
    mutate=mutate,
    dictionary=dictionary,
    most_bytes=8192,
    runs=4,
)
