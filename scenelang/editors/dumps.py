"""Trees, graphs and Programs as data, text or drawings, and the JSON Schemas of scenelang's files."""

from __future__ import annotations

import difflib
import json
import re
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, fields
from importlib.resources import files
from math import degrees
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

from scenelang.assets.element import Element, Gradient
from scenelang.assets.records import deep_stack
from scenelang.compiler.compile import find_model
from scenelang.compiler.graph import Fold, Graph, Leaf, Link, Look, Move, Node, colour_steps, coloured
from scenelang.compiler.spaces import PLANE, SPACES, Space, Stage, Triple, stage_data
from scenelang.compiler.steps import IDENTITY, Affine, Displace, Grow, Shell, Twist, Warp
from scenelang.language import scene as schema
from scenelang.language import tree
from scenelang.language.diagnostics import Diagnostics, Span, common_start, plural
from scenelang.language.scene import Scene
from scenelang.language.scene_text import material, transform

if TYPE_CHECKING:
    from scenelang.compiler.program import Program


def tree_data(file: tree.File) -> dict[str, Any]:
    """The tree as JSON data: each node's kind, its fields and its place (from 1, the end exclusive)."""
    with deep_stack():
        return _data(file)  # type: ignore[no-any-return]


def _data(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_data(item) for item in value]
    if isinstance(value, Span):
        start, end = value.locate()
        names = ("line", "column")
        return {"start": dict(zip(names, start, strict=True)), "end": dict(zip(names, end, strict=True))}
    if not hasattr(value, "__dataclass_fields__"):
        return value
    return {"node": type(value).__name__, **{f.name: _data(getattr(value, f.name)) for f in fields(value)}}


def tree_text(file: tree.File) -> str:
    """One line for each node: the field that holds it, its kind, its fields that are not nodes, its place."""
    with deep_stack():
        return "".join(_lines(file, "", ""))


def _lines(node: Any, margin: str, label: str) -> Iterator[str]:
    words: list[str] = []
    inside: list[tuple[str, Any]] = []
    for each in fields(node):
        value = getattr(node, each.name)
        if isinstance(value, Span) or value in (None, (), False, "") or each.name == "is_integer":
            continue
        if isinstance(value, tree.Name):
            words.append(value.text if each.name == "name" else f"{each.name}={value.text}")
        elif hasattr(value, "__dataclass_fields__"):
            inside.append((f"{each.name}: ", value))
        elif isinstance(value, tuple) and hasattr(value[0], "__dataclass_fields__"):
            one = len(value) == 1 and each.name not in ("statements", "items")
            inside += [(f"{each.name}: " if one else "", item) for item in value]
        elif value is True:
            words.append(each.name)
        else:
            if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
                value = int(value)
            elif isinstance(value, str) and each.name == "value":
                value = repr(value)
            words.append(str(value) if each.name in ("value", "op", "unit") else f"{each.name}={value}")
    line, column = node.span.locate()[0]
    said = " ".join([f"{label}{type(node).__name__}", *words])
    yield f"{margin}{said}  @{line}:{column}\n"
    for name, child in inside:
        yield from _lines(child, margin + "  ", name)


def dump(graph: Graph) -> str:
    """One line for each node, indented by depth, with its moves from the leaf outwards."""
    width, height = graph.canvas
    lines = [f"{graph.root.kind} {width}x{height}"]
    lines += [f"  {line}" for line in stage_text(graph.stage)]
    stack = [(link, 1, at == 0) for at, link in enumerate(graph.root.links)][::-1]
    while stack:
        link, depth, first = stack.pop()
        word = "" if first or link.op == "union" else f"{op_text(link)} "
        node = link.node
        if isinstance(node, Leaf):
            name = f"{node.called} {look_text(node.look, graph.space)}"
            name += "" if node.look.material == "flat" else f" {node.look.shading}"
        else:
            name = f"({node.kind})"
        moves = " ".join(move_text(move, graph.space) for move in node.moves)
        lines.append(f"{'  ' * depth}{word}{name}" + (f"  {moves}" if moves else ""))
        if isinstance(node, Fold):
            stack += [(link, depth + 1, at == 0) for at, link in enumerate(node.links)][::-1]
    return "\n".join(lines) + "\n"


def look_text(look: Look, space: Space) -> str:
    """A colour; or a texture with its moves and the operations on its colours; then its properties."""
    own = [f" {name}({' '.join(f'{v:.6g}' for v in numbers)})" for name, *numbers in _properties(look)]
    if look.element is None:
        return "".join([hex_text(space.written(look.colour())), *own])
    moves = [move_text(Move(step), space if look.tilted else PLANE) for step in look.texture]
    steps = [f"{kind}({' '.join(f'{v:.6g}' for v in numbers)})" for kind, *numbers in look.colours]
    return "".join([" ".join([look.element.name, *moves, *steps]), *own])


def _properties(look: Look) -> Iterator[tuple[str, *tuple[float, ...]]]:
    """Names of what operations on colours do not touch, where it is not as usual, each with its numbers."""
    if look.opacity != 1.0:
        yield "opacity", look.opacity
    if look.density:
        yield "density", look.density
    if look.roughness:
        yield "roughness", abs(look.roughness)
    if any(look.glow):
        yield "glow", *look.glow


def move_text(move: Move, space: Space) -> str:
    """``warp(twirl; bend)`` and the like, or the rows of a matrix."""
    step = move.step
    if isinstance(step, Warp):
        return f"warp({step.twirl:.6g}; {step.bend[0]:.6g} {step.bend[1]:.6g})"
    if isinstance(step, Twist):
        return f"twist({step.twist:.6g})"
    if isinstance(step, Displace):
        return f"displace({step.amount:.6g}; {step.frequency:.6g})"
    if isinstance(step, Grow):
        return f"grow({step.r:.6g})"
    if isinstance(step, Shell):
        return f"shell({step.w:.6g})"
    if step.rows == IDENTITY:
        return "[identity]"
    rows = (" ".join(f"{step.rows[i] + 0.0:.6g}" for i in row) for row in space.shown)
    return f"[{'; '.join(rows)}]"


def op_text(link: Link) -> str:
    """An operator, ``smooth(0.3)`` where its blend is not of the usual width."""
    return f"{link.op}({link.k:g})" if link.k else link.op


def stage_text(stage: Stage | None) -> list[str]:
    """A stage as the statements that set it, colours as they are written; none without a stage."""
    if stage is None:
        return []
    camera, ground, sky = stage.camera, stage.ground, stage.sky

    def point(p: Triple) -> str:
        return "[{:g}, {:g}, {:g}]".format(*p)

    def colour(rgb: Triple) -> str:
        return hex_text(SPACES[3].written(rgb))

    lamps = [
        f"light({point(lamp.position)}, {lamp.power:g}, {colour(lamp.rgb)}"
        + (f", {lamp.radius:g})" if lamp.radius else ")")
        for lamp in stage.lights
    ]
    seen = "sky" if stage.horizon != stage.zenith else colour(stage.horizon)
    return [
        f"camera({point(camera.eye)}, {point(camera.target)}, {degrees(camera.fov_rad):g}deg"
        + (")" if camera.exposure == 1.0 else f", exposure = {camera.exposure:g})"),
        *(lamps or ["light(none)"]),
        f"ground({'none' if ground is None else f'{ground.y:g}, {colour(ground.rgb)}'})",
        *([] if sky is None else [f"sky({sky.power:g}, {colour(sky.horizon)}, {colour(sky.zenith)})"]),
        f"background({'none' if stage.transparent else seen})",
    ]


def hex_text(rgb: tuple[float, float, float]) -> str:
    """``#rrggbb``, rounded."""
    return "#" + "".join(f"{int(255.0 * v + 0.5):02x}" for v in rgb)


def graph_data(graph: Graph) -> dict[str, Any]:
    """A graph: leaves and folds with their moves, nearest the leaf first, affine ones as matrices."""
    with deep_stack():
        root = _node(graph.root)
    return {
        "canvas": list(graph.canvas),
        "background": None if graph.background is None else list(graph.background),
        "dimension": graph.space.dimension,
        **({} if graph.samples == 4 else {"samples": graph.samples}),
        **({} if graph.stage is None else {"stage": stage_data(graph.stage)}),
        "root": root,
    }


def _node(node: Node) -> dict[str, Any]:
    moves = [_move(move) for move in node.moves]
    if isinstance(node, Leaf):
        look: dict[str, Any] = {"geometry": node.geometry, "material": node.look.shading}
        look["rgb"] = list(node.look.colour())
        look |= {n: numbers if len(numbers) > 1 else numbers[0] for n, *numbers in _properties(node.look)}
        if (element := node.look.element) is not None:
            rows = [_move(Move(step))["affine"][: 3 if node.look.tilted else 2] for step in node.look.texture]
            look["texture"] = {**_texture(element), "steps": list(node.look.colours), "moves": rows}
        return {"kind": "leaf", **look, "moves": moves}
    links = [{"op": one.op, **({"k": one.k} if one.k else {}), "node": _node(one.node)} for one in node.links]
    return {"kind": node.kind, "moves": moves, "links": links}


def _texture(element: Element | Gradient) -> dict[str, Any]:
    if isinstance(element, Gradient):
        return {"name": element.name, "stops": [list(stop) for stop in element.stops]}
    return {"name": element.name, "digest": element.digest}


def _move(move: Move) -> dict[str, Any]:
    step = move.step
    if isinstance(step, Affine):
        return {"affine": [list(step.rows[at : at + 4]) for at in (0, 4, 8)]}
    return asdict(step)


def program_data(program: Program) -> dict[str, Any]:
    """A Program with its numbers; float32 values are written so that they read back exactly."""
    names = ("object", "token", "bounds", "place", "vector")
    places = [place and place._asdict() for place in program.places]
    bounds, vectors = program.bounds.tolist(), program.vectors.tolist()
    columns = zip(program.objects, token_names(program), bounds, places, vectors, strict=True)
    rows: list[dict[str, Any]] = [dict(zip(names, row, strict=True)) for row in columns]
    for row, paint in zip(rows, program.paints(), strict=True):
        if paint is not None:
            row["texture"] = {**_texture(paint.element), "steps": list(paint.steps)}
            row["texture"] |= {"tilt": paint.tilt} if any(paint.tilt) else {}
    return {
        "canvas": list(program.canvas),
        "background": None if program.background is None else list(program.background),
        **({} if program.samples == 4 else {"samples": program.samples}),
        **({} if program.stage is None else {"stage": stage_data(program.stage)}),
        "model": program.model,
        "weights": program.weights,
        "digest": program.digest(),
        "rows": rows,
    }


def program_table(program: Program) -> str:
    """A Program as a table: each row's token, object, bounds in the world and place in the source."""
    width, height = program.canvas
    head = f"program {width}x{height}, model {program.model}, weights {program.weights[:12]}"
    lines = [f"{head}, digest {program.digest()[:12]}"]
    lines += stage_text(program.stage)
    rows = [("row", "token", "object", "bounds", "place")]
    columns = zip(program.objects, token_names(program), program.bounds.tolist(), program.places, strict=True)
    for at, (name, token, bounds, place) in enumerate(columns):
        x, y, *rest = (f"{v:.4g}" for v in bounds)
        box = f"[{x} {y}; {' '.join(rest)}]" if program.stage is None else f"({x} {y} {rest[0]}; {rest[1]})"
        where = "" if place is None else f"{place.file}:{place.line}:{place.column}"
        rows.append((str(at), token, name, box, where))
    widths = [max(len(row[column]) for row in rows) for column in range(4)]
    for row in rows:
        cells = [cell.ljust(width) for cell, width in zip(row[:4], widths, strict=True)]
        lines.append("  ".join([*cells, row[4]]).rstrip())
    return "\n".join(lines) + "\n"


def token_names(program: Program) -> list[str]:
    """The tokens of rows in words."""
    from scenelang.compiler.groups import token_name

    return [token_name(token) for token in program.tokens.tolist()]


def changes(before: str, after: str, old: str, new: str) -> str:
    """The diff of two dumps; of very large changes, which take quadratic time, only the size."""
    if before == after:
        return ""
    a, b = before.splitlines(), after.splitlines()
    start = common_start(a, b)
    end = common_start(a[start:][::-1], b[start:][::-1])
    gone, come = len(a) - start - end, len(b) - start - end
    if max(gone, come) > 3000:
        counts = f"{plural(gone, 'line')} became {come:,}"
        return f"--- {old}\n+++ {new}\n@@ from line {start + 1:,}: {counts} @@\n"
    return "\n".join(difflib.unified_diff(a, b, old, new, lineterm="")) + "\n"


MOST_BOXES: Final = 200
_MOST_CHILDREN: Final = 40
_MOST_LINES: Final = 12
T = TypeVar("T")


class Box(NamedTuple):
    """A node of a drawing."""

    lines: tuple[str, ...]
    fill: str | None = None
    leaf: bool = False  # with round corners
    parent: int | None = None  # number of the box whose arrow leads here
    word: str = ""  # on that arrow


def _draw_tree(
    head: tuple[str, ...],
    nodes: Sequence[tuple[str, T]],
    look: Callable[[T], tuple[Box, Sequence[tuple[str, T]]]],
    most: int,
) -> list[Box]:
    """A tree, level by level: its first box, its nodes with their words, and each one's box and children."""
    boxes = [Box(head)]
    todo = deque([(0, nodes)])
    while todo:
        parent, inner = todo.popleft()
        room = max(0, min(_MOST_CHILDREN, most - len(boxes)))
        if len(inner) > room:
            boxes.append(Box((f"{len(inner) - room:,} more",), parent=parent))
        for word, node in inner[:room]:
            box, below = look(node)
            todo.append((len(boxes), below))
            boxes.append(box._replace(parent=parent, word=word))
    return boxes


def draw_scene(scene: schema.Scene, most: int = MOST_BOXES) -> list[Box]:
    """The tree of a scene with its transforms, materials and boolean words."""
    manifest = find_model(scene, Diagnostics())
    space = SPACES[manifest.dimension if manifest is not None else 2]
    Child = tuple[schema.SceneNode, schema.Material | None]

    def look(child: Child) -> tuple[Box, list[tuple[str, Child]]]:
        node, outer = child
        inner = node.material or outer
        own = [] if node.material is None else [material(node.material)]
        lines = _short([_rounded(text) for text in (*own, *map(transform, node.transforms))])
        match node:
            case schema.Object():
                ops = () if inner is None else map(space.inked, inner.ops)
                fill = None if inner is None else hex_text(space.written(coloured(colour_steps(ops))))
                said = f" of {len(node.points):,} points" if node.points else ""
                return Box((node.geometry + said, *lines), fill, leaf=True), []
            case schema.Chain():
                links = enumerate(node.children)
                below = [(str(link.op) if at else "", (link.node, inner)) for at, link in links]
            case _:
                below = [("", (each, inner)) for each in node.children]
        return Box((node.op if isinstance(node, schema.Boolean) else node.kind, *lines)), below

    model = () if scene.model is None else (f"model {scene.model}",)
    nodes: list[tuple[str, Child]] = [("", (node, None)) for node in scene.nodes]
    return _draw_tree(("scene {} x {}".format(*scene.canvas), *model), nodes, look, most)


def _rounded(statement: str) -> str:
    """A statement as a box shows it, its numbers to five digits."""
    return re.sub(r"\d+\.\d{5,}(e-?\d+)?", lambda match: f"{float(match[0]):.5g}", statement.rstrip(";"))


def draw_graph(graph: Graph, most: int = MOST_BOXES) -> list[Box]:
    """A graph after `lower` or any pass."""

    def links(fold: Fold) -> list[tuple[str, Node]]:
        return [(op_text(link) if at else "", link.node) for at, link in enumerate(fold.links)]

    def look(node: Node) -> tuple[Box, list[tuple[str, Node]]]:
        moves = _short([move_text(move, graph.space) for move in node.moves])
        if isinstance(node, Fold):
            return Box((node.kind, *moves)), links(node)
        texture = () if node.look.element is None else (look_text(node.look, graph.space),)
        rgb = hex_text(graph.space.written(node.look.colour()))
        return Box((node.geometry, *texture, *moves), rgb, leaf=True), []

    head = ("scene {} x {}".format(*graph.canvas), *stage_text(graph.stage))
    return _draw_tree(head, links(graph.root), look, most)


def draw_program(program: Program, most: int = MOST_BOXES) -> list[Box]:
    """The stream of a Program: each object and the token that joins it to what came before."""
    head = ("program {} x {}".format(*program.canvas), f"model {program.model}", *stage_text(program.stage))
    boxes, tokens = [Box(head)], token_names(program)
    for at, name in enumerate(program.objects[:most]):
        place = program.places[at]
        where = () if place is None else (f"line {place.line}",)
        boxes.append(Box((name, f"row {at}", *where), leaf=True, parent=at, word=tokens[at]))
    if len(program) > most:
        boxes.append(Box((f"{len(program) - most:,} more",), parent=most))
    return boxes


def _short(lines: list[str]) -> list[str]:
    more = len(lines) - _MOST_LINES
    return lines if more <= 0 else [*lines[:_MOST_LINES], f"{more:,} more"]


def to_mermaid(boxes: list[Box], sideways: bool = False) -> str:
    """Text for Mermaid, as Markdown pages of code hosts draw it; special characters by their numbers."""

    def escaped(text: str) -> str:
        return "".join(c if c.isalnum() or c in " .,:+-_=()[]" else f"#{ord(c)};" for c in text)

    lines, arrows, styles = [f"flowchart {'LR' if sideways else 'TB'}"], [], []
    for number, box in enumerate(boxes):
        text = "<br/>".join(map(escaped, box.lines))
        lines.append(f'  n{number}("{text}")' if box.leaf else f'  n{number}["{text}"]')
        if box.parent is not None:
            arrows.append(f"  n{box.parent} -->{f'|{box.word}|' if box.word else ''} n{number}")
        if box.fill is not None:
            styles.append(f"  style n{number} fill:{box.fill},color:{_ink(box.fill)}")
    return "\n".join([*lines, *arrows, *styles]) + "\n"


def to_dot(boxes: list[Box], sideways: bool = False) -> str:
    """Text for Graphviz."""
    lines = [
        "digraph scene {",
        f"  rankdir={'LR' if sideways else 'TB'};",
        '  node [shape=box, fontname="Helvetica", fontsize=10];',
        '  edge [fontname="Helvetica", fontsize=9];',
    ]
    arrows = []
    for number, box in enumerate(boxes):
        text = "\\n".join(line.replace("\\", "\\\\").replace('"', '\\"') for line in box.lines)
        look = [f'label="{text}"']
        if box.leaf:
            fill = box.fill or "#ffffff"
            look += ['style="rounded,filled"', f'fillcolor="{fill}"', f'fontcolor="{_ink(fill)}"']
        lines.append(f"  n{number} [{', '.join(look)}];")
        if box.parent is not None:
            word = f' [label="{box.word}"]' if box.word else ""
            arrows.append(f"  n{box.parent} -> n{number}{word};")
    return "\n".join([*lines, *arrows, "}"]) + "\n"


def _ink(fill: str) -> str:
    """Black or white, whichever can be read on a colour."""
    red, green, blue = (int(fill[at : at + 2], 16) for at in (1, 3, 5))
    return "#000000" if 0.2126 * red + 0.7152 * green + 0.0722 * blue > 120 else "#ffffff"


def scene_schema() -> dict[str, Any]:
    """The schema of a Scene, as `Scene.from_json` reads and `Scene.to_json` writes it.

    It leaves out checks that need code: singular matrices, numbers beyond float64, the depth of nodes.
    """
    # Descriptions as Markdown writes code, not as Python's documentation does.
    model = json.loads(json.dumps(Scene.model_json_schema()).replace("``", "`"))
    described = {"title": "Scene", "description": model.pop("description", ""), **model}
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": "urn:scenelang:schema:scene:1"}
    return head | described


_CHECKED: Final = files("scenelang").joinpath("editors/schemas/diagnostics.json")
SCHEMAS: Final[dict[str, Callable[[], Any]]] = {
    "scene": scene_schema,
    "diagnostics": lambda: json.loads(_CHECKED.read_text("utf-8")),  # what `check --format json` prints
}
