"""Drawings (.svg) as layers, each in one colour, and pictures as outlines. Needs svgelements."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np

from scenelang.diagnostics.suggest import plural
from scenelang.elements.groups import Painted
from scenelang.fitting.mesh import FitError, needed
from scenelang.fitting.outline import Layer, Outline, traced, winding

MOST_OF_DRAWING: Final = dict.fromkeys((".svg", ".png", ".jpg", ".jpeg"), 10 << 20)  # bytes of a file
_CURVE: Final = 48  # edges of a curve
_PAINT: Final = re.compile(r"""url\(\s*['"]?#([^)'"\s]+)['"]?\s*\)[^;"}]*""")  # and what is meant without it
_OPACITY: Final = re.compile(r"(?<![-\w])opacity\s*:\s*([^;]*)")
_MOST_DRAWN: Final = 50_000  # elements of a drawing, each counted as often as it is used
_MOST_STYLE: Final = 100_000  # letters of its style sheets, which are read again for each element
_MOST_SAID: Final = 1_000_000  # letters of its paths, transforms and styles
_UNSEEN: Final = {"mask": "masks", "marker": "markers", "filter": "filters", "clipPath": "clip paths"}


def read_outline(data: bytes, suffix: str) -> Outline:
    """A drawing (.svg), or the dark or opaque part of a picture, in the bytes of a file."""
    return Outline(*(drawn(data) if suffix == ".svg" else traced(data)))


def drawn(data: bytes) -> tuple[list[Layer], tuple[str, ...]]:
    """The layers of a drawing in the order of painting, y up, and what there is to say of it.

    Gradients are their mean colours, what is not opaque is mixed with white.
    """
    with needed("svgelements"):
        import svgelements
    try:  # a reader of a large format, which a stranger's file may break in many ways
        root = ElementTree.fromstring(data)
        notes = _simplified(root, svgelements)
        simple = io.BytesIO(ElementTree.tostring(root))
        parsed = [*svgelements.SVG.parse(simple, reify=True).elements()]
        shapes = [e for e in parsed if isinstance(e, svgelements.Shape)]
        others = {type(e).__name__.lower() for e in parsed} & {"text", "image"}
        layers = [layer for shape in shapes for layer in _layers(shape, svgelements)]
    except (FitError, MemoryError):
        raise
    except Exception as error:
        raise FitError(f"damaged or not a drawing: {str(error) or type(error).__name__}"[:200]) from error
    strokes = sum(layer.inside is None for layer in layers)
    counts = f"{plural(len(layers) - strokes, 'area')}, {plural(strokes, 'stroke')}"
    return layers, (counts, *(f"{name} left out" for name in sorted(others)), *notes)


def _simplified(root: Any, svg: Any) -> list[str]:
    """Change a tree into what svgelements draws as it is meant; what is lost by that."""
    found = [(element, element.tag.rpartition("}")[2]) for element in root.iter()]
    named = {element.get("id"): element for element, _ in found}
    if sum(len(element.text or "") for element, tag in found if tag == "style") > _MOST_STYLE:
        raise FitError(f"style sheets of more than {_MOST_STYLE:,} letters")
    said = (value for element, _ in found for key, value in element.items() if not key.endswith("href"))
    if sum(map(len, said)) > _MOST_SAID:
        raise FitError(f"paths and styles of more than {_MOST_SAID:,} letters")
    if _drawn(root, named) > _MOST_DRAWN:
        raise FitError(f"a drawing of more than {_MOST_DRAWN:,} elements")
    means = {
        element.get("id"): _mean(element, named, svg) for element, tag in found if tag.endswith("Gradient")
    }
    notes = [f"{said} left out" for tag, said in _UNSEEN.items() if any(tag == t for _, t in found)]
    notes += ["gradients in their mean colours"] if means else []
    notes += ["patterns left out"] if any(tag == "pattern" for _, tag in found) else []

    def meant(match: re.Match[str]) -> str:
        return means.get(match[1], "none")

    for element, _ in found:
        for key in ("fill", "stroke", "style"):
            if key in element.attrib:
                element.set(key, _PAINT.sub(meant, element.get(key)))
        if element.text and "url(" in element.text:
            element.text = _PAINT.sub(meant, element.text)
    for element, _ in found:
        opacity = _opacity(element)
        for child in list(element):
            tag = child.tag.rpartition("}")[2]
            if tag in _UNSEEN:
                element.remove(child)
            elif tag == "symbol":  # seen where it is used
                element.remove(child)
                ElementTree.SubElement(element, child.tag.replace("symbol", "defs")).append(child)
            elif (own := opacity * _opacity(child)) < 1:
                child.set("opacity", str(own))
    if any(_opacity(element) < 1 or "opacity" in "".join(element.attrib) for element, _ in found):
        notes.append("what is not opaque mixed with white")
    return notes


def _drawn(root: Any, named: dict[str, Any]) -> int:
    """How many elements svgelements goes through, those that are used as often as they are.

    A use of itself counts as too many.
    """
    counts: dict[Any, int] = {}
    waiting = [(root, False)]
    while waiting:
        element, counted = waiting.pop()
        href = next((value for key, value in element.attrib.items() if key.endswith("href")), "")
        used = named.get(href[1:]) if element.tag.endswith("use") else None
        inner = [*element, *([] if used is None else [used])]
        if counted:
            counts[element] = 1 + sum(counts[part] or _MOST_DRAWN for part in inner)
        elif element not in counts:
            counts[element] = 0  # until all in it are
            waiting += [(element, True), *((part, False) for part in inner)]
    return counts[root]


def _opacity(element: Any) -> float:
    style = _OPACITY.search(element.get("style", ""))
    return _share(element.get("opacity") or (style[1] if style else "1"))


def _share(text: str) -> float:
    """A number from 0 to 1, which may be written in per cent; 1 of what is none."""
    try:
        number = float(text.strip().removesuffix("%")) / (100 if text.strip().endswith("%") else 1)
    except ValueError:
        return 1.0
    return min(max(number, 0.0), 1.0)


def _mean(gradient: Any, named: dict[str, Any], svg: Any) -> str:
    """The mean colour of a gradient, which may have the stops of another."""
    for _ in range(9):
        stops = [child for child in gradient if child.tag.endswith("stop")]
        href = next((value for key, value in gradient.attrib.items() if key.endswith("href")), "")
        if stops or href[1:] not in named:
            break
        gradient = named[href[1:]]
    rows = []
    for stop in stops:
        style = dict(part.split(":", 1) for part in stop.get("style", "").split(";") if ":" in part)
        given = {key.strip(): value.strip() for key, value in (stop.attrib | style).items()}
        colour = svg.Color(given.get("stop-color", "black"))
        alpha = _share(given.get("stop-opacity", "1")) * (colour.alpha or 0) / 255
        rows.append((_share(given.get("offset", "0")), colour.red, colour.green, colour.blue, alpha))
    if not rows:
        return "none"
    offsets, *channels = np.array(rows, float).T
    at = (np.arange(64) + 0.5) / 64
    red, green, blue, alpha = (np.interp(at, offsets, channel) for channel in channels)
    weight = alpha / max(alpha.sum(), 1e-9)
    shown = [round((channel * weight).sum()) for channel in (red, green, blue)]
    return "#" + bytes([*shown, round(255 * alpha.mean())]).hex()


def _seen(paint: Any, shape: Any) -> Painted | None:
    """The colour of a paint on white; None of one that is not seen."""
    if paint is None or paint.value is None:
        return None
    alpha = paint.alpha / 255 * _share(str(shape.values.get("opacity", "1")))
    if alpha == 0:
        return None
    red, green, blue = (
        round(1 - alpha * (1 - channel / 255), 4) for channel in (paint.red, paint.green, paint.blue)
    )
    return red, green, blue


def _layers(shape: Any, svg: Any) -> Iterator[Layer]:
    """What a shape of a drawing paints, y up."""
    open_edges, closing = [], []
    for part in svg.Path(shape).as_subpaths():
        points = [at for segment in svg.Path(part) for at in _ends(segment, svg)]
        if len(points) > 1:
            line = np.array(points) * (1.0, -1.0)
            open_edges.append(np.stack([line[:-1], line[1:]], 1))
            closing.append(np.stack([line[-1:], line[:1]], 1))
    if not open_edges:
        return
    edges, closed = np.concatenate(open_edges), np.concatenate([*open_edges, *closing])
    if shape.values.get("visibility") in ("hidden", "collapse"):
        return
    if (color := _seen(shape.fill, shape)) is not None:
        odd = shape.values.get("fill-rule") == "evenodd"
        yield Layer(closed, winding(closed, odd), color=color)
    width = float(shape.stroke_width or 0.0)
    if (color := _seen(shape.stroke, shape)) is not None and width > 0:
        yield Layer(edges, None, width / 2, color)


def _ends(segment: Any, svg: Any) -> list[tuple[float, float]]:
    """Points of a segment, its last one among them."""
    if segment.end is None:
        return []
    if isinstance(segment, svg.Move | svg.Line | svg.Close):
        return [(segment.end.x, segment.end.y)]
    found = [segment.point(at) for at in np.linspace(0, 1, _CURVE + 1)[1:]]
    return [(point.x, point.y) for point in found]
