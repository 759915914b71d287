"""The Program: what a compiled scene is to a renderer, and what embedders take away.

Its file is safetensors with a JSON header, read as if a stranger had written it. Tensors: ``vectors`` F32
(N, 64), ``tokens`` I8 (N,), ``bounds`` F32 (N, 4), ``objects`` I32 (N,) indexing the header's ``geometries``,
``places`` I32 (N, 5) as (index into the header's ``files``, line, column, end line, end column), all -1 where
unknown, ``numbers`` I32 (N,) unless 1 to N. The header is metadata ``scenelang``, with a stage of solids.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.files import read_regular, write_output
from scenelang.graph.stage import Stage, read_stage, stage_data
from scenelang.notebook import bundle
from scenelang.tensors import FORMAT, MOST_HEADER, TensorError, TensorFile, read_tensors
from scenelang.words import TOKENS

MOST_OBJECTS = 100_000
MOST_PIXELS = 8192
WIDTH = 64


class ProgramError(ValueError):
    """A Program is not one: a damaged or foreign file, wrong shapes, or numbers out of range."""


class Place(NamedTuple):
    """Where an object was written: lines and columns from 1, in code points, the end exclusive."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """Objects in stream order. Arrays are copied, checked and made read-only.

    Args:
        vectors: float32 (N, 64), geometry vector (32) then material vector (32) of each object.
        tokens: int8 (N,), how each joins what came before, as in `scenelang.words.TOKENS`; the first is 0.
        bounds: float32 (N, 4), world xmin, ymin, xmax, ymax: outside it the row makes no difference to
            the picture. An intersection, which reaches everything, has the whole canvas. Of solids it is a
            ball, x, y, z and radius, and of intersections the one around all others.
        canvas: width and height in pixels.
        background: (r, g, b) as written, in [0, 1], or None for transparency.
        model: name of the model that draws it.
        weights: SHA-256 of that model's weights, hex.
        objects: geometry name of each row.
        places: where each row was written; None where that is unknown.
        stage: camera, light, ground and sky of a scene of solids; None in the plane.
        numbers: of each row's object in the scene as written, from 1; by default the rows'.

    Raises:
        ProgramError: anything is not as above.
    """

    vectors: npt.NDArray[np.float32] = field(repr=False)
    tokens: npt.NDArray[np.int8] = field(repr=False)
    bounds: npt.NDArray[np.float32] = field(repr=False)
    canvas: tuple[int, int]
    background: tuple[float, float, float] | None
    model: str
    weights: str
    objects: tuple[str, ...]
    places: tuple[Place | None, ...] = field(repr=False)
    stage: Stage | None = None
    numbers: tuple[int, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        count = len(self.objects)
        if count > MOST_OBJECTS:
            raise ProgramError(f"{count:,} objects, at most {MOST_OBJECTS:,}")
        for name, dtype, shape in (
            ("vectors", np.float32, (count, WIDTH)),
            ("tokens", np.int8, (count,)),
            ("bounds", np.float32, (count, 4)),
        ):
            object.__setattr__(self, name, _frozen(name, getattr(self, name), dtype, shape))
        if len(self.places) != count:
            raise ProgramError(f"{len(self.places)} places for {count} objects")
        object.__setattr__(self, "numbers", self.numbers or tuple(range(1, count + 1)))
        if len(self.numbers) != count or not all(0 < n <= MOST_OBJECTS for n in self.numbers):
            raise ProgramError(f"numbers that are not those of {count} objects")
        _check_rows(self)
        _check_settings(self)

    def __len__(self) -> int:
        return len(self.objects)

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, Any]:
        said = f"Program of {len(self):,} object{'s' * (len(self) != 1)} for `{self.model}`"
        return bundle(self, self.canvas, said)

    def digest(self) -> str:
        """SHA-256, hex, of all that decides the picture: not of names or places in source text."""
        colour = self.background and tuple(float(v) for v in self.background)
        settings: tuple[object, ...] = (tuple(self.canvas), colour, self.model, self.weights, len(self))
        if self.stage is not None:
            settings = (*settings, repr(self.stage))
        total = hashlib.sha256(repr(settings).encode())
        for array, kind in ((self.vectors, "<f4"), (self.tokens, "i1"), (self.bounds, "<f4")):
            total.update(array.astype(kind).tobytes())
        return total.hexdigest()

    def check_weights(self, digest: str) -> None:
        """Raise ProgramError where it was compiled for other weights than those of a digest."""
        if self.weights != digest:
            raise ProgramError(
                f"the program was compiled for weights {self.weights[:12]}… of model `{self.model}`, "
                f"these are {digest[:12]}…: compile the scene again"
            )

    def save(self, path: str | Path) -> None:
        """Write to a file, whole or not at all; the same Program gives the same bytes.

        Raises:
            OSError: the file cannot be written.
        """
        write_output(path, program_bytes(self))


def program_bytes(program: Program) -> bytes:
    """The file of a Program; equal Programs give equal bytes."""
    from safetensors.numpy import save

    geometries = sorted(set(program.objects))
    files = sorted({place.file for place in program.places if place is not None})
    of_geometry = {name: index for index, name in enumerate(geometries)}
    of_file = {name: index for index, name in enumerate(files)}
    places = [(-1,) * 5 if place is None else (of_file[place.file], *place[1:]) for place in program.places]
    header: dict[str, Any] = {
        "background": program.background,
        "canvas": program.canvas,
        "files": files,
        "format": FORMAT,
        "geometries": geometries,
        "model": program.model,
        "weights": program.weights,
    }
    if program.stage is not None:
        header["stage"] = stage_data(program.stage)
    tensors: dict[str, npt.NDArray[Any]] = {
        "vectors": program.vectors,
        "tokens": program.tokens,
        "bounds": program.bounds,
        "objects": np.array([of_geometry[name] for name in program.objects], dtype=np.int32),
        "places": np.array(places, dtype=np.int32).reshape(len(program), 5),
    }
    if program.numbers != tuple(range(1, len(program) + 1)):
        tensors["numbers"] = np.array(program.numbers, dtype=np.int32)
    text = json.dumps(header, sort_keys=True, separators=(",", ":"))
    data: bytes = save(tensors, metadata={"scenelang": text})
    return data


def _frozen(name: str, array: Any, dtype: type[np.generic], shape: tuple[int, ...]) -> npt.NDArray[Any]:
    if not isinstance(array, np.ndarray) or array.dtype != dtype or array.shape != shape:
        kind = f"{array.dtype} {array.shape}" if isinstance(array, np.ndarray) else type(array).__name__
        raise ProgramError(f"{name} are {kind}, not {np.dtype(dtype)} {shape}")
    copy = np.array(array, order="C")
    copy.setflags(write=False)
    return copy


def _check_rows(program: Program) -> None:
    for name, array in (("vectors", program.vectors), ("bounds", program.bounds)):
        finite = np.isfinite(array).all(axis=1)
        if not finite.all():
            row = int(np.argmin(finite))
            raise ProgramError(f"{name} of object {row} (`{program.objects[row]}`) are not finite")
    known = (program.tokens >= 0) & (program.tokens < len(TOKENS))
    if not known.all():
        row = int(np.argmin(known))
        raise ProgramError(f"token {int(program.tokens[row])} of object {row}, where 0 to 3 are known")
    if len(program) and program.tokens[0] != 0:
        raise ProgramError(f"token {int(program.tokens[0])} of the first object, which is always 0")
    if program.stage is not None:
        if (program.bounds[:, 3:] < 0.0).any():
            raise ProgramError("bounds with a negative radius")
    elif (program.bounds[:, :2] > program.bounds[:, 2:]).any():
        raise ProgramError("bounds with a minimum above their maximum")


def _check_settings(program: Program) -> None:
    canvas, colour = program.canvas, program.background
    if len(canvas) != 2 or not all(type(side) is int and 1 <= side <= MOST_PIXELS for side in canvas):
        raise ProgramError(f"a canvas of {canvas!r}, where sides from 1 to {MOST_PIXELS} are allowed")
    shares = colour is None or all(type(v) in (int, float) and 0 <= v <= 1 for v in colour)
    if not shares or (colour is not None and len(colour) != 3):
        raise ProgramError(f"a background of {colour!r}, which is not a colour")
    if (stage := program.stage) is not None and (fault := stage.camera.fault() or stage.light.fault()):
        raise ProgramError(fault)
    if not program.model:
        raise ProgramError("no model is named")
    if len(program.weights) != 64 or not set(program.weights) <= set("0123456789abcdef"):
        raise ProgramError("the digest of the weights is not 64 hexadecimal digits")


MOST_BYTES = MOST_HEADER + 8 + MOST_OBJECTS * (4 * WIDTH + 1 + 16 + 4 + 20 + 4)

_LAYOUT: dict[str, tuple[str, tuple[int, ...]]] = {
    "vectors": ("F32", (WIDTH,)),
    "tokens": ("I8", ()),
    "bounds": ("F32", (4,)),
    "objects": ("I32", ()),
    "places": ("I32", (5,)),
    "numbers": ("I32", ()),
}
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
        weights: SHA-256 of the weights it is to be drawn with, hex; by default those shipped for its model.

    Raises:
        ProgramError: the file is damaged, foreign or hostile, or was compiled for other weights.
        OSError: the file cannot be read.
    """
    program = parse_program(read_regular(path, MOST_BYTES))
    program.check_weights(weights if weights is not None else _shipped(program.model))
    return program


def parse_program(data: bytes) -> Program:
    """The Program that a file's bytes hold; everything in them is checked but the weights' digest.

    Raises:
        ProgramError: they hold none.
    """
    try:
        file = read_tensors(data, MOST_BYTES)
        count = _count(file)
        tensors = file.arrays()
    except TensorError as error:
        raise ProgramError(f"not a program: {error}") from None
    header = file.header
    if header.keys() - {"stage"} != _HEADER.keys() or not all(
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
        model=header["model"],
        weights=header["weights"],
        objects=tuple(geometries[index] for index in objects.tolist()),
        places=tuple(Place(files[at], *rest) if at >= 0 else None for at, *rest in places.tolist()),
        stage=staged,
        numbers=tuple(tensors["numbers"].tolist()) if "numbers" in tensors else (),
    )


def _count(file: TensorFile) -> int:
    """Objects of a file whose tensors are those of a Program."""
    if file.tensors.keys() | {"numbers"} != _LAYOUT.keys():
        raise TensorError("it holds other tensors")
    count = (*file.tensors["vectors"].shape, 0)[0]
    if count > MOST_OBJECTS:
        raise TensorError(f"{count:,} objects, at most {MOST_OBJECTS:,}")
    for name, tensor in file.tensors.items():
        kind, rest = _LAYOUT[name]
        if tensor.type != kind or tensor.shape != (count, *rest):
            raise TensorError(f"tensor `{name}` is {tensor.type} {list(tensor.shape)}")
    return count


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
