"""Materials that users bring: pictures of the plane, and grids of colours of space.

A picture's bytes are those of a WebP file, made without loss, or an AV1 still picture
(`scenelang.elements.still`). `scenelang.elements.colours` has those of colours of space.
"""

from __future__ import annotations

import io
import struct
import warnings
from typing import TYPE_CHECKING, Final

from scenelang.elements.element import Element
from scenelang.elements.still import contained
from scenelang.tensors import TensorError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

_FILES: Final = {"webp": "WEBP", "av1": "AVIF"}
"""Codings of pictures, and what Pillow calls their files; no other opener is tried."""


def pixels(element: Element) -> bytes:
    """Red, green and blue, 8 bits, of each texel of a picture, row after row from the top.

    Raises:
        TensorError: the bytes are damaged, or those of another picture than the sizes tell.
    """
    from PIL import Image

    height, width = element.sizes
    bombs = Image.DecompressionBombError, Image.DecompressionBombWarning
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            data = contained(element.data) if element.coding == "av1" else element.data
            with Image.open(io.BytesIO(data), formats=[_FILES[element.coding]]) as image:
                if image.size != (width, height):
                    raise ValueError(f"a picture of {image.size[0]} x {image.size[1]}")
                if getattr(image, "n_frames", 1) > 1:
                    raise ValueError("more than one frame")
                return image.convert("RGB").tobytes()
    except (OSError, ValueError, RuntimeError, SyntaxError, EOFError, struct.error, *bombs) as error:
        raise TensorError(f"element `{element.name}` is damaged: {error}") from None


def texels(element: Element) -> npt.NDArray[np.float32]:
    """Colours of a material as they are in its file, sRGB-encoded, in [0, 1].

    Returns:
        (h, w, 3) of a picture, the first row at the top; (n, n, n, 3) of colours of space, by x, y and z.

    Raises:
        TensorError: the element is damaged.
    """
    import numpy as np

    if element.form == "colours":
        from scenelang.elements.colours import unpacked

        return np.moveaxis(unpacked(element), 0, -1)
    flat = np.frombuffer(pixels(element), np.uint8).reshape((*element.sizes, 3))
    return flat.astype(np.float32) / np.float32(255)


def painted(
    name: str, colours: npt.NDArray[np.uint8], about: dict[str, str | float] | None = None
) -> Element:
    """The element of a picture (h, w, 3), without loss."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(colours).save(file, "WEBP", lossless=True, quality=100, method=6)
    return Element(name, "picture", colours.shape[:2], "webp", file.getvalue(), about or {})
