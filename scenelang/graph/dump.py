"""A graph as text, for people."""

from __future__ import annotations

from scenelang.graph.nodes import Fold, Graph, Leaf, Link, Move
from scenelang.graph.space import Space
from scenelang.graph.steps import IDENTITY, Affine, Warp


def dump(graph: Graph) -> str:
    """One line for each node, indented by depth, moves after it from the leaf outwards.

    Example::

        scene 256x256
          square #d33333  [0.8 0 -0.2; 0 0.8 0]
          smooth pentagon #ffffff  warp(0.6; 0.2 0) [0.5 0 0; 0 0.5 0]
    """
    width, height = graph.canvas
    lines = [f"{graph.root.kind} {width}x{height}"]
    stack: list[tuple[Link, int, bool]] = []
    _push(stack, graph.root, 1)
    while stack:
        link, depth, first = stack.pop()
        word = "" if first or link.op == "union" else f"{link.op} "
        node = link.node
        if isinstance(node, Leaf):
            name = f"{node.geometry} {hex_text(node.look.colour())}"
        else:
            name = f"({node.kind})"
        moves = " ".join(move_text(move, graph.space) for move in node.moves)
        lines.append(f"{'  ' * depth}{word}{name}" + (f"  {moves}" if moves else ""))
        if isinstance(node, Fold):
            _push(stack, node, depth + 1)
    return "\n".join(lines) + "\n"


def _push(stack: list[tuple[Link, int, bool]], fold: Fold, depth: int) -> None:
    stack.extend((fold.links[at], depth, at == 0) for at in range(len(fold.links) - 1, -1, -1))


def move_text(move: Move, space: Space) -> str:
    """``warp(twirl; bend)``, or the rows of a matrix."""
    step = move.step
    if isinstance(step, Warp):
        return f"warp({step.twirl:.6g}; {step.bend[0]:.6g} {step.bend[1]:.6g})"
    if not isinstance(step, Affine):
        return repr(step)
    if step.rows == IDENTITY:
        return "[identity]"
    rows = (" ".join(f"{step.rows[i] + 0.0:.6g}" for i in row) for row in space.shown)
    return f"[{'; '.join(rows)}]"


def hex_text(rgb: tuple[float, float, float]) -> str:
    """``#rrggbb``, rounded."""
    return "#" + "".join(f"{int(255.0 * v + 0.5):02x}" for v in rgb)
