"""Passes that rewrite a graph: drop what makes no difference, make trees one stream, order chains.

====================  =========================================================================
``(x op y) op z``     ``x op y op z``, as every fold is from the left
``S u (x u y)``       ``S u x u y``, exact everywhere, colours too
``S - (x u y)``       ``S - x - y``, exact everywhere where the edges are sharp
``S n (x n y)``       ``S n x n y``, likewise; so is ``S n (x - y)`` as ``S n x - y``
otherwise             a group: a renderer folds it by itself and joins it as one object
====================  =========================================================================

Later links of the operand that may stand apart do: ``S u (x n y u z)`` is ``S u (x n y) u z``.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from scenelang.assets.records import Record
from scenelang.compiler.chain import Moves, merged, normal
from scenelang.compiler.graph import (
    MOST_OPEN,
    Fold,
    Graph,
    Later,
    Leaf,
    Link,
    Look,
    Node,
    bottom_up,
    leaf_box,
    leaves,
    links_within,
    map_leaves,
    overlap,
)
from scenelang.compiler.manifest import Manifest
from scenelang.compiler.spaces import Box, Space
from scenelang.compiler.steps import Rows, Step, composed
from scenelang.language.diagnostics import Diagnostics, Label


class Context(Record):
    """The model a graph is compiled for, and where its mistakes (E04xx, E05xx) and warnings go.

    ``whole`` is False after an earlier error, when no bound means anything. ``moves`` is True for a frame of
    an animation, where nothing may be in sight for a while.
    """

    manifest: Manifest
    diagnostics: Diagnostics
    whole: bool = True
    moves: bool = False


def drop_empty(graph: Graph, context: Context) -> Graph:
    """Drop empty folds, and replace folds with one child by that child.

    A fold without links is the empty set, at distance +infinity. A union, `smooth` or subtraction with it
    changes nothing; subtracting from it or intersecting it leaves it empty. After: COMPOSITE.
    """

    def fold(node: Fold, children: list[Node | None]) -> Node | None:
        if not (links := _linked(node, children, context)):
            return None
        if len(links) > 1:
            return Fold(node.kind, tuple(links), node.moves, node.span)
        only = links[0].node
        if not node.moves:
            return only
        moves = only.moves + node.moves
        if isinstance(only, Leaf):
            return Leaf(only.geometry, only.look, moves, only.span, only.number)
        return Fold(only.kind, only.links, moves, only.span)

    children = [bottom_up(link.node, lambda leaf: leaf, fold) for link in graph.root.links]
    root = Fold("scene", tuple(_linked(graph.root, children, context)))
    return graph.rooted(root)


def _linked(fold: Fold, children: list[Node | None], context: Context) -> list[Link]:
    links: list[Link] = []
    for index, (link, child) in enumerate(zip(fold.links, children, strict=True)):
        if child is None:
            if link.op == "intersect" and links:
                fact = "an intersection with an empty node, which leaves nothing"
                help = "give the node a child, or drop it"
                labels = [] if fold.span is None else [Label(fold.span, "the intersection")]
                context.diagnostics.add("W0401", fact, link.node.span, labels=labels, help=help)
                links.clear()
        elif links:
            links.append(Link(link.op, child, link.k))
        elif index == 0 or link.op in ("union", "smooth"):
            links.append(Link("union", child))
    return links


def drop_unseen(graph: Graph, context: Context) -> Graph:
    """Drop rows that provably have no effect on the picture, and rows that then have none; STREAM stays."""
    window, space = graph.window(), graph.space

    def seen(fold: Fold, later: Later) -> tuple[Link, ...]:
        kept: list[Link | None] = [None] * len(fold.links)
        for index in range(len(fold.links) - 1, -1, -1):
            link = fold.links[index]
            own, node = later.of(link.op, link.width), link.node
            if isinstance(node, Fold):
                links = seen(node, own)
                matters = bool(links)
                node = Fold(node.kind, links, (), node.span) if len(links) > 1 else node
                node = links[0].node if len(links) == 1 else node
            else:
                level = own.level
                matters = level is None or overlap(leaf_box(node, level, space), window)
            if matters:
                kept[index] = Link(link.op, node, link.k) if node is not link.node else link
                later = later.before(link.op, link.width)
            elif link.op == "intersect":
                break  # what comes before is cut down to nothing on the canvas
        return begun(kept)

    return graph.rooted(Fold("scene", seen(graph.root, Later())))


def begun(links: Sequence[Link | None]) -> tuple[Link, ...]:
    """The links that are not dropped; behind a dropped first one, cuts go too, up to the next union."""
    result: list[Link] = []
    for index, link in enumerate(links):
        if link is None:
            continue
        if result or index == 0:
            result.append(link)
        elif link.op in ("union", "smooth"):
            first = link.node.links if isinstance(link.node, Fold) else (Link("union", link.node),)
            result.extend(first)
    return tuple(result)


_MOST = 8  # covers that each row is compared with: the largest so far, so that time stays linear

_INSIDE = 1.0 - 1e-9  # share of a cover's inner disc that counts, to cover the rounding of float64

Cover = tuple[float, Rows, float]
"""World radius, map from the world to the leaf, radius of the disc or ball inside it."""


def drop_hidden(graph: Graph, context: Context) -> Graph:
    """Drop unions and subtractions whose whole leaf lies inside one that a later union draws.

    A row's effect stays within its leaf, and there the later union alone decides. A blend uses distances, so
    rows before the last blend stay, and groups with blends. A leaf drawn twice in one place is covered too.
    What is translucent covers nothing.
    Before: STREAM. After: STREAM; the reference image keeps every pixel.
    """
    space = graph.space
    covers: list[Cover] = []
    drawn: set[tuple[str, tuple[Step, ...]]] = set()
    cover = partial(cover_of, space=space)

    def hidden(leaf: Leaf) -> bool:
        key = leaf.geometry, leaf.steps
        return key in drawn or (bool(covers) and covered(leaf_box(leaf, 0.0, space), covers))

    kept: list[Link | None] = list(graph.root.links)
    for index in range(len(kept) - 1, -1, -1):
        link = graph.root.links[index]
        if link.width:
            break
        if link.op == "intersect":
            continue
        if isinstance(link.node, Fold):
            blends = any(inner.width for inner in links_within(link.node))
            if not blends and all(hidden(leaf) for leaf in leaves(link.node)):
                kept[index] = None
        elif hidden(leaf := link.node):
            kept[index] = None
        elif link.op == "union" and leaf.look.opacity == 1.0:
            drawn.add((leaf.geometry, leaf.steps))
            disc = leaf.noted("cover", cover)
            if disc is not None and (len(covers) < _MOST or disc > covers[-1]):
                covers = sorted([*covers, disc], reverse=True)[:_MOST]
    return graph.rooted(Fold("scene", begun(kept)))


def cover_of(leaf: Leaf, space: Space) -> Cover | None:
    """A disc or ball that lies within a leaf, where one is known."""
    if (disc := space.disc(leaf.geometry, leaf.steps)) is None:
        return None
    radius, inward = disc
    return radius * space.stretches(composed(leaf.steps))[0], inward, radius * _INSIDE


def covered(box: Box, covers: list[Cover]) -> bool:
    left, bottom, right, top, near, far = box
    depths = (near,) if near == far else (near, far)
    corners = [(x, y, z) for x in (left, right) for y in (bottom, top) for z in depths]
    for _, rows, radius in covers:
        a, b, c, x, d, e, f, y, g, h, i, z = rows
        limit = radius * radius
        # A ball is convex: a box is inside when its corners are.
        for p, q, r in corners:
            u, v, w = a * p + b * q + c * r + x, d * p + e * q + f * r + y, g * p + h * q + i * r + z
            if not u * u + v * v + w * w < limit:
                break
        else:
            return True
    return False


def flatten(graph: Graph, context: Context) -> Graph:
    """Take composite operands apart where that does not change the result.

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


def push_transforms(graph: Graph, context: Context) -> Graph:
    """Append to each leaf's moves those of all folds around it, from the inside out.

    Moves that do nothing vanish and neighbouring affine maps compose, so that chains stay short at any depth.
    Before: any graph. After: AT_LEAVES, MERGED.
    """

    def pushed(fold: Fold, outward: Moves) -> Fold:
        links: list[Link] = []
        for link in fold.links:
            node = link.node
            if isinstance(node, Fold):
                node = pushed(node, _tidy(node, outward))
            elif outward:
                node = node.changed(node.look, _tidy(node, outward))
            else:
                node = node.noted("push_transforms", _alone)
            links.append(Link(link.op, node, link.k))
        return Fold(fold.kind, tuple(links), (), fold.span)

    return graph.rooted(pushed(graph.root, graph.root.moves))


def _alone(leaf: Leaf) -> Leaf:
    moves = _tidy(leaf, ())
    return leaf if moves == leaf.moves else leaf.changed(leaf.look, moves)


def _tidy(node: Node, outward: Moves) -> Moves:
    return merged([move for move in node.moves + outward if not move.step.idle])


def fold_looks(graph: Graph, context: Context) -> Graph:
    """Fold constant materials to colours; compose moves of textures, normalise their colour operations.

    Objects that share a look still share it afterwards. Before: any graph. After: LOOKS.
    """
    folded: dict[int, Look] = {}

    def change(leaf: Leaf) -> Leaf:
        if (look := folded.get(id(leaf.look))) is None:
            look = folded[id(leaf.look)] = leaf.look.folded()
        return leaf if look is leaf.look else leaf.changed(look, leaf.moves)

    return map_leaves(graph, change, "fold_looks")


def fold_warps(graph: Graph, context: Context) -> Graph:
    """Merge warps, past rotations, reflections and uniform scales; a learned lifting drops identities alone.

    Before: AT_LEAVES. After: MERGED, NO_IDENTITIES, and chains are in the form of `chain.normal`.
    """
    exact = context.manifest.lifting == "exact"

    def change(leaf: Leaf) -> Leaf:
        if not leaf.moves:
            return leaf
        moves = normal(leaf.moves, graph.space) if exact else _tidy(leaf, ())
        return leaf if moves == leaf.moves else leaf.changed(leaf.look, moves)

    return map_leaves(graph, change, "fold_warps")
