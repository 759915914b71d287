"""Nothing is seen from inside something opaque."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, exp, hypot, inf, sin
from typing import Final

from scenelang.graph.affine import composed, inverted
from scenelang.graph.geometries import GEOMETRIES
from scenelang.graph.nodes import Fold, Graph, Leaf
from scenelang.graph.space import Space
from scenelang.graph.stage import EXTINCTION
from scenelang.graph.steps import Affine, Displace, Step, Twist
from scenelang.passes.context import Context

Point = tuple[float, float, float]

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
    eye = graph.stage.camera.eye
    depth, holder = _folded(graph.root, eye, graph.space)
    if depth < 0.0 and holder is not None and holder.look.material != "volumetric":
        x, y, z = eye
        fact = f"the eye at [{x:g}, {y:g}, {z:g}] is inside this `{holder.geometry}`"
        context.diagnostics.add("E0408", fact, holder.span, help="move the camera or the object")
    elif depth < 0.0 and holder is not None and (through := exp(EXTINCTION * depth)) < _DIM:
        x, y, z = eye
        fact = f"the eye at [{x:g}, {y:g}, {z:g}] is deep inside this `{holder.geometry}`, a medium"
        help = f"it lets {through:.2g} of the light through at most: move the camera or the object"
        context.diagnostics.add("W0403", fact, holder.span, help=help)
    return graph


def _folded(fold: Fold, eye: Point, space: Space) -> tuple[float, Leaf | None]:
    """The distance of a fold at a point, and the leaf whose material holds there."""
    depth, holder = inf, None
    for link in fold.links:
        node, k = link.node, link.width
        if isinstance(node, Fold):
            d, leaf = _folded(node, eye, space)
        elif node.geometry in GEOMETRIES:
            d, leaf = _distance(node.geometry, node.steps, eye), node
            d *= space.stretches(composed(node.steps))[0]
        else:
            d, leaf = inf, None
        if link.op in ("subtract", "intersect"):
            cut = -d if link.op == "subtract" and leaf is not None else d
            depth = -_smooth(-depth, -cut, k)[0] if k else max(depth, cut)
        elif link.op == "smooth":
            depth, h = _smooth(depth, d, k)
            holder = leaf if h > 0.5 else holder
        else:
            holder = leaf if d < max(depth, 0.0) else holder
            depth = min(depth, d)
    return depth, holder


def _smooth(depth: float, d: float, k: float) -> tuple[float, float]:
    """The distance of a blend, and the share of what joins."""
    if inf in (abs(depth), abs(d)):
        return min(depth, d), float(d < depth)
    h = min(max(0.5 + 0.5 * (depth - d) / k, 0.0), 1.0)
    return (d if h == 1.0 else depth + h * (d - depth)) - k * h * (1.0 - h), h


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
            return float(GEOMETRIES[geometry].distance(p)) + bump
        elif isinstance(step, Twist):
            s, c = sin(step.twist * y), cos(step.twist * y)
            p = c * x + s * z, y, c * z - s * x
        else:
            angle = step.twirl * hypot(x, y, z) + step.bend[0] * x + step.bend[1] * y
            s, c = sin(angle), cos(angle)
            p = c * x + s * y, c * y - s * x, z
    return float(GEOMETRIES[geometry].distance(p))
