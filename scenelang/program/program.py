"""The Program: what a compiled scene is to a renderer, and what embedders take away.

Its file is safetensors with a JSON header, read as if a stranger had written it. Tensors: ``vectors`` F32
(N, 64), ``tokens`` I8 (N,), ``bounds`` F32 (N, 4), ``objects`` I32 (N,) indexing the header's ``geometries``,
``places`` I32 (N, 5) as (index into the header's ``files``, line, column, end line, end column), all -1 where
unknown, ``numbers`` I32 (N,) unless 1 to N. The header is metadata ``scenelang``, with a stage of solids.
Programs with elements have format 2: the header lists these, ``forms`` I32 (N,) has the index of each
row's geometry, and ``element.0`` and so on are their bytes. Where some are materials it is format 3, with a
table of paints (`scenelang.program.paints`) and ``worn`` I32 (N,), the index of each row's paint or -1. With
groups, or cuts that have a width, it is format 4, and has these where the others would.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.diagnostics.suggest import plural
from scenelang.elements.element import Element
from scenelang.elements.zoo import entry_of
from scenelang.files import write_output
from scenelang.graph.stage import Stage, stage_data
from scenelang.lifting.vector import LAYOUTS, WIDTH
from scenelang.models.manifest import ALIASES, available, load_manifest
from scenelang.notebook import bundle
from scenelang.program.groups import OPERATOR, token_fault
from scenelang.program.paints import Paint, paint_fault, paint_tensors
from scenelang.tensors import FORMAT
from scenelang.words import TOKENS

MOST_OBJECTS = 100_000
MOST_PIXELS = 8192


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
        tokens: int8 (N,), how each joins what came before, and the groups that begin and end with it: see
            `scenelang.program.groups`; the first joins nothing.
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
        elements: what users brought.
        forms: int32 (N,), which of these a row shows; -1 for a geometry of the model. None stands for all -1.
        palette: their materials as rows wear them.
        worn: int32 (N,), which of these a row wears; -1 for the colour of its vector. None stands for all -1.

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
    elements: tuple[Element, ...] = ()
    forms: npt.NDArray[np.int32] | None = field(default=None, repr=False)
    palette: tuple[Paint, ...] = field(default=(), repr=False)
    worn: npt.NDArray[np.int32] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        count = len(self.objects)
        if count > MOST_OBJECTS:
            raise ProgramError(f"{count:,} objects, at most {MOST_OBJECTS:,}")
        for name in ("forms", "worn"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, np.full(count, -1, np.int32))
        for name, dtype, shape in (
            ("vectors", np.float32, (count, WIDTH)),
            ("tokens", np.int8, (count,)),
            ("bounds", np.float32, (count, 4)),
            ("forms", np.int32, (count,)),
            ("worn", np.int32, (count,)),
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
        said = f"Program of {plural(len(self), 'object')} for `{self.model}`"
        return bundle(self, self.canvas, said)

    def digest(self) -> str:
        """SHA-256, hex, of all that decides the picture: not of names or places in source text."""
        colour = self.background and tuple(float(v) for v in self.background)
        settings: tuple[object, ...] = (tuple(self.canvas), colour, self.model, self.weights, len(self))
        if self.stage is not None:
            settings = (*settings, repr(self.stage))
        if self.elements:
            settings = (*settings, *[element and element.digest for element in self.brought()])
        if self.palette:
            settings = (
                *settings,
                *[paint and (paint.element.digest, paint.steps) for paint in self.paints()],
            )
        total = hashlib.sha256(repr(settings).encode())
        for array, kind in ((self.vectors, "<f4"), (self.tokens, "i1"), (self.bounds, "<f4")):
            total.update(array.astype(kind).tobytes())
        return total.hexdigest()

    def brought(self) -> list[Element | None]:
        """Each row's element, None for a geometry of the model."""
        assert self.forms is not None
        return [self.elements[at] if at >= 0 else None for at in self.forms.tolist()]

    def paints(self) -> list[Paint | None]:
        """Each row's material that a user brought, None where its vector has the colour."""
        assert self.worn is not None
        return [self.palette[at] if at >= 0 else None for at in self.worn.tolist()]

    @property
    def extended(self) -> bool:
        """Whether it has groups, or cuts that have a width: a chain of sharp cuts and blends has neither."""
        if (self.tokens > OPERATOR).any():
            return True
        known = ALIASES.get(self.model, self.model)
        if known in available() and load_manifest(known).lifting != "exact":
            return False  # its numbers mean something else
        layout = LAYOUTS[2 if self.stage is None else 3]
        return bool((self.vectors[self.tokens >= TOKENS["subtract"], layout.places.width] > 0.0).any())

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
    if program.elements:
        header |= {"format": 2, "elements": [[e.name, entry_of(e)] for e in program.elements]}
    tensors: dict[str, npt.NDArray[Any]] = {
        "vectors": program.vectors,
        "tokens": program.tokens,
        "bounds": program.bounds,
        "objects": np.array([of_geometry[name] for name in program.objects], dtype=np.int32),
        "places": np.array(places, dtype=np.int32).reshape(len(program), 5),
    }
    if program.numbers != tuple(range(1, len(program) + 1)):
        tensors["numbers"] = np.array(program.numbers, dtype=np.int32)
    if program.elements and program.forms is not None:
        tensors["forms"] = program.forms
        tensors |= {f"element.{at}": np.frombuffer(e.data, np.uint8) for at, e in enumerate(program.elements)}
    if program.palette and program.worn is not None:
        header["format"] = 3
        tensors |= {"worn": program.worn, **paint_tensors(program.palette, program.elements)}
    if program.extended:
        header["format"] = 4
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
    if (fault := token_fault(program.tokens)) is not None:
        raise ProgramError(fault)
    for index, listed, what in (
        (program.forms, program.elements, "an element"),
        (program.worn, program.palette, "a paint"),
    ):
        assert index is not None
        if ((index < -1) | (index >= len(listed))).any():
            raise ProgramError(f"an object of {what} that is not listed")
    if any(element is not None and element.material for element in program.brought()):
        raise ProgramError("an object whose geometry is a material")
    dimension = 2 if program.stage is None else 3
    if any(element.dimension != dimension for element in program.elements if not element.material):
        raise ProgramError(f"an element that is not of dimension {dimension}")
    if (fault := paint_fault(program.palette, program.elements, dimension)) is not None:
        raise ProgramError(fault)
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
