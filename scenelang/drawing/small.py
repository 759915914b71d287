"""Small pictures, drawn by numpy without waiting for torch to be imported.

Torch has more cores and devices, and takes one to two seconds to import, which pays from some amount of work
on. That amount is counted from the Program, so that the same one is always drawn by the same library.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal, NamedTuple, Unpack

import numpy as np
from PIL import Image as Pillow

from scenelang.assets.element import Element, credit_of
from scenelang.assets.element_file import ElementFile
from scenelang.assets.picture import pixels
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.program import Program, ProgramError
from scenelang.compiler.weights import ModelError
from scenelang.drawing.closed import field_of
from scenelang.drawing.how import Device, RenderError, Samples, keep_memory, threads_for
from scenelang.drawing.image import Image
from scenelang.drawing.neural.draw import Drawing, Run, draw_objects
from scenelang.drawing.neural.files import load_arrays
from scenelang.language.scene import Color, Elements, Material, Object, Rotate, Scale, Scene

PROBE: Final = 16  # the root of the pixels that solids are drawn in to count evaluations


class Load(NamedTuple):
    """Numbers that a frame's time depends on."""

    objects: int  # rows of the Program
    pixels: int  # of the canvas
    meetings: float  # pixels within objects' bounds, summed over objects; of solids, network evaluations
    # pixels around those bounds, summed likewise, for each four samples; of solids, evaluations for a pixel
    # times pixels of the canvas's shorter side, as outlines and shadows grow with both
    outline: float

    def row(self, skip: bool) -> tuple[float, float, float, float, float]:
        """The terms of the sum; without skipping every object meets every pixel."""
        meetings = self.meetings if skip else float(self.objects * self.pixels)
        return 1.0, float(self.objects), float(self.pixels), meetings, self.outline


def load_of(program: Program) -> Load:
    """The load of a Program, of solids by a very small picture; `ModelError` if their weights are missing."""
    width, height = program.canvas
    if program.stage is not None:
        scale = PROBE / (width * height) ** 0.5
        small = replace(program, canvas=(max(1, round(width * scale)), max(1, round(height * scale))))
        drawn = draw_objects(load_arrays(program.model, program.weights).network, small, samples="one")
        each = drawn.pairs / drawn.met  # of a pixel
        return Load(len(program), width * height, each * width * height, each * min(width, height))
    unit = min(width, height) / 2  # pixels of a world unit
    half = np.array([width, height], np.float64) / 2
    corners = np.clip(program.bounds.astype(np.float64).reshape(-1, 2, 2) * unit, -half, half)
    size = corners[:, 1] - corners[:, 0]  # (N, 2)
    outline = np.minimum(2 * size.sum(1), 2 * half.sum()) * (program.samples / 4)
    return Load(len(program), width * height, float(size.prod(1).sum()), float(outline.sum()))


MOST_MS: Final = 250.0
"""Work up to which numpy draws: a quarter of the least that importing torch was seen to take."""
_NS: Final = (4.3e6, 11e3, 11.0, 0.0, 3600.0)
"""Nanoseconds of a frame, an object, a pixel, a meeting and a pixel around bounds (`Load.row`).

`python -m lab bench work` fits them and `_SHARES` to the examples and random scenes on several canvases.
"""
_SHARES: Final[dict[Samples, float]] = {"four": 1.1, "one": 0.6, "draft": 0.45}
"""Shares of that for other ways to sample."""

Drawer = tuple[Literal["numpy", "torch"], str]
"""The library that draws a picture, and the reason in words."""


def choose_drawer(
    program: Program, device: Device = "auto", samples: Samples = "adaptive", *, exact: bool = False
) -> Drawer:
    """Choose the library for a single picture; `RenderError` where there is no such model."""
    if exact:
        return "numpy", "formulas in the network's place"
    if device != "auto":
        return "torch", f"asked for by device {device}"
    try:
        renderer = load_manifest(program.model).renderer
    except KeyError:
        raise RenderError(f"unknown model `{program.model}`") from None
    if renderer == "solid":
        return "numpy", "solids are"
    if renderer != "framed":
        return "torch", f"a `{renderer}` network is large work for any picture"
    ms = work_ms(program, samples)
    numpy = ms <= MOST_MS
    bound = "at most" if numpy else "more than"
    return "numpy" if numpy else "torch", f"about {ms:,.0f} ms of work, {bound} {MOST_MS:.0f}"


def work_ms(program: Program, samples: Samples = "adaptive") -> float:
    """Milliseconds to draw a Program on one core of the machine that was measured."""
    row = load_of(program).row(skip=True)
    return _SHARES.get(samples, 1.0) * sum(n * ns for n, ns in zip(row, _NS, strict=True)) / 1e6


def draw_small(program: Program, *, exact: bool = False, **run: Unpack[Run]) -> Drawing:
    """Draw a Program by numpy, or by formulas if ``exact``: the plane on one core, large solids on several;
    the rest is as of `Run`.

    Raises `RenderError` where the model's weights are missing or not those it was compiled for, or there are
    no formulas.
    """
    keep_memory()
    try:
        network = field_of(program, exact)
        if program.stage is None:
            run |= {"threads": 1, "split": 1}
        run["threads"] = run.get("threads") or threads_for(program.canvas)
        drawing = draw_objects(network, program, **run)
    except (ModelError, ProgramError) as error:
        raise RenderError(str(error)) from None
    drawing.image.credit = credit_of(program.elements)
    return drawing


WIDEST: Final = 2048  # pixels of a sheet
_TURN: Final = Rotate.degrees(30, axis=(0, 1, 0))


def thumbnail(element: Element, side: int = 128, worn: Element | None = None) -> Image:
    """An element alone on a square canvas (side, side, 3); a texture fills it, one of space is lit, turned a
    little and ``worn`` by a geometry, by default a ball.
    """
    if element.form == "picture":
        colours = np.frombuffer(pixels(element), np.uint8).reshape(*element.sizes, 3)
        small = Pillow.fromarray(colours).resize((side, side))
        return (np.asarray(small, np.float32) / np.float32(255)).view(Image)
    worn = element if element.material else worn
    zoo = Elements.of("zoo", "zoo.safetensors", ElementFile.of([element, *([worn] if worn else ())]))
    solid = element.dimension == 3
    moves = (_TURN, Scale(1.0)) if solid else (Scale(0.9),)
    look = Material("diffuse" if solid else "flat", (Color("#c96" if solid else "#222"),))
    look = look if worn is None else Material(f"zoo.{worn.name}")
    shown = Object("sphere" if element.material else f"zoo.{element.name}", moves, look)
    return draw_small(compile_scene(Scene(elements=(zoo,), nodes=(shown,), canvas=(side, side)))).image


def sheet(elements: Sequence[Element]) -> Image:
    """Elements in rows of about as many, in order, on white; geometries wear the colours of their name."""
    worn = {element.name: element for element in elements if element.form == "colours"}
    elements = [element for element in elements if element.name not in worn or not element.material]
    columns = math.ceil(math.sqrt(len(elements)))
    rows, side = math.ceil(len(elements) / columns), min(256, WIDEST // columns)
    picture = np.ones((rows * side, columns * side, 3), np.float32)
    for at, element in enumerate(elements):
        y, x = side * (at // columns), side * (at % columns)
        picture[y : y + side, x : x + side] = thumbnail(element, side, worn.get(element.name))
    return picture.view(Image)
