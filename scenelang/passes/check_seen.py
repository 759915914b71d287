"""Report a picture of one colour, where bounds prove it: nothing is in sight, or one object covers all."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import hypot, tan
from typing import Final

from scenelang.diagnostics.span import Span
from scenelang.graph.bounds import leaf_box, meet, overlap
from scenelang.graph.nodes import Fold, Graph, Leaf, Link, links_within
from scenelang.graph.space import Box
from scenelang.passes.context import Context
from scenelang.passes.drop import cover_of, covered

_FAR: Final = 8.0
"""Coordinates and sizes beyond so many units were most likely meant as pixels."""
_TESTS: Final = 20_000
"""Boxes that are compared before nothing is said, so that no scene takes long."""


def check_seen(graph: Graph, context: Context) -> Graph:
    """Warn where the picture provably shows nothing but the background, or one object without a texture.

    Before: STREAM. After: unchanged.
    """
    rows = graph.rows()
    if not context.whole or not rows:
        return graph
    boxes, cut = _left(graph)
    if boxes is None:
        return graph
    seen = [box for box in boxes if _in_sight(box, graph)]
    if context.moves and (seen or not boxes or not all(_is_far(box) for box in boxes)):
        return graph  # it may be in sight in another frame
    last = rows[-1].leaf
    if not boxes and cut is not None:
        fact = "nothing is left of the scene: the last cut takes all of it"
        _say(context, fact, cut, "let what is cut reach out of what cuts it, or what intersects meet")
    elif not seen:
        _say(context, *_unseen(graph, rows[0].leaf))
    elif graph.stage is None and graph.root.links[-1] == Link("union", last) and last.look.element is None:
        cover = cover_of(last, graph.space)
        if cover is not None and covered(graph.window(), [cover]):
            fact = f"this `{last.geometry}` covers the whole canvas: the picture has one colour"
            _say(context, fact, last.span, _units(graph, cover[0] > _FAR))
    return graph


def _say(context: Context, fact: str, span: Span | None, help: str) -> None:
    context.diagnostics.add("W0402", fact, span, help=help)


def _left(graph: Graph) -> tuple[list[Box] | None, Span | None]:
    """Boxes that hold all that the fold leaves, None where that is not known, and what left none of them."""
    widths = [link.width for link in links_within(graph.root) if link.op == "smooth"]
    felt, tests = sum(widths) / 4, 0  # blends add so much at most

    def left(fold: Fold) -> tuple[list[Box] | None, Span | None]:
        nonlocal tests
        boxes, cut = list[Box](), None
        for link in fold.links:
            node, op = link.node, link.op
            own = [leaf_box(node, felt, graph.space)] if isinstance(node, Leaf) else left(node)[0]
            tests += len(boxes) * len(own or ())
            if own is None or tests > _TESTS:
                return None, None
            if op in ("union", "smooth"):
                boxes += own
            elif op == "intersect":
                pairs = (meet(a, b) for a, b in product(boxes, own))
                boxes = [shared for shared in pairs if shared is not None]
            elif not felt and isinstance(node, Leaf) and (disc := cover_of(node, graph.space)) is not None:
                boxes = [box for box in boxes if not covered(box, [disc])]
            cut = cut if boxes or cut is not None else node.span
        return boxes, None if boxes else cut

    return left(graph.root)


def _in_sight(box: Box, graph: Graph) -> bool:
    """Whether something in a box may be seen."""
    if (stage := graph.stage) is None:
        return overlap(box, graph.window())
    eye, (forward, right, up) = stage.camera.eye, stage.camera.axes()
    if stage.ground is not None and eye[1] > stage.ground.y > box[3]:
        return False
    side, reach = min(graph.canvas), tan(stage.camera.fov_rad / 2)
    wide, high = (reach * pixels / side for pixels in graph.canvas)
    planes: list[Sequence[float]] = [forward]
    for axis, half in ((right, wide), (up, high)):
        planes += [_plus(forward, axis, half, sign) for sign in (1.0, -1.0)]
    corners = [*product((box[0], box[2]), (box[1], box[3]), (box[4], box[5]))]
    return all(
        any(not sum(n * (p - e) for n, p, e in zip(plane, at, eye, strict=True)) < 0.0 for at in corners)
        for plane in planes
    )


def _plus(forward: Sequence[float], axis: Sequence[float], half: float, sign: float) -> tuple[float, ...]:
    """The inward normal of a side of what the camera sees."""
    return tuple(half * f + sign * a for f, a in zip(forward, axis, strict=True))


def _is_far(box: Box) -> bool:
    return hypot((box[0] + box[2]) / 2, (box[1] + box[3]) / 2) > _FAR


def _unseen(graph: Graph, leaf: Leaf) -> tuple[str, Span | None, str]:
    """Message, place and help where everything lies out of sight."""
    if graph.stage is None:
        far = _is_far(leaf_box(leaf, 0.0, graph.space))
        return "everything lies off the canvas", leaf.span, _units(graph, far)
    eye, target = (
        ", ".join(f"{v:g}" for v in p) for p in (graph.stage.camera.eye, graph.stage.camera.target)
    )
    help = f"the camera at [{eye}] looks at [{target}], and the ground hides what is below it; "
    return "no object is in sight", leaf.span, f"{help}move the objects, or turn the camera by `target`"


def _units(graph: Graph, pixels: bool) -> str:
    """Extent of the canvas, and how to write in pixels where those were likely meant."""
    width, height = graph.canvas
    side = min(width, height)
    shown = f"the canvas shows x from {-width / side:.3g} to {width / side:.3g}, y from {-height / side:.3g} "
    shown += f"to {height / side:.3g}"
    if not pixels:
        return shown
    group = f"group {{ … translate({-width / 2:g}, {-height / 2:g}); scale({2 / side:.6g}); }}"
    return f"{shown}, in units that are not pixels; to write in pixels put all objects into {group}"
