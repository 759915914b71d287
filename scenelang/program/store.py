"""Programs in files: safetensors with a JSON header, read as if a stranger had written them.

Tensors: ``vectors`` F32 (N, 64), ``tokens`` I8 (N,), ``bounds`` F32 (N, 4), ``objects`` I32 (N,) indexing the
header's ``geometries``, ``places`` I32 (N, 5) as (index into the header's ``files``, line, column, end line,
end column), all -1 where unknown. The header is the metadata entry ``scenelang``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy.typing as npt

from scenelang.files import read_regular
from scenelang.program.program import MOST_OBJECTS, WIDTH, Place, Program, ProgramError
from scenelang.tensors import MOST_HEADER, TensorError, TensorFile, read_tensors

MOST_BYTES = MOST_HEADER + 8 + MOST_OBJECTS * (4 * WIDTH + 1 + 16 + 4 + 20)

_LAYOUT: dict[str, tuple[str, tuple[int, ...]]] = {
    "vectors": ("F32", (WIDTH,)),
    "tokens": ("I8", ()),
    "bounds": ("F32", (4,)),
    "objects": ("I32", ()),
    "places": ("I32", (5,)),
}


def load_program(path: str | Path, *, weights: str | None = None) -> Program:
    """Read a Program that was saved.

    Args:
        path: the file.
        weights: SHA-256 of the weights it is to be drawn with, hex; by default those shipped for its model.

    Raises:
        ProgramError: the file is damaged, foreign or hostile, or was compiled for other weights.
        OSError: the file cannot be read.
    """
    program = parse_program(read_regular(path, MOST_BYTES))
    expected = weights if weights is not None else _shipped(program.model)
    if program.weights != expected:
        raise ProgramError(
            f"the program was compiled for weights {program.weights[:12]}… of model `{program.model}`, "
            f"these are {expected[:12]}…: compile the scene again"
        )
    return program


def parse_program(data: bytes) -> Program:
    """The Program that a file's bytes hold; everything in them is checked but the weights' digest.

    Raises:
        ProgramError: they hold none.
    """
    try:
        file = read_tensors(data, MOST_BYTES)
        _check_layout(file)
        tensors = file.arrays()
    except TensorError as error:
        raise ProgramError(f"not a program: {error}") from None
    header = _header(file)
    geometries, files = _names(header, "geometries"), _names(header, "files")
    objects = _indexed(tensors["objects"], len(geometries), "objects")
    background, canvas = header["background"], header["canvas"]
    if not isinstance(canvas, list) or not (background is None or isinstance(background, list)):
        raise ProgramError("a damaged header")
    if not isinstance(header["model"], str) or not isinstance(header["weights"], str):
        raise ProgramError("a damaged header")
    return Program(
        vectors=tensors["vectors"],
        tokens=tensors["tokens"],
        bounds=tensors["bounds"],
        canvas=tuple(canvas),
        background=None if background is None else tuple(background),
        model=header["model"],
        weights=header["weights"],
        objects=tuple(geometries[index] for index in objects),
        places=_places(tensors["places"], files),
    )


def _check_layout(file: TensorFile) -> None:
    if file.tensors.keys() != _LAYOUT.keys():
        raise TensorError("it holds other tensors")
    count = (*file.tensors["vectors"].shape, 0)[0]
    if count > MOST_OBJECTS:
        raise TensorError(f"{count:,} objects, at most {MOST_OBJECTS:,}")
    for name, (kind, rest) in _LAYOUT.items():
        tensor = file.tensors[name]
        if tensor.type != kind or tensor.shape != (count, *rest):
            raise TensorError(f"tensor `{name}` is {tensor.type} {list(tensor.shape)}")


def _header(file: TensorFile) -> dict[str, Any]:
    fields = {"background", "canvas", "files", "format", "geometries", "model", "weights"}
    if file.header.keys() != fields:
        raise ProgramError("the header has missing or unknown fields")
    return file.header


def _names(header: dict[str, Any], key: str) -> list[str]:
    names = header[key]
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ProgramError(f"`{key}` in the header are not names")
    return names


def _indexed(array: npt.NDArray[Any], count: int, what: str) -> list[int]:
    if ((array < 0) | (array >= count)).any():
        raise ProgramError(f"`{what}` name what the header does not list")
    return array.tolist()  # type: ignore[no-any-return]


def _places(array: npt.NDArray[Any], files: list[str]) -> tuple[Place | None, ...]:
    known = array[:, 0] >= 0
    if (array[known][:, 0] >= len(files)).any() or (array[known][:, 1:] < 1).any():
        raise ProgramError("places that no file has")
    return tuple(Place(files[file], *rest) if file >= 0 else None for file, *rest in array.tolist())


def _shipped(model: str) -> str:
    """Digest of the weights shipped for a model."""
    from scenelang.models.manifest import available
    from scenelang.models.weights import load_codes

    if model not in available():
        raise ProgramError(f"unknown model `{model}`; the models are {', '.join(available())}")
    try:
        return load_codes(model).digest
    except FileNotFoundError:
        raise ProgramError(f"model `{model}` has no weights here") from None
