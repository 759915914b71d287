"""Codes, header and digest of a model's weights, read without torch."""

from __future__ import annotations

import hashlib
import json
import math
import struct
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from scenelang.models.manifest import ROOT, load_manifest


class ModelError(Exception):
    """A model's files are missing, damaged or not what its manifest says."""


@dataclass(frozen=True, slots=True)
class Codes:
    """The learned codes that a Program carries, and which weights they belong to.

    Args:
        geometry: leaf name to code, 4 numbers.
        material: material name to code, 12 numbers.
        digest: SHA-256 of the weights file, hex.
    """

    geometry: dict[str, tuple[float, ...]]
    material: dict[str, tuple[float, ...]]
    digest: str


@dataclass(frozen=True, slots=True)
class Facts:
    """What a weights file says about itself.

    Args:
        digest: SHA-256 of the file, hex.
        bytes: its size.
        parameters: numbers in it.
        training: its header: config, seed, iterations, seconds, device, revision.
    """

    digest: str
    bytes: int
    parameters: int
    training: dict[str, Any]


def weights_path(name: str) -> Path:
    """Where a shipped model's weights lie."""
    return ROOT / name / "weights.safetensors"


def read_header(data: bytes) -> dict[str, Any]:
    """The training header of a weights file; raises ModelError where there is none."""
    try:
        (length,) = struct.unpack("<Q", data[:8])
        outer = json.loads(data[8 : 8 + length])
        header = json.loads(outer["__metadata__"]["scenelang"])
    except (struct.error, ValueError, KeyError, TypeError, RecursionError) as error:
        raise ModelError(f"no training header: {error}") from None
    if not isinstance(header, dict) or header.get("format") != 1:
        raise ModelError("not a weights file of format 1")
    return header


def read_facts(name: str) -> Facts:
    """What the weights file of a shipped model says about itself.

    Raises:
        OSError: it cannot be read.
        ModelError: it is damaged.
    """
    data = weights_path(name).read_bytes()
    training = read_header(data)
    (length,) = struct.unpack("<Q", data[:8])
    tensors = {k: v for k, v in json.loads(data[8 : 8 + length]).items() if k != "__metadata__"}
    try:
        parameters = sum(math.prod(entry["shape"]) for entry in tensors.values())
    except (KeyError, TypeError) as error:
        raise ModelError(f"damaged weights: {error}") from None
    return Facts(hashlib.sha256(data).hexdigest(), len(data), parameters, training)


@lru_cache(maxsize=8)
def load_codes(name: str) -> Codes:
    """Read the codes of a shipped model.

    Raises:
        KeyError: there is no such model.
        FileNotFoundError: it has no weights.
    """
    from safetensors.numpy import load

    manifest = load_manifest(name)
    data = weights_path(name).read_bytes()
    tensors = load(data)
    return Codes(
        geometry=_rows(manifest.geometries, tensors["codes"]),
        material=_rows(manifest.materials, tensors["material_codes"]),
        digest=hashlib.sha256(data).hexdigest(),
    )


def _rows(names: tuple[str, ...], table: object) -> dict[str, tuple[float, ...]]:
    rows = table.tolist()  # type: ignore[attr-defined]
    if len(rows) != len(names):
        raise ValueError(f"{len(rows)} codes for {len(names)} names")
    return {name: tuple(row) for name, row in zip(names, rows, strict=True)}
