"""Rows of the stream that nothing in the picture can feel vanish."""

from __future__ import annotations

from collections.abc import Sequence

from scenelang.graph.bounds import felt_level, leaf_box, overlap
from scenelang.graph.nodes import BLEND, Fold, Graph, Link
from scenelang.passes.context import Context


def drop_unseen(graph: Graph, context: Context) -> Graph:
    """Drop rows that provably stay out of what decides the picture, and whatever they leave without effect.

    Before: STREAM. After: STREAM; the reference image keeps every pixel.
    """
    window = graph.window()
    links = graph.root.links
    keep = [False] * len(links)
    smooths = 0.0
    for index, (op, leaf) in reversed(list(enumerate(graph.rows()))):
        level = felt_level(op, links[index].k, smooths)
        if level is None or overlap(leaf_box(leaf, level, graph.space), window):
            keep[index] = True
            smooths += links[index].k / BLEND if op == "smooth" else 0.0
        elif op == "intersect":
            break  # what comes before is cut down to nothing on the canvas
    return graph.rooted(begun(links, keep))


def begun(links: Sequence[Link], keep: Sequence[bool]) -> Fold:
    """The stream of the rows to keep; where its first row goes, so do those that only cut what is left.

    Args:
        links: a stream.
        keep: for each row whether it stays; a row that goes had no effect, or was the first.
    """
    kept: list[Link] = []
    for index, (link, stays) in enumerate(zip(links, keep, strict=True)):
        if not stays:
            continue
        if kept:
            kept.append(link)
        elif index == 0 or link.op in ("union", "smooth"):
            kept.append(Link("union", link.node))
    return Fold("scene", tuple(kept))
