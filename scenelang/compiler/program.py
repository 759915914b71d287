"""The Program: a compiled scene for renderers and embedders, and its files.

A file is safetensors, read as if a stranger had written it, with a JSON header as metadata ``scenelang``.
Tensors: ``vectors`` F32 (N, 64), ``tokens`` I8 (N,), ``bounds`` F32 (N, 4), ``objects`` I32 (N,) indexing the
header's ``geometries``, ``places`` I32 (N, 5) as (index into the header's ``files``, line, column, end line,
end column), all -1 where unknown, ``numbers`` I32 (N,) unless 1 to N. With elements it has format 2: the
header lists them, ``forms`` I32 (N,) has the index of each row's geometry, and ``element.0`` and so on are
their bytes. Where some are materials it is format 3, with a table of paints (`Paint`) and ``worn`` I32 (N,),
the index of each row's paint or -1. With groups, or cuts that have a width, it is format 4, and has these
where the others would; with gradients, whose ``stops`` F32 (S, 5) lie beside the paints, with numbers in the
places `OTHERS` of vectors, ``samples`` other than 4, which the header then has, or a stage that has a sky or
another count of lights than one, or one of a radius, it is format 5. With polygons or splines it is format 6:
``outlines`` I32 (K, 3), place among the elements, kind and number of points, and ``points`` F64 (M, 2). So
it is where textures are tilted out of x and y, with ``tilts`` beside the paints.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets import notebook
from scenelang.assets.element import (
    BY_POINTS,
    POINTS,
    Element,
    Gradient,
    element_of,
    points_fault,
    stops_fault,
)
from scenelang.assets.element_file import MOST_ELEMENT_BYTES, entry_of, read_elements
from scenelang.assets.files import read_regular, write_output
from scenelang.assets.tensors import FORMAT, MOST_HEADER, TensorError, TensorFile, check_fields, read_tensors
from scenelang.compiler.graph import MOST_STEPS, ColourStep
from scenelang.compiler.groups import OPERATOR, token_fault
from scenelang.compiler.lifting import LAYOUTS, WIDTH, Layout
from scenelang.compiler.manifest import ALIASES, available, load_manifest
from scenelang.compiler.spaces import Stage, read_stage, stage_data
from scenelang.language.diagnostics import plural
from scenelang.language.nodes import DENSEST, MOST, SAMPLES
from scenelang.language.words import TOKENS

GROUPED, NEWER, NEWEST = 4, 5, 6  # formats of files with groups, with what is newer, with outlines by points
STEPS: Final = {"color": 3, "grayscale": 1, "hue": 1}
"""Operations on a colour and how many numbers each has; files have their index here."""
_GRADED: Final = {-1: "linear", -2: "radial"}
"""Gradients, in place of an index of elements."""


class Paint(NamedTuple):
    """A gradient, a picture or colours of space, `STEPS` on its colours, each clamped to [0, 1], and of a
    texture in space how much its u and v change along z, beside the frame that its rows' vectors have.
    """

    element: Element | Gradient
    steps: tuple[ColourStep, ...] = ()
    tilt: tuple[float, float] = (0.0, 0.0)


def paint_tensors(paints: tuple[Paint, ...], elements: tuple[Element, ...]) -> dict[str, npt.NDArray[Any]]:
    """Tensors of paints: `paints` I32 (K, 2), element and number of steps; `steps` F32 (S, 4), in order; with
    gradients, whose elements are -1 linear and -2 radial, `stops` F32 (S, 5), each behind its paint's index;
    `tilts` F32 (K, 2) where there are any.
    """
    kinds, index = list(STEPS), {element: at for at, element in enumerate(elements)}
    graded = {name: at for at, name in _GRADED.items()}
    table, steps, stops = list[Any](), list[Any](), list[Any]()
    for at, (element, own, _) in enumerate(paints):
        listed = graded[element.name] if isinstance(element, Gradient) else index[element]
        table.append((listed, len(own)))
        steps += [(kinds.index(kind), *numbers, *[0.0] * (3 - len(numbers))) for kind, *numbers in own]
        stops += [(at, *stop) for stop in element.stops] if isinstance(element, Gradient) else []
    tensors = {
        "paints": np.array(table, np.int32).reshape(-1, 2),
        "steps": np.array(steps, np.float32).reshape(-1, 4),
    }
    if any(any(paint.tilt) for paint in paints):
        tensors["tilts"] = np.array([paint.tilt for paint in paints], np.float32)
    return tensors | ({"stops": np.array(stops, np.float32)} if stops else {})


def read_paints(tensors: dict[str, npt.NDArray[Any]], elements: tuple[Element, ...]) -> tuple[Paint, ...]:
    """The paints of tensors, as `paint_tensors` writes them; raises TensorError where they do not agree."""
    kinds, rows, result, first = list(STEPS), tensors["steps"].tolist(), [], 0
    stops: dict[float, list[Any]] = {}
    for owner, *stop in tensors["stops"].tolist() if "stops" in tensors else ():
        stops.setdefault(owner, []).append(tuple(stop))
    tilts = tensors.get("tilts", np.zeros_like(tensors["paints"], np.float32)).tolist()
    if len(tilts) != len(tensors["paints"]):
        raise TensorError("tilts of other paints than there are")
    if not all(kind in range(len(kinds)) for kind, *_ in rows):
        raise TensorError("a paint with a step that this version does not know")
    for row, (at, count) in enumerate(tensors["paints"].tolist()):
        graded = Gradient(_GRADED[at], tuple(stops.pop(row, ()))) if at in _GRADED else None
        if not (graded or 0 <= at < len(elements)) or not 0 <= count <= min(MOST_STEPS, len(rows) - first):
            raise TensorError("a paint of an element or of steps that are not listed")
        named = [(kinds[int(kind)], *numbers) for kind, *numbers in rows[first : first + count]]
        used = tuple([step[: STEPS[step[0]] + 1] for step in named])
        result.append(Paint(graded or elements[at], used, tuple(tilts[row])))
        first += count
    if first != len(rows):
        raise TensorError("steps that no paint has")
    if stops:
        raise TensorError("stops that no gradient has")
    return tuple(result)


def paint_fault(paints: Iterable[Paint], elements: tuple[Element, ...], dimension: int) -> str | None:
    """Say what is wrong with the paints of a Program of a dimension, None where nothing is."""
    known = set(elements)
    for element, steps, tilt in paints:
        if isinstance(element, Gradient):
            fault = stops_fault([stop[0] for stop in element.stops])
            if fault is not None or not all(0.0 <= v <= 1.0 for stop in element.stops for v in stop):
                return fault[1] if fault else "a stop whose colour is outside 0..1"
        elif not element.material or element not in known:
            return f"a paint of `{element.name}`, which is not a material that is listed"
        if element.dimension > dimension:
            return f"a paint of dimension {element.dimension} in the plane"
        if not np.isfinite(tilt).all() or (any(tilt) and (dimension, element.dimension) != (3, 2)):
            return f"a tilt of a paint of `{element.name}` where there is none"
        numbers = [number for step in steps for number in step[1:]]
        if any(STEPS.get(step[0]) != len(step) - 1 for step in steps) or not np.isfinite(numbers).all():
            return f"a step of a paint of `{element.name}` that is not known"
        if len(steps) > MOST_STEPS:
            return f"a paint of {len(steps):,} steps, at most {MOST_STEPS:,}"
    return None


MOST_OBJECTS = 100_000
MOST_PIXELS = 8192


class ProgramError(ValueError):
    """A Program is not one: a damaged or foreign file, wrong shapes, or numbers out of range."""


class Place(NamedTuple):
    """The place of an object in text: lines and columns from 1, in code points, the end exclusive."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int


def written(places: Sequence[Place | None]) -> str:
    """The first place that is known, for a message."""
    return next((f" ({place.file}:{place.line}:{place.column})" for place in places if place), "")


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """Objects in stream order. Arrays are copied, checked and set read-only.

    Args:
        vectors: float32 (N, 64), geometry vector (32) then material vector (32) of each object.
        tokens: int8 (N,), the operator that joins each, and the groups that begin and end with it: see
            `scenelang.compiler.groups`; the first joins nothing.
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
        elements: geometries and materials of users' files.
        forms: int32 (N,), index of a row's element, -1 for a geometry of the model. None stands for all -1.
        palette: paints of the rows.
        worn: int32 (N,), index of a row's paint, -1 for the colour of its vector. None stands for all -1.
        samples: of a pixel, 4 or 16 on a regular grid.

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
    samples: int = 4

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
        return notebook.show(self, self.canvas, said)

    def digest(self) -> str:
        """SHA-256, hex, of all that decides the picture: names and places in source text do not."""
        colour = self.background and tuple(float(v) for v in self.background)
        settings: tuple[object, ...] = (tuple(self.canvas), colour, self.model, self.weights, len(self))
        if self.stage is not None:
            settings = (*settings, repr(self.stage))
        if self.elements:
            settings = (*settings, *[element and element.digest for element in self.brought()])
        if self.palette:
            worn = [
                paint and (paint.element.digest, paint.steps, *([paint.tilt] if any(paint.tilt) else []))
                for paint in self.paints()
            ]
            settings = (*settings, *worn)
        if self.samples != 4:
            settings = (*settings, "samples", self.samples)
        total = hashlib.sha256(repr(settings).encode())
        for array, kind in ((self.vectors, "<f4"), (self.tokens, "i1"), (self.bounds, "<f4")):
            total.update(array.astype(kind).tobytes())
        return total.hexdigest()

    def brought(self) -> list[Element | None]:
        """The element of each row, None for a geometry of the model."""
        assert self.forms is not None
        return [self.elements[at] if at >= 0 else None for at in self.forms.tolist()]

    def paints(self) -> list[Paint | None]:
        """The paint of each row, None where its vector has the colour."""
        assert self.worn is not None
        return [self.palette[at] if at >= 0 else None for at in self.worn.tolist()]

    @property
    def extended(self) -> bool:
        """True where it has groups, or cuts with a width, as chains of sharp cuts and blends do not."""
        if (self.tokens > OPERATOR).any():
            return True
        if (layout := self._layout()) is None:
            return False
        return bool((self.vectors[self.tokens >= TOKENS["subtract"], layout.places.width] > 0.0).any())

    @property
    def newer(self) -> bool:
        """True where it has what files have from format 5 on: gradients, other samples, `OTHERS`."""
        layout = self._layout()
        if self.samples != 4 or (layout is not None and self.vectors[:, layout.others].any()):
            return True
        return (
            any(element.curved for element in self.elements)
            or self.lit
            or any(isinstance(paint.element, Gradient) for paint in self.palette)
        )

    @property
    def lit(self) -> bool:
        """True where not one point light lights all, or an object glows, reflects or is of a density."""
        others = LAYOUTS[3].others[4:]
        return self.stage is not None and (not self.stage.plain or bool(self.vectors[:, others].any()))

    def _layout(self) -> Layout | None:
        """The layout of its vectors, None where their numbers are those of a learned lifting."""
        known = ALIASES.get(self.model, self.model)
        if known in available() and load_manifest(known).lifting != "exact":
            return None
        return LAYOUTS[2 if self.stage is None else 3]

    def check_weights(self, digest: str) -> None:
        """Raise ProgramError where it was compiled for other weights than those of a digest."""
        if self.weights != digest:
            fact = f"weights {self.weights[:12]}… of model `{self.model}`, these are {digest[:12]}…"
            raise ProgramError(f"the program was compiled for {fact}: compile the scene again")

    def save(self, path: str | Path) -> None:
        """Write to a file, whole or not at all, equal bytes for equal Programs; raises OSError."""
        write_output(path, program_bytes(self))


def program_bytes(program: Program) -> bytes:
    """The file of a Program; equal Programs give equal bytes."""
    from safetensors.numpy import save

    geometries = sorted(set(program.objects))
    files = sorted({place.file for place in program.places if place is not None})
    of_geometry = {name: index for index, name in enumerate(geometries)}
    of_file = {name: index for index, name in enumerate(files)}
    places = [(-1,) * 5 if place is None else (of_file[place.file], *place[1:]) for place in program.places]
    header = {name: getattr(program, name) for name in ("background", "canvas", "model", "weights")}
    header |= {"files": files, "format": FORMAT, "geometries": geometries}
    if program.stage is not None:
        header["stage"] = stage_data(program.stage)
    outlines = [(at, e) for at, e in enumerate(program.elements) if e.form in BY_POINTS]
    listed = [(at, e) for at, e in enumerate(program.elements) if e.form not in BY_POINTS]
    if program.elements:
        header |= {"format": 2, "elements": [[e.name, entry_of(e)] for _, e in listed]}
    tensors = {name: getattr(program, name) for name in ("vectors", "tokens", "bounds")}
    tensors["objects"] = np.array([of_geometry[name] for name in program.objects], dtype=np.int32)
    tensors["places"] = np.array(places, dtype=np.int32).reshape(len(program), 5)
    if program.numbers != tuple(range(1, len(program) + 1)):
        tensors["numbers"] = np.array(program.numbers, dtype=np.int32)
    if program.elements and program.forms is not None:
        tensors["forms"] = program.forms
        held = ((at, e) for at, (_, e) in enumerate(listed))
        tensors |= {f"element.{at}": np.frombuffer(e.data, np.uint8) for at, e in held}
    if program.palette and program.worn is not None:
        header["format"] = 3
        tensors |= {"worn": program.worn, **paint_tensors(program.palette, program.elements)}
    if outlines:
        header["format"] = NEWEST
        table = [(at, BY_POINTS.index(e.form), *e.sizes) for at, e in outlines]
        tensors["outlines"] = np.array(table, np.int32)
        tensors["points"] = np.frombuffer(b"".join(e.data for _, e in outlines), "<f8").reshape(-1, 2)
    elif "tilts" in tensors:
        header["format"] = NEWEST
    elif program.newer:
        header["format"] = NEWER
    elif program.extended:
        header["format"] = GROUPED
    if program.samples != 4:
        header["samples"] = program.samples
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
    if (stage := program.stage) is not None and (fault := stage.fault()):
        raise ProgramError(fault)
    if type(program.samples) is not int or program.samples not in SAMPLES:
        raise ProgramError(f"{program.samples!r} samples of a pixel, where 4 and 16 are allowed")
    if fault := _light_fault(program):
        raise ProgramError(fault)
    if not program.model:
        raise ProgramError("no model is named")
    if len(program.weights) != 64 or not set(program.weights) <= set("0123456789abcdef"):
        raise ProgramError("the digest of the weights is not 64 hexadecimal digits")


def _light_fault(program: Program) -> str | None:
    """Say what is wrong with densities, roughnesses and glow, None where nothing is."""
    if program.stage is None or not program.lit:
        return None
    parts = LAYOUTS[3].unpack(program.vectors)
    if not ((parts.density >= 0.0) & (parts.density <= DENSEST)).all():
        return f"a density outside 0..{DENSEST:,.0f}"
    rough = abs(parts.roughness[parts.roughness != 0.0])
    if not ((rough >= np.float32(0.05)) & (rough <= 1.0)).all():
        return "a roughness outside 0.05..1"
    if rough.size and program.stage.sky is None:
        return "an object that reflects, and no sky"
    if not ((parts.glow >= 0.0) & (parts.glow <= MOST)).all():
        return f"a glow outside 0..{MOST:g}"
    return None


_MOST_STEPS = 10 * MOST_OBJECTS  # of all paints
MOST_PROGRAM_BYTES = MOST_HEADER + 8 + MOST_ELEMENT_BYTES + 16 * _MOST_STEPS
MOST_PROGRAM_BYTES += MOST_OBJECTS * (4 * WIDTH + 1 + 16 + 4 + 20 + 4 + 4 + 4 + 8 + 12 + 8) + 16 * _MOST_STEPS

_Columns = dict[str, tuple[str, tuple[int, ...]]]  # kinds of numbers, and the sides of each row
_LAYOUT: _Columns = {"vectors": ("F32", (WIDTH,)), "tokens": ("I8", ()), "bounds": ("F32", (4,))}
_LAYOUT |= {"objects": ("I32", ()), "places": ("I32", (5,))}
_OPTIONAL = dict.fromkeys(("numbers", "forms", "worn"), _LAYOUT["objects"])
_TABLES: _Columns = {"paints": ("I32", (2,)), "steps": ("F32", (4,)), "stops": ("F32", (5,))}
_TABLES |= {"tilts": ("F32", (2,))}
_PAINTS = {"paints", "steps"}
_OUTLINES: _Columns = {"outlines": ("I32", (3,)), "points": ("F64", (2,))}
_HEADER: dict[Any, Any] = dict.fromkeys(("format", "samples?"), int) | dict.fromkeys(
    ("model", "weights"), str
)
_HEADER |= {"canvas": [range(1, MOST_PIXELS + 1)], "background": [(0, 1)], "stage?": dict, "elements?": list}
_HEADER |= {"files": [str], "geometries": [str]}
"""A header of the newest format, as `check_fields` takes it."""


def load_program(path: str | Path, *, weights: str | None = None) -> Program:
    """Read a Program that was saved.

    Args:
        path: the file.
        weights: SHA-256 of the weights it is to be drawn with, hex; by default any that ship for its model.

    Raises:
        ProgramError: the file is damaged, foreign or hostile, or was compiled for other weights.
        OSError: the file cannot be read.
    """
    program = parse_program(read_regular(path, MOST_PROGRAM_BYTES))
    program.check_weights(_shipped(program) if weights is None else weights)
    return program


def parse_program(data: bytes) -> Program:
    """The Program in a file's bytes, checked but for the weights' digest; raises `ProgramError`."""
    try:
        file = read_tensors(data, MOST_PROGRAM_BYTES, range(FORMAT, NEWEST + 1))
        clear = {"background": type(None)} if file.header.get("background", 0) is None else {}
        newer = {"samples?"} if file.header["format"] < NEWER else set()
        schema = {name: each for name, each in (_HEADER | clear).items() if name not in newer}
        check_fields(file.header, schema, "the header")
        elements = _read_elements(file)
        count = _count(file)
        tensors = file.arrays()
        elements = _with_outlines(elements, tensors)
        palette = read_paints(tensors, elements) if "worn" in tensors else ()
    except TensorError as error:
        raise ProgramError(f"not a program: {error}") from None
    header = file.header
    geometries, files = header["geometries"], header["files"]
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
    if staged is not None and not staged.plain and header["format"] < NEWER:
        raise ProgramError(f"a damaged stage: lights that format {header['format']} does not have")
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
        samples=header.get("samples", 4),
    )


def _read_elements(file: TensorFile) -> tuple[Element, ...]:
    """The elements of a file of format 2 or above; their tensors are taken out of it."""
    if file.header["format"] == 1 and "elements" in file.header:
        raise TensorError("elements in a file of format 1")
    if file.header["format"] == 1 or (file.header["format"] >= GROUPED and "elements" not in file.header):
        return ()
    listed = file.header.get("elements", [None])
    if not all(isinstance(item, list) and len(item) == 2 and isinstance(item[0], str) for item in listed):
        raise TensorError("its list of elements is damaged")
    result = []
    for at, (name, entry) in enumerate(listed):
        if (tensor := file.tensors.pop(f"element.{at}", None)) is None:
            raise TensorError(f"element {at} has no bytes")
        result.append((name, entry, tensor))
    return read_elements(result, file.body)


def _with_outlines(
    elements: tuple[Element, ...], tensors: dict[str, npt.NDArray[Any]]
) -> tuple[Element, ...]:
    """The elements of a file with those that it has as points, at their places; raises `TensorError`."""
    result, first = [*elements], 0
    table, points = (tensors.pop(name, np.zeros((0, 3))) for name in _OUTLINES)
    for at, kind, count in table.tolist():
        own = points[first : first + count]
        if not 0 <= at <= len(result) or kind not in range(len(BY_POINTS)) or len(own) not in POINTS:
            raise TensorError("an outline by points that is not one")
        if (
            count != len(own)
            or np.hypot(*own.T).max() > 1.0 + 1e-9
            or points_fault(tuple(map(tuple, own.tolist())))
        ):
            raise TensorError("an outline whose points are none")
        result.insert(at, element_of(BY_POINTS[kind], own.tolist()))
        first += count
    if first != len(points):
        raise TensorError("points that no outline has")
    return tuple(result)


def _count(file: TensorFile) -> int:
    """Objects of a file whose tensors are those of a Program."""
    format = file.header["format"]
    newer = ({"forms"} if format > 1 else set()) | ({"worn", *_PAINTS} if format > 2 else set())
    if format >= GROUPED:  # these are there where scenes have elements, and where materials are among them
        newer &= file.tensors.keys() if "elements" in file.header or format >= NEWER else set()
        if "worn" in newer:
            newer |= _PAINTS
        if format > 4 and "worn" in newer:
            newer |= {"stops"} & file.tensors.keys()
    if format == NEWEST:  # with outlines, tilts or both
        newer |= {"tilts"} & file.tensors.keys() if "worn" in newer else set()
        newer |= set(_OUTLINES) if "outlines" in file.tensors or "tilts" not in newer else set()
    if not _LAYOUT.keys() | newer <= file.tensors.keys() <= _LAYOUT.keys() | newer | {"numbers"}:
        raise TensorError(f"it holds other tensors than a program of format {format}")
    count = (*file.tensors["vectors"].shape, 0)[0]
    if count > MOST_OBJECTS:
        raise TensorError(f"{count:,} objects, at most {MOST_OBJECTS:,}")
    for name, tensor in file.tensors.items():
        kind, rest = (_LAYOUT | _OPTIONAL | _TABLES | _OUTLINES)[name]
        rows = count
        if name in _TABLES | _OUTLINES:
            most = MOST_OBJECTS if name in ("paints", "outlines", "tilts") else _MOST_STEPS
            rows = min((*tensor.shape, 0)[0], most)
        if tensor.type != kind or tensor.shape != (rows, *rest):
            raise TensorError(f"tensor `{name}` is {tensor.type} {list(tensor.shape)}")
    return count


def _shipped(program: Program) -> str:
    """Digest of the shipped weights for a Program: replaced ones where it was compiled for them."""
    from scenelang.compiler.weights import ModelError, load_codes, replaced

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
