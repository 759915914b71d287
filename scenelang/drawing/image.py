"""Pictures as arrays that save and show themselves, and their other outputs with the files of these.

A PNG holds one output in 16 bits, an EXR the picture and all outputs as layers of floats. Both carry a text
``scenelang``, JSON, that says what the numbers are and which objects are seen.

Source: W3C, Portable Network Graphics (PNG) Specification, third edition, 2025, chapters 5 and 11.
"""

from __future__ import annotations

import io
import json
import os
import struct
import tempfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from math import isqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from scenelang.assets.files import write_output, write_whole
from scenelang.language.diagnostics import listing, plural

if TYPE_CHECKING:
    import PIL.Image

Output = Literal["depth", "normal", "object", "alpha", "proof"]
PLANE: tuple[Output, ...] = ("object", "alpha")  # Outputs of 2D pictures
DEEP = 0.01  # World units in a medium where its object is asked for, where it is as deep
SIGNATURE = b"\x89PNG\r\n\x1a\n"
PROVED = 1 / 255  # Greatest error of a channel in a pixel that counts as proved right
Floats = npt.NDArray[np.float32]
Source = dict[str, str | int]
"""An object's ``geometry``, and ``file``, ``line`` and ``column`` where they are known."""


@dataclass(frozen=True, slots=True, eq=False)
class Proof:
    """Bounds of a picture's distance from the exact one; row 0 is the top.

    Args:
        bound: float32 (H, W), no less than the largest difference of a pixel's channels, in [0, 1] and, where
            there is alpha, times that.
        redrawn: pixels that were drawn again.
        unknown: elements in the scene, of whose shapes nothing is proved.
    """

    bound: Floats
    redrawn: int = 0
    unknown: tuple[str, ...] = ()

    @property
    def share(self) -> float:
        """Share of pixels that are proved right to `PROVED`."""
        return float((self.bound <= PROVED).mean())

    @property
    def left(self) -> int:
        """Number of pixels that are not."""
        return int((self.bound > PROVED).sum())

    @property
    def worst(self) -> float:
        """The largest bound."""
        return float(self.bound.max())

    def facts(self) -> dict[str, Any]:
        """The figures, as JSON data."""
        figures = {"share": self.share, "left": self.left, "worst": self.worst, "redrawn": self.redrawn}
        return {"to": PROVED, **figures, "unknown": list(self.unknown)}

    def told(self) -> str:
        """A sentence about the proof."""
        percent = int(self.share * 1e5) / 1e3  # rounded down, so that only all are 100
        again = f", {self.redrawn:,} of them drawn again" if self.redrawn else ""
        rest = f"; {self.left:,} are not, by at most {255 * self.worst:.0f}/255" if self.left else ""
        names = listing(f"`{name}`" for name in self.unknown)
        unknown = f"; nothing is proved of the shape of {names}" if names else ""
        return f"{percent:g} % of pixels proved right to 1/255{again}{rest}{unknown}"


@dataclass(frozen=True, slots=True, eq=False)
class Outputs:
    """Outputs of a picture; None where one was not asked for. Row 0 is the top.

    Depth, normal and object are of the pixel's centre and not antialiased: no depth lies between two
    surfaces. Media have neither depth nor normal.

    Args:
        depth: float32 (H, W), world units along the camera's axis to the first solid or the ground; inf where
            there is neither.
        normal: float32 (H, W, 3), of the same surface, unit length, in world axes, turned to the viewer; 0
            where there is none.
        object: int32 (H, W), number of the object in the scene as written, from 1: of the solid, or of the
            first medium where no solid is seen; 0 for ground and background.
        alpha: float32 (H, W), in [0, 1], how much of the pixel objects cover, ground and background left out;
            a medium covers 1 - its transmittance.
        objects: what the numbers in ``object`` are, in order.
        proof: bounds of the picture's pixels.
    """

    depth: Floats | None = None
    normal: Floats | None = None
    object: npt.NDArray[np.int32] | None = None
    alpha: Floats | None = None
    objects: Mapping[int, Source] | None = None
    proof: Proof | None = None

    def only(self, wanted: Sequence[Output], sources: Mapping[int, Source]) -> Outputs:
        """Select the outputs that are wanted, with the ``sources`` of the objects that are seen."""
        result = {name: getattr(self, name) for name in wanted}
        if self.object is None or "object" not in wanted:
            return Outputs(**result)
        seen = {n: sources[n] for n in np.unique(self.object).tolist() if n}
        return Outputs(**result, objects=seen)

    @property
    def names(self) -> tuple[Output, ...]:
        """Names of the outputs that are not None."""
        return tuple(name for name in get_args(Output) if getattr(self, name) is not None)

    def facts(self, name: Output) -> dict[str, Any]:
        """Meaning of an output's numbers for its file, as JSON data."""
        said: dict[str, Any] = {"output": name}
        if name == "depth":
            near, far = self.range()
            said |= {"unit": "scene units along the camera's axis", "near": near, "far": far}
        elif name == "normal":
            said |= {"axes": "world"}
        elif name == "object":
            said |= {"objects": [{"index": n, **source} for n, source in (self.objects or {}).items()]}
        elif self.proof is not None and name == "proof":
            said |= self.proof.facts()
        return said

    def range(self) -> tuple[float | None, float | None]:
        """Least and greatest depth; None where no surface is seen."""
        assert self.depth is not None
        result = self.depth[np.isfinite(self.depth)]
        return (float(result.min()), float(result.max())) if result.size else (None, None)

    def told(self, name: Output) -> str:
        """A few words about the file of an output."""
        if name != "depth":
            seen = f"{plural(len(self.objects or ()), 'object')} seen"
            known = {"normal": "normals in world axes", "object": seen, "proof": "bounds of pixels"}
            return known.get(name, "coverage by objects")
        near, far = self.range()
        return "no surface" if near is None else f"depth from {near:.6g} to {far:.6g} scene units"

    def png(self, name: Output) -> bytes:
        """An output as a PNG of 16 bits.

        Depth is ``65535 near / depth``, 0 for none; a normal ``65535 (n + 1) / 2``; alpha ``65535 alpha``;
        a bound of a proof 65535 of it, rounded up; objects are their numbers.

        Raises:
            ValueError: a number has more than 16 bits.
        """
        result = getattr(self, name)
        facts, values = self.facts(name), np.asarray(getattr(result, "bound", result), np.float64)
        if name == "depth":
            values = 65535.0 * (facts["near"] or 0.0) / values
            facts["stored"] = "65535 near / depth, 0 for none"
        elif name == "normal":
            values = 65535.0 * (values + 1.0) / 2.0
            facts["stored"] = "65535 (normal + 1) / 2"
        elif name == "alpha":
            values = 65535.0 * values
            facts["stored"] = "65535 alpha"
        elif name == "proof":
            values = np.ceil(65535.0 * values.clip(0.0, 1.0))
            facts["stored"] = "65535 bound"
        elif values.max(initial=0.0) > 65535.0:
            raise ValueError("objects numbered beyond 65535, which only .exr holds")
        return png16(np.floor(values + 0.5).astype(np.uint16), json.dumps(facts))

    def save(self, path: str | os.PathLike[str]) -> list[Path]:
        """Write each output, to ``STEM.depth.png`` and so on, or all into an .exr; the files.

        Args:
            path: of the picture, ``STEM.png``, which is not written, or of the EXR.

        Raises:
            ValueError, OSError: a format cannot hold them, or a file cannot be written.
        """
        path = Path(path)
        contents = self.packed(path)  # all, before any is written
        for file, data in contents.items():
            (write_output if file == path else write_whole)(file, data)
        return list(contents)

    def packed(self, path: Path, layers: Mapping[str, Floats] | None = None) -> dict[Path, bytes]:
        """Contents of the files of `save`, with further ``layers`` in an EXR; raises as that does."""
        files = {output_file(path, name): name for name in self.names}
        if path in files:
            return {path: exr({**(layers or {}), **self.layers()}, [self.facts(name) for name in self.names])}
        return {file: self.png(name) for file, name in files.items()}

    def layers(self) -> dict[str, Floats]:
        """The channels of an EXR."""
        single = {"depth.Z": self.depth, "object.id": self.object, "alpha.A": self.alpha}
        single |= {"proof.bound": None if self.proof is None else self.proof.bound}
        result = {name: np.asarray(v, np.float32) for name, v in single.items() if v is not None}
        if self.normal is not None:
            result |= {f"normal.{axis}": self.normal[..., at] for at, axis in enumerate("XYZ")}
        return result


def chunk(kind: bytes, body: bytes) -> bytes:
    """A chunk of a PNG."""
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png16(values: npt.NDArray[np.uint16], text: str) -> bytes:
    """A PNG of 16 bits, grey (H, W) or RGB (H, W, 3), with a text `scenelang` in ASCII."""
    height, width = values.shape[:2]
    rows = values.astype(">u2").reshape(height, -1).view(np.uint8)
    filtered = np.pad(rows, ((0, 0), (1, 0)))  # a byte 0, for no filter, before each row
    head = struct.pack(">IIBBBBB", width, height, 16, 2 * (values.ndim - 2), 0, 0, 0)
    body = chunk(b"IHDR", head) + chunk(b"tEXt", b"scenelang\0" + text.encode("ascii"))
    return SIGNATURE + body + chunk(b"IDAT", zlib.compress(filtered.tobytes())) + chunk(b"IEND", b"")


def output_file(path: Path, name: Output) -> Path:
    """Path of an output of a picture: ``STEM.depth.png``, or an EXR itself; `ValueError` for others."""
    suffix = path.suffix.lower()
    if suffix not in (".png", ".exr"):
        raise ValueError(f"outputs go with .png or .exr pictures, not `{path.name}`")
    return path if suffix == ".exr" else path.with_name(f"{path.stem}.{name}{path.suffix}")


def check_exr() -> None:
    """Raise `ValueError` where what writes EXR is not installed."""
    if find_spec("OpenEXR") is None:
        raise ValueError("writing `.exr` needs OpenEXR: pip install 'scenelang[exr]'")


def exr(layers: Mapping[str, Floats], facts: object = None) -> bytes:
    """An EXR of float channels (H, W) by their names; raises as `check_exr`."""
    check_exr()
    import OpenEXR

    head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    if facts:
        head["scenelang"] = json.dumps(facts)
    with tempfile.TemporaryDirectory() as folder:  # the library writes to paths alone
        path = Path(folder) / "picture.exr"
        OpenEXR.File(head, {name: np.ascontiguousarray(v) for name, v in layers.items()}).write(str(path))
        return path.read_bytes()


class Image(np.ndarray[Any, np.dtype[np.float32]]):
    """A float32 array (H, W, 3), or (H, W, 4) with straight alpha; sRGB-encoded values in [0, 1].

    Row 0 is the top. Notebooks show it as a PNG.
    """

    credit: str = ""
    """Whose work it shows and under which licenses; PNG files hold it, and a copy of the array does not."""
    noise: float = 0.0
    """Standard error of a channel where the picture was found by chance; a copy does not hold it."""

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
        """Contents in one of Pillow's formats, if without alpha over white, or ``"EXR"``, with `layers`."""
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
        return None if self.ndim != 3 or self.shape[2] not in (3, 4) else self.encode()


def packed(image: Image, outputs: Outputs, path: Path) -> dict[Path, bytes]:
    """Contents of the files of a picture and of its outputs, its own first; raises as `save_outputs`."""
    contents = outputs.packed(path, image.layers())
    return contents if path in contents else {path: image.encode(image_format(path)), **contents}


def save_outputs(image: Image, outputs: Outputs, path: Path) -> list[Path]:
    """Write a picture and its outputs, each file whole or not at all; the files of the outputs.

    Raises:
        ValueError, OSError: their format cannot hold them, or a file cannot be written.
    """
    for file, data in packed(image, outputs, path).items():
        (write_output if file == path else write_whole)(file, data)
    return [output_file(path, name) for name in outputs.names]


def image_format(path: str | os.PathLike[str]) -> str:
    """Pillow's name for the format of a file's suffix, or ``"EXR"``; raises as `Image.save`."""
    suffix = Path(path).suffix.lower()
    if suffix == ".exr":
        check_exr()
        return "EXR"
    from PIL import Image as pillow

    pillow.preinit()  # the common formats; loading all takes as long as loading Pillow
    if pillow.EXTENSION.get(suffix) not in pillow.SAVE:
        pillow.init()
    if (kind := pillow.EXTENSION.get(suffix)) is None or kind not in pillow.SAVE:
        raise ValueError(f"no image format has the suffix `{suffix}`")
    return kind


def sample_places(count: int) -> npt.NDArray[np.float64]:
    """Places of samples (2, count) in their pixel, pixels from its upper left corner."""
    side = isqrt(count)
    axis = (np.arange(side) + 0.5) / side
    return np.stack([np.tile(axis, side), np.repeat(axis, side)])


def from_samples(colour: npt.NDArray[Any], alpha: npt.NDArray[Any] | None) -> Image:
    """An image of colours (H, W, 3); with coverage (H, W), of premultiplied ones, which it divides."""
    if alpha is not None:
        straight = colour / np.maximum(alpha, 1e-6)[..., None]
        colour = np.concatenate([straight, alpha[..., None]], 2)
    image: Image = np.clip(colour, 0.0, 1.0).astype(np.float32, copy=False).view(Image)
    return image


def from_light(picture: npt.NDArray[Any], transparent: bool, exposure: float = 1.0) -> Image:
    """An image of premultiplied linear light, times ``exposure``, and alpha (4, H, W)."""
    light, alpha = exposure * np.moveaxis(picture[:3], 0, 2), picture[3]
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
    result = np.stack([np.asarray(c.resize(canvas, pillow.Resampling.BILINEAR)) for c in channels], 2)
    return from_samples(result[..., :3], result[..., 3] if clear else None)
