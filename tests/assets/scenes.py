"""Scenes beside a file of elements, and files whose header and tensors are changed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from safetensors.numpy import load as tensors_of
from safetensors.numpy import save

import scenelang as nsg
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.evaluation import Source

IMPORT = 'import "zoo.safetensors" as zoo;\n'
Change = Callable[[dict[str, Any], dict[str, Any]], object]


def load(folder: Path, text: str, **files: str) -> tuple[nsg.Scene | None, list[tuple[str, str]]]:
    """A scene of a folder, after its files are written, and what was said of it."""
    for name, said in {"scene": text, **files}.items():
        (folder / f"{name}.nsg").write_text(said, "utf-8")
    found = Diagnostics()
    scene, _ = Source(folder / "scene.nsg").scene(found)
    return scene, [(d.code, d.message) for d in found]


def good(folder: Path, text: str, **files: str) -> nsg.Scene:
    scene, found = load(folder, text, **files)
    assert scene is not None, found
    return scene


def changed(data: bytes, change: Change) -> bytes:
    """A file after ``change`` of its header and its tensors."""
    size = int.from_bytes(data[:8], "little")
    header = json.loads(json.loads(data[8 : 8 + size])["__metadata__"]["scenelang"])
    tensors = tensors_of(data)
    change(header, tensors)
    return save(tensors, metadata={"scenelang": json.dumps(header)})


TYPES = (None, True, -1, 3, 10**400, 1e308, "x", [], [[]], {"a": {}})
"""Values of every type of JSON, and the extremes of some."""


def retyped(value: Any) -> Iterator[Any]:
    """Copies of a value of JSON that each have one part, at any depth, of another type or left out."""
    keys = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        for changed in (*TYPES, *retyped(value[key])):
            copy = value.copy()
            copy[key] = changed
            yield copy
        copy = value.copy()
        del copy[key]
        yield copy
