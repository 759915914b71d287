"""The exact field: points of the world to distance and colour, through the chains and folds of a graph."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import add, mul
from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.graph.nodes import Fold, Leaf, Node
from scenelang.graph.steps import Affine, Step, Warp
from scenelang.reference.fold import combine
from scenelang.reference.leaves import Array, leaf_distance, namespace
from scenelang.words import TOKENS

Floats = npt.NDArray[np.float64]


def map_back(frame: Array, p: Array) -> list[Array]:
    """Points (d, …) through the inverse of an affine map, as d rows of d factors and a shift."""
    return [reduce(add, map(mul, row, p)) + row[-1] for row in frame]


def warp_back(twirl: Array, bend: Sequence[Array], p: Array) -> list[Array]:
    """``p -> R(twirl |p| + bend . p) p`` with ``R(a) p = (cos a x + sin a y, -sin a x + cos a y, …)``."""
    x, y, *others = p
    xp = namespace(x)
    angle = reduce(add, map(mul, bend, p), twirl * xp.sqrt(reduce(add, (c * c for c in p))))
    cos, sin = xp.cos(angle), xp.sin(angle)
    return [cos * x + sin * y, cos * y - sin * x, *others]


def carry_back(steps: Sequence[Step], p: Array) -> Array:
    """World points (d, M) to leaf coordinates: from the last step to the first."""
    for step in reversed(steps):
        if isinstance(step, Affine):
            inverse = np.linalg.inv(linear := _linear(step, len(p)))
            shift = -inverse @ np.reshape(step.rows, (3, 4))[: len(linear), 3]
            p = map_back(np.column_stack([inverse, shift]), p)
        elif isinstance(step, Warp):
            p = warp_back(step.twirl, step.bend, p)
    return p


def _linear(step: Affine, dimension: int) -> Floats:
    return np.reshape(step.rows, (3, 4))[:dimension, :dimension]


def distance_scale(steps: Sequence[Step], dimension: int = 2) -> float:
    """The smallest singular value of the linear part of the affine steps composed in order."""
    linear = np.eye(dimension)
    for step in steps:
        if isinstance(step, Affine):
            linear = _linear(step, dimension) @ linear
    return float(np.linalg.svd(linear, compute_uv=False)[-1])


def evaluate(node: Node, p: Array, outer: tuple[Step, ...] = ()) -> tuple[Any, Any]:
    """Distance D (M,) and colour C (M, 3) of a node at world points.

    Args:
        node: a leaf or a fold.
        p: world points (d, M), float64.
        outer: steps of the folds around it, nearest first.
    """
    steps = (*(move.step for move in node.moves), *outer)
    if isinstance(node, Leaf):
        d = leaf_distance(node.geometry, carry_back(steps, p)) * distance_scale(steps, len(p))
        return d, np.broadcast_to(np.asarray(node.look.colour(), np.float64), (*d.shape, 3))
    big_d, big_c = np.full(p[0].shape, np.inf), np.zeros((*p[0].shape, 3))
    for index, link in enumerate(node.links):
        d, c = evaluate(link.node, p, steps)
        empty = isinstance(link.node, Fold) and not link.node.links
        if index == 0:
            big_d, big_c = d, c
        elif not (empty and link.op == "smooth"):  # nothing blends with the empty set
            with np.errstate(invalid="ignore"):
                big_d, big_c = combine(big_d, big_c, d, c, TOKENS[link.op], link.k)
    return big_d, big_c
