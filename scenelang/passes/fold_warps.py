"""Chains of leaves take their normal form: deformations towards the leaf, as few steps as the rules allow."""

from __future__ import annotations

from scenelang.graph.chain import Moves, normal
from scenelang.graph.nodes import Graph
from scenelang.graph.walk import map_moves
from scenelang.passes.context import Context
from scenelang.passes.drop_identities import drop_identities


def fold_warps(graph: Graph, context: Context) -> Graph:
    """Merge warps, moving them towards the leaf past rotations, reflections and uniform scales.

    Before: AT_LEAVES. After: MERGED, NO_IDENTITIES, and each leaf's moves are in the normal form of
    `scenelang.graph.chain.normal`, where the rules are proved.

    A learned lifting knows twirls and bends by themselves, as they are written, and no merged ones: for it
    identities alone are dropped.
    """
    if context.manifest.lifting != "exact":
        return drop_identities(graph, context)

    def change(moves: Moves) -> Moves:
        return normal(moves, graph.space)

    return map_moves(graph, change, "fold_warps")
