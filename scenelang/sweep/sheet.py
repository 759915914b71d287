"""A contact sheet: the pictures of a sweep, small, in one."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from PIL import Image as pillow
from PIL import ImageDraw, ImageFont

from scenelang.files import write_output
from scenelang.image import image_format
from scenelang.sweep.table import Line

MOST_SIDE: Final = 4096  # pixels of a sheet
MOST_CELLS: Final = 1024
_CELL, _LEAST, _GAP, _TEXT = 160, 24, 4, 13
_WORTH: Final = 64  # pixels across from which on a picture is labelled


def write_sheet(
    path: Path, folder: Path, names: Sequence[str], lines: Sequence[Line], across: int = 0
) -> int:
    """Draw the pictures of ``lines`` in rows, over white, labelled where there is room; returns how many.

    Of more than `MOST_CELLS` as many are taken, evenly.

    Args:
        path: the sheet.
        folder: of the pictures.
        across: pictures in a row; by default as many as make a square.

    Raises:
        OSError: a picture cannot be read, or the sheet be written.
    """
    every = math.ceil(len(lines) / MOST_CELLS)
    lines = lines[::every]
    first = next((line.picture for line in lines if line.digest), None)
    width, height = (1, 1) if first is None else _size(folder / first)
    fits = across if every == 1 and 0 < across <= 64 else 0
    columns = min(len(lines), fits or max(1, round(math.sqrt(len(lines) * height / width))))
    rows = math.ceil(len(lines) / columns)
    room = min(MOST_SIDE // columns, MOST_SIDE // rows) - _GAP
    cell = max(1, min(_CELL, room - _TEXT * (room > _WORTH + _TEXT)))
    scale = cell / max(width, height)
    size = max(1, round(width * scale)), max(1, round(height * scale))
    below = _TEXT + 2 if size[0] >= _WORTH else 0
    step = size[0] + _GAP, size[1] + _GAP + below
    sheet = pillow.new("RGB", (columns * step[0] + _GAP, rows * step[1] + _GAP), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(_TEXT - 2)
    for at, line in enumerate(lines):
        x, y = _GAP + at % columns * step[0], _GAP + at // columns * step[1]
        if line.digest:
            sheet.paste(_small(folder / line.picture, size), (x, y))
        else:
            draw.rectangle((x, y, x + size[0] - 1, y + size[1] - 1), "#eeeeee")
            draw.text((x + 3, y + 2), line.error[:5], "#aa2222", font)
        if below:
            label = ", ".join(
                f"{name} {value}" for name, value in zip(names, line.values, strict=True) if value
            )
            draw.text((x, y + size[1]), _cut(label, size[0], font), "#444444", font)
    made = io.BytesIO()
    sheet.save(made, image_format(path))
    write_output(path, made.getvalue())
    return len(lines)


def _size(file: Path) -> tuple[int, int]:
    with pillow.open(file) as image:
        return image.size


def _small(file: Path, size: tuple[int, int]) -> pillow.Image:
    with pillow.open(file) as image:
        image.draft("RGB", size)
        shown = image.convert("RGBA").resize(size, pillow.Resampling.LANCZOS)
    return pillow.alpha_composite(pillow.new("RGBA", size, "white"), shown).convert("RGB")


def _cut(text: str, width: int, font: ImageFont.FreeTypeFont | ImageFont.ImageFont) -> str:
    while text and font.getlength(text) > width:
        text = text[:-2] + "…" if len(text) > 2 else ""
    return text
