"""Rows of the stream that a later object is wholly drawn over vanish."""

from __future__ import annotations

from functools import partial

from scenelang.graph.affine import composed
from scenelang.graph.bounds import leaf_box
from scenelang.graph.nodes import Graph, Leaf
from scenelang.graph.space import Box, Space
from scenelang.graph.steps import Rows, Step
from scenelang.passes.context import Context
from scenelang.passes.drop_unseen import begun

_MOST = 8
"""Covers that are tried for each row: the largest ones seen, so that time stays linear."""

_INSIDE = 1.0 - 1e-9
"""Share of a cover's inner disc that counts, to cover the rounding of float64."""

Cover = tuple[float, Rows, float]
"""World radius, map from the world to the leaf, radius of the disc or ball inside it."""


def drop_hidden(graph: Graph, context: Context) -> Graph:
    """Drop unions and subtractions whose whole leaf lies inside one that a later union draws.

    What a row does to the picture stays within its leaf, and there the later union decides distance sign
    and colour alone. A `smooth` looks at distances, so rows before the last one are kept. A leaf that is
    drawn twice in the very same place is covered too.

    Before: STREAM. After: STREAM; the reference image keeps every pixel.
    """
    space, links = graph.space, graph.root.links
    keep = [True] * len(links)
    covers: list[Cover] = []
    drawn: set[tuple[str, tuple[Step, ...]]] = set()
    cover_of = partial(_cover, space=space)
    for index, (op, leaf) in reversed(list(enumerate(graph.rows()))):
        if op == "smooth":
            break
        if op == "intersect":
            continue
        key = leaf.geometry, leaf.steps
        if key in drawn or (covers and _covered(leaf_box(leaf, 0.0, space), covers)):
            keep[index] = False
        elif op == "union":
            drawn.add(key)
            cover = leaf.noted("cover", cover_of)
            if cover is not None and (len(covers) < _MOST or cover > covers[-1]):
                covers = sorted([*covers, cover], reverse=True)[:_MOST]
    return graph.rooted(begun(links, keep))


def _cover(leaf: Leaf, space: Space) -> Cover | None:
    disc = space.disc(leaf.geometry, leaf.steps)
    if disc is None:
        return None
    radius, inward = disc
    return radius * space.stretches(composed(leaf.steps))[0], inward, radius * _INSIDE


def _covered(box: Box, covers: list[Cover]) -> bool:
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
