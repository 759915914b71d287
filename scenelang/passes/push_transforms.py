"""The moves of groups, chains and booleans go to their leaves."""

from __future__ import annotations

from dataclasses import dataclass, field

from scenelang.graph.chain import Moves, merged
from scenelang.graph.nodes import Fold, Graph, Leaf, Link
from scenelang.passes.context import Context


@dataclass(slots=True)
class _Open:
    """A fold whose children are being visited, and the moves from its children's space to the world."""

    fold: Fold
    outward: Moves
    links: list[Link] = field(default_factory=list)


def push_transforms(graph: Graph, context: Context) -> Graph:
    """Append to each leaf's moves those of all folds around it, from the inside out.

    A leaf's world distance is defined by its whole chain, so nothing changes but where the chain is kept.

    Before: MERGED. After: AT_LEAVES, MERGED.
    """
    stack = [_Open(graph.root, graph.root.moves)]
    while True:
        here = stack[-1]
        if len(here.links) < len(here.fold.links):
            link = here.fold.links[len(here.links)]
            node = link.node
            if isinstance(node, Leaf) and not here.outward:
                here.links.append(link)
                continue
            moves = merged(node.moves + here.outward) if here.outward else node.moves
            if isinstance(node, Leaf):
                here.links.append(Link(link.op, node.moved(moves)))
            else:
                stack.append(_Open(node, moves))
            continue
        stack.pop()
        fold = Fold(here.fold.kind, tuple(here.links), (), here.fold.span)
        if not stack:
            return graph.rooted(fold)
        above = stack[-1]
        above.links.append(Link(above.fold.links[len(above.links)].op, fold))
