"""Pictures as arrays that know how to save and show themselves."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from scenelang.files import write_output, write_whole
from scenelang.outputs import Floats, Outputs, check_exr, exr, output_file

if TYPE_CHECKING:
    import PIL.Image


class Image(np.ndarray[Any, np.dtype[np.float32]]):
    """A float32 array (H, W, 3), or (H, W, 4) with straight alpha; sRGB-encoded values in [0, 1].

    Row 0 is the top. Notebooks show it as a PNG.
    """

    credit: str = ""
    """Whose work it shows and under which licenses; PNG files hold it, and a copy of the array does not."""

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
            ValueError: no format has that suffix, or what writes it is not installed.
            OSError: the file cannot be written.
        """
        write_output(path, self.encode(image_format(path)))

    def encode(self, kind: str = "PNG") -> bytes:
        """What a file holds, in one of Pillow's formats or as ``"EXR"``, which has `layers`.

        Formats without alpha (JPEG) get the picture over white.
        """
        if kind == "EXR":
            return exr(self.layers())
        from PIL import Image as pillow
        from PIL.PngImagePlugin import PngInfo

        image, info = self.to_pil(), PngInfo()
        if self.credit:
            info.add_itxt("Copyright", self.credit)
        data = io.BytesIO()
        try:
            image.save(data, kind, **({"pnginfo": info} if kind == "PNG" and self.credit else {}))
        except OSError:
            white = pillow.new("RGBA", image.size, "white")
            data = io.BytesIO()
            pillow.alpha_composite(white, image.convert("RGBA")).convert("RGB").save(data, kind)
        return data.getvalue()

    def layers(self) -> dict[str, Floats]:
        """Linear light, times alpha where there is any, by channels: what an EXR holds."""
        values = np.asarray(self, np.float64)
        colour, alpha = values[..., :3], values[..., 3:]
        light = decoded(colour)
        both = np.concatenate([light * alpha if alpha.size else light, alpha], 2).astype(np.float32)
        return {name: both[..., at] for at, name in enumerate("RGBA"[: both.shape[2]])}

    def _repr_png_(self) -> bytes | None:
        if self.ndim != 3 or self.shape[2] not in (3, 4):
            return None
        return self.encode()


def packed(image: Image, outputs: Outputs, path: Path) -> dict[Path, bytes]:
    """What the files of a picture and of its outputs hold, the picture's first.

    Raises:
        ValueError: their format cannot hold them.
    """
    files = [output_file(path, name) for name in outputs.names]
    if path in files:
        facts = [outputs.facts(name) for name in outputs.names]
        return {path: exr({**image.layers(), **outputs.layers()}, facts)}
    pictures = {file: outputs.png(name) for file, name in zip(files, outputs.names, strict=True)}
    return {path: image.encode(image_format(path)), **pictures}


def save_outputs(image: Image, outputs: Outputs, path: Path) -> list[Path]:
    """Write a picture and its outputs, each file whole or not at all; the files of the outputs.

    Raises:
        ValueError: their format cannot hold them.
        OSError: a file cannot be written.
    """
    for file, data in packed(image, outputs, path).items():
        (write_output if file == path else write_whole)(file, data)
    return [output_file(path, name) for name in outputs.names]


def image_format(path: str | os.PathLike[str]) -> str:
    """Pillow's name for the format that a file's suffix names, or ``"EXR"``.

    Raises:
        ValueError: no format has that suffix, or what writes it is not installed.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".exr":
        check_exr()
        return "EXR"
    from PIL import Image as pillow

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
    image: Image = np.clip(colour, 0.0, 1.0).astype(np.float32, copy=False).view(Image)
    return image


def from_light(picture: npt.NDArray[Any], transparent: bool) -> Image:
    """An image of premultiplied linear light and alpha (4, H, W)."""
    light, alpha = np.moveaxis(picture[:3], 0, 2), picture[3]
    if not transparent:
        return from_samples(encoded(light), None)
    return from_samples(encoded(light / np.maximum(alpha, 1e-6)[..., None]) * alpha[..., None], alpha)


def encoded(linear: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """sRGB of linear values, clamped to [0, 1] (IEC 61966-2-1)."""
    x = np.clip(linear, 0.0, 1.0)
    power = np.exp(np.log(np.maximum(x, 1e-9)) / 2.4)  # seven times as fast as `x ** (1 / 2.4)`
    return np.asarray(np.where(x <= 0.0031308, 12.92 * x, 1.055 * power - 0.055))


def decoded(srgb: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The inverse of `encoded`."""
    return np.asarray(np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4))


def enlarged(picture: Image, canvas: tuple[int, int]) -> Image:
    """A picture in another width and height, each channel by bilinear interpolation."""
    from PIL import Image as pillow

    if picture.shape[:2] == canvas[::-1]:
        return picture
    parts = np.asarray(picture, np.float32)
    if clear := picture.shape[2] == 4:
        parts = np.concatenate([parts[..., :3] * parts[..., 3:], parts[..., 3:]], 2)
    channels = [pillow.fromarray(np.ascontiguousarray(part)) for part in np.moveaxis(parts, 2, 0)]
    found = np.stack([np.asarray(c.resize(canvas, pillow.Resampling.BILINEAR)) for c in channels], 2)
    return from_samples(found[..., :3], found[..., 3] if clear else None)
