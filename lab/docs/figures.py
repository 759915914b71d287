"""Figures of records and of shipped files, for tables and pictures of pages."""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path
from typing import Any

from lab import RESULTS, ROOT

PACKAGE = ROOT / "scenelang/compiler"


@cache
def read(name: str) -> Any:
    """A record of docs/results, or one that is shipped (``models/…``), named without its ending."""
    folder = PACKAGE if name.startswith("models/") else RESULTS
    return json.loads((folder / f"{name}.json").read_text("utf-8"))


def kilobytes(name: str) -> float:
    """Size of a file of the package, named without its ending."""
    return _file(name).stat().st_size / 1000


def numbers(name: str) -> int:
    """Count of numbers in a file of the package, named without its ending."""
    return sum(math.prod(e["shape"]) for key, e in _header(name).items() if key != "__metadata__")


def told(name: str) -> Any:
    """Facts about training in the header of a model's weights."""
    return json.loads(_header(f"models/{name}/weights")["__metadata__"]["scenelang"])


def _file(name: str) -> Path:
    folder = ROOT / "scenelang/language" if name.startswith("std/") else PACKAGE
    return folder / f"{name}.safetensors"


def _header(name: str) -> Any:
    with open(_file(name), "rb") as file:
        return json.loads(file.read(int.from_bytes(file.read(8), "little")))
