"""Parts of a page: its script, the blob of arrays, elements, and the rows of a Program.

The files of ``viewer/`` are ES modules; a page gets them one after the other in one scope, so names at their
top level differ across all of them. The data names an array in the blob as ``[kind, offset, count]``: a kind
of `KINDS`, bytes, a multiple of 4, and a count of numbers.
"""

from __future__ import annotations

import base64
import re
import zlib
from collections.abc import Iterable
from functools import cache, lru_cache
from importlib.resources import files
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import Element, Gradient
from scenelang.assets.picture import texels
from scenelang.assets.pyramid import FAR, FARTHEST, FINE, FINER, FIRST, NEAR, curves_of, has_finer, unpacked
from scenelang.assets.tensors import TensorError
from scenelang.compiler.groups import OPERATOR, widths_of
from scenelang.compiler.lifting import LAYOUTS, Layout
from scenelang.compiler.manifest import Manifest
from scenelang.compiler.program import Program, ProgramError
from scenelang.drawing.neural.frames import Frames, read_skins
from scenelang.drawing.neural.outlines import table_of
from scenelang.drawing.tables import read_ways

MODULES: Final = (
    *("store", "gl", "grids", "groups", "ways", "plane"),
    *("values", "functions", "maps", "looks", "chain", "graph", "stage"),
    *("eye", "letters", "outlines", "expressions", "evaluate"),
    *("elements", "balls", "around", "solid"),
    *("camera", "pace", "surface", "viewer", "dom", "steer", "controls", "page"),
)
"""Files of ``viewer/``, each behind those that it imports."""

_IMPORT: Final = re.compile(r'^import \{[^}]*\} from "[^"]*";\n', re.MULTILINE)
_EXPORT: Final = re.compile(r"^export (?=(?:async )?(?:function|class|const)\b)", re.MULTILINE)


@cache
def script() -> str:
    """The script of a page, for the body of a function or a module."""
    return "\n".join(_EXPORT.sub("", _IMPORT.sub("", web(f"{name}.js"))) for name in MODULES)


def web(name: str) -> str:
    """The text of a file of ``viewer/``."""
    return files("scenelang").joinpath("web/viewer", name).read_text("utf-8")


KINDS = {"float32": "f32", "int8": "i8", "uint8": "u8", "int16": "i16", "uint16": "u16", "int32": "i32"}


class ArrayStore:
    """The blob of arrays, one after the other."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, array: np.ndarray) -> list[Any]:
        """Add an array of a dtype of `KINDS`; return its name in the data."""
        data = np.ascontiguousarray(array).astype(array.dtype.newbyteorder("<")).tobytes()
        name = [KINDS[array.dtype.name], self._size, array.size]
        self._parts.append(data + bytes(-len(data) % 4))
        self._size += len(self._parts[-1])
        return name

    def bytes(self) -> bytes:
        """The blob."""
        return b"".join(self._parts)


def packed(data: bytes) -> str:
    """Deflated (zlib), in base64."""
    return base64.b64encode(zlib.compress(data, 9)).decode()


MOST_CELLS = 24  # along an axis of the grid of an outline


def shapes_of(elements: Iterable[Element | Gradient], store: ArrayStore) -> list[dict[str, Any]]:
    """Entries of a view's ``shapes`` for the geometries among elements; raises `ProgramError`."""
    shapes = (element for element in elements if isinstance(element, Element) and not element.material)
    return [_shape(element, store) for element in shapes]


def worn_of(program: Program) -> tuple[Element | Gradient, ...]:
    """The elements of a Program, and a gradient without stops for each kind that it has: those are rows'."""
    graded = {paint.element.name for paint in program.palette if isinstance(paint.element, Gradient)}
    return *program.elements, *map(Gradient, sorted(graded))


def paints_of(elements: Iterable[Element | Gradient], store: ArrayStore) -> list[dict[str, Any]]:
    """Entries of a view's ``paints`` for the materials among elements; raises as `shapes_of`."""
    return [_paint(element, store) for element in elements if element.material]


def _shape(element: Element, store: ArrayStore) -> dict[str, Any]:
    if element.curved:
        table, curves = table_of(element, MOST_CELLS), curves_of(element)
        wide, high = (float(side) for side in abs(curves).max((0, 1)))
        lists = table.first, table.begins, table.near, table.passing
        return {
            **{"name": element.called, "kind": "outline", "dimension": 2, "cellsAlong": table.side},
            "cells": store.add(np.concatenate(lists).astype(np.int32)),
            "posts": store.add(np.ascontiguousarray(table.posts.T).reshape(-1)),
            "pieces": store.add(np.ascontiguousarray(table.pieces.T).reshape(-1)),
            "bounds": (wide, high, 1.0),
        }
    return {
        **{"name": element.name, "kind": "grid", "dimension": element.dimension, "sides": element.sides},
        "finest": len(unpacked(element)),
        "steps": store.add(_steps(element)),
        "codec": {
            **{"fine": FINE, "far": FAR, "first": FIRST, "farthest": FARTHEST},
            **{"finer": FINER, "near": NEAR if has_finer(element) else 0.0},
        },
        "bounds": bounds_of(element) if element.dimension == 2 else None,
    }


@lru_cache(maxsize=32)
def bounds_of(element: Element) -> tuple[float, float, float]:
    """Numbers x, y and r for an element of the plane: it is no nearer than |q.x| - x, |q.y| - y, |q| - r."""
    grid = unpacked(element)
    axis = np.linspace(-1.0, 1.0, len(grid))
    x, y = np.meshgrid(axis, axis, indexing="ij")
    # a cell's distances lie between those of its nodes; outside the square they grow with the distance to it
    least = np.min([grid[:-1, :-1], grid[1:, :-1], grid[:-1, 1:], grid[1:, 1:]], 0)
    most = [np.maximum(length[:-1, :-1], length[1:, 1:]) for length in (abs(x), abs(y))]
    result = [float((length - least).max()) for length in (*most, np.hypot(*most))]
    return max(result[0], 1.0), max(result[1], 1.0), max(result[2], 2.0**0.5)


def _paint(element: Element | Gradient, store: ArrayStore) -> dict[str, Any]:
    if isinstance(element, Gradient):
        return {"name": element.name, "kind": element.name}
    if element.form != "picture":
        parts = {"kind": "colours", "sides": element.sides, "steps": store.add(_steps(element))}
        return {"name": element.name, **parts, "fineness": element.sizes[1]}
    try:
        colours = texels(element)
    except TensorError as error:
        raise ProgramError(str(error)) from None
    high, wide = element.sizes
    data = store.add(np.rint(colours * 255).astype(np.uint8).reshape(-1))
    return {"name": element.name, "kind": "picture", "wide": wide, "high": high, "texels": data}


def _steps(element: Element) -> npt.NDArray[np.int8]:
    try:
        return np.frombuffer(element.inflated(), np.int8)
    except TensorError as error:
        raise ProgramError(str(error)) from None


Row = dict[str, Any]
Step = list[Any]


def rows_of(program: Program, manifest: Manifest, codes: np.ndarray, material_codes: np.ndarray) -> list[Row]:
    """Rows of a Program as JSON data, see docs/architecture.md; raises `ProgramError` for foreign vectors."""
    layout = LAYOUTS[manifest.dimension]
    parts = layout.unpack(program.vectors)
    forms = [at for at, element in enumerate(program.elements) if not element.material]
    paints = [element for element in worn_of(program) if element.material]
    if layout.dimension == 2:  # world distances per leaf distance
        scales = Frames(program.vectors, layout).scale.tolist()
    else:
        scales = read_ways(program.vectors, layout).scale.tolist()
    widths = widths_of(program.tokens.astype(np.intp) & OPERATOR, parts.width).tolist()
    rows, skins = [], read_skins(parts, program.brought())
    for i, (v, worn, form) in enumerate(zip(program.vectors, program.worn, program.forms, strict=True)):  # type: ignore[arg-type]
        row = {
            "token": int(program.tokens[i]),
            "shape": _index(codes, parts.code[i]) if form < 0 else len(codes) + forms.index(form),
            "material": _index(material_codes, parts.material[i]),
            "steps": _row_steps(v.astype(np.float64), layout),
            **{"scale": scales[i], "colour": parts.rgb[i].tolist()},
            "opacity": 1.0 - min(max(float(parts.clear[i]), 0.0), 1.0),
            **{
                "paint": -1,
                "amount": 0.0,
                "frequency": 0.0,
                "blend": widths[i],
                "object": program.numbers[i],
            },
        }
        if skins is not None:
            row["skin"] = [float(number) for number in skins.at(i)]
        if layout.dimension == 3:
            row["amount"], row["frequency"] = parts.bulge[i].tolist()
            if parts.density[i] > 0:
                row["density"] = float(parts.density[i])
            if parts.glow[i].any():
                row["glow"] = parts.glow[i].tolist()
        if worn >= 0:
            element, steps, tilt = program.palette[worn]
            if isinstance(element, Gradient):
                row["stops"], element = element.stops, Gradient(element.name)
            row |= {"paint": paints.index(element), "paintSteps": steps}
            row["place"] = parts.texture[i].tolist()
            row |= {"tilt": tilt} if any(tilt) else {}
        rows.append(row)
    return rows


def _index(known: np.ndarray, code: np.ndarray) -> int:
    result = np.flatnonzero((known.astype(np.float32) == code).all(1))
    if not len(result):
        raise ProgramError("codes that are not the model's")
    return int(result[0])


def _row_steps(v: np.ndarray, layout: Layout) -> list[Step]:
    """The way of a world point to the leaf, outermost first."""
    steps: list[Step] = []
    for frame, warps in layout.ways:
        if tuple(v[frame]) != layout.identity:
            steps.append(["map", *v[frame].tolist()])
        for a, b, c in v[warps].reshape(-1, 3).tolist():
            if layout.dimension == 2:
                steps += [["turn", a, b, c]] if a or b or c else []
            else:
                steps += [["turn", a, b]] if a or b else []
                steps += [["twist", c]] if c else []
    return steps
