"""Codes, header and digest of a model's weights, read without torch."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from scenelang.assets.files import read_regular, reason
from scenelang.assets.records import Record
from scenelang.assets.tensors import TensorError, read_tensors
from scenelang.compiler.manifest import MANIFEST, ROOT, Manifest, load_manifest, model_folder

if TYPE_CHECKING:
    import numpy.typing as npt

    from scenelang.compiler.lifting import Lifting

MOST_BYTES = 64 << 20
REPLACED: Final = ROOT / "replaced"
"""Folders of weights that others have replaced, by digest: saved Programs still draw with them."""
LIFTING = "lifting."
"""Prefix of the names of a lifting's tensors, where a file also holds a renderer's."""


class ModelError(Exception):
    """A model's files are missing, damaged or do not fit its manifest."""


class Codes(Record):
    """The learned codes that a Program carries, by names of leaves and materials.

    Geometries have 4 numbers, materials 12, or 2 in space; of a learned lifting these are whole vectors.
    ``digest`` is the SHA-256 of the weights file, hex.
    """

    geometry: dict[str, tuple[float, ...]]
    material: dict[str, tuple[float, ...]]
    digest: str
    lifting: Lifting | None = None


def replaced(digest: str) -> str:
    """The digest of weights that Programs were saved for and that others replaced; of any other, ""."""
    return digest if digest in os.listdir(REPLACED) else ""


def weights_folder(name: str, digest: str = "") -> Path:
    """Folder of a model's weights and their proofs: the current ones, or those `replaced`, by digest."""
    return REPLACED / digest if replaced(digest) else model_folder(name)


def weights_path(name: str, digest: str = "") -> Path:
    """File of a shipped model's weights, the current ones or those `replaced`."""
    return weights_folder(name, digest) / "weights.safetensors"


def manifest_of(name: str, digest: str = "", path: Path | None = None) -> Manifest:
    """A model's manifest, or that of its weights `replaced` since; of weights at a path with the first of its
    geometries, for which these have codes. Raises as `load_manifest`, and `ModelError`.
    """
    current = load_manifest(name)
    if path is not None:
        codes = open_weights(shipped_weights(name, path=path)).arrays.get("codes", current.geometries)
        return replace(current, geometries=current.geometries[: len(codes)])
    if not replaced(digest):
        return current
    result = Manifest.from_json((REPLACED / digest / MANIFEST).read_bytes())
    if result.name != current.name:
        raise ModelError(f"weights of model `{result.name}`")
    return result


def shipped_weights(name: str, digest: str = "", path: Path | None = None) -> bytes:
    """The bytes of a model's weights file or of ``path``; raises `ModelError` where it cannot be read."""
    try:
        return read_regular(path or weights_path(name, digest), MOST_BYTES)
    except OSError as error:
        raise ModelError(f"cannot read the weights of `{name}`: {reason(error)}") from error


class Weights(NamedTuple):
    """Content of a weights file: its header and its tensors by name, all finite."""

    header: dict[str, Any]
    arrays: dict[str, npt.NDArray[Any]]


def open_weights(data: bytes) -> Weights:
    """Read a weights file; raises `ModelError` for a damaged or hostile one, or numbers not finite."""
    try:
        result = read_tensors(data, MOST_BYTES)
        return Weights(result.header, result.arrays())
    except TensorError as error:
        raise ModelError(f"damaged weights: {error}") from None


def check_shapes(arrays: Mapping[str, npt.NDArray[Any]], shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Raise ModelError where tensors are not those of a network, float32 and of its shapes."""
    for name in sorted(shapes.keys() | arrays.keys()):
        result = arrays.get(name)
        if name not in shapes or result is None or result.shape != shapes[name] or result.dtype != "float32":
            held = "is missing" if result is None else f"is {result.dtype} {list(result.shape)}"
            wanted = f"float32 {list(shapes[name])} is needed" if name in shapes else "none is known"
            raise ModelError(f"damaged weights: tensor `{name}` {held}, where {wanted}")


def read_facts(name: str) -> dict[str, Any]:
    """SHA-256, bytes, parameters and header of a model's shipped weights; raises OSError or `ModelError`."""
    data = read_regular(weights_path(name), MOST_BYTES)
    header, arrays = open_weights(data)
    parameters = sum(array.size for array in arrays.values())
    digest = hashlib.sha256(data).hexdigest()
    return {"digest": digest, "bytes": len(data), "parameters": parameters, "training": header}


@lru_cache(maxsize=8)
def load_codes(name: str, digest: str = "") -> Codes:
    """Codes of a model's current weights or of those `replaced`; raises KeyError, OSError or `ModelError`."""
    return codes_of(manifest_of(name, digest), read_regular(weights_path(name, digest), MOST_BYTES))


def codes_of(manifest: Manifest, data: bytes) -> Codes:
    """The codes of a weights file; raises `ModelError` where it is damaged, or not of this model."""
    from scenelang.compiler.lifting import LAYOUTS, WIDTH

    tensors = open_weights(data).arrays
    prefix = "" if manifest.renderer in ("framed", "solid") else LIFTING
    learned = manifest.lifting == "learned"
    at = LAYOUTS[manifest.dimension].places
    own = at.code.stop - at.code.start, at.material.stop - at.material.start
    sides = (WIDTH // 2, WIDTH // 2) if learned else own
    geometry = _rows(manifest.geometries, tensors, f"{prefix}codes", sides[0])
    material = _rows(manifest.materials, tensors, f"{prefix}material_codes", sides[1])
    lifting = None
    if learned:
        from scenelang.compiler.lifting import read_lifting

        try:
            lifting = read_lifting(tensors, LIFTING)
        except (KeyError, ValueError) as error:
            raise ModelError(f"damaged weights: the lifting: {error}") from None
    return Codes(geometry, material, hashlib.sha256(data).hexdigest(), lifting)


def _rows(
    names: tuple[str, ...], tensors: Mapping[str, Any], key: str, side: int
) -> dict[str, tuple[float, ...]]:
    table = tensors.get(key)
    if table is None or table.dtype not in ("float32", "float16") or table.shape != (len(names), side):
        held = "is missing" if table is None else f"is {table.dtype} {list(table.shape)}"
        needed = f"{len(names)} rows of {side} floats are needed"
        raise ModelError(f"damaged weights: tensor `{key}` {held}; {needed}")
    return {name: tuple(row) for name, row in zip(names, table.tolist(), strict=True)}
