"""A scene, a graph or a Program as boxes and arrows: what Mermaid and Graphviz DOT draw alike.

Large ones are cut: nodes nearest the top come first, and a box says how many more there are.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, TypeVar

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.graph.looks import colour_steps, coloured
from scenelang.graph.nodes import Fold, Graph, Leaf, Node
from scenelang.graph.space import Space
from scenelang.graph.spaces import SPACES
from scenelang.interchange.dumps import hex_text, look_text, move_text, op_text, stage_text, token_names
from scenelang.program.compile import find_model
from scenelang.scene import schema
from scenelang.scene.text import material, transform

if TYPE_CHECKING:
    from scenelang.program.program import Program

MOST_BOXES: Final = 200
_MOST_CHILDREN: Final = 40
_MOST_LINES: Final = 12
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Box:
    """A node: its lines of text, the colour it is filled with, and whether it is a leaf."""

    lines: tuple[str, ...]
    fill: str | None = None
    leaf: bool = False


@dataclass(frozen=True, slots=True)
class Arrow:
    """From box to box by their numbers, with a word on it."""

    start: int
    end: int
    word: str = ""


@dataclass(slots=True)
class Drawing:
    """Boxes and arrows, from top to bottom or from left to right."""

    boxes: list[Box] = field(default_factory=list)
    arrows: list[Arrow] = field(default_factory=list)
    sideways: bool = False

    def add(self, box: Box, parent: int | None = None, word: str = "") -> int:
        """Put a box in, below another one; returns its number."""
        self.boxes.append(box)
        if parent is not None:
            self.arrows.append(Arrow(parent, len(self.boxes) - 1, word))
        return len(self.boxes) - 1


def draw_scene(scene: schema.Scene, most: int = MOST_BOXES) -> Drawing:
    """The tree of a scene with its transforms, materials and boolean words."""
    drawn = Drawing()
    width, height = scene.canvas
    manifest = find_model(scene, Diagnostics())
    space = SPACES[manifest.dimension if manifest is not None else 2]
    model = () if scene.model is None else (f"model {scene.model}",)
    top = drawn.add(Box((f"scene {width} x {height}", *model)))
    Child = tuple[str, schema.SceneNode, schema.Material | None]
    todo: deque[tuple[int, list[Child]]] = deque([(top, [("", node, None) for node in scene.nodes])])
    while todo:
        parent, children = todo.popleft()
        for word, node, outer in _some(drawn, parent, children, most):
            inner = node.material or outer
            number = drawn.add(_scene_box(node, inner, space), parent, word)
            if not isinstance(node, schema.Object) and node.children:
                todo.append((number, [(*child, inner) for child in _children(node)]))
    return drawn


def _children(node: schema.Group | schema.Boolean | schema.Chain) -> Iterable[tuple[str, schema.SceneNode]]:
    if isinstance(node, schema.Chain):
        return [("" if at == 0 else link.op, link.node) for at, link in enumerate(node.children)]
    return [("", child) for child in node.children]


def _scene_box(node: schema.SceneNode, inner: schema.Material | None, space: Space) -> Box:
    steps = [_rounded(transform(t)) for t in node.transforms]
    own = [] if node.material is None else [_rounded(material(node.material))]
    if isinstance(node, schema.Object):
        ops = () if inner is None else map(space.inked, inner.ops)
        fill = None if inner is None else hex_text(space.written(coloured(colour_steps(ops))))
        return Box((node.geometry, *_short([*own, *steps])), fill, leaf=True)
    name = node.op if isinstance(node, schema.Boolean) else node.kind
    return Box((name, *_short([*own, *steps])))


def _rounded(statement: str) -> str:
    """A statement as a box shows it, its numbers to five digits."""
    return re.sub(r"\d+\.\d{5,}(e-?\d+)?", lambda found: f"{float(found[0]):.5g}", statement.rstrip(";"))


def draw_graph(graph: Graph, most: int = MOST_BOXES) -> Drawing:
    """A graph after `lower` or any pass."""
    drawn = Drawing()
    width, height = graph.canvas
    stage = () if graph.stage is None else stage_text(graph.stage)
    top = drawn.add(Box((f"scene {width} x {height}", *stage)))
    todo: deque[tuple[int, Fold]] = deque([(top, graph.root)])
    while todo:
        parent, fold = todo.popleft()
        links = [("" if at == 0 else op_text(link), link.node) for at, link in enumerate(fold.links)]
        for word, node in _some(drawn, parent, links, most):
            number = drawn.add(_graph_box(node, graph.space), parent, word)
            if isinstance(node, Fold):
                todo.append((number, node))
    return drawn


def _graph_box(node: Node, space: Space) -> Box:
    moves = _short([move_text(move, space) for move in node.moves])
    if isinstance(node, Leaf):
        texture = () if node.look.element is None else (look_text(node.look, space),)
        rgb = hex_text(space.written(node.look.colour()))
        return Box((node.geometry, *texture, *moves), rgb, leaf=True)
    return Box((node.kind, *moves))


def draw_program(program: Program, most: int = MOST_BOXES) -> Drawing:
    """The stream of a Program: each object and the token that joins it to what came before."""
    drawn = Drawing(sideways=True)
    width, height = program.canvas
    stage = () if program.stage is None else stage_text(program.stage)
    last = drawn.add(Box((f"program {width} x {height}", f"model {program.model}", *stage)))
    tokens = token_names(program)
    for at, name in enumerate(program.objects[:most]):
        place = program.places[at]
        where = () if place is None else (f"line {place.line}",)
        last = drawn.add(Box((name, f"row {at}", *where), leaf=True), last, tokens[at])
    if len(program) > most:
        drawn.add(Box((f"{len(program) - most:,} more",)), last)
    return drawn


def _some(drawn: Drawing, parent: int, children: Sequence[T], most: int) -> Sequence[T]:
    """The children that are drawn; the others become one box that counts them."""
    room = max(0, min(_MOST_CHILDREN, most - len(drawn.boxes)))
    left = len(children) - room
    if left <= 0:
        return children
    drawn.add(Box((f"{left:,} more",)), parent)
    return children[:room]


def _short(lines: list[str]) -> list[str]:
    if len(lines) <= _MOST_LINES:
        return lines
    return [*lines[:_MOST_LINES], f"{len(lines) - _MOST_LINES:,} more"]


def to_mermaid(drawn: Drawing) -> str:
    """Text for Mermaid, as Markdown pages of code hosts draw it."""
    lines = [f"flowchart {'LR' if drawn.sideways else 'TB'}"]
    for number, box in enumerate(drawn.boxes):
        text = "<br/>".join(_for_mermaid(line) for line in box.lines)
        lines.append(f'  n{number}("{text}")' if box.leaf else f'  n{number}["{text}"]')
    for arrow in drawn.arrows:
        word = f"|{arrow.word}|" if arrow.word else ""
        lines.append(f"  n{arrow.start} -->{word} n{arrow.end}")
    for number, box in enumerate(drawn.boxes):
        if box.fill is not None:
            lines.append(f"  style n{number} fill:{box.fill},color:{_ink(box.fill)}")
    return "\n".join(lines) + "\n"


def _for_mermaid(text: str) -> str:
    """Text without characters that mean something to Mermaid: they are written by their number."""
    return "".join(c if c.isalnum() or c in " .,:+-_=()[]" else f"#{ord(c)};" for c in text)


def to_dot(drawn: Drawing) -> str:
    """Text for Graphviz."""
    lines = [
        "digraph scene {",
        f"  rankdir={'LR' if drawn.sideways else 'TB'};",
        '  node [shape=box, fontname="Helvetica", fontsize=10];',
        '  edge [fontname="Helvetica", fontsize=9];',
    ]
    for number, box in enumerate(drawn.boxes):
        text = "\\n".join(line.replace("\\", "\\\\").replace('"', '\\"') for line in box.lines)
        look = [f'label="{text}"']
        if box.leaf:
            fill = box.fill or "#ffffff"
            look += ['style="rounded,filled"', f'fillcolor="{fill}"', f'fontcolor="{_ink(fill)}"']
        lines.append(f"  n{number} [{', '.join(look)}];")
    for arrow in drawn.arrows:
        word = f' [label="{arrow.word}"]' if arrow.word else ""
        lines.append(f"  n{arrow.start} -> n{arrow.end}{word};")
    return "\n".join([*lines, "}"]) + "\n"


def _ink(fill: str) -> str:
    """Black or white, whichever can be read on a colour."""
    red, green, blue = (int(fill[at : at + 2], 16) for at in (1, 3, 5))
    return "#000000" if 0.2126 * red + 0.7152 * green + 0.0722 * blue > 120 else "#ffffff"
