"""A tree of booleans as one stream: where a left fold is equal it goes on in the open state, else in a group.

====================  =========================================================================
``(x op y) op z``     ``x op y op z``, as every fold is from the left
``S u (x u y)``       ``S u x u y``, exact everywhere, colours too
``S - (x u y)``       ``S - x - y``, exact everywhere where the edges are sharp
``S n (x n y)``       ``S n x n y``, likewise; so is ``S n (x - y)`` as ``S n x - y``
otherwise             a group: a renderer folds it by itself and joins it as one object
====================  =========================================================================

What follows in the operand is taken off its end: ``S u (x n y u z)`` is ``S u (x n y) u z``.
"""

from __future__ import annotations

from scenelang.graph.nodes import MOST_OPEN, Fold, Graph, Link, Node, bottom_up
from scenelang.passes.context import Context


def flatten(graph: Graph, context: Context) -> Graph:
    """Take composite operands apart where that changes nothing.

    Before: COMPOSITE, AT_LEAVES. After: STREAM, with the same distances and colours. Groups within more than
    15 others are reported as E0409, and any where the model has no stack as E0513, with cuts of a width.
    """
    root = bottom_up(graph.root, lambda leaf: leaf, _flat)
    assert isinstance(root, Fold)
    stack, stacks = [(root, 0)], context.manifest.any_blend
    while stack:
        fold, depth = stack.pop()
        group = fold if depth else None
        rounded = next((link.node for link in fold.links if link.op != "smooth" and link.width), None)
        if not stacks and (odd := group or rounded) is not None:
            what = f"a composite `{group.kind}` as an operand" if group is not None else "a cut with a width"
            fact = f"{what}, which model `{context.manifest.name}` does not draw"
            help = "leave `model` out: another one draws any tree of booleans"
            context.diagnostics.add("E0513", fact, odd.span, help=help)
            return graph.rooted(Fold("scene", ()))
        if depth > MOST_OPEN:
            fact = f"a composite `{fold.kind}` in {MOST_OPEN} others, each an operand of the next"
            help = "put the innermost first where its node allows: a first child opens no group"
            context.diagnostics.add("E0409", fact, fold.span, help=help)
            return graph.rooted(Fold("scene", ()))
        stack += [(link.node, depth + 1) for link in fold.links if isinstance(link.node, Fold)]
    return graph.rooted(root)


def _flat(fold: Fold, children: list[Node]) -> Node:
    links: list[Link] = []
    for link, child in zip(fold.links, children, strict=True):
        if not isinstance(child, Fold):
            links.append(Link(link.op, child, link.k))
            continue
        if not links:
            links += child.links
            continue
        core = _core(link, child)
        whole = Fold(child.kind, child.links[:core], (), child.span) if core > 1 else child.links[0].node
        links.append(Link(link.op, whole, link.k))
        for after in child.links[core:]:
            links.append(Link(after.op if link.op == "intersect" else link.op, after.node))
    return Fold(fold.kind, tuple(links), fold.moves, fold.span)


def _core(link: Link, operand: Fold) -> int:
    """Number of first links of a composite operand that have to stay together; 1: none."""
    if link.width:
        return len(operand.links)
    apart = ("intersect", "subtract") if link.op == "intersect" else ("union",)
    for at in range(len(operand.links) - 1, 0, -1):
        if operand.links[at].op not in apart or operand.links[at].width:
            return at + 1
    return 1
