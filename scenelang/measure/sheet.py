"""Pictures side by side: reference, network and FLIP map, with their figures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image as pillow
from PIL import ImageDraw

from scenelang.image import Image
from scenelang.measure.metrics import Array, flip_map

GAP, TEXT = 4, 14


def side_by_side(picture: Array, reference: Array, label: str) -> Image:
    """Network, reference and FLIP map in a row, with a line of text above (H + 14, 3 W + 8, 3)."""
    parts = [
        ("network", picture),
        ("reference", reference),
        ("FLIP", flip_map(picture, reference, magma=True)),
    ]
    height, width = reference.shape[:2]
    sheet = pillow.new("RGB", (3 * width + 2 * GAP, height + TEXT), "white")
    pen = ImageDraw.Draw(sheet)
    for column, (name, part) in enumerate(parts):
        left = column * (width + GAP)
        sheet.paste(np.asarray(part, np.float32).view(Image).to_pil(), (left, TEXT))
        pen.text((left + 2, 1), f"{name} {label}" if column == 0 else name, fill="black")
    return (np.asarray(sheet, np.float32) / 255).view(Image)


def contact_sheet(rows: Sequence[Image], columns: int = 2) -> Image:
    """Put pictures of one size on a sheet, row by row."""
    height, width = rows[0].shape[:2]
    lines = -(-len(rows) // columns)
    sheet = np.ones((lines * (height + GAP), columns * (width + 3 * GAP), 3), np.float32)
    for index, row in enumerate(rows):
        top, left = index // columns * (height + GAP), index % columns * (width + 3 * GAP)
        sheet[top : top + height, left : left + width] = row
    return sheet.view(Image)
