"""What users brought as a page has it: steps of pyramids of distances and of colours, and texels of pictures.

The page unfolds pyramids itself (``web/grids.js``): its steps are a fifth of the grid, deflated.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.elements.element import Element
from scenelang.elements.picture import texels
from scenelang.elements.pyramid import FAR, FARTHEST, FINE, FINER, FIRST, NEAR, has_finer, unpacked
from scenelang.program.program import ProgramError
from scenelang.tensors import TensorError
from scenelang.viewer.store import Store


def shapes_of(elements: Iterable[Element], store: Store) -> list[dict[str, Any]]:
    """Entries of a view's ``shapes`` for the geometries among elements.

    Raises:
        ProgramError: one is damaged.
    """
    return [_shape(element, store) for element in elements if not element.material]


def paints_of(elements: Iterable[Element], store: Store) -> list[dict[str, Any]]:
    """Entries of a view's ``paints`` for the materials among elements; raises as `shapes_of`."""
    worn = [element for element in elements if element.material]
    return [(_picture if element.form == "picture" else _colours)(element, store) for element in worn]


def _shape(element: Element, store: Store) -> dict[str, Any]:
    return {
        "name": element.name,
        "kind": "grid",
        "dimension": element.dimension,
        "sides": element.sides,
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
    """Of an element of the plane x, y and r: it is no nearer than |q.x| - x, |q.y| - y and |q| - r."""
    grid = unpacked(element)
    axis = np.linspace(-1.0, 1.0, len(grid))
    x, y = np.meshgrid(axis, axis, indexing="ij")
    # a cell's distances lie between those of its nodes, and beyond the square they grow as the way out does
    least = np.min([grid[:-1, :-1], grid[1:, :-1], grid[:-1, 1:], grid[1:, 1:]], 0)
    most = [np.maximum(length[:-1, :-1], length[1:, 1:]) for length in (abs(x), abs(y))]
    found = [float((length - least).max()) for length in (*most, np.hypot(*most))]
    return max(found[0], 1.0), max(found[1], 1.0), max(found[2], 2.0**0.5)


def _picture(element: Element, store: Store) -> dict[str, Any]:
    try:
        colours = texels(element)
    except TensorError as error:
        raise ProgramError(str(error)) from None
    high, wide = element.sizes
    return {
        "name": element.name,
        "kind": "picture",
        "wide": wide,
        "high": high,
        "texels": store.add(np.rint(colours * 255).astype(np.uint8).reshape(-1)),
    }


def _colours(element: Element, store: Store) -> dict[str, Any]:
    return {
        "name": element.name,
        "kind": "colours",
        "sides": element.sides,
        "steps": store.add(_steps(element)),
        "fineness": element.sizes[1],
    }


def _steps(element: Element) -> npt.NDArray[np.int8]:
    try:
        return np.frombuffer(element.inflated(), np.int8)
    except TensorError as error:
        raise ProgramError(str(error)) from None
