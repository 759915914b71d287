"""Passes over leaves: the moves of folds go to them, and their looks and chains take their normal form."""

from __future__ import annotations

from dataclasses import field

from scenelang.graph.chain import Moves, merged, normal
from scenelang.graph.looks import Look
from scenelang.graph.nodes import Fold, Graph, Leaf, Link, Node, map_leaves
from scenelang.passes.context import Context
from scenelang.records import Record


class _Open(Record, frozen=False):
    """A fold whose children are being visited, and the moves from its children's space to the world."""

    fold: Fold
    outward: Moves
    links: list[Link] = field(default_factory=list)


def push_transforms(graph: Graph, context: Context) -> Graph:
    """Append to each leaf's moves those of all folds around it, from the inside out.

    Moves that do nothing vanish and neighbouring affine maps compose, in float64, so that the chain which
    each group hands down stays short however deep it stands. A leaf's world distance is defined by its
    whole chain, so nothing changes but where the chain is kept.

    Before: any graph. After: AT_LEAVES, MERGED.
    """
    stack = [_Open(graph.root, graph.root.moves)]
    while True:
        here = stack[-1]
        if len(here.links) < len(here.fold.links):
            link = here.fold.links[len(here.links)]
            node = link.node
            if isinstance(node, Fold):
                stack.append(_Open(node, _tidy(node, here.outward)))
            else:
                if here.outward:
                    leaf = node.changed(node.look, _tidy(node, here.outward))
                else:
                    leaf = node.noted("push_transforms", _alone)
                here.links.append(Link(link.op, leaf, link.k))
            continue
        stack.pop()
        fold = Fold(here.fold.kind, tuple(here.links), (), here.fold.span)
        if not stack:
            return graph.rooted(fold)
        above = stack[-1]
        link = above.fold.links[len(above.links)]
        above.links.append(Link(link.op, fold, link.k))


def _alone(leaf: Leaf) -> Leaf:
    moves = _tidy(leaf, ())
    return leaf if moves == leaf.moves else leaf.changed(leaf.look, moves)


def _tidy(node: Node, outward: Moves) -> Moves:
    return merged([move for move in node.moves + outward if not move.step.idle])


def fold_looks(graph: Graph, context: Context) -> Graph:
    """Apply the colour operations of constant materials to their white, and drop moves of their textures.

    The moves of a texture compose to one, and its colour operations take their normal form. Objects that
    share a look still share it afterwards.

    Before: any graph. After: LOOKS.
    """
    folded: dict[int, Look] = {}

    def change(leaf: Leaf) -> Leaf:
        look = folded.get(id(leaf.look))
        if look is None:
            look = folded[id(leaf.look)] = leaf.look.folded()
        return leaf if look is leaf.look else leaf.changed(look, leaf.moves)

    return map_leaves(graph, change, "fold_looks")


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
