"""Pictures as textures: read as people see them, and kept in the fewest bytes that are near enough.

What is tried is WebP without loss, which suits drawings, and AV1 still pictures of one quality after another,
found by halving. Others were measured and are larger (docs/training-log.md, Textures).
"""

from __future__ import annotations

import io
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from PIL import ExifTags, Image, ImageCms, ImageOps, UnidentifiedImageError, features

from scenelang.elements.element import TEXELS, Element
from scenelang.elements.picture import painted, texels
from scenelang.elements.still import frame_of
from scenelang.fitting.mesh import FitError

MOST_OF_PICTURE: Final = dict.fromkeys((".png", ".jpg", ".jpeg"), 32 << 20)  # bytes of a file
MOST_PIXELS: Final = 50_000_000
MOST_DECODED: Final = 1_000_000_000  # pixels times the scans of a JPEG, each of which goes over all of them
NEAR_COLOUR: Final = 0.01  # root mean square off that is near enough: 40 dB
_BEST: Final = 100  # quality of AV1
_PROFILED: Final = "CMYK", "RGB", "L"  # modes whose colours a profile tells of


class Picture(NamedTuple):
    """A picture that is to be a texture.

    Args:
        colours: (h, w, 3), sRGB-encoded, 8 bits, the first row at the top.
        notes: what was found and changed.
    """

    colours: npt.NDArray[np.uint8]
    notes: tuple[str, ...] = ()


class Coded(NamedTuple):
    """A form that was tried.

    Args:
        form: what it is called.
        error: root mean square off, of channels in [0, 1].
    """

    form: str
    bytes: int
    error: float


@contextmanager
def opened(data: bytes, most: int = MOST_PIXELS) -> Iterator[Image.Image]:
    """A picture of at most so many pixels (.png, .jpg), which it says before anything is decoded.

    Raises:
        FitError: it is damaged, another kind of file or too large; also of what is done with it.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=["PNG", "JPEG"]) as found:
                if found.width * found.height > most:
                    raise FitError(f"a picture of more than {most:,} pixels")
                scans = data.count(b"\xff\xda") if found.format == "JPEG" else 1
                if found.width * found.height * scans > MOST_DECODED:
                    raise FitError(f"a picture of {scans:,} scans")
                yield found
    except (FitError, MemoryError):
        raise
    except UnidentifiedImageError:
        raise FitError("neither a PNG nor a JPEG") from None
    except Exception as error:  # readers of large formats, which a stranger's file may break in many ways
        raise FitError(f"damaged or not a picture: {error}"[:200]) from error


def read_picture(data: bytes, side: int = TEXELS) -> Picture:
    """Read a picture (.png, .jpg): turned as its EXIF says, in sRGB, laid over white, made smaller.

    Args:
        side: most texels along the longer side.
    """
    with opened(data) as file:
        notes = [f"{file.width} × {file.height} pixels"]
        image = ImageOps.exif_transpose(file)
        if file.getexif().get(ExifTags.Base.Orientation, 1) != 1:
            notes.append("turned as its EXIF says")
        if image.mode.startswith("I"):  # 16 bits of grey
            grey = np.asarray(image).astype(np.float64) / 257
            image = Image.fromarray(np.clip(grey + 0.5, 0, 255).astype(np.uint8))
            notes.append("16 bits made 8")
        elif image.has_transparency_data:
            image = image.convert("RGBA")
        cover = image.getchannel("A") if image.mode == "RGBA" else None
        plain = image if image.mode in _PROFILED else image.convert("RGB")
        plain = _profiled(plain, file.info.get("icc_profile"), notes).convert("RGB")
        if cover is not None and cover.getextrema() != (255, 255):
            plain = Image.composite(plain, Image.new("RGB", plain.size, "white"), cover)
            notes.append("laid over white")
        if (longer := max(plain.size)) > side:
            width, height = (max(1, round(length * side / longer)) for length in plain.size)
            plain = plain.resize((width, height), Image.Resampling.LANCZOS)
            notes.append(f"made {width} × {height}")
        return Picture(np.asarray(plain), tuple(notes))


def _profiled(image: Image.Image, profile: bytes | None, notes: list[str]) -> Image.Image:
    """A picture in sRGB whose colours a profile tells of."""
    if not profile:
        return image
    try:
        known = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        called = "".join(c for c in ImageCms.getProfileDescription(known).strip() if c.isprintable())[:60]
        if "srgb" in called.lower():
            return image
        found = ImageCms.profileToProfile(image, known, ImageCms.createProfile("sRGB"), outputMode="RGB")
    except (ImageCms.PyCMSError, OSError, ValueError, TypeError):
        notes.append("its colour profile cannot be read: taken as sRGB")
        return image
    notes.append(f"from the colour profile `{called}`")
    return found or image


def fit_picture(
    picture: Picture,
    name: str,
    *,
    max_error: float | None = None,
    budget_s: float = np.inf,
    steps: int | None = None,
    about: dict[str, str | float] | None = None,
    report: Callable[[Coded], None] = lambda coded: None,
) -> tuple[Element, list[Coded]]:
    """The smallest texture whose error is at most ``max_error``.

    Args:
        max_error: root mean square of channels in [0, 1]; `NEAR_COLOUR` if left out.
        budget_s: nothing further is tried after so many seconds.
        steps: how many are tried at most, whatever the time; the same number gives the same bytes.
        about: what the element says of itself, beside its figures.
        report: called with each that was tried.
    """
    started, tried, asked = time.monotonic(), [], max_error or NEAR_COLOUR
    true = picture.colours.astype(np.float32) / np.float32(255)

    def measured(element: Element, form: str) -> float:
        error = float(np.sqrt(np.square(texels(element) - true, dtype=np.float64).mean()))
        tried.append(Coded(form, len(element.data), error))
        report(tried[-1])
        return error

    best, error, ended = painted(name, picture.colours), 0.0, "near enough"
    measured(best, "without loss")
    low, high = (0, _BEST) if features.check("avif") else (1, 0)
    while low <= high:
        if len(tried) >= steps if steps is not None else time.monotonic() - started > budget_s:
            ended = "steps"
            break
        quality = (low + high) // 2
        element = _still(name, picture.colours, quality)
        if (off := measured(element, f"quality {quality}")) > asked:
            low = quality + 1
            if len(element.data) >= len(best.data):
                break
        else:
            high = quality - 1
            if len(element.data) < len(best.data):
                best, error = element, off
    said = {**(about or {}), "error": error, "steps": len(tried), "ended": ended}
    return Element(name, "picture", best.sizes, best.coding, best.data, said), tried


def _still(name: str, colours: npt.NDArray[np.uint8], quality: int) -> Element:
    """An AV1 still picture, with as many samples of colour as of light."""
    file = io.BytesIO()
    image = Image.fromarray(colours)
    image.save(file, "AVIF", quality=quality, subsampling="4:4:4", speed=6, max_threads=1)
    return Element(name, "picture", colours.shape[:2], "av1", frame_of(file.getvalue()))
