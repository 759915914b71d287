"""Passes that drop what makes no difference: empty folds, and rows of the stream that nothing shows."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from scenelang.diagnostics.diagnostic import Label
from scenelang.graph.affine import composed
from scenelang.graph.bounds import Later, leaf_box, overlap
from scenelang.graph.nodes import Fold, Graph, Leaf, Link, Node, bottom_up, leaves, links_within
from scenelang.graph.space import Box, Space
from scenelang.graph.steps import Rows, Step
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


def drop_unseen(graph: Graph, context: Context) -> Graph:
    """Drop rows that provably stay out of what decides the picture, and whatever they leave without effect.

    Before: STREAM. After: STREAM; the reference image keeps every pixel.
    """
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
    """The rows that are kept; where the first one goes, so do those that only cut what is left.

    A row that goes had no effect, or was the first.
    """
    kept: list[Link] = []
    for index, link in enumerate(links):
        if link is None:
            continue
        if kept or index == 0:
            kept.append(link)
        elif link.op in ("union", "smooth"):
            first = link.node.links if isinstance(link.node, Fold) else (Link("union", link.node),)
            kept.extend(first)
    return tuple(kept)


_MOST = 8  # covers that are tried for each row: the largest ones seen, so that time stays linear

_INSIDE = 1.0 - 1e-9  # share of a cover's inner disc that counts, to cover the rounding of float64

Cover = tuple[float, Rows, float]
"""World radius, map from the world to the leaf, radius of the disc or ball inside it."""


def drop_hidden(graph: Graph, context: Context) -> Graph:
    """Drop unions and subtractions whose whole leaf lies inside one that a later union draws.

    What a row does to the picture stays within its leaf, and there the later union decides distance sign
    and colour alone. A blend looks at distances, so rows before the last one are kept. A leaf that is
    drawn twice in the very same place is covered too. What a group without blends draws or cuts lies within
    its leaves.

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
        elif link.op == "union":
            drawn.add((leaf.geometry, leaf.steps))
            disc = leaf.noted("cover", cover)
            if disc is not None and (len(covers) < _MOST or disc > covers[-1]):
                covers = sorted([*covers, disc], reverse=True)[:_MOST]
    return graph.rooted(Fold("scene", begun(kept)))


def cover_of(leaf: Leaf, space: Space) -> Cover | None:
    """The disc or ball that a leaf certainly fills, where one is known."""
    disc = space.disc(leaf.geometry, leaf.steps)
    if disc is None:
        return None
    radius, inward = disc
    return radius * space.stretches(composed(leaf.steps))[0], inward, radius * _INSIDE


def covered(box: Box, covers: list[Cover]) -> bool:
    """Whether a box lies inside one of some covers."""
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
