"""Files of elements, which scenes import, and fonts in them, checked without numpy as a stranger's.

A file has a tensor of bytes for each element, named as the header's ``elements`` and, as ``material.NAME``,
its ``materials``; ``groups`` come with these, in format 2, and in format 3 a ``font`` with its own tensors.

A letter of a font is an element of the form ``outline`` in a disc of its own; `Letter` says where that lies
on the line. Kerning is a table of classes: of a pair, the row of the left letter's class and the column of
the right one's. Nothing of a font is learned, as curves are exact and small.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
from array import array
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, NamedTuple

from scenelang.assets.element import FORMS, MOST_CURVES, MOST_SIDE, ROOM, Element, Facts, Group, read_group
from scenelang.assets.element import entry_of as group_entry
from scenelang.assets.files import read_regular
from scenelang.assets.picture import pixels
from scenelang.assets.tensors import Tensor, TensorError, check_fields, read_tensors

MOST_LETTERS: Final = 40_000
MOST_CLASSES: Final = 1 << 22  # entries of a table of kerning
RESERVED: Final = frozenset(("text", "width"))  # what a font brings to a scene
ALIGNED: Final = {"left": 0.0, "center": 0.5, "right": 1.0}
"""Shares of a line's width that lie left of the origin, by how it is aligned."""
UNIT: Final = 10_000  # of kerning, in an em
_FAR: Final = 100.0  # em: farthest that a letter may reach, and widest that it may be
_SMALL: Final = 1e-6  # em: the least radius of a letter that shows
TENSORS: Final = {
    "font.codes": ("I32", "i"),  # (L,) code points, rising
    "font.letters": ("F32", "f"),  # (4 L,) advance, x, y and radius of each, em
    "font.ends": ("I32", "i"),  # (L,) where the curves of each end, in curves
    "font.classes": ("I32", "i"),  # (2 L,) class of each on the left and on the right of a pair
    "font.kerning": ("I16", "h"),  # (rows columns,) 1 / `UNIT` em
    "font.curves": ("U8", "B"),
}
"""Types of a font's tensors in a file, and as the standard library calls them."""


class Letter(NamedTuple):
    """A letter: how far it advances, and its disc; em, from where it begins on the baseline."""

    advance: float
    x: float
    y: float
    radius: float  # 0 of one that shows nothing


class Placed(NamedTuple):
    """A letter of a line: its element, and middle and radius of its disc."""

    name: str
    x: float
    y: float
    radius: float


class FontError(ValueError):
    """A text that cannot be set; ``at`` is the place of the character, None where it is not one's."""

    def __init__(self, message: str, at: int | None = None) -> None:
        super().__init__(message)
        self.at = at


class Font:
    """A font, by its tables as `TENSORS` has them; raises `TensorError` where they do not fit together."""

    def __init__(self, tables: Mapping[str, Any], columns: int, about: Facts) -> None:
        self.tables, self.columns, self.about = dict(tables), columns, about
        codes, numbers, ends, classes, self._kerning, curves = (tables[name] for name in TENSORS)
        count = len(codes)
        if not 0 < count <= MOST_LETTERS or any(a >= b for a, b in pairwise(codes)):
            raise TensorError(f"a font of {count:,} letters, or of letters out of order")
        fit = len(numbers) == 4 * count == 2 * len(classes) and len(ends) == count
        if not (fit and codes[0] >= 0 and codes[-1] <= sys.maxunicode):
            raise TensorError("a font whose tables do not fit together")
        rows = len(self._kerning) // columns
        if rows * columns != len(self._kerning) or not 0 < rows * columns <= MOST_CLASSES:
            raise TensorError("a font with a damaged table of kerning")
        if not (min(classes) >= 0 and max(classes[:count]) < rows and max(classes[count:]) < columns):
            raise TensorError("a font with letters of unknown classes")
        if not all(-_FAR < number < _FAR for number in numbers):
            raise TensorError("a font with letters beyond all measure")
        self._left, self._right = classes[:count], classes[count:]
        self.letters: dict[str, int] = {chr(code): at for at, code in enumerate(codes)}
        """Places of letters in the tables, by character."""
        self.metrics = [Letter(*numbers[4 * at : 4 * at + 4]) for at in range(count)]
        self.glyphs: dict[str, Element] = {}
        """Elements of the letters that show, by name."""
        first, data = 0, bytes(curves)
        for code, end, letter in zip(codes, ends, self.metrics, strict=True):
            if not first <= end <= first + MOST_CURVES or (end > first) != (letter.radius > _SMALL):
                raise TensorError(f"a font with a damaged letter U+{code:04X}")
            if end > first:
                name = name_of(chr(code))
                curves = data[ROOM * first : ROOM * end]
                self.glyphs[name] = Element(name, "outline", (end - first,), "plain", curves, about)
            first = end
        if ROOM * first != len(data):
            raise TensorError("a font with curves of no letter")

    def line(self, text: str) -> tuple[list[Placed], float]:
        """The letters of a line that begins at the origin, and its width, em; raises `FontError`."""
        pen, placed, last = 0.0, list[Placed](), ""
        for place, character in self._composed(text):
            at = self.letters.get(character, -1)
            if character in "\n\r\v\f\x85\u2028\u2029":
                raise FontError("a line break in a text, which is one line", place)
            if at < 0:
                code = f"U+{ord(character):04X}"
                shown = f"`{character}` ({code})" if character.isprintable() else code
                raise FontError(f"the font has no {shown}", place)
            if last:
                pen += self.kerning(last, character)
            letter, last = self.metrics[at], character
            if letter.radius > _SMALL:
                placed.append(Placed(name_of(character), pen + letter.x, letter.y, letter.radius))
            pen += letter.advance
        return placed, pen

    def _composed(self, text: str) -> Iterator[tuple[int, str]]:
        """Places and characters of a text, where a letter and its marks are one if the font has it."""
        if text.isascii():
            yield from enumerate(text)
            return
        from unicodedata import category, normalize

        joins = [
            category(c)[0] == "M" or "\u1160" <= c <= "\u11ff" for c in text
        ]  # marks, and parts of Hangul
        starts = [at for at, joined in enumerate(joins) if not (at and joined)]
        for start, end in pairwise([*starts, len(text)]):
            part, whole = text[start:end], normalize("NFC", text[start:end])
            if not self.letters.keys() >= {*whole} and self.letters.keys() >= {*part}:
                whole = part
            for at, character in enumerate(whole):
                yield max(start, end - len(whole) + at) if at else start, character

    def kerning(self, left: str, right: str) -> float:
        """By how much a letter goes farther from another than that advances, em."""
        row, column = self._left[self.letters[left]], self._right[self.letters[right]]
        return float(self._kerning[row * self.columns + column]) / UNIT


GLYPH: Final = re.compile("u[0-9a-f]{4,}")
"""Names that elements of letters may have."""


def name_of(character: str) -> str:
    """Name of a letter's element: ``u0041``."""
    return f"u{ord(character):04x}"


def read_font(columns: int, about: Facts, tensors: Mapping[str, Tensor], body: memoryview) -> Font:
    """The font of a file of tensors; raises `TensorError`."""
    tables: dict[str, Any] = {}
    for name, (kind, code) in TENSORS.items():
        if (tensor := tensors.get(name)) is None or tensor.type != kind or len(tensor.shape) != 1:
            raise TensorError(f"a font without its table `{name}`")
        table = array(code, bytes(body[tensor.first : tensor.last]))
        if sys.byteorder == "big":
            table.byteswap()
        tables[name] = table
    return Font(tables, columns, about)


SUFFIX: Final = ".safetensors"
TEXTURES_FILE: Final = Path(__file__).with_name("textures.safetensors")
MOST_ELEMENT_BYTES: Final = 32 << 20
MOST_ELEMENTS: Final = 1000
MOST_HELD: Final = 128 << 20  # bytes that all elements of a file take unpacked
_MOST_TEXT: Final = 2000


@dataclass(frozen=True, slots=True)
class ElementFile:
    """Contents of a file of elements by name; a geometry and a material may share a name."""

    geometries: dict[str, Element]
    digest: str  # SHA-256 of the file, hex
    materials: dict[str, Element] = field(default_factory=dict)
    groups: dict[str, Group] = field(default_factory=dict)
    folder: Path | None = field(default=None, compare=False)  # where it lies
    font: Font | None = field(default=None, compare=False)  # whose letters are among the geometries

    @staticmethod
    def of(elements: Iterable[Element], digest: str = "0" * 64) -> ElementFile:
        """The zoo of elements, without groups."""
        listed = list(elements)
        geometries = {element.name: element for element in listed if not element.material}
        return ElementFile(geometries, digest, {e.name: e for e in listed if e.material})

    @property
    def elements(self) -> tuple[Element, ...]:
        """All of it, geometries first."""
        return *self.geometries.values(), *self.materials.values()


def load_element_file(path: str | Path) -> ElementFile:
    """Read a file of elements; raises `OSError`, or `TensorError` for a damaged or hostile one."""
    stat = os.stat(path)
    return _load(os.fspath(path), stat.st_mtime_ns, stat.st_size, stat.st_ino)


def load_textures() -> dict[str, Element]:
    """The sixteen textures that ship, by name, materials of every model; raises as `load_element_file`."""
    return load_element_file(TEXTURES_FILE).materials


@lru_cache(maxsize=16)
def _load(path: str, *version: int) -> ElementFile:
    """Cached elements of one version of a file, which editors and animations read repeatedly."""
    return replace(read_zoo(read_regular(path, MOST_ELEMENT_BYTES)), folder=Path(path).parent)


_TABLES: Final = {"elements": "", "materials": "material."}
"""Tables of a header, and the prefixes of their tensors' names."""
_HEADER: Final = {"format": int, "elements": {str: dict}}
_HEADERS: Final = [_HEADER, _HEADER | {"materials": {str: dict}, "groups": {str: list}}]
_HEADERS.append(_HEADERS[1] | {"font?": {"about": dict, "columns": range(1, MOST_CLASSES + 1)}})
"""Headers by format, from 1, as `check_fields` takes them."""


def read_zoo(data: bytes) -> ElementFile:
    """The elements in a file's bytes, each unpacked once as a check; raises `TensorError`."""
    file = read_tensors(data, MOST_ELEMENT_BYTES, (1, 2, 3))
    check_fields(file.header, _HEADERS[file.header["format"] - 1], "its header")
    font = None
    if entry := file.header.get("font"):
        font = read_font(entry["columns"], _about(entry["about"], "the font"), file.tensors, file.body)
        for name in TENSORS:
            del file.tensors[name]
    listed_groups = file.header.get("groups", {})
    entries = [(key, name, e) for key in _TABLES for name, e in file.header.get(key, {}).items()]
    tensors = [_TABLES[key] + name for key, name, _ in entries]
    if len(set(tensors)) < len(tensors) or {*tensors} != file.tensors.keys():
        raise TensorError("its header names other elements than it holds")
    if not (font is None) <= len(entries) <= MOST_ELEMENTS:
        raise TensorError(f"{len(entries):,} elements, where 1 to {MOST_ELEMENTS:,} are allowed")
    listed = [(e[1], e[2], file.tensors[tensor]) for e, tensor in zip(entries, tensors, strict=True)]
    result = read_elements(listed, file.body)
    if any(e.material != (key == "materials") for (key, *_), e in zip(entries, result, strict=True)):
        raise TensorError("a material among its geometries, or a geometry among its materials")
    zoo = ElementFile.of(result, hashlib.sha256(data).hexdigest())
    if len(listed_groups) > MOST_ELEMENTS:
        raise TensorError(f"more than {MOST_ELEMENTS:,} groups")
    if font is not None:
        named = (name.removeprefix("material.") for name in (*tensors, *listed_groups))
        if taken := next((name for name in named if name in RESERVED or GLYPH.fullmatch(name)), ""):
            raise TensorError(f"an element called `{taken[:40]}` beside a font, to which that name belongs")
        zoo = replace(zoo, geometries=zoo.geometries | font.glyphs, font=font)
    held = zoo.geometries, zoo.materials
    return replace(zoo, groups={name: read_group(name, e, *held) for name, e in listed_groups.items()})


def read_elements(listed: Iterable[tuple[str, Any, Tensor]], body: memoryview) -> tuple[Element, ...]:
    """The elements of names, header entries and tensors of a file; raises as `read_zoo`."""
    result, held = [], 0
    for name, entry, tensor in listed:
        element = _element(name, entry, tensor, body)
        held += element.held
        if held > MOST_HELD:
            raise TensorError(f"elements of more than {MOST_HELD:,} bytes unpacked")
        _ = pixels(element) if element.form == "picture" else element.inflated()
        result.append(element)
    return tuple(result)


def _element(name: str, entry: Any, tensor: Tensor, body: memoryview) -> Element:
    if tensor.type != "U8" or len(tensor.shape) != 1:
        raise TensorError(f"element `{name[:40]}` is not a row of bytes")
    if not (name.isascii() and name.isidentifier()):
        raise TensorError(f"an element has the name {name[:40]!r}")
    form = FORMS.get(str(entry.get("form"))) if isinstance(entry, dict) else None
    if form is None or "points" in form.sizes:
        raise TensorError(f"element `{name}` has a form that this version does not know")
    check_fields(entry, {"form": str, "about": dict, "coding?": str, **form.sizes}, f"element `{name}`")
    coding = entry.get("coding", form.codings[0])
    if coding not in form.codings:
        raise TensorError(f"element `{name}` has a coding that this version does not know")
    sizes = tuple(entry[key] for key in form.sizes)
    if entry["form"] == "pyramid" and sizes[1] << sizes[2] - 1 >= MOST_SIDE[sizes[0]]:
        raise TensorError(f"element `{name}` has sizes out of range")
    about = _about(entry["about"], f"element `{name}`")
    return Element(name, entry["form"], sizes, coding, bytes(body[tensor.first : tensor.last]), about)


def _about(said: Facts, whose: str) -> Facts:
    if not all(key.isidentifier() and is_said(value) for key, value in said.items()):
        raise TensorError(f"what {whose} says of itself is not text and numbers")
    return said


def is_said(value: Any) -> bool:
    """Return whether a value may stand among an element's facts: bounded text or a finite number."""
    if isinstance(value, str):
        return len(value) <= _MOST_TEXT and value.replace("\n", " ").isprintable()
    return type(value) in (int, float) and abs(value) < 1e300


def entry_of(element: Element) -> dict[str, Any]:
    """Entry of an element in a header."""
    sizes = dict(zip(FORMS[element.form].sizes, element.sizes, strict=True))
    coding = {"coding": element.coding} if element.names_coding else {}
    return {"form": element.form, **sizes, **coding, "about": element.about}


def element_file_bytes(
    elements: Iterable[Element], groups: Mapping[str, Group] | None = None, font: Font | None = None
) -> bytes:
    """The file of elements, groups and a font, whose letters are left out; equal ones give equal bytes."""
    import numpy as np
    from safetensors.numpy import save

    own = {} if font is None else font.glyphs
    zoo = ElementFile.of(sorted((e for e in elements if e.name not in own), key=lambda element: element.name))
    more = bool(zoo.materials or groups or font)
    tables = {"elements": zoo.geometries} | ({"materials": zoo.materials} if more else {})
    header: dict[str, Any] = {"format": len(tables)}
    header |= {key: {e.name: entry_of(e) for e in table.values()} for key, table in tables.items()}
    if len(tables) > 1:
        header["groups"] = {name: group_entry(group) for name, group in (groups or {}).items()}
    if font is not None:
        header |= {"format": 3, "font": {"about": font.about, "columns": font.columns}}
    text = json.dumps(header, sort_keys=True, separators=(",", ":"))
    listed = ((_TABLES[key] + e.name, e) for key, table in tables.items() for e in table.values())
    tensors = {name: np.frombuffer(element.data, np.uint8) for name, element in listed}
    if font is not None:
        tensors |= {name: np.array(table) for name, table in font.tables.items()}
    data: bytes = save(tensors, metadata={"scenelang": text})
    return data
