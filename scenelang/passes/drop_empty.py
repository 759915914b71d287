"""Empty groups and booleans vanish, and those of one child become that child."""

from __future__ import annotations

from scenelang.diagnostics.diagnostic import Label
from scenelang.graph.nodes import Fold, Graph, Leaf, Link, Node
from scenelang.graph.walk import bottom_up
from scenelang.passes.context import Context


def drop_empty(graph: Graph, context: Context) -> Graph:
    """Drop what is empty, and make transparent what has one child.

    A fold without links is the empty set, at distance +infinity from everywhere. So a union, `smooth` or
    subtraction with it changes nothing, subtracting from it or intersecting it leaves it empty, and what
    is joined to it by union or `smooth` begins the stream anew. All of it is exact, colours too.

    Before: any graph. After: COMPOSITE.
    """

    def fold(node: Fold, children: list[Node | None]) -> Node | None:
        links = _linked(node, children, context)
        if not links:
            return None
        if len(links) > 1:
            return Fold(node.kind, tuple(links), node.moves, node.span)
        only = links[0].node
        if not node.moves:
            return only
        moves = only.moves + node.moves
        if isinstance(only, Leaf):
            return Leaf(only.geometry, only.look, moves, only.span)
        return Fold(only.kind, only.links, moves, only.span)

    children = [bottom_up(link.node, _same, fold) for link in graph.root.links]
    root = Fold("scene", tuple(_linked(graph.root, children, context)))
    return graph.rooted(root)


def _same(leaf: Leaf) -> Node | None:
    return leaf


def _linked(fold: Fold, children: list[Node | None], context: Context) -> list[Link]:
    links: list[Link] = []
    for index, (link, child) in enumerate(zip(fold.links, children, strict=True)):
        if child is None:
            if link.op == "intersect" and links:
                context.diagnostics.add(
                    "W0401",
                    "an intersection with an empty node, which leaves nothing",
                    link.node.span,
                    labels=[Label(fold.span, "the intersection")] if fold.span is not None else [],
                    help="give the node a child, or drop it",
                )
                links.clear()
        elif links:
            links.append(Link(link.op, child, link.k))
        elif index == 0 or link.op in ("union", "smooth"):
            links.append(Link("union", child))
    return links
