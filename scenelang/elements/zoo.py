"""Files of elements, which scenes import: what is in them, checked without numpy as a stranger's.

Such a zoo is a file of tensors (`scenelang.tensors`), one of bytes for each element, of its name. The
header's ``elements`` say of each what it is made of. There is one form so far, a geometry as a pyramid of
distances (`scenelang.elements.pyramid`), whose bytes are deflated.
"""

from __future__ import annotations

import hashlib
import json
import os
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from scenelang.files import read_regular
from scenelang.tensors import Tensor, TensorError, read_tensors

SUFFIX: Final = ".safetensors"
MOST_BYTES: Final = 32 << 20
MOST_ELEMENTS: Final = 1000
MOST_NODES: Final = 32 << 20  # of all pyramids of a file, a byte each
MOST_SIDE: Final = {2: 1025, 3: 193}  # nodes along an axis, by dimension
_MOST_TEXT: Final = 2000


@dataclass(frozen=True, slots=True)
class Element:
    """A geometry that a user brought, in the unit ball of its own space.

    Args:
        name: what scenes call it, behind the name of the import.
        dimension: 2 or 3.
        cells: of the coarsest grid, along an axis.
        levels: grids, each of twice as many cells as the one before.
        data: their steps, deflated.
        about: what its maker says of it: license, source, errors; text and numbers by their names.
        digest: SHA-256, hex, of all that decides its shape.
    """

    name: str
    dimension: int
    cells: int
    levels: int
    data: bytes = field(repr=False)
    about: dict[str, str | float] = field(default_factory=dict, hash=False, compare=False)
    digest: str = field(init=False)

    def __post_init__(self) -> None:
        said = f"pyramid {self.dimension} {self.cells} {self.levels} ".encode()
        object.__setattr__(self, "digest", hashlib.sha256(said + self.data).hexdigest())

    @property
    def kind(self) -> str:
        """What manifests call its like."""
        return "element of the plane" if self.dimension == 2 else "element of space"

    def told(self) -> str:
        """What there is to say of it, a line each."""
        shown = " × ".join([str(self.sides[-1])] * self.dimension)
        lines = [f"{self.kind}: {shown} distances, {len(self.data):,} bytes"]
        return "\n".join([*lines, *(f"{key}: {value}" for key, value in self.about.items())])

    @property
    def sides(self) -> tuple[int, ...]:
        """Nodes along an axis of each grid."""
        return tuple(self.cells * 2**level + 1 for level in range(self.levels))

    @property
    def nodes(self) -> int:
        """Nodes of all grids, of a byte each."""
        return sum(side**self.dimension for side in self.sides)

    def inflated(self) -> bytes:
        """The bytes of all nodes.

        Raises:
            TensorError: they are damaged, fewer or more.
        """
        inflate = zlib.decompressobj()
        try:
            found = inflate.decompress(self.data, self.nodes + 1)
        except zlib.error as error:
            raise TensorError(f"element `{self.name}` is damaged: {error}") from None
        if len(found) != self.nodes or not inflate.eof or inflate.unused_data:
            raise TensorError(f"element `{self.name}` does not hold {self.nodes:,} bytes")
        return found


@dataclass(frozen=True, slots=True)
class Zoo:
    """The elements of a file, by name."""

    elements: dict[str, Element]
    digest: str  # SHA-256 of the file, hex


def load_zoo(path: str | Path) -> Zoo:
    """Read a file of elements.

    Raises:
        OSError: it cannot be read.
        TensorError: it is damaged, foreign or hostile.
    """
    found = os.stat(path)
    return _load(os.fspath(path), found.st_mtime_ns, found.st_size, found.st_ino)


@lru_cache(maxsize=16)
def _load(path: str, *version: int) -> Zoo:
    """The elements of a version of a file, which editors and animations ask for again and again."""
    return read_zoo(read_regular(path, MOST_BYTES))


def read_zoo(data: bytes) -> Zoo:
    """The elements in the bytes of a file; every one is inflated once, so that none is damaged.

    Raises:
        TensorError: the bytes are not those of such a file.
    """
    file = read_tensors(data, MOST_BYTES)
    entries = file.header.get("elements")
    if file.header.keys() != {"format", "elements"} or not isinstance(entries, dict):
        raise TensorError("not a file of elements")
    if entries.keys() != file.tensors.keys():
        raise TensorError("its header names other elements than it holds")
    if not 0 < len(entries) <= MOST_ELEMENTS:
        raise TensorError(f"{len(entries):,} elements, where 1 to {MOST_ELEMENTS:,} are allowed")
    listed = [(name, entry, file.tensors[name]) for name, entry in entries.items()]
    found = {element.name: element for element in read_elements(listed, file.body)}
    return Zoo(found, hashlib.sha256(data).hexdigest())


def read_elements(listed: Iterable[tuple[str, Any, Tensor]], body: memoryview) -> tuple[Element, ...]:
    """The elements that names, entries of a header and tensors of a file tell of; each is inflated once.

    Raises:
        TensorError: they are damaged, do not agree, or are more than can be held.
    """
    found, nodes = [], 0
    for name, entry, tensor in listed:
        element = _element(name, entry, tensor, body)
        nodes += element.nodes
        if nodes > MOST_NODES:
            raise TensorError(f"elements of more than {MOST_NODES:,} nodes")
        element.inflated()
        found.append(element)
    return tuple(found)


def _element(name: str, entry: Any, tensor: Tensor, body: memoryview) -> Element:
    if tensor.type != "U8" or len(tensor.shape) != 1:
        raise TensorError(f"element `{name[:40]}` is not a row of bytes")
    if not (name.isascii() and name.isidentifier()):
        raise TensorError(f"an element has the name {name[:40]!r}")
    sizes = ("dimension", "cells", "levels")
    if not isinstance(entry, dict) or entry.keys() != {"form", "about", *sizes}:
        raise TensorError(f"element `{name}` has missing or unknown fields")
    if entry["form"] != "pyramid":
        raise TensorError(f"element `{name}` has a form that this version does not know")
    dimension, cells, levels = (entry[key] for key in sizes)
    whole = all(type(entry[key]) is int for key in sizes)
    if not whole or dimension not in (2, 3) or not 2 <= cells <= 8 or not 1 <= levels <= 9:
        raise TensorError(f"element `{name}` has sizes out of range")
    if cells * 2 ** (levels - 1) >= MOST_SIDE[dimension]:
        raise TensorError(f"element `{name}` has more than {MOST_SIDE[dimension]} nodes along an axis")
    about = entry["about"]
    if not isinstance(about, dict) or not all(k.isidentifier() and is_said(v) for k, v in about.items()):
        raise TensorError(f"what element `{name}` says of itself is not text and numbers")
    return Element(name, dimension, cells, levels, bytes(body[tensor.first : tensor.last]), about)


def is_said(value: Any) -> bool:
    """Whether an element may say this of itself: text of a bounded length, or a finite number."""
    if isinstance(value, str):
        return len(value) <= _MOST_TEXT and value.replace("\n", " ").isprintable()
    return type(value) in (int, float) and abs(value) < 1e300


def entry_of(element: Element) -> dict[str, Any]:
    """What a header says of an element."""
    sizes = {name: getattr(element, name) for name in ("dimension", "cells", "levels")}
    return {"form": "pyramid", **sizes, "about": element.about}


def zoo_bytes(elements: Iterable[Element]) -> bytes:
    """The file of elements; equal elements give equal bytes."""
    import numpy as np
    from safetensors.numpy import save

    listed = sorted(elements, key=lambda element: element.name)
    entries = {element.name: entry_of(element) for element in listed}
    text = json.dumps({"format": 1, "elements": entries}, sort_keys=True, separators=(",", ":"))
    tensors = {e.name: np.frombuffer(e.data, np.uint8) for e in listed}
    data: bytes = save(tensors, metadata={"scenelang": text})
    return data
