"""The exact picture of a scene and its outputs, in float64: the definition that accuracy is measured against.

It is drawn from the graph as written, before any pass, so that it checks the compiler too.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isqrt
from typing import Any

import numpy as np

from scenelang.compiler.graph import Graph, Node, leaves
from scenelang.compiler.spaces import Stage
from scenelang.drawing.exact.field import Array, Brought, evaluate, parts, sample_points
from scenelang.drawing.exact.light import sky_light
from scenelang.drawing.exact.outline import of_curves
from scenelang.drawing.exact.solid import OPAQUE, TILE, ExactField, facing, seen_along, solid_image, ways
from scenelang.drawing.image import DEEP, Image, Outputs, from_samples


def reference_image(
    graph: Graph,
    *,
    per_side: int | None = None,
    brought: Brought | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Image:
    """Draw the exact picture of a lowered graph: (H, W, 3), or (H, W, 4) with straight alpha where the
    background is none.

    A pixel has ``per_side`` samples along each side, by default as the scene says; ``brought`` are shapes of
    elements;
    ``progress`` is called with the share done. Raises `ValueError` where the eye is inside something opaque,
    or a shape is known only by what was made of it.
    """
    brought = true_shapes(graph, brought)
    per_side = per_side or isqrt(graph.samples)
    if (stage := graph.stage) is not None:
        how: Any = {"per_side": per_side, "brought": brought, "light": sky_light if stage.sky else None}
        return solid_image(graph.root, stage, graph.canvas, progress=progress, **how)
    width, height = graph.canvas
    colour = np.empty((height, width, 3))
    alpha = np.empty((height, width))
    done = 0
    for node, rows, columns in parts(graph.root, graph.canvas, brought):
        clear, p = translucent(node), sample_points(graph.canvas, rows, per_side, columns)
        d, c = evaluate(node, p, clear=clear, brought=brought)
        inside = (d < 0).reshape(len(rows), per_side, len(columns), per_side)
        shown = np.where(inside[..., None], c.reshape(*inside.shape, -1), 0.0)
        part = slice(rows.start, rows.stop), slice(columns.start, columns.stop)
        colour[part] = shown[..., :3].mean((1, 3))
        alpha[part] = (shown[..., 3] if clear else inside).mean((1, 3))
        done += len(rows) * len(columns)
        progress(done / (width * height))
    if graph.background is None:
        return from_samples(colour, alpha)
    return from_samples(colour + (1 - alpha)[..., None] * np.asarray(graph.background), None)


def translucent(node: Node) -> bool:
    """Return whether some object of a node is not opaque."""
    return any(leaf.look.opacity < 1.0 for leaf in leaves(node))


def true_shapes(graph: Graph, brought: Brought | None) -> Brought:
    """True shapes of the elements that a graph shows, those of outlines from their curves; raises
    `ValueError` where another one is not given.
    """
    result = dict(brought or {})
    for leaf in leaves(graph.root):
        if (element := graph.elements.get(name := leaf.geometry)) is not None and name not in result:
            if element.form != "outline":
                raise ValueError(f"the exact shape of `{name}` is not known")
            result[name] = of_curves(element)
    return result


def graph_outputs(graph: Graph, brought: Brought | None = None) -> Outputs:
    """All outputs that a lowered graph has; raises as `reference_image`."""
    brought = true_shapes(graph, brought)
    width, height = graph.canvas
    result = np.zeros((6, height, width))  # depth, normal, object and alpha
    side = isqrt(graph.samples)
    if graph.stage is None:
        for node, rows, columns in parts(graph.root, graph.canvas, brought):
            part = slice(rows.start, rows.stop), slice(columns.start, columns.stop)
            p = sample_points(graph.canvas, rows, 1, columns)
            d, owner = evaluate(node, p, owners=True, brought=brought)
            result[4][part] = np.where(d < 0, owner[:, 0], 0).reshape(len(rows), len(columns))
            p = sample_points(graph.canvas, rows, side, columns)
            d, owner = evaluate(node, p, owners=True, brought=brought)
            covered = np.where(d < 0, owner[:, 2], 0.0).reshape(len(rows), side, len(columns), side)
            result[5][part] = covered.mean((1, 3))
        return Outputs(object=result[4].astype(np.int32), alpha=result[5].astype(np.float32))
    step = max(1, TILE // (graph.samples * width))
    field = ExactField(graph.root, brought)
    for top in range(0, height, step):
        rows = range(top, min(top + step, height))
        centres = _shown(field, graph.stage, ways(graph.stage, graph.canvas, rows, 1))
        view = seen_along(field, graph.stage, ways(graph.stage, graph.canvas, rows, side))[1]
        alpha = 1.0 - (view.last != OPAQUE) * np.exp(-view.total)  # the share that objects hide
        result[:5, rows.start : rows.stop] = centres.reshape(-1, len(rows), width)
        result[5, rows.start : rows.stop] = alpha.reshape(len(rows), side, width, side).mean((1, 3))
    depth, normal = result[0].astype(np.float32), np.moveaxis(result[1:4], 0, 2).astype(np.float32)
    return Outputs(depth, normal, result[4].astype(np.int32), result[5].astype(np.float32))


def _shown(field: ExactField, stage: Stage, d: Array) -> Array:
    """Depth, normal and object (5, M) along unit directions d (3, M)."""
    o, view = seen_along(field, stage, d)
    end = view.end
    forward = np.asarray(stage.camera.axes()[0])
    out = np.zeros((5, len(end)))
    out[2, end < np.inf] = 1.0
    ray = np.nonzero(view.last == OPAQUE)[0]
    inside, first = np.unique(view.ray, return_index=True)
    enter, leave = view.enter[first], view.leave[first]
    t = np.minimum((enter + leave) / 2.0, enter + DEEP)
    out[4, inside] = field.at(o[:, inside] + t * d[:, inside]).owner
    state, out[1:4, ray] = facing(field, o[:, ray] + end[ray] * d[:, ray], d[:, ray])
    out[4, ray] = state.owner
    out[0] = np.where(end < np.inf, (forward @ d) * np.where(end < np.inf, end, 1.0), np.inf)
    return out
