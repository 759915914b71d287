"""Scenes and Programs as notebooks show them."""

from __future__ import annotations

import os
from typing import Any, Final, Literal

MOST_PIXELS: Final = 1 << 21  # beyond, drawing takes longer than a look is worth
SWITCH: Final = "SCENELANG_NOTEBOOK"

Shows = Literal["viewer", "picture"]


def set_notebook(shows: Shows) -> None:
    """Choose how Scenes and Programs show in notebooks from now on.

    Args:
        shows: the interactive ``"viewer"``, as at first, or a ``"picture"``. The environment variable
            ``SCENELANG_NOTEBOOK`` says the same.

    Raises:
        ValueError: neither.
    """
    if shows not in ("viewer", "picture"):
        raise ValueError(f"notebooks show a `viewer` or a `picture`, not `{shows}`")
    os.environ[SWITCH] = shows


def bundle(value: Any, canvas: tuple[int, int], said: str) -> dict[str, Any]:
    """Representations of a value by media type: a viewer, a picture, text; never raises."""
    width, height = canvas
    text = f"{said}, {width} × {height} pixels"
    if width * height > MOST_PIXELS:
        return {"text/plain": f"{text}: too large to be drawn in passing"}
    try:
        from scenelang.drawing.render import render
        from scenelang.web.export import frame

        image = render(value)
        result = {"image/png": image._repr_png_(), "text/plain": text}
        if os.environ.get(SWITCH, "viewer") != "picture":
            html = frame(value, image)
            result |= {"text/html": html} if html else {}
    except Exception as error:  # whatever it is: a cell that ends in a value has not failed
        return {"text/plain": f"{text}\n\n{error}"}
    return result
