"""A Scene as Python code that makes an equal Scene, laid out as Black and Ruff lay code out."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from typing import Final

from scenelang.deep import deep_stack
from scenelang.records import Record
from scenelang.scene.fields import Rgb
from scenelang.scene.modifiers import MaterialOp, Transform
from scenelang.scene.nodes import Link, Object, SceneData, SceneNode
from scenelang.scene.text import degrees, hex_colour, number, numbers
from scenelang.words import BLEND, STAGE

_WIDTH: Final = 88
_INDENT: Final = "    "
_DEEPEST: Final = 10
"""Nodes within nodes of one expression; Python itself takes no more than 200 brackets."""


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
        whole = _Call("nsg.Scene", tuple(made.settings(scene)))
        lines = ["import scenelang as nsg", ""]
        for name, code in [*made.parts, ("scene", whole)]:
            lines.append(f"{name} = {_laid_out(code, len(name) + 3, '')}")
        return "\n".join(lines) + "\n"


class _Maker(Record, frozen=False):
    """Makes code of nodes; what nests too deep becomes a variable of its own in ``parts``."""

    parts: list[tuple[str, _Code]] = field(default_factory=list)

    def settings(self, scene: SceneData) -> Iterable[_Code]:
        if scene.model is not None:
            yield f'model="{scene.model}"'
        if scene.canvas != (256, 256):
            yield _tuple("canvas=", map(str, scene.canvas))
        if scene.background is None:
            yield "background=None"
        elif scene.background != "default":
            yield _numbers("background=", scene.background)
        for word in STAGE:
            value = getattr(scene, word)
            if value is None:
                yield f"{word}=None"
            elif value != "default":
                parts = [
                    _numbers(f"{name}=", item) if isinstance(item, tuple) else f"{name}={number(item)}"
                    for name, item in value.__repr_args__()
                ]
                yield _Call(f"{word}=nsg.{type(value).__name__}", tuple(parts))
        if scene.animation is not None:
            loop = () if scene.animation.loop else ("loop=False",)
            times = (f"seconds={number(scene.animation.seconds)}", f"fps={number(scene.animation.fps)}")
            yield _Call("animation=nsg.Animation", (*times, *loop))
        if scene.nodes:
            yield _tuple("nodes=", [self.node("", node)[0] for node in scene.nodes])

    def node(self, prefix: str, node: SceneNode) -> tuple[_Code, int]:
        """The code of a node, and how deep nodes nest in it."""
        height, name = 0, type(node).__name__
        parts: list[_Code] = []
        if isinstance(node, Object):
            parts.append(f'"{node.geometry}"')
        else:
            if node.kind == "boolean":
                parts.append(f'op="{node.op}"')
            children = [self.child(child) for child in node.children]
            height = max([inner + 1 for _, inner in children], default=0)
            if children:
                parts.append(_tuple("children=", [code for code, _ in children]))
        if node.transforms:
            parts.append(_tuple("transforms=", map(_step, node.transforms)))
        if node.kind == "boolean" and node.k != BLEND:
            parts.append(f"k={number(node.k)}")
        if node.material is not None:
            ops = (_tuple("ops=", map(_step, node.material.ops)),) if node.material.ops else ()
            parts.append(_Call("material=nsg.Material", (f'"{node.material.name}"', *ops)))
        if height < _DEEPEST:
            return _Call(f"{prefix}nsg.{name}", tuple(parts)), height
        variable = f"part_{len(self.parts) + 1}"
        self.parts.append((variable, _Call(f"nsg.{name}", tuple(parts))))
        return f"{prefix}{variable}", 0

    def child(self, child: SceneNode | Link) -> tuple[_Code, int]:
        if not isinstance(child, Link):
            return self.node("", child)
        code, height = self.node("node=", child.node)
        op = () if child.op == "union" else (f'op="{child.op}"',)
        width = () if child.k == BLEND else (f"k={number(child.k)}",)
        return _Call("nsg.Link", (*op, code, *width)), height


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
