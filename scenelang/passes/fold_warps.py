"""Chains of leaves take their normal form: deformations towards the leaf, as few steps as the rules allow."""

from __future__ import annotations

from scenelang.graph.chain import merged, normal
from scenelang.graph.nodes import Graph, Leaf
from scenelang.graph.walk import map_leaves
from scenelang.passes.context import Context


def fold_warps(graph: Graph, context: Context) -> Graph:
    """Merge warps, moving them towards the leaf past rotations, reflections and uniform scales.

    Before: AT_LEAVES. After: MERGED, NO_IDENTITIES, and each leaf's moves are in the normal form of
    `scenelang.graph.chain.normal`, where the rules are proved.

    A learned lifting knows twirls and bends by themselves, as they are written, and no merged ones: for it
    identities alone are dropped.
    """
    exact = context.manifest.lifting == "exact"

    def change(leaf: Leaf) -> Leaf:
        if not leaf.moves:
            return leaf
        if exact:
            moves = normal(leaf.moves, graph.space)
        else:
            moves = merged([move for move in leaf.moves if not move.step.idle])
        return leaf if moves == leaf.moves else leaf.changed(leaf.look, moves)

    return map_leaves(graph, change, "fold_warps")
