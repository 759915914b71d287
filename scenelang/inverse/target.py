"""Targets: pictures that a scene is to look like, in the sizes in which it is drawn on the way there."""

from __future__ import annotations

import math
import os
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from PIL import Image as pillow
from PIL import ImageOps

from scenelang.files import read_regular
from scenelang.fitting.mesh import FitError
from scenelang.fitting.picture import opened
from scenelang.image import decoded, encoded
from scenelang.records import Record

Picture = npt.NDArray[np.float64]
Given = npt.NDArray[np.floating] | str | os.PathLike[str]
"""A picture as callers have it."""
MOST_BYTES: Final = 64 << 20
_ASPECT: Final = 0.02  # by which shares of sides may differ before a picture is another part of the world
WHITE: Final = (1.0, 1.0, 1.0)


class Target(Record):
    """What pictures are compared with.

    Args:
        colours: (H, W, 3), sRGB-encoded in [0, 1], laid over ``under`` where it was transparent.
        weights: (H, W), in [0, 1]: how much a pixel counts.
        under: the colour behind what is transparent, of the target and of the scene.
    """

    colours: Picture
    weights: Picture
    under: tuple[float, float, float] = WHITE

    def sized(self, canvas: tuple[int, int], light: bool) -> tuple[Picture, Picture]:
        """Colours and weights on a canvas; ``light`` has the means of linear light, as solids' pixels are."""
        colours = decoded(self.colours) if light else self.colours
        channels = [_resized(channel, canvas) for channel in np.moveaxis(colours, 2, 0)]
        found = np.stack(channels, 2)
        return encoded(found) if light else found, _resized(self.weights, canvas)


def _resized(channel: Picture, canvas: tuple[int, int]) -> Picture:
    """Means over areas where it becomes smaller, linear between pixels where it becomes larger."""
    smaller = canvas[0] <= channel.shape[1]
    how = pillow.Resampling.BOX if smaller else pillow.Resampling.BILINEAR
    image = pillow.fromarray(np.ascontiguousarray(channel, np.float32))
    return np.asarray(image.resize(canvas, how), np.float64)


def over(picture: npt.NDArray[np.floating], under: tuple[float, float, float]) -> Picture:
    """Colours (H, W, 3) of a picture that may have straight alpha."""
    values = np.asarray(picture, np.float64)
    if values.shape[2] == 3:
        return values
    return np.asarray(values[..., :3] * values[..., 3:] + np.array(under) * (1 - values[..., 3:]))


class Blur(NamedTuple):
    """How a picture is blurred.

    Args:
        sigma: standard deviation of a Gaussian, pixels; 0 where it is not.
        light: whether its light is, as by a lens out of focus, or its sRGB-encoded numbers, as by a program.
    """

    sigma: float = 0.0
    light: bool = True


def blurred(picture: Picture, blur: Blur, finer: int = 1) -> Picture:
    """A picture (H, W, 3) after a blur; beyond its edges it is as there.

    Args:
        picture: of ``finer`` times as many pixels along each side, of which means are taken.
    """
    sigma = blur.sigma * finer
    if sigma <= 0.0 and finer == 1:
        return picture
    found, reach = decoded(picture) if blur.light else picture, math.ceil(3 * sigma)
    weights = np.exp(-np.square(np.arange(-reach, reach + 1) / max(sigma, 1e-9)) / 2)
    for axis in (0, 1):
        wide = np.pad(found, [(reach * (at == axis),) * 2 for at in range(3)], mode="edge")
        views = np.lib.stride_tricks.sliding_window_view(wide, len(weights), axis)
        found = np.asarray(views @ (weights / weights.sum()))
    height, width = found.shape[0] // finer, found.shape[1] // finer
    found = found.reshape(height, finer, width, finer, 3).mean((1, 3))
    return encoded(found) if blur.light else found


def target_of(
    picture: Given,
    canvas: tuple[int, int],
    *,
    mask: Given | None = None,
    crop: tuple[int, int, int, int] | None = None,
    under: tuple[float, float, float] = WHITE,
) -> Target:
    """A target for scenes of a canvas.

    Args:
        picture: a file (.png, .jpg), or an array (H, W, 3 or 4) of sRGB-encoded values in [0, 1].
        canvas: width and height of the scene, whose aspect the picture needs.
        mask: of the picture's size, brighter where pixels count for more; in its darkness they do not count.
        crop: x, y, width and height of the part that shows the scene, pixels of the picture.
        under: the colour behind what is transparent.

    Raises:
        FitError: a file is damaged, or the sizes do not fit.
        OSError: a file cannot be read.
    """
    found = over(_read(picture), under)
    weights = np.ones(found.shape[:2]) if mask is None else over(_read(mask), (0.0, 0.0, 0.0)).mean(2)
    if weights.shape != found.shape[:2]:
        sizes = [f"{part.shape[1]} × {part.shape[0]}" for part in (weights, found)]
        raise FitError(f"a mask of {sizes[0]} pixels for a target of {sizes[1]}")
    if crop is not None:
        x, y, wide, high = crop
        if x + wide > found.shape[1] or y + high > found.shape[0]:
            raise FitError(f"a part that leaves the target of {found.shape[1]} × {found.shape[0]} pixels")
        found, weights = found[y : y + high, x : x + wide], weights[y : y + high, x : x + wide]
    height, width = weights.shape
    if abs(width * canvas[1] / (height * canvas[0]) - 1) > _ASPECT:
        fact = f"a target of {width} × {height} pixels for a canvas of {canvas[0]} × {canvas[1]}"
        raise FitError(f"{fact}: say which part of it shows the scene, or give the scene another canvas")
    if not weights.any():
        raise FitError("a mask in which no pixel counts")
    return Target(found, weights, under)


def _read(picture: Given) -> npt.NDArray[np.floating]:
    if isinstance(picture, str | os.PathLike):
        data = read_regular(picture, MOST_BYTES)
        try:
            if len(data) > MOST_BYTES:
                raise FitError(f"a file of more than {MOST_BYTES >> 20} MiB")
            with opened(data) as file:
                kind = "RGBA" if file.has_transparency_data else "RGB"
                values = ImageOps.exif_transpose(file).convert(kind)
                return np.asarray(values, np.float64) / 255
        except FitError as error:
            raise FitError(f"{os.fspath(picture)}: {error}") from None
    if picture.ndim != 3 or picture.shape[2] not in (3, 4):
        raise FitError(f"a picture of shape {picture.shape}, not (height, width, 3 or 4)")
    return picture
