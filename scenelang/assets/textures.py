"""The sixteen textures that ship: materials of every model that draws pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from scenelang.assets.element import Element
from scenelang.assets.zoo import load_zoo

FILE: Final = Path(__file__).with_name("textures.safetensors")


def load_textures() -> dict[str, Element]:
    """The textures by name, those of `scenelang.language.words.TEXTURES`.

    Raises:
        OSError: their file cannot be read.
        TensorError: it is damaged.
    """
    return load_zoo(FILE).materials
