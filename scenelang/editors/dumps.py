"""Trees, graphs and Programs as data, text or drawings, and the JSON Schemas of scenelang's files.

Large drawings are cut: nodes nearest the top come first, and a box says how many more there are.

The Scene's schema is made from the pydantic model. It leaves out checks that need code: that a matrix is not
singular, that numbers fit into float64, and how deep nodes may nest.
"""

from __future__ import annotations

import difflib
import re
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, fields
from math import degrees
from typing import TYPE_CHECKING, Any, Final, TypeVar

from scenelang.assets.element import Element
from scenelang.assets.records import deep_stack
from scenelang.compiler.compile import find_model
from scenelang.compiler.graph import Fold, Graph, Leaf, Link, Look, Move, Node, colour_steps, coloured
from scenelang.compiler.manifest import OPTIONAL
from scenelang.compiler.spaces import (
    HORIZON,
    PLANE,
    SPACES,
    ZENITH,
    Space,
    Stage,
    Triple,
    encoded,
    stage_data,
)
from scenelang.compiler.steps import IDENTITY, Affine, Displace, Twist, Warp
from scenelang.language import scene as schema
from scenelang.language import tree
from scenelang.language.diagnostics import Diagnostics, Span, plural
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
        return {"start": _position(start), "end": _position(end)}
    if not hasattr(value, "__dataclass_fields__"):
        return value
    return {"node": type(value).__name__, **{f.name: _data(getattr(value, f.name)) for f in fields(value)}}


def _position(place: tuple[int, int]) -> dict[str, int]:
    return {"line": place[0], "column": place[1]}


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
        else:
            words.append(
                repr(value) if isinstance(value, str) and each.name == "value" else _word(each.name, value)
            )
    line, column = node.span.locate()[0]
    said = " ".join([f"{label}{type(node).__name__}", *words])
    yield f"{margin}{said}  @{line}:{column}\n"
    for name, child in inside:
        yield from _lines(child, margin + "  ", name)


def _word(name: str, value: Any) -> str:
    if value is True:
        return name
    if isinstance(value, float) and value.is_integer():
        value = int(value) if abs(value) < 1e15 else value
    return str(value) if name in ("value", "op", "unit") else f"{name}={value}"


def dump(graph: Graph) -> str:
    """One line for each node, indented by depth, moves after it from the leaf outwards.

    Example::

        scene 256x256
          square #d33333  [0.8 0 -0.2; 0 0.8 0]
          smooth pentagon #ffffff  warp(0.6; 0.2 0) [0.5 0 0; 0 0.5 0]
    """
    width, height = graph.canvas
    lines = [f"{graph.root.kind} {width}x{height}"]
    lines += [] if graph.stage is None else [f"  {line}" for line in stage_text(graph.stage)]
    stack: list[tuple[Link, int, bool]] = []
    _push(stack, graph.root, 1)
    while stack:
        link, depth, first = stack.pop()
        word = "" if first or link.op == "union" else f"{op_text(link)} "
        node = link.node
        if isinstance(node, Leaf):
            name = f"{node.geometry} {look_text(node.look, graph.space)}"
            name += "" if node.look.material == "flat" else f" {node.look.material}"
        else:
            name = f"({node.kind})"
        moves = " ".join(move_text(move, graph.space) for move in node.moves)
        lines.append(f"{'  ' * depth}{word}{name}" + (f"  {moves}" if moves else ""))
        if isinstance(node, Fold):
            _push(stack, node, depth + 1)
    return "\n".join(lines) + "\n"


def _push(stack: list[tuple[Link, int, bool]], fold: Fold, depth: int) -> None:
    stack.extend((fold.links[at], depth, at == 0) for at in range(len(fold.links) - 1, -1, -1))


def look_text(look: Look, space: Space) -> str:
    """A colour; or a texture with its moves and the operations on its colours."""
    if look.element is None:
        return hex_text(space.written(look.colour()))
    moves = [move_text(Move(step), PLANE) for step in look.texture]
    steps = [f"{kind}({' '.join(f'{v:.6g}' for v in numbers)})" for kind, *numbers in look.colours]
    return " ".join([look.element.name, *moves, *steps])


def move_text(move: Move, space: Space) -> str:
    """``warp(twirl; bend)`` and the like, or the rows of a matrix."""
    step = move.step
    if isinstance(step, Warp):
        return f"warp({step.twirl:.6g}; {step.bend[0]:.6g} {step.bend[1]:.6g})"
    if isinstance(step, Twist):
        return f"twist({step.twist:.6g})"
    if isinstance(step, Displace):
        return f"displace({step.amount:.6g}; {step.frequency:.6g})"
    if step.rows == IDENTITY:
        return "[identity]"
    rows = (" ".join(f"{step.rows[i] + 0.0:.6g}" for i in row) for row in space.shown)
    return f"[{'; '.join(rows)}]"


def op_text(link: Link) -> str:
    """An operator, ``smooth(0.3)`` where its blend is not of the usual width."""
    return f"{link.op}({link.k:g})" if link.k else link.op


def stage_text(stage: Stage) -> list[str]:
    """A stage as the statements that set it, colours as they are written."""
    camera, light, ground = stage.camera, stage.light, stage.ground

    def point(p: Triple) -> str:
        return f"[{p[0]:g}, {p[1]:g}, {p[2]:g}]"

    def colour(rgb: Triple) -> str:
        return hex_text(encoded(rgb))

    sky = "sky" if (stage.horizon, stage.zenith) == (HORIZON, ZENITH) else colour(stage.horizon)
    return [
        f"camera({point(camera.eye)}, {point(camera.target)}, {degrees(camera.fov_rad):g}deg)",
        f"light({point(light.position)}, {light.power:g}, {colour(light.rgb)})",
        f"ground({'none' if ground is None else f'{ground.y:g}, {colour(ground.rgb)}'})",
        f"background({'none' if stage.transparent else sky})",
    ]


def hex_text(rgb: tuple[float, float, float]) -> str:
    """``#rrggbb``, rounded."""
    return "#" + "".join(f"{int(255.0 * v + 0.5):02x}" for v in rgb)


def graph_data(graph: Graph) -> dict[str, Any]:
    """A graph: leaves and folds with their moves, nearest the leaf first.

    An affine move is the upper three rows of its matrix; the others are their fields. Solids have a stage,
    and linear colours.
    """
    with deep_stack():
        root = _node(graph.root)
    return {
        "canvas": list(graph.canvas),
        "background": None if graph.background is None else list(graph.background),
        "dimension": graph.space.dimension,
        **_staged(graph.stage),
        "root": root,
    }


def _staged(stage: Stage | None) -> dict[str, Any]:
    return {} if stage is None else {"stage": stage_data(stage)}


def _node(node: Node) -> dict[str, Any]:
    moves = [_move(move) for move in node.moves]
    if isinstance(node, Leaf):
        look: dict[str, Any] = {
            "geometry": node.geometry,
            "material": node.look.material,
            "rgb": list(node.look.colour()),
        }
        if (element := node.look.element) is not None:
            rows = [_move(Move(step))["affine"][:2] for step in node.look.texture]
            look["texture"] = {**_texture(element), "steps": list(node.look.colours), "moves": rows}
        return {"kind": "leaf", **look, "moves": moves}
    links = [
        {"op": link.op, **({"k": link.k} if link.k else {}), "node": _node(link.node)} for link in node.links
    ]
    return {"kind": node.kind, "moves": moves, "links": links}


def _texture(element: Element) -> dict[str, Any]:
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
    return {
        "canvas": list(program.canvas),
        "background": None if program.background is None else list(program.background),
        **_staged(program.stage),
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
    lines += [] if program.stage is None else stage_text(program.stage)
    rows = [("row", "token", "object", "bounds", "place")]
    for at, (name, token, bounds, place) in enumerate(
        zip(program.objects, token_names(program), program.bounds.tolist(), program.places, strict=True)
    ):
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


def common_start(left: Sequence[str], right: Sequence[str]) -> int:
    """Number of items with which both sequences begin."""
    pairs = enumerate(zip(left, right, strict=False))
    return next((at for at, (a, b) in pairs if a != b), min(len(left), len(right)))


def changes(before: str, after: str, old: str, new: str) -> str:
    """The diff of two dumps; empty where nothing changed.

    Comparing line by line takes quadratic time, so only the size of very large changes is given.
    """
    if before == after:
        return ""
    a, b = before.splitlines(), after.splitlines()
    start = common_start(a, b)
    end = common_start(a[start:][::-1], b[start:][::-1])
    gone, come = len(a) - start - end, len(b) - start - end
    if max(gone, come) > 3000:
        counts = f"{plural(gone, 'line')} became {come:,}"
        return f"--- {old}\n+++ {new}\n@@ from line {start + 1:,}: {counts} @@\n"
    lines = difflib.unified_diff(a, b, old, new, lineterm="")
    return "\n".join(lines) + "\n"


MOST_BOXES: Final = 200
_MOST_CHILDREN: Final = 40
_MOST_LINES: Final = 12
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Box:
    """A node: its lines of text, its fill colour, and whether it is a leaf."""

    lines: tuple[str, ...]
    fill: str | None = None
    leaf: bool = False


@dataclass(frozen=True, slots=True)
class Arrow:
    """An arrow from box to box, by their numbers, with a word on it."""

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
        """Add a box below another one; return its number."""
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
    return re.sub(r"\d+\.\d{5,}(e-?\d+)?", lambda match: f"{float(match[0]):.5g}", statement.rstrip(";"))


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
    """The children to draw; one box counts the others."""
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
    """Text for Mermaid, its special characters written by their numbers."""
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


_DRAFT: Final = "https://json-schema.org/draft/2020-12/schema"


def scene_schema() -> dict[str, Any]:
    """The schema of a Scene, as `Scene.from_json` reads and `Scene.to_json` writes it."""
    model = Scene.model_json_schema()
    described = {"title": "Scene", "description": model.pop("description", ""), **model}
    return _plain(_headed("scene", described))  # type: ignore[no-any-return]


def diagnostics_schema() -> dict[str, Any]:
    """The schema of the output of ``scenelang check --format json``."""
    number = {"type": "integer", "minimum": 1}
    position = {
        "description": "from 1, in code points",
        "type": ["object", "null"],
        "properties": {"line": number, "column": number},
        "required": ["line", "column"],
        "additionalProperties": False,
    }
    place = {
        "file": {"description": "as the user named it", "type": ["string", "null"]},
        "start": {"$ref": "#/$defs/position"},
        "end": {"$ref": "#/$defs/position", "description": "exclusive"},
    }
    edit = _object({**place, "replacement": {"description": "instead of the text there", "type": "string"}})
    fix = _object(
        {"message": {"type": "string"}, "edits": {"type": "array", "items": edit}},
        type=["object", "null"],
        description="a change that is safe to apply unseen",
    )
    diagnostic = _object(
        {
            "code": {"description": "stable; `scenelang explain CODE`", "pattern": "^[EW]\\d{4}$"},
            "severity": {"enum": ["error", "warning"]},
            "message": {"type": "string"},
            **place,
            "labels": {
                "description": "further places",
                "type": "array",
                "items": _object({"message": {"type": "string"}, **place}),
            },
            "help": {"type": ["string", "null"]},
            "fix": fix,
        }
    )
    whole = _object(
        {"version": {"const": 1}, "diagnostics": {"type": "array", "items": diagnostic}},
        title="Diagnostics",
        description="What is wrong with scenes.",
    )
    return _headed("diagnostics", {**whole, "$defs": {"position": position}})


def manifest_schema() -> dict[str, Any]:
    """The schema of a model's ``manifest.json``."""
    word = {"type": "string", "pattern": "^[A-Za-z_][A-Za-z0-9_]*$"}
    words = {"type": "array", "items": word, "uniqueItems": True}
    pair = {"type": "array", "prefixItems": [{"type": "number"}] * 2, "minItems": 2, "maxItems": 2}
    limit = {"type": "integer", "minimum": 0, "exclusiveMaximum": 1 << 31}
    side = {"type": "integer", "minimum": 1, "maximum": 8192}
    size = {"type": "array", "prefixItems": [side] * 2, "minItems": 2, "maxItems": 2}
    whole = _object(
        {
            "format": {"const": 1},
            "name": {"description": 'as in `model "name";`', "type": "string", "pattern": '^[^"\\\\]+$'},
            "summary": {"description": "one line for people", "type": "string"},
            "dimension": {"enum": [2, 3]},
            "renderer": word,
            "lifting": word,
            "geometries": {**words, "minItems": 1, "description": "in the order of the learned codes"},
            "materials": {**words, "minItems": 1, "description": "likewise, the default first"},
            "limits": {"type": "object", "additionalProperties": limit},
            "trained": {
                "description": "ranges, beyond which is a warning",
                "type": "object",
                "additionalProperties": pair,
            },
            "measured": {"description": "figures of its evaluation", "type": "object"},
            "set": {"description": "the scenes it was trained on; by default its name", "type": "string"},
            "sizes": {
                "description": "canvases (width, height) that it draws; any within its limits if none",
                "type": "array",
                "items": size,
            },
            "any_blend": {"description": "whether it blends over any width", "type": "boolean"},
            "white": {"description": "whether it draws over white alone", "type": "boolean"},
        },
        optional=OPTIONAL,
        title="Manifest",
        description="What a model states about itself.",
    )
    return _headed("manifest", whole)


SCHEMAS: Final = {"scene": scene_schema, "diagnostics": diagnostics_schema, "manifest": manifest_schema}


def _headed(name: str, schema: dict[str, Any]) -> dict[str, Any]:
    return {"$schema": _DRAFT, "$id": f"urn:scenelang:schema:{name}:1", **schema}


def _object(properties: dict[str, Any], *, optional: tuple[str, ...] = (), **further: Any) -> dict[str, Any]:
    """An object that has these properties, but for those that are optional, and no others."""
    return {
        "type": "object",
        **further,
        "properties": properties,
        "required": [name for name in properties if name not in optional],
        "additionalProperties": False,
    }


def _plain(value: Any) -> Any:
    """Descriptions as Markdown writes code, not as Python's documentation does."""
    if isinstance(value, dict):
        return {
            key: item.replace("``", "`") if key == "description" and isinstance(item, str) else _plain(item)
            for key, item in value.items()
        }
    return [_plain(item) for item in value] if isinstance(value, list) else value
