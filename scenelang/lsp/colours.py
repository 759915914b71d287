"""Colour swatches and what a picker may write."""

from __future__ import annotations

import colorsys
from typing import Final

from lsprotocol import types

from scenelang.lsp.workspace import Document
from scenelang.syntax import nodes
from scenelang.syntax.nodes import walk
from scenelang.words import OPERATIONS, SETTINGS

COLOURED: Final = ("color", "background", "light", "ground")
"""What has an argument `c` or `color`."""


def colours(document: Document) -> list[types.ColorInformation]:
    """Colours that are written out: `#hex`, `rgb(…)`, `hsv(…)` and vectors where a colour is wanted."""
    found = []
    for stmt in document.file.statements:
        wanted: set[int] = set()
        for node in walk(stmt):
            if isinstance(node, nodes.Call) and node.args and node.name.text in COLOURED:
                params = (OPERATIONS | SETTINGS)[node.name.text].params
                for arg, param in zip(node.args, params, strict=False):
                    if (arg.name.text if arg.name else param) in ("c", "color"):
                        wanted.add(id(arg.value))
            rgb = _colour(node, id(node) in wanted)
            if rgb is not None:
                place = document.lines.span(node.span)
                found.append(types.ColorInformation(place, types.Color(*rgb, 1.0)))
    found.sort(key=lambda c: (c.range.start.line, c.range.start.character))
    return found


def _colour(node: object, wanted: bool) -> tuple[float, float, float] | None:
    if isinstance(node, nodes.Color):
        return node.rgb
    if isinstance(node, nodes.Vector) and wanted:
        return _clamped([_number(item) for item in node.items])
    if isinstance(node, nodes.CallExpr) and node.name.text in ("rgb", "hsv"):
        order = ("r", "g", "b") if node.name.text == "rgb" else ("h", "s", "v")
        given: dict[str, float | None] = {}
        for index, arg in enumerate(node.args):
            if index < 3:
                name = arg.name.text if arg.name is not None else order[index]
                given[name] = _number(arg.value)
        parts = [given.get(name) for name in order]
        rgb = _clamped(parts, first_free=node.name.text == "hsv")
        if rgb is None or node.name.text == "rgb":
            return rgb
        return colorsys.hsv_to_rgb(rgb[0] % 1.0, rgb[1], rgb[2])
    return None


def _number(expr: nodes.Expr) -> float | None:
    """A literal number, an angle in turns."""
    if isinstance(expr, nodes.Unary) and expr.op == "-":
        inner = _number(expr.operand)
        return None if inner is None else -inner
    if not isinstance(expr, nodes.Number):
        return None
    per_turn = {"": 1.0, "turn": 1.0, "deg": 360.0, "rad": 6.283185307179586}
    return expr.value / per_turn[expr.unit] if expr.unit in per_turn else None


def _clamped(parts: list[float | None], first_free: bool = False) -> tuple[float, float, float] | None:
    if len(parts) != 3:
        return None
    values = []
    for index, part in enumerate(parts):
        if part is None:
            return None
        values.append(part if first_free and index == 0 else min(max(part, 0.0), 1.0))
    return values[0], values[1], values[2]


def presentations(
    document: Document, color: types.Color, place: types.Range
) -> list[types.ColorPresentation]:
    """How a picked colour may be written, the way it is written now first."""
    red, green, blue = color.red, color.green, color.blue
    bytes_ = [min(max(round(255 * x), 0), 255) for x in (red, green, blue)]
    long = "#" + "".join(f"{b:02x}" for b in bytes_)
    short = "#" + "".join(f"{b:02x}"[0] for b in bytes_) if all(b % 17 == 0 for b in bytes_) else long
    h, s, v = colorsys.rgb_to_hsv(red, green, blue)

    def listed(values: tuple[float, ...]) -> str:
        return ", ".join(f"{round(x, 3) + 0.0:g}" for x in values)

    forms = {
        "#": short,
        "rgb": f"rgb({listed((red, green, blue))})",
        "hsv": f"hsv({listed((h, s, v))})",
        "[": f"[{listed((red, green, blue))}]",
    }
    lines = document.lines
    now = document.text[lines.offset(place.start) : lines.offset(place.end)]
    order = sorted(forms, key=lambda form: not now.startswith(form))
    return [types.ColorPresentation(forms[form], types.TextEdit(place, forms[form])) for form in order]
