"""Parts of a picture in the plane, each with what can matter there: without the rest the picture is the same.

A disc of points is carried back to each leaf. As a leaf's distance changes by no more than a point moves, the
distance at the centre tells whether all of the disc is outside.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import product
from math import hypot, inf, isnan

import numpy as np

from scenelang.graph.nodes import Fold, Leaf, Link, Node, leaves
from scenelang.graph.steps import Affine, Step, Warp
from scenelang.reference.field import Array, Brought, carry_back, distance_scale, frame_back, leaf_distance

_MOST, _LEAST = 1 << 16, 1 << 10  # pixels of a part that is halved whatever it holds, and of one that is not
_FEW = 4  # objects that are no reason to go on halving
_DIGITS = 1e-12  # of a coordinate: more than float64 loses in a step


def parts(
    root: Fold, canvas: tuple[int, int], brought: Brought | None
) -> Iterator[tuple[Node, range, range]]:
    """What there is to draw in each part of a picture: a node, rows and columns."""
    (width, height), unit = canvas, min(canvas) / 2
    todo: list[tuple[Node, range, range]] = [(root, range(height), range(width))]
    while todo:
        node, rows, columns = todo.pop()
        across, down = columns.start + columns.stop - width, height - rows.start - rows.stop
        radius = hypot(len(rows), len(columns)) / 2 / unit * (1.0 + 1e-9)
        low, node = within(node, np.array([[across], [down]]) / 2 / unit, radius, brought=brought)
        few = low > 0 or sum(1 for _ in leaves(node)) <= _FEW
        if len(rows) * len(columns) <= (_MOST if few else _LEAST):
            yield Fold("scene", ()) if low > 0 else node, rows, columns
        else:
            todo += [(node, *half) for half in product(_halves(rows), _halves(columns))]


def _halves(side: range) -> list[range]:
    middle = len(side) // 2
    return [half for half in (side[:middle], side[middle:]) if half]


def within(
    node: Node,
    centre: Array,
    radius: float,
    outer: tuple[Step, ...] = (),
    *,
    signed: bool = True,
    brought: Brought | None = None,
) -> tuple[float, Node]:
    """A bound below the distance of a node in a disc of world points, and the node without what is outside.

    Args:
        centre, radius: of the disc, (2, 1) and world units.
        outer: steps of the folds around the node, nearest first.
        signed: whether no more is asked for than the sign of the distance, and the colour where it is
            negative. Else nothing is left out: a blend wants the distance itself.
        brought: shapes of elements.
    """
    steps = (*(move.step for move in node.moves), *outer)
    if isinstance(node, Leaf):
        q, spread = _carried(steps, centre, radius)
        low = float(leaf_distance(node.geometry, q, brought)[0] - spread) * distance_scale(steps)
        return (-inf if isnan(low) else low), node
    last = max((index for index, link in enumerate(node.links) if link.width), default=-1)
    low = inf
    kept: list[Link] = []
    for index, link in enumerate(node.links):
        free = signed and index > last
        own, child = within(link.node, centre, radius, steps, signed=free, brought=brought)
        if free and ((own > 0 and link.op != "intersect") or (index and not kept and link.op != "union")):
            low = min(low, own) if link.op == "union" else low
            continue
        kept.append(Link(link.op, child, link.k))
        if link.op == "intersect":
            low = max(low, own)
        elif link.op != "subtract":
            low = min(low, own) - link.width / 4  # what a blend adds at most
    return low, Fold(node.kind, tuple(kept), node.moves, node.span)


def _carried(steps: tuple[Step, ...], centre: Array, radius: float) -> tuple[Array, float]:
    """A disc carried back: the centre, and the radius of a disc around it that holds all of its points."""
    for step in reversed(steps):
        size = hypot(*np.ravel(centre))
        if isinstance(step, Affine):
            radius = _stretch(step) * (radius + _DIGITS * (size + hypot(step.rows[3], step.rows[7])))
        elif isinstance(step, Warp):
            rate = abs(step.twirl) + hypot(*step.bend)  # how fast the angle changes
            radius = (radius + _DIGITS * size) * (1.0 + rate * (size + radius))
        centre = np.asarray(carry_back((step,), centre))
    return centre, radius


@lru_cache(maxsize=1 << 12)
def _stretch(step: Affine) -> float:
    """By how much the way back through an affine map lengthens at most."""
    return float(np.linalg.norm(frame_back(step, 2)[:, :2], 2))
