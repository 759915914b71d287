"""Small pictures, drawn by numpy without waiting for torch to be imported.

Torch has more cores and devices, and takes one to two seconds to import, which pays from some amount of work
on. That amount is counted from the Program, so that the same one is always drawn by the same library.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal, Unpack

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
from scenelang.drawing.how import Device, RenderError, keep_memory, threads_for
from scenelang.drawing.image import Image
from scenelang.drawing.kernel import there_is_a_kernel
from scenelang.drawing.neural.draw import Drawing, Run, draw_objects
from scenelang.language.scene import Color, Elements, Material, Object, Rotate, Scale, Scene

Drawer = tuple[Literal["numpy", "torch"], str]
"""The library that draws a picture, and in words what draws, or why it is torch."""


def choose_drawer(program: Program, device: Device = "auto", *, exact: bool = False) -> Drawer:
    """Choose the library for a single picture; `RenderError` where there is no such model."""
    if exact:
        return "numpy", "formulas in the network's place"
    if device != "auto":
        return "torch", f"asked for by device {device}"
    try:
        renderer = load_manifest(program.model).renderer
    except KeyError:
        raise RenderError(f"unknown model `{program.model}`") from None
    if renderer not in ("framed", "solid"):
        return "torch", f"a `{renderer}` network is large work for any picture"
    return ("numpy", "the kernel") if there_is_a_kernel() else ("torch", "there is no kernel")


def draw_small(program: Program, *, exact: bool = False, **run: Unpack[Run]) -> Drawing:
    """Draw a Program without torch, or by formulas if ``exact``; the rest is as of `Run`.

    Raises `RenderError` where the model's weights are missing or not those it was compiled for, or there are
    no formulas.
    """
    keep_memory()
    try:
        network = field_of(program, exact)
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
