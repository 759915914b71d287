"""A hook for notebooks: what shows Scenes and Programs draws them, and so comes after them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Show = Callable[[Any, tuple[int, int], str], dict[str, Any]]


def _said(value: Any, canvas: tuple[int, int], said: str) -> dict[str, Any]:
    return {"text/plain": said}


show: Show = _said
"""Representations by media type of a value with a canvas; the package puts `scenelang.web.notebook` here."""
