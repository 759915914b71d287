"""Neighbouring affine maps of one node compose into one."""

from __future__ import annotations

from scenelang.graph.chain import merged
from scenelang.graph.nodes import Graph
from scenelang.graph.walk import map_moves
from scenelang.passes.context import Context


def fold_affines(graph: Graph, context: Context) -> Graph:
    """Compose neighbouring affine maps, in float64.

    Before: any graph. After: MERGED. Doing it here, before `push_transforms`, keeps the chain that each
    group hands down short however deep it stands.
    """
    return map_moves(graph, merged, "fold_affines")
