"""How a Scene and a Program show themselves in notebooks.

They stand before what draws them in the order of the package, and know nothing of it: the public `render` is
fetched by its name when a notebook asks.
"""

from __future__ import annotations

import importlib
from typing import Any, Final

MOST_PIXELS: Final = 1 << 21  # beyond, drawing takes longer than a look is worth


def bundle(value: Any, canvas: tuple[int, int], said: str) -> dict[str, Any]:
    """What stands for a value, by media type: a picture, or words why there is none; never an exception."""
    width, height = canvas
    text = f"{said}, {width} × {height} pixels"
    if width * height > MOST_PIXELS:
        return {"text/plain": f"{text}: too large to be drawn in passing"}
    try:
        return {
            "image/png": importlib.import_module("scenelang").render(value)._repr_png_(),
            "text/plain": text,
        }
    except Exception as error:  # whatever it is: a cell that ends in a value has not failed
        return {"text/plain": f"{text}\n\n{error}"}
