"""Graphs and Programs as JSON data, and a Program as a table."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from scenelang.deep import deep_stack
from scenelang.graph.dump import stage_text
from scenelang.graph.nodes import BLEND, Graph, Leaf, Link, Move, Node
from scenelang.graph.stage import Stage, stage_data
from scenelang.graph.steps import Affine

if TYPE_CHECKING:
    from scenelang.program.program import Program


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
        look = {"geometry": node.geometry, "material": node.look.material, "rgb": list(node.look.colour())}
        return {"kind": "leaf", **look, "moves": moves}
    links = [{"op": link.op, **_width(link), "node": _node(link.node)} for link in node.links]
    return {"kind": node.kind, "moves": moves, "links": links}


def _width(link: Link) -> dict[str, Any]:
    """The width of a blend that is not the usual one."""
    return {"k": link.k} if link.op == "smooth" and link.k != BLEND else {}


def _move(move: Move) -> dict[str, Any]:
    step = move.step
    if isinstance(step, Affine):
        return {"affine": [list(step.rows[at : at + 4]) for at in (0, 4, 8)]}
    return asdict(step)


def program_data(program: Program) -> dict[str, Any]:
    """A Program with its numbers; float32 values are written so that they read back exactly."""
    rows = [
        {
            "object": name,
            "token": token,
            "bounds": bounds,
            "place": None if place is None else place._asdict(),
            "vector": vector,
        }
        for name, token, bounds, place, vector in zip(
            program.objects,
            _tokens(program),
            program.bounds.tolist(),
            program.places,
            program.vectors.tolist(),
            strict=True,
        )
    ]
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
        zip(program.objects, _tokens(program), program.bounds.tolist(), program.places, strict=True)
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


def _tokens(program: Program) -> list[str]:
    from scenelang.words import TOKENS

    names = {value: word for word, value in TOKENS.items()}
    return [names[token] for token in program.tokens.tolist()]
