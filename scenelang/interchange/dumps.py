"""What `scenelang dump` writes: trees, graphs and Programs as data and as text, and what a pass changed."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from dataclasses import asdict, fields
from math import degrees
from typing import TYPE_CHECKING, Any

from scenelang.deep import deep_stack
from scenelang.diagnostics.span import Span
from scenelang.diagnostics.suggest import plural
from scenelang.elements.element import Element
from scenelang.graph.looks import Look
from scenelang.graph.nodes import Fold, Graph, Leaf, Link, Move, Node
from scenelang.graph.space import Space
from scenelang.graph.spaces import PLANE
from scenelang.graph.stage import HORIZON, ZENITH, Stage, Triple, encoded, stage_data
from scenelang.graph.steps import IDENTITY, Affine, Displace, Twist, Warp
from scenelang.syntax import nodes

if TYPE_CHECKING:
    from scenelang.program.program import Program


def tree_data(file: nodes.File) -> dict[str, Any]:
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


def tree_text(file: nodes.File) -> str:
    """One line for each node: the field that holds it, its kind, what is not a node in it, its place."""
    with deep_stack():
        return "".join(_lines(file, "", ""))


def _lines(node: Any, margin: str, label: str) -> Iterator[str]:
    words: list[str] = []
    inside: list[tuple[str, Any]] = []
    for each in fields(node):
        value = getattr(node, each.name)
        if isinstance(value, Span) or value in (None, (), False, "") or each.name == "is_integer":
            continue
        if isinstance(value, nodes.Name):
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
    """A colour; or a texture with the moves of it and what is done to its colours."""
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
    links = [{"op": link.op, **_width(link), "node": _node(link.node)} for link in node.links]
    return {"kind": node.kind, "moves": moves, "links": links}


def _texture(element: Element) -> dict[str, Any]:
    return {"name": element.name, "digest": element.digest}


def _width(link: Link) -> dict[str, Any]:
    """The width of a blend that is not the usual one."""
    return {"k": link.k} if link.k else {}


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
    """How each row joins what came before it, in words."""
    from scenelang.program.groups import token_name

    return [token_name(token) for token in program.tokens.tolist()]


def _alike(left: list[str], right: list[str]) -> int:
    """Number of lines with which both lists begin."""
    pairs = enumerate(zip(left, right, strict=False))
    return next((at for at, (a, b) in pairs if a != b), min(len(left), len(right)))


def changes(before: str, after: str, old: str, new: str) -> str:
    """The diff of two dumps; empty where nothing changed.

    Comparing line by line takes quadratic time, so of very large changes only the size is told.
    """
    if before == after:
        return ""
    a, b = before.splitlines(), after.splitlines()
    start = _alike(a, b)
    end = _alike(a[start:][::-1], b[start:][::-1])
    gone, come = len(a) - start - end, len(b) - start - end
    if max(gone, come) > 3000:
        counts = f"{plural(gone, 'line')} became {come:,}"
        return f"--- {old}\n+++ {new}\n@@ from line {start + 1:,}: {counts} @@\n"
    lines = difflib.unified_diff(a, b, old, new, lineterm="")
    return "\n".join(lines) + "\n"
