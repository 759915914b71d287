"""Looks of constant materials become one colour."""

from __future__ import annotations

from scenelang.graph.looks import Look
from scenelang.graph.nodes import Graph, Leaf
from scenelang.graph.walk import map_leaves
from scenelang.passes.context import Context


def fold_looks(graph: Graph, context: Context) -> Graph:
    """Apply the colour operations of constant materials to their white, and drop moves of their textures.

    Objects that share a look still share it afterwards.

    Before: any graph. After: LOOKS.
    """
    folded: dict[int, Look] = {}

    def change(leaf: Leaf) -> Leaf:
        look = folded.get(id(leaf.look))
        if look is None:
            look = folded[id(leaf.look)] = leaf.look.folded()
        return leaf if look is leaf.look else leaf.changed(look, leaf.moves)

    return map_leaves(graph, change, "fold_looks")
