"""Pictures as arrays that know how to save and show themselves."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from scenelang.files import write_output

if TYPE_CHECKING:
    import PIL.Image


class Image(np.ndarray[Any, np.dtype[np.float32]]):
    """A float32 array (H, W, 3), or (H, W, 4) with straight alpha; sRGB-encoded values in [0, 1].

    Row 0 is the top. Notebooks show it as a PNG.
    """

    def to_uint8(self) -> npt.NDArray[np.uint8]:
        """8-bit values, floor(255 v + 1/2)."""
        scaled: npt.NDArray[np.float32] = np.clip(np.asarray(self), 0.0, 1.0) * 255.0 + 0.5
        return np.floor(scaled).astype(np.uint8)

    def to_pil(self) -> PIL.Image.Image:
        """A Pillow image, RGB or RGBA."""
        from PIL import Image as pillow

        return pillow.fromarray(self.to_uint8())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file whose format its suffix names, whole or not at all; see `encode`.

        Raises:
            ValueError: Pillow knows no format of that suffix.
            OSError: the file cannot be written.
        """
        write_output(path, self.encode(image_format(path)))

    def encode(self, kind: str = "PNG") -> bytes:
        """What a file holds, in one of Pillow's formats.

        Formats without alpha (JPEG) get the picture over white.
        """
        from PIL import Image as pillow

        image = self.to_pil()
        data = io.BytesIO()
        try:
            image.save(data, kind)
        except OSError:
            white = pillow.new("RGBA", image.size, "white")
            data = io.BytesIO()
            pillow.alpha_composite(white, image.convert("RGBA")).convert("RGB").save(data, kind)
        return data.getvalue()

    def _repr_png_(self) -> bytes | None:
        if self.ndim != 3 or self.shape[2] not in (3, 4):
            return None
        return self.encode()


def image_format(path: str | os.PathLike[str]) -> str:
    """Pillow's name for the format that a file's suffix names.

    Raises:
        ValueError: it writes no format of that suffix.
    """
    from PIL import Image as pillow

    suffix = Path(path).suffix.lower()
    pillow.preinit()  # the common formats; loading all takes as long as loading Pillow
    if pillow.EXTENSION.get(suffix) not in pillow.SAVE:
        pillow.init()
    kind = pillow.EXTENSION.get(suffix)
    if kind is None or kind not in pillow.SAVE:
        raise ValueError(f"no image format has the suffix `{suffix}`")
    return kind


def from_samples(colour: npt.NDArray[Any], alpha: npt.NDArray[Any] | None) -> Image:
    """An image of colours (H, W, 3); with coverage (H, W), of premultiplied ones, which it divides."""
    if alpha is not None:
        straight = colour / np.maximum(alpha, 1e-6)[..., None]
        colour = np.concatenate([straight, alpha[..., None]], 2)
    image: Image = np.clip(colour, 0.0, 1.0).astype(np.float32).view(Image)
    return image
