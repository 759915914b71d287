"""Materials that users brought, as rows of a Program wear them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.elements.element import Element
from scenelang.graph.looks import MOST_STEPS, ColourStep
from scenelang.tensors import TensorError

STEPS: Final = {"color": 3, "grayscale": 1, "hue": 1}
"""Operations on a colour and how many numbers each has; in files they are told by their place here."""


class Paint(NamedTuple):
    """The colours of an element, and what is done to each, in order, clamped to [0, 1] after each.

    Args:
        element: a picture, which repeats, or colours of space.
        steps: ``("color", r, g, b)`` multiplies, ``("grayscale", a)`` mixes with the luma, ``("hue", turns)``
            shifts H of HSV; float32 numbers.
    """

    element: Element
    steps: tuple[ColourStep, ...] = ()


def paint_tensors(paints: tuple[Paint, ...], elements: tuple[Element, ...]) -> dict[str, npt.NDArray[Any]]:
    """Tensors of a table of paints: ``paints`` I32 (K, 2), the index of each one's element and how many of
    ``steps`` F32 (S, 4) are its, one after the other: a place in `STEPS` and numbers.
    """
    kinds, index = list(STEPS), {element: at for at, element in enumerate(elements)}
    table = [(index[paint.element], len(paint.steps)) for paint in paints]
    steps = [
        (kinds.index(kind), *numbers, *[0.0] * (3 - len(numbers)))
        for paint in paints
        for kind, *numbers in paint.steps
    ]
    return {
        "paints": np.array(table, np.int32).reshape(-1, 2),
        "steps": np.array(steps, np.float32).reshape(-1, 4),
    }


def read_paints(
    table: npt.NDArray[Any], steps: npt.NDArray[Any], elements: tuple[Element, ...]
) -> tuple[Paint, ...]:
    """The paints that such tensors tell of.

    Raises:
        TensorError: they do not agree, or name what is not listed.
    """
    kinds, rows, found, first = list(STEPS), steps.tolist(), [], 0
    if not all(kind in range(len(kinds)) for kind, *_ in rows):
        raise TensorError("a paint with a step that this version does not know")
    for at, count in table.tolist():
        if not 0 <= at < len(elements) or not 0 <= count <= min(MOST_STEPS, len(rows) - first):
            raise TensorError("a paint of an element or of steps that are not listed")
        own = rows[first : first + count]
        named = [(kinds[int(kind)], *numbers) for kind, *numbers in own]
        found.append(Paint(elements[at], tuple([step[: STEPS[step[0]] + 1] for step in named])))
        first += count
    if first != len(rows):
        raise TensorError("steps that no paint has")
    return tuple(found)


def paint_fault(paints: Iterable[Paint], elements: tuple[Element, ...], dimension: int) -> str | None:
    """What is wrong with the paints of a Program of a dimension."""
    known = set(elements)
    for element, steps in paints:
        if not element.material or element not in known:
            return f"a paint of `{element.name}`, which is not a material that is listed"
        if element.dimension > dimension:
            return f"a paint of dimension {element.dimension} in the plane"
        numbers = [number for step in steps for number in step[1:]]
        if any(STEPS.get(step[0]) != len(step) - 1 for step in steps) or not np.isfinite(numbers).all():
            return f"a step of a paint of `{element.name}` that is not known"
        if len(steps) > MOST_STEPS:
            return f"a paint of {len(steps):,} steps, at most {MOST_STEPS:,}"
    return None
