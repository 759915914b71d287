"""The frontier as one HTML file: a chart, a table and, by JavaScript, each point's pictures and command."""

from __future__ import annotations

import base64
import html
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from lab.frontier.chart import LINEAR, base_of, mark_of, short_name
from lab.frontier.record import Frontier, Point
from scenelang.drawing.image import Image

_PAGE: Final = Path(__file__).with_name("page.html")
_LARGE: Final = 24_000
"""Bytes above which a picture is noise, which PNG does not compress."""


def frontier_page(frontier: Frontier, pictures: Mapping[str, Sequence[Image]], exact: Sequence[Image]) -> str:
    """The page's text, with pictures of the same scenes by every point's name, and the exact ones."""
    points = [_facts(p, base_of(frontier), pictures.get(p.name, ())) for p in frontier.points]
    width, height = frontier.canvas
    cores = "one core" if frontier.threads == 1 else f"{frontier.threads} cores"
    data = {
        "points": points,
        "exact": [picture_uri(image) for image in exact],
        "streaming_ms": frontier.streaming_ms,
        "canvas": [width, height],
        "linear": LINEAR,
    }
    about = (
        f"{frontier.scenes} scenes of the set {frontier.set} (seed {frontier.seed}), {width} × {height} "
        f"pixels, {cores} of {frontier.machine}; torch {frontier.torch}, revision {frontier.revision[:10]}. "
        "All ways drew each scene in turn, in one run. Times are medians of warm frames"
        + (", in processor time." if frontier.clock == "processor" else ".")
    )
    page = _PAGE.read_text("utf-8")
    for name, text in (
        ("SET", html.escape(frontier.set)),
        ("BASE", html.escape(base_of(frontier))),
        ("ABOUT", html.escape(about)),
        ("ROWS", "\n".join(map(_row, range(len(points)), frontier.points))),
        # last, as it may hold anything; `<` cannot end the element it stands in
        ("DATA", json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")),
    ):
        page = page.replace(f"{{{{{name}}}}}", text)
    return page


def _facts(point: Point, base: str, images: Sequence[Image]) -> dict[str, Any]:
    return {
        **asdict(point),
        "name": point.title,
        "label": short_name(point, base),
        "mark": mark_of(point),
        "pictures": [picture_uri(image) for image in images],
    }


def picture_uri(image: Image) -> str:
    """A picture as a ``data:`` URI: PNG, or WebP of high quality where it is noise."""
    pillow = image.to_pil()
    data = io.BytesIO()
    pillow.save(data, "PNG", optimize=True)
    kind = "png"
    if data.tell() > _LARGE:
        data = io.BytesIO()
        pillow.save(data, "WEBP", quality=92)
        kind = "webp"
    return f"data:image/{kind};base64,{base64.b64encode(data.getvalue()).decode('ascii')}"


def _row(index: int, point: Point) -> str:
    """A row of the table; the first cell holds the button that shows the point."""
    flip, psnr = point.flip, point.psnr
    ratio = f"{point.ratio_to_streaming:.3g}×" if point.ratio_to_streaming else ""
    cells = [
        f"{point.ms.median:.3g}",
        ratio,
        "" if flip is None else f"{flip.mean:.2g}",
        "" if flip is None else f"{flip.bound:.2g}",
        "" if psnr is None else f"{psnr.mean:.1f}",
        f"{point.parameters:,}" if point.parameters else "",
        "yes" if point.on_front else "",
        html.escape(point.why_not or ""),
    ]
    tds = "".join(f"<td>{cell}</td>" for cell in cells)
    name = html.escape(point.title)
    button = f'<button type="button" data-point="{index}">{name}</button>'
    return f'<tr data-row="{index}"><th scope="row">{button}</th>{tds}</tr>'
