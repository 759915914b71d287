"""What must hold of a graph between two passes. A broken invariant is a bug of the compiler."""

from __future__ import annotations

from collections.abc import Collection
from enum import Enum
from math import isfinite

from scenelang.graph.nodes import Fold, Graph, Leaf
from scenelang.graph.steps import Affine, Warp
from scenelang.graph.walk import nodes


class Invariant(Enum):
    """A property that a pass establishes and every later one keeps."""

    NO_IDENTITIES = "no move leaves every point where it is"
    COMPOSITE = "every fold below the root has at least two links"
    MERGED = "no two affine maps are neighbours"
    AT_LEAVES = "no fold has moves"
    STREAM = "every child of the root is a leaf"


class InternalError(RuntimeError):
    """A bug of the compiler, not of the scene."""


def verify(graph: Graph, stage: str, holds: Collection[Invariant] = ()) -> Graph:
    """Check a graph after ``stage``, the name of a pass or ``lower``.

    Args:
        graph: any graph.
        stage: whom to name.
        holds: what this stage and those before it established.

    Returns:
        The graph itself.

    Raises:
        InternalError: an invariant is broken.
    """
    flat = graph.dimension == 2
    fault: str | None = None
    if graph.root.kind != "scene" or graph.root.moves:
        fault = "the root is a scene without moves"
    tidy, merged = Invariant.NO_IDENTITIES in holds, Invariant.MERGED in holds
    for node, depth in nodes(graph.root):
        if isinstance(node, Fold):
            if node.links and node.links[0].op != "union":
                fault = "the first link of a fold is a union"
            if depth and Invariant.COMPOSITE in holds and len(node.links) < 2:
                fault = Invariant.COMPOSITE.value
            if node.moves and Invariant.AT_LEAVES in holds:
                fault = Invariant.AT_LEAVES.value
            if depth and Invariant.STREAM in holds:
                fault = Invariant.STREAM.value
        fault = _moves_fault(node, flat, tidy, merged) or fault
        if fault is not None:
            raise InternalError(f"internal error after pass `{stage}`: it does not hold that {fault}")
    return graph


def _moves_fault(node: Leaf | Fold, flat: bool, tidy: bool, merged: bool) -> str | None:
    before: object = None
    for move in node.moves:
        step = move.step
        if isinstance(step, Affine):
            if flat and (step.rows[2], step.rows[6], *step.rows[8:]) != _PLANE:
                return "a map of a 2D model keeps the plane"
            if merged and isinstance(before, Affine):
                return Invariant.MERGED.value
        elif tidy and step == _STILL:
            return Invariant.NO_IDENTITIES.value
        before = step
    if isinstance(node, Leaf) and not all(0.0 <= v <= 1.0 and isfinite(v) for v in node.rgb):
        return "colours lie in [0, 1]"
    return None


_PLANE = (0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
_STILL = Warp(0.0, (0.0, 0.0))
