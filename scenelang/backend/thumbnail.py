"""Small pictures of elements, drawn by numpy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from PIL import Image as Pillow

from scenelang.backend.small import draw_small
from scenelang.elements.element import Element
from scenelang.elements.picture import pixels
from scenelang.elements.zoo import Zoo
from scenelang.image import Image
from scenelang.program.compile import compile_scene
from scenelang.scene.schema import Color, Elements, Material, Object, Rotate, Scale, Scene

WIDEST: Final = 2048  # pixels of a sheet
_TURN: Final = Rotate.degrees(30, axis=(0, 1, 0))


def thumbnail(element: Element, side: int = 128, worn: Element | None = None) -> Image:
    """An element alone on a square canvas (side, side, 3), one of space lit and turned a little.

    A texture fills the canvas.

    Args:
        worn: colours of space that a geometry wears; without one a ball shows such.
    """
    if element.form == "picture":
        colours = np.frombuffer(pixels(element), np.uint8).reshape(*element.sizes, 3)
        small = Pillow.fromarray(colours).resize((side, side))
        return (np.asarray(small, np.float32) / np.float32(255)).view(Image)
    worn = element if element.material else worn
    zoo = Elements.of("zoo", "zoo.safetensors", Zoo.of([element, *([worn] if worn else ())]))
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
