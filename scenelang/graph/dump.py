"""A graph as text, for people."""

from __future__ import annotations

from math import degrees

from scenelang.graph.nodes import BLEND, Fold, Graph, Leaf, Link, Move
from scenelang.graph.space import Space
from scenelang.graph.stage import HORIZON, ZENITH, Stage, Triple, encoded
from scenelang.graph.steps import IDENTITY, Displace, Twist, Warp


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
            name = f"{node.geometry} {hex_text(graph.space.written(node.look.colour()))}"
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
    return f"smooth({link.k:g})" if link.op == "smooth" and link.k != BLEND else link.op


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
