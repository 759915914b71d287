"""Files of elements, which scenes import, checked without numpy as a stranger's.

A file has a tensor of bytes for each element, named as the header's ``elements`` and, as ``material.NAME``,
its ``materials``; ``groups`` come with these, in format 2, and in format 3 a ``font`` with its own tensors.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from scenelang.assets.element import FORMS, Element, Facts, Group, in_range, read_group
from scenelang.assets.element import entry_of as group_entry
from scenelang.assets.files import read_regular
from scenelang.assets.font import GLYPH, RESERVED, TENSORS, Font, read_font
from scenelang.assets.picture import pixels
from scenelang.assets.tensors import Tensor, TensorError, read_tensors

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


def read_zoo(data: bytes) -> ElementFile:
    """The elements in a file's bytes, each unpacked once as a check; raises `TensorError`."""
    file = read_tensors(data, MOST_ELEMENT_BYTES, (1, 2, 3))
    entry = file.header.pop("font", None) if file.header["format"] == 3 else None
    known = {"format", "elements"} | ({"materials", "groups"} if file.header["format"] > 1 else set())
    tables = {key: file.header.get(key) for key in sorted(known - {"format"})}
    if file.header.keys() != known or not all(isinstance(table, dict) for table in tables.values()):
        raise TensorError("not a file of elements")
    font = None
    if entry is not None:
        if not isinstance(entry, dict) or entry.keys() != {"about", "columns"}:
            raise TensorError("its font has missing or unknown fields")
        font = read_font(entry["columns"], _about(entry["about"], "the font"), file.tensors, file.body)
        for name in TENSORS:
            del file.tensors[name]
    listed_groups = tables.pop("groups", None) or {}
    entries = [(key, name, entry) for key, table in tables.items() for name, entry in (table or {}).items()]
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
    if form is None:
        raise TensorError(f"element `{name}` has a form that this version does not know")
    if entry.keys() - {"coding"} != {"form", "about", *form.sizes}:
        raise TensorError(f"element `{name}` has missing or unknown fields")
    coding = entry.get("coding", form.codings[0])
    if coding not in form.codings:
        raise TensorError(f"element `{name}` has a coding that this version does not know")
    sizes = tuple(entry[key] for key in form.sizes)
    if not all(type(size) is int for size in sizes) or not in_range(entry["form"], sizes):
        raise TensorError(f"element `{name}` has sizes out of range")
    about = _about(entry["about"], f"element `{name}`")
    return Element(name, entry["form"], sizes, coding, bytes(body[tensor.first : tensor.last]), about)


def _about(said: Any, whose: str) -> Facts:
    if not isinstance(said, dict) or not all(k.isidentifier() and is_said(v) for k, v in said.items()):
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
