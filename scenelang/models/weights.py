"""Codes, header and digest of a model's weights, read without torch."""

from __future__ import annotations

import hashlib
import math
import struct
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenelang.files import read_json, read_regular
from scenelang.models.manifest import ROOT, Manifest, load_manifest

if TYPE_CHECKING:
    from scenelang.lifting.learned import Lifting

MOST_BYTES = 64 << 20
LIFTING = "lifting."
"""In front of the names of a lifting's tensors, where a file holds it beside a renderer's."""
_MOST_HEADER = 1 << 20


class ModelError(Exception):
    """A model's files are missing, damaged or not what its manifest says."""


@dataclass(frozen=True, slots=True)
class Codes:
    """The learned codes that a Program carries, and which weights they belong to.

    Args:
        geometry: leaf name to code, 4 numbers; of a learned lifting the whole vector.
        material: material name to code, 12 numbers; likewise.
        digest: SHA-256 of the weights file, hex.
        lifting: the encoders of a learned lifting.
    """

    geometry: dict[str, tuple[float, ...]]
    material: dict[str, tuple[float, ...]]
    digest: str
    lifting: Lifting | None = None


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


def read_weights(path: Path) -> bytes:
    """The bytes of a weights file.

    Raises:
        OSError: it cannot be read.
        ModelError: it is larger than any.
    """
    data = read_regular(path, MOST_BYTES)
    if len(data) > MOST_BYTES:
        raise ModelError(f"weights of more than {MOST_BYTES >> 20} MB")
    return data


def read_header(data: bytes) -> dict[str, Any]:
    """The training header of a weights file; raises ModelError where there is none."""
    metadata = _outer(data).get("__metadata__")
    try:
        header = read_json(metadata["scenelang"].encode())  # type: ignore[index]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ModelError(f"no training header: {error}") from None
    if not isinstance(header, dict) or header.get("format") != 1:
        raise ModelError("not a weights file of format 1")
    return header


def _outer(data: bytes) -> dict[str, Any]:
    """The safetensors header of a file: tensors by name, and the metadata."""
    try:
        (length,) = struct.unpack("<Q", data[:8])
        if length > min(_MOST_HEADER, len(data) - 8):
            raise ValueError(f"a header of {length:,} bytes")
        outer = read_json(data[8 : 8 + length])
    except (struct.error, ValueError) as error:
        raise ModelError(f"damaged weights: {error}") from None
    if not isinstance(outer, dict):
        raise ModelError("damaged weights: the header is no object")
    return outer


def read_facts(name: str) -> Facts:
    """What the weights file of a shipped model says about itself.

    Raises:
        OSError: it cannot be read.
        ModelError: it is damaged.
    """
    data = read_weights(weights_path(name))
    training = read_header(data)
    parameters = sum(_count(name, entry) for name, entry in _outer(data).items() if name != "__metadata__")
    return Facts(hashlib.sha256(data).hexdigest(), len(data), parameters, training)


def _count(name: str, entry: Any) -> int:
    """Numbers in a tensor that the header lists."""
    shape = entry.get("shape") if isinstance(entry, dict) else None
    if not isinstance(shape, list) or not all(type(side) is int and 0 <= side < 1 << 31 for side in shape):
        raise ModelError(f"damaged weights: tensor `{name[:40]}` has no shape")
    return math.prod(shape[:8])


@lru_cache(maxsize=8)
def load_codes(name: str) -> Codes:
    """Read the codes of a shipped model.

    Raises:
        KeyError: there is no such model.
        FileNotFoundError: it has no weights.
        ModelError: its weights are damaged.
    """
    return codes_of(load_manifest(name), read_weights(weights_path(name)))


def codes_of(manifest: Manifest, data: bytes) -> Codes:
    """The codes that a weights file holds.

    Raises:
        ModelError: it is damaged, or not of this model.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    _outer(data)  # says things once, which safetensors does not ask for
    try:
        tensors = load(data)
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise ModelError(f"damaged weights: {error}") from None
    digest = hashlib.sha256(data).hexdigest()
    prefix = "" if manifest.renderer == "framed" else LIFTING
    geometry = _rows(manifest.geometries, tensors.get(f"{prefix}codes"))
    material = _rows(manifest.materials, tensors.get(f"{prefix}material_codes"))
    lifting = None
    if manifest.lifting == "learned":
        from scenelang.lifting.learned import read_lifting

        try:
            lifting = read_lifting(tensors, LIFTING)
        except (KeyError, ValueError) as error:
            raise ModelError(f"damaged weights: the lifting: {error}") from None
    return Codes(geometry, material, digest, lifting)


def _rows(names: tuple[str, ...], table: Any) -> dict[str, tuple[float, ...]]:
    if (
        table is None
        or table.dtype not in ("float32", "float16")
        or table.ndim != 2
        or len(table) != len(names)
    ):
        found = "no codes" if table is None else f"codes {table.dtype} {list(table.shape)}"
        raise ModelError(f"{found}, where {len(names)} rows of float32 are needed")
    rows: list[list[float]] = table.tolist()
    if not all(math.isfinite(number) for row in rows for number in row):
        raise ModelError("codes that are not finite")
    return {name: tuple(row) for name, row in zip(names, rows, strict=True)}
