"""Image metrics between a picture and its reference, PSNR, SSIM and FLIP, and sheets that show both.

All take float arrays (H, W, 3) of sRGB-encoded values in [0, 1].
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image as pillow
from PIL import ImageDraw

from scenelang.drawing.image import Image

Array = npt.NDArray[Any]
MOST_DB = 50.0
UNCAPPED_DB = 100.0  # what no picture in single precision reaches
GAP, TEXT = 4, 14  # pixels of a sheet, between pictures and for a line of text
WIDE = 128  # pixels across from which on a picture's name and its figures stand on one line


def over_white(picture: Array) -> Array:
    """Colours (H, W, 3), float64, of a picture that may have alpha."""
    values = np.asarray(picture, np.float64)
    if values.shape[2] == 3:
        return values
    return np.asarray(values[..., :3] * values[..., 3:] + 1 - values[..., 3:])


def psnr(picture: Array, reference: Array, most: float = MOST_DB) -> float:
    """Peak signal-to-noise ratio in dB, at most ``most``, so that a perfect picture counts for something."""
    error = float(np.mean((np.asarray(picture, np.float64) - np.asarray(reference, np.float64)) ** 2))
    return most if error <= 0 else min(most, -10 * math.log10(error))


def ssim(picture: Array, reference: Array) -> float:
    """Structural similarity (Wang et al. 2004) in [-1, 1]; a Gaussian window of 11 pixels, less if small."""
    import torch
    from pytorch_msssim import ssim as torch_ssim

    window = min(11, *((side - 1) // 2 * 2 + 1 for side in reference.shape[:2]))
    a, b = (
        torch.from_numpy(np.ascontiguousarray(np.moveaxis(np.asarray(v, np.float32), 2, 0)))[None]
        for v in (picture, reference)
    )
    return float(torch_ssim(a, b, data_range=1.0, win_size=window))


def flip_map(picture: Array, reference: Array, *, magma: bool = False) -> npt.NDArray[np.float32]:
    """FLIP error of each pixel, LDR: (H, W) in [0, 1], or (H, W, 3) in the tool's colours, dark for 0.

    Source: Andersson et al., FLIP: A Difference Evaluator for Alternating Images, 2020 (their tool).
    """
    import flip_evaluator

    a, b = (np.ascontiguousarray(v, np.float32) for v in (reference, picture))
    error = np.asarray(flip_evaluator.evaluate(a, b, "LDR", applyMagma=magma)[0], np.float32)
    return error if magma else error[:, :, 0]


def flip(picture: Array, reference: Array) -> float:
    """Mean FLIP error in [0, 1], 0 for equal pictures."""
    return float(flip_map(picture, reference).mean())


def compare(picture: Array, reference: Array) -> dict[str, float]:
    """Similarity of two pictures: PSNR in dB (at most `MOST_DB`), SSIM and FLIP by name.

    Args:
        picture: float (H, W, 3) or, with straight alpha, (H, W, 4), sRGB-encoded in [0, 1]; alpha is put over
            white first.
        reference: the like, of the same size.

    Raises:
        ValueError: they differ in size.
        ImportError: the packages of the extra ``eval`` are not installed.
    """
    a, b = over_white(picture), over_white(reference)
    if a.shape != b.shape:
        sizes = [f"{v.shape[1]} × {v.shape[0]}" for v in (a, b)]
        raise ValueError(f"pictures of {sizes[0]} and {sizes[1]} pixels")
    return {"psnr": psnr(a, b), "ssim": ssim(a, b), "flip": flip(a, b)}


def side_by_side(picture: Array, reference: Array, label: str, *, plain: bool = False) -> Image:
    """Network, reference and FLIP map in a row, with a line of text above (H + 14, 3 W + 8, 3), or two lines.

    Of pictures narrower than their captions the columns stand apart by these, and the sheet holds the label.
    If ``plain``, eight times how far each channel is off in place of the map, which needs the extra ``eval``.
    """
    far = ("8 × difference", np.clip(8 * np.abs(picture - reference), 0, 1)) if plain else None
    parts = [
        ("network", picture),
        ("reference", reference),
        far or ("FLIP", flip_map(picture, reference, magma=True)),
    ]
    height, width = reference.shape[:2]
    top = TEXT if width >= WIDE else 2 * TEXT
    wide = ImageDraw.Draw(pillow.new("RGB", (1, 1))).textlength
    step = GAP + max(width, *(2 + math.ceil(wide(name)) for name, _ in parts))
    sheet = pillow.new("RGB", (max(3 * step - GAP, 4 + math.ceil(wide(label))), top + height), "white")
    pen = ImageDraw.Draw(sheet)
    pen.text((2, 1), f"network {label}" if top == TEXT else label, fill="black")
    for column, (name, part) in enumerate(parts):
        left = column * step
        sheet.paste(np.asarray(part, np.float32).view(Image).to_pil(), (left, top))
        if column or top > TEXT:
            pen.text((left + 2, 1 + top - TEXT), name, fill="black")
    return (np.asarray(sheet, np.float32) / 255).view(Image)
