"""Nodes of a Scene as canonical text that evaluates back to equal ones."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

from scenelang.language.nodes import (
    LATER,
    Boolean,
    Glow,
    Link,
    Material,
    MaterialOp,
    Object,
    Rgb,
    SceneNode,
    Transform,
)
from scenelang.language.words import PROPERTIES

_Line = str | tuple[str, SceneNode, int]
_INDENT: Final = "  "
_AXES: Final = {"[1, 0, 0]": "X", "[0, 1, 0]": "Y"}


def node_lines(nodes: Iterable[SceneNode]) -> list[str]:
    """Lines of nodes in order, which nest deeper than Python likes to recurse."""
    lines: list[str] = []
    todo: list[_Line] = [("", node, 0) for node in reversed([*nodes])]
    while todo:
        entry = todo.pop()
        if isinstance(entry, str):
            lines.append(entry)
        else:
            todo.extend(reversed(_node(*entry)))
    return lines


def blend(op: str, k: float | None) -> str:
    """A word that joins, with its width where one is written."""
    return op if k is None else f"{op}(k = {number(k)})"


def _node(word: str, node: SceneNode, depth: int) -> list[_Line]:
    """The lines of one node, with its children still to be printed."""
    margin = _INDENT * depth
    inside = margin + _INDENT
    head = node.geometry if isinstance(node, Object) else node.kind
    if isinstance(node, Object) and node.points:
        head += f"([{', '.join(map(vector, node.points))}])"
    if isinstance(node, Boolean):
        head = blend(node.op, node.k)
    statements = [material(node.material)] if node.material is not None else []
    statements += [transform(t) for t in node.transforms]
    if isinstance(node, Object):
        return [f"{margin}{word}{head} {{ {' '.join(statements)} }}"]  # the formatter makes `{}` of `{  }`
    parts: list[_Line] = [f"{margin}{word}{head} {{"]
    for child in node.children:
        op = blend(child.op, child.k) if isinstance(child, Link) else "union"
        inner = child.node if isinstance(child, Link) else child
        parts.append(("" if op == "union" else f"{op} ", inner, depth + 1))
    parts.extend([inside + statement for statement in statements])
    parts.append(margin + "}")
    return parts


def number(value: float) -> str:
    """The shortest text that reads back as the same float64."""
    if value.is_integer() and abs(value) < 1e15 and not (value == 0.0 and math.copysign(1.0, value) < 0):
        return str(int(value))
    return repr(value)


def angle(rad: float) -> str:
    """An angle in degrees where few digits say it exactly, else in radians."""
    if number(rad) == "0":
        return "0"
    degrees = round(math.degrees(rad), 9)
    return f"{number(degrees)}deg" if math.radians(degrees) == rad else f"{number(rad)}rad"


def rgb(color: Rgb) -> str:
    """A colour as ``#rrggbb`` where that is exact, else as a vector."""
    return hex_colour(color) or vector(color)


def hex_colour(color: Rgb) -> str | None:
    """``#rrggbb`` where it is exactly the colour."""
    levels = [round(c * 255) if 0.0 <= c <= 1.0 and number(c) != "-0.0" else -1 for c in color]
    if all(level >= 0 and level / 255 == c for level, c in zip(levels, color, strict=True)):
        return "#" + "".join(f"{level:02x}" for level in levels)
    return None


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(map(number, values))


def vector(values: Iterable[float]) -> str:
    return f"[{_numbers(values)}]"


def material(value: Material) -> str:
    """A material statement."""
    ops = " ".join(map(transform, value.ops))
    for name in PROPERTIES:
        if (given := getattr(value, name)) != LATER[name]:
            glow = isinstance(given, Glow)
            ops += f" {name}({f'{rgb(given.color)}, {number(given.power)}' if glow else number(given)});"
    name = value.name if value.shading is None else f"{value.shading} {value.name}"
    return f"material {name} {{ {ops} }}" if ops else f"material {name};"


def transform(t: Transform | MaterialOp) -> str:
    """A transform, or a statement in a material's block."""
    match t.kind:
        case "rotate":
            axis = vector(t.axis)
            about = "" if axis == "[0, 0, 1]" else f", axis = {_AXES.get(axis, axis)}"
            given = angle(t.angle) + about
        case "translate":
            given = _numbers((t.x, t.y) if number(t.z) == "0" else (t.x, t.y, t.z))
        case "scale" if t.x == t.y == t.z:
            given = number(t.x)
        case "scale":
            given = _numbers((t.x, t.y) if t.z == 1.0 else (t.x, t.y, t.z))
        case "shear":
            given = f"{t.axes} = {number(t.k)}"
        case "matrix":
            given = f"[{', '.join(map(vector, t.rows))}]"
        case "color":
            given = rgb(t.rgb)
        case "stop":
            given = f"{number(t.offset)}, {rgb(t.rgb)}"
        case "hue":
            given = angle(t.angle)
        case _:
            given = _numbers(value for name, value in t if name != "kind")
    return f"{t.kind}({given});"
