"""Nothing is seen from inside something opaque."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, exp, hypot, inf, sin
from typing import Final

from scenelang.graph.affine import composed, inverted
from scenelang.graph.nodes import Graph, Leaf
from scenelang.graph.stage import EXTINCTION
from scenelang.graph.steps import Affine, Displace, Step, Twist
from scenelang.passes.context import Context

Point = tuple[float, float, float]

_DISTANCES: Final[dict[str, Callable[[float, float, float], float]]] = {
    "sphere": lambda x, y, z: hypot(x, y, z) - 1.0,
    "torus": lambda x, y, z: hypot(hypot(x, z) - 0.7, y) - 0.3,
}

_DIM: Final = 0.1
"""A medium around the eye that lets less of the light through, in any direction, hides the scene."""


def check_eye(graph: Graph, context: Context) -> Graph:
    """Report an eye inside an opaque object, and warn of one deep in a medium.

    The exact fold at that one point, by its definition. Geometries that are not known by a formula are taken
    as far away, and as leaving nothing where they cut.

    Before: STREAM. After: unchanged.
    """
    if graph.stage is None or not context.whole:
        return graph
    eye, depth, holder = graph.stage.camera.eye, inf, None
    for link in graph.root.links:
        leaf = link.node
        if not isinstance(leaf, Leaf) or leaf.geometry not in _DISTANCES:
            if link.op in ("subtract", "intersect"):
                depth = inf
            continue
        steps = leaf.steps
        d = _distance(leaf.geometry, steps, eye) * graph.space.stretches(composed(steps))[0]
        if link.op == "subtract":
            depth = max(depth, -d)
        elif link.op == "intersect":
            depth = max(depth, d)
        elif link.op == "smooth":
            h = min(max(0.5 + 0.5 * (depth - d) / link.k, 0.0), 1.0)
            depth = (d if h == 1.0 else depth + h * (d - depth)) - link.k * h * (1.0 - h)
            holder = leaf if h > 0.5 else holder
        else:
            holder = leaf if d < max(depth, 0.0) else holder
            depth = min(depth, d)
    if depth < 0.0 and holder is not None and holder.look.material != "volumetric":
        x, y, z = eye
        fact = f"the eye at [{x:g}, {y:g}, {z:g}] is inside this `{holder.geometry}`"
        context.diagnostics.add("E0408", fact, holder.span, help="move the camera or the object")
    elif holder is not None and (through := exp(EXTINCTION * depth)) < _DIM:
        x, y, z = eye
        fact = f"the eye at [{x:g}, {y:g}, {z:g}] is deep inside this `{holder.geometry}`, a medium"
        help = f"it lets {through:.2g} of the light through at most: move the camera or the object"
        context.diagnostics.add("W0403", fact, holder.span, help=help)
    return graph


def _distance(geometry: str, steps: Sequence[Step], p: Point) -> float:
    """The leaf's own distance at a world point."""
    for step in reversed(steps):
        x, y, z = p
        if isinstance(step, Affine):
            a, b, c, u, d, e, f, v, g, h, i, w = inverted(step.rows)
            p = a * x + b * y + c * z + u, d * x + e * y + f * z + v, g * x + h * y + i * z + w
        elif isinstance(step, Displace):
            f = step.frequency
            bump = step.amount * sin(f * x) * sin(f * y) * sin(f * z)
            return _DISTANCES[geometry](x, y, z) + bump
        elif isinstance(step, Twist):
            s, c = sin(step.twist * y), cos(step.twist * y)
            p = c * x + s * z, y, c * z - s * x
        else:
            angle = step.twirl * hypot(x, y, z) + step.bend[0] * x + step.bend[1] * y
            s, c = sin(angle), cos(angle)
            p = c * x + s * y, c * y - s * x, z
    return _DISTANCES[geometry](*p)
