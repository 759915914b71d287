"""A Scene as canonical text that evaluates back to an equal Scene, and as Python code that makes one.

The code is laid out as Black and Ruff lay code out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from typing import Any, Final

from scenelang.deep import deep_stack
from scenelang.diagnostics.error import SceneError
from scenelang.formatting import format_text
from scenelang.records import Record
from scenelang.scene.data import SceneData
from scenelang.scene.elements import Elements
from scenelang.scene.fields import Frozen, Rgb
from scenelang.scene.modifiers import MaterialOp, Transform
from scenelang.scene.nodes import Boolean, Link, Material, Object, SceneNode
from scenelang.words import OPERATIONS, STAGE, TRANSFORMS

_Line = str | tuple[str, SceneNode, int]
_INDENT: Final = "  "
_AXES: Final = {"[1, 0, 0]": "X", "[0, 1, 0]": "Y"}


def to_nsg(scene: SceneData, notes: Mapping[int, str] | None = None) -> str:
    """The text of ``scene``: settings that differ from the defaults, then its nodes in order.

    Args:
        notes: comments to put before nodes, a line each, by the nodes' `id`.
    """
    lines = ["nsg 1;"]
    if scene.model is not None:
        lines.append(f'model "{scene.model}";')
    lines += [f'import "{file.path}" as {file.name};' for file in scene.elements]
    if scene.canvas != (256, 256):
        lines.append(f"canvas({scene.canvas[0]}, {scene.canvas[1]});")
    if scene.background is None:
        lines.append("background(none);")
    elif scene.background != "default":
        lines.append(f"background({rgb(scene.background)});")
    lines += [f"{word}({given});" for word, given in _stage(scene)]
    if scene.animation is not None:
        loop = "" if scene.animation.loop else ", loop = false"
        lines.append(f"animate({number(scene.animation.seconds)}s, {number(scene.animation.fps)}{loop});")
    # Nodes nest deeper than Python likes to recurse: a stack of lines and nodes still to print.
    todo: list[_Line] = [("", node, 0) for node in reversed(scene.nodes)]
    while todo:
        entry = todo.pop()
        if isinstance(entry, str):
            lines.append(entry)
        else:
            word, node, depth = entry
            if notes and id(node) in notes:
                lines.append(f"{_INDENT * depth}// {notes[id(node)]}")
            todo.extend(reversed(_node(word, node, depth)))
    text = "\n".join(lines) + "\n"
    try:
        return format_text(text)
    except SceneError:  # nested deeper than text may be: to be looked at, not to be read back
        return text


def _stage(scene: SceneData) -> Iterator[tuple[str, str]]:
    """The settings of the stage, each with what differs from its defaults."""
    for word in STAGE:
        value = getattr(scene, word)
        if value is None:
            yield word, "none"
        elif value != "default":
            given = ((name, item) for name, item in value.__repr_args__())
            yield word, ", ".join(f"{name} = {_field(name, item)}" for name, item in given)


def _field(name: str | None, value: Any) -> str:
    """A value of the stage."""
    if name == "color":
        return rgb(value)
    if isinstance(value, tuple):
        return _vector(value)
    return angle(value) if name == "fov" else number(value)


def blend(op: str, k: float | None) -> str:
    """A word that joins, with its width where one is written."""
    return op if k is None else f"{op}(k = {number(k)})"


def _node(word: str, node: SceneNode, depth: int) -> list[_Line]:
    """The lines of one node, with its children still to be printed."""
    margin = _INDENT * depth
    inside = margin + _INDENT
    head = node.geometry if isinstance(node, Object) else node.kind
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
    exact = degrees(rad)
    return f"{number(rad)}rad" if exact is None else f"{number(exact)}deg"


def degrees(rad: float) -> float | None:
    """The angle in degrees, of few digits, that is exactly so many radians; None where there is none."""
    rounded = round(math.degrees(rad), 9)
    return rounded if math.radians(rounded) == rad else None


def rgb(color: Rgb) -> str:
    """A colour as ``#rrggbb`` where that is exact, else as a vector."""
    return hex_colour(color) or _vector(color)


def hex_colour(color: Rgb) -> str | None:
    """``#rrggbb`` where it is exactly the colour."""
    levels = [round(c * 255) if 0.0 <= c <= 1.0 and number(c) != "-0.0" else -1 for c in color]
    if all(level >= 0 and level / 255 == c for level, c in zip(levels, color, strict=True)):
        return "#" + "".join(f"{level:02x}" for level in levels)
    return None


def _vector(values: tuple[float, ...]) -> str:
    return f"[{', '.join(map(number, values))}]"


def material(value: Material) -> str:
    """A material statement."""
    ops = " ".join(map(transform, value.ops))
    name = value.name if value.shading is None else f"{value.shading} {value.name}"
    return f"material {name} {{ {ops} }}" if ops else f"material {name};"


def numbers(step: Transform | MaterialOp) -> list[float]:
    """The numbers that a transform or an operation is called with, in both languages."""
    match step.kind:
        case "translate":
            return [step.x, step.y, *([step.z] if number(step.z) != "0" else [])]
        case "scale":
            even = step.x == step.y == step.z
            return [step.x] if even else [step.x, step.y, *([step.z] if step.z != 1.0 else [])]
        case _:
            return [value for name, value in step if name != "kind"]


def transform(t: Transform | MaterialOp) -> str:
    """A transform, or a statement in a material's block."""
    match t.kind:
        case "rotate":
            axis = _vector(t.axis)
            about = "" if axis == "[0, 0, 1]" else f", axis = {_AXES.get(axis, axis)}"
            given = angle(t.angle) + about
        case "shear":
            given = f"{t.axes} = {number(t.k)}"
        case "matrix":
            given = f"[{', '.join(map(_vector, t.rows))}]"
        case "color":
            given = rgb(t.rgb)
        case "hue":
            given = angle(t.angle)
        case _:
            given = ", ".join(map(number, numbers(t)))
    return f"{t.kind}({given});"


_WIDTH: Final = 88  # of lines of Python
_DEEPEST: Final = 10
"""Nodes within nodes of one expression; Python itself takes no more than 200 brackets."""
_UNNAMED: Final = ("geometry", "name")
"""Arguments that go without their names."""
_STEPS: Final = {*TRANSFORMS, *OPERATIONS}


class _Call(Record):
    """Brackets with something before them and something in them: a call, or a tuple."""

    head: str
    parts: tuple[_Code, ...]
    is_tuple: bool = False


_Code = str | _Call


def to_python(scene: SceneData) -> str:
    """The code of ``scene``: the import, parts that nest too deep, and ``scene = nsg.Scene(…)``."""
    with deep_stack():
        made = _Maker()
        whole, _ = made.code("", scene)
        lines = ["import scenelang as nsg", ""]
        for name, code in [*made.parts, ("scene", whole)]:
            lines.append(f"{name} = {_laid_out(code, len(name) + 3, '')}")
        return "\n".join(lines) + "\n"


class _Maker(Record, frozen=False):
    """Makes code of a Scene; what nests too deep becomes a variable of its own in ``parts``."""

    parts: list[tuple[str, _Code]] = field(default_factory=list)

    def code(self, head: str, value: Any) -> tuple[_Code, int]:
        """The code of a value, with something before it, and how deep nodes nest in it."""
        if isinstance(value, tuple):
            items = [self.code("", item) for item in value]
            return _tuple(head, [code for code, _ in items]), max([height for _, height in items], default=0)
        if getattr(value, "kind", "") in _STEPS:
            return _step(value), 0
        if not isinstance(value, Frozen):
            plain = f'"{value}"' if isinstance(value, str) else value
            return f"{head}{number(value) if isinstance(value, float) else plain}", 0
        if isinstance(value, Elements):
            given = (f'"{value.path}"', f'name="{value.name}"')
            return _Call(f"{head}nsg.load_elements", given), 0
        parts, height, name = [], 0, f"nsg.{type(value).__name__}"
        for key, item in value.__repr_args__():
            code, inner = self.code("" if key in _UNNAMED else f"{key}=", item)
            parts.append(code)
            height = max(height, inner + (key == "children"))
        if height < _DEEPEST:
            return _Call(f"{head}{name}", tuple(parts)), height
        variable = f"part_{len(self.parts) + 1}"
        self.parts.append((variable, _Call(name, tuple(parts))))
        return f"{head}{variable}", 0


def _step(step: Transform | MaterialOp) -> _Code:
    """A transform or a texture operation."""
    parts: list[_Code]
    head = ""
    match step.kind:
        case "rotate":
            exact = degrees(step.angle)
            head = "" if exact is None else ".degrees"
            parts = [f"angle={number(step.angle)}" if exact is None else number(exact)]
            if repr(step.axis) != "(0.0, 0.0, 1.0)":
                parts.append(_numbers("axis=", step.axis))
        case "shear":
            parts = [f'"{step.axes}"', number(step.k)]
        case "matrix":
            parts = [_tuple("", [_numbers("", row) for row in step.rows])]
        case "color":
            written = hex_colour(step.rgb)
            parts = [_numbers("", step.rgb) if written is None else f'"{written}"']
        case "hue":
            parts = [f"angle={number(step.angle)}"]
        case _:
            parts = [*map(number, numbers(step))]
    return _Call(f"nsg.{type(step).__name__}{head}", tuple(parts))


def _numbers(head: str, values: Rgb | Iterable[float]) -> _Call:
    return _tuple(head, map(number, values))


def _tuple(head: str, parts: Iterable[_Code]) -> _Call:
    return _Call(head, tuple(parts), True)


def _flat(code: _Code) -> str:
    if isinstance(code, str):
        return code
    comma = "," if code.is_tuple and len(code.parts) == 1 else ""
    return f"{code.head}({', '.join(map(_flat, code.parts))}{comma})"


def _laid_out(code: _Code, used: int, margin: str) -> str:
    """Code that fits into the width; ``used`` columns of its first line are taken, one after it too."""
    flat = _flat(code)
    if isinstance(code, str) or used + len(flat) < _WIDTH:
        return flat
    inner = margin + 2 * _INDENT
    together = ", ".join(map(_flat, code.parts))
    if not code.is_tuple and len(inner) + len(together) <= _WIDTH:
        return f"{code.head}(\n{inner}{together}\n{margin})"
    lines = [f"{inner}{_laid_out(part, len(inner), inner)},\n" for part in code.parts]
    return f"{code.head}(\n{''.join(lines)}{margin})"
