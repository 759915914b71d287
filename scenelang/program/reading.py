"""Programs out of files, whose layout `scenelang.program.program` tells; they are read as a stranger's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenelang.elements.element import Element
from scenelang.elements.zoo import MOST_BYTES as MOST_ELEMENT_BYTES
from scenelang.elements.zoo import read_elements
from scenelang.files import read_regular
from scenelang.graph.stage import read_stage
from scenelang.lifting.vector import WIDTH
from scenelang.models.manifest import ALIASES, available
from scenelang.program.paints import read_paints
from scenelang.program.program import MOST_OBJECTS, Place, Program, ProgramError
from scenelang.tensors import MOST_HEADER, TensorError, TensorFile, read_tensors

_MOST_STEPS = 10 * MOST_OBJECTS  # of all paints
MOST_BYTES = MOST_HEADER + 8 + MOST_ELEMENT_BYTES + 16 * _MOST_STEPS
MOST_BYTES += MOST_OBJECTS * (4 * WIDTH + 1 + 16 + 4 + 20 + 4 + 4 + 4 + 8)

_LAYOUT: dict[str, tuple[str, tuple[int, ...]]] = {
    "vectors": ("F32", (WIDTH,)),
    "tokens": ("I8", ()),
    "bounds": ("F32", (4,)),
    "objects": ("I32", ()),
    "places": ("I32", (5,)),
}
_OPTIONAL: dict[str, tuple[str, tuple[int, ...]]] = {
    "numbers": ("I32", ()),
    "forms": ("I32", ()),
    "worn": ("I32", ()),
}
_TABLES: dict[str, tuple[str, tuple[int, ...]]] = {"paints": ("I32", (2,)), "steps": ("F32", (4,))}
_HEADER: dict[str, Any] = {
    "background": list | None,
    "canvas": list,
    "files": list,
    "format": int,
    "geometries": list,
    "model": str,
    "weights": str,
}


def load_program(path: str | Path, *, weights: str | None = None) -> Program:
    """Read a Program that was saved.

    Args:
        path: the file.
        weights: SHA-256 of the weights it is to be drawn with, hex; by default any that ship for its model.

    Raises:
        ProgramError: the file is damaged, foreign or hostile, or was compiled for other weights.
        OSError: the file cannot be read.
    """
    program = parse_program(read_regular(path, MOST_BYTES))
    program.check_weights(_shipped(program) if weights is None else weights)
    return program


def parse_program(data: bytes) -> Program:
    """The Program that a file's bytes hold; everything in them is checked but the weights' digest.

    Raises:
        ProgramError: they hold none.
    """
    try:
        file = read_tensors(data, MOST_BYTES, (1, 2, 3, 4))
        elements = _read_elements(file)
        count = _count(file)
        tensors = file.arrays()
        palette = read_paints(tensors["paints"], tensors["steps"], elements) if "worn" in tensors else ()
    except TensorError as error:
        raise ProgramError(f"not a program: {error}") from None
    header = file.header
    if header.keys() - {"stage", "elements"} != _HEADER.keys() or not all(
        isinstance(header[k], _HEADER[k]) for k in _HEADER
    ):
        raise ProgramError("the header has missing, unknown or damaged fields")
    geometries, files = header["geometries"], header["files"]
    if not all(isinstance(name, str) for name in (*geometries, *files)):
        raise ProgramError("names in the header that are not text")
    objects, places = tensors["objects"], tensors["places"]
    known = places[:, 0] >= 0
    if count and not 0 <= objects.min() <= objects.max() < len(geometries):
        raise ProgramError("`objects` name what the header does not list")
    if (places[known, 0] >= len(files)).any() or (places[known, 1:] < 1).any():
        raise ProgramError("places that no file has")
    background, stage = header["background"], header.get("stage")
    try:
        staged = None if stage is None else read_stage(stage)
    except ValueError as error:
        raise ProgramError(f"a damaged stage: {error}") from None
    return Program(
        vectors=tensors["vectors"],
        tokens=tensors["tokens"],
        bounds=tensors["bounds"],
        canvas=tuple(header["canvas"]),
        background=None if background is None else tuple(background),
        model=ALIASES.get(header["model"], header["model"]),
        weights=header["weights"],
        objects=tuple(geometries[index] for index in objects.tolist()),
        places=tuple(Place(files[at], *rest) if at >= 0 else None for at, *rest in places.tolist()),
        stage=staged,
        numbers=tuple(tensors["numbers"].tolist()) if "numbers" in tensors else (),
        elements=elements,
        forms=tensors.get("forms"),
        palette=palette,
        worn=tensors.get("worn"),
    )


def _read_elements(file: TensorFile) -> tuple[Element, ...]:
    """The elements of a file of format 2 or above; their tensors are taken out of it."""
    if file.header["format"] == 1 and "elements" in file.header:
        raise TensorError("elements in a file of format 1")
    if file.header["format"] == 1 or (file.header["format"] == 4 and "elements" not in file.header):
        return ()
    listed = file.header.get("elements")
    if not isinstance(listed, list) or not all(
        isinstance(item, list) and len(item) == 2 and isinstance(item[0], str) for item in listed
    ):
        raise TensorError("its list of elements is damaged")
    found = []
    for at, (name, entry) in enumerate(listed):
        if (tensor := file.tensors.pop(f"element.{at}", None)) is None:
            raise TensorError(f"element {at} has no bytes")
        found.append((name, entry, tensor))
    return read_elements(found, file.body)


def _count(file: TensorFile) -> int:
    """Objects of a file whose tensors are those of a Program."""
    format = file.header["format"]
    newer = ({"forms"} if format > 1 else set()) | ({"worn", *_TABLES} if format > 2 else set())
    if format == 4:  # these are there where scenes have elements, and where materials are among them
        newer &= file.tensors.keys() if "elements" in file.header else set()
        if "worn" in newer:
            newer |= _TABLES.keys()
    if not _LAYOUT.keys() | newer <= file.tensors.keys() <= _LAYOUT.keys() | newer | {"numbers"}:
        raise TensorError(f"it holds other tensors than a program of format {format}")
    count = (*file.tensors["vectors"].shape, 0)[0]
    if count > MOST_OBJECTS:
        raise TensorError(f"{count:,} objects, at most {MOST_OBJECTS:,}")
    for name, tensor in file.tensors.items():
        kind, rest = (_LAYOUT | _OPTIONAL | _TABLES)[name]
        rows = count
        if name in _TABLES:
            most = _MOST_STEPS if name == "steps" else MOST_OBJECTS
            rows = min((*tensor.shape, 0)[0], most)
        if tensor.type != kind or tensor.shape != (rows, *rest):
            raise TensorError(f"tensor `{name}` is {tensor.type} {list(tensor.shape)}")
    return count


def _shipped(program: Program) -> str:
    """Digest of the weights that ship for a Program: replaced ones where it was compiled for them."""
    from scenelang.models.manifest import ALIASES
    from scenelang.models.weights import ModelError, load_codes, replaced

    model, old = program.model, replaced(program.weights)
    if ALIASES.get(model, model) not in available():
        raise ProgramError(f"unknown model `{model}`; the models are {', '.join(available())}")
    try:
        return load_codes(model, old).digest
    except ModelError as error:
        if not old:
            raise
        raise ProgramError(f"the program was compiled for weights of another model than `{model}`") from error
    except FileNotFoundError:
        raise ProgramError(f"model `{model}` has no weights here") from None
