"""A Scene as Python code that makes an equal Scene, laid out as Black and Ruff lay code out."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from typing import Any, Final

from scenelang.deep import deep_stack
from scenelang.records import Record
from scenelang.scene.fields import Frozen, Rgb
from scenelang.scene.modifiers import MaterialOp, Transform
from scenelang.scene.nodes import SceneData
from scenelang.scene.text import degrees, hex_colour, number, numbers
from scenelang.words import OPERATIONS, TRANSFORMS

_WIDTH: Final = 88
_INDENT: Final = "    "
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
    inner = margin + _INDENT
    together = ", ".join(map(_flat, code.parts))
    if not code.is_tuple and len(inner) + len(together) <= _WIDTH:
        return f"{code.head}(\n{inner}{together}\n{margin})"
    lines = [f"{inner}{_laid_out(part, len(inner), inner)},\n" for part in code.parts]
    return f"{code.head}(\n{''.join(lines)}{margin})"
