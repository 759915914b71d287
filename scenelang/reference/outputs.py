"""Exact depth, normal, object and alpha, in float64, from the graph as written."""

from __future__ import annotations

import numpy as np

from scenelang.graph.nodes import Graph
from scenelang.graph.stage import EXTINCTION, Stage
from scenelang.outputs import DEEP, Outputs
from scenelang.reference.field import Array, Brought, evaluate
from scenelang.reference.image import check_shapes
from scenelang.reference.near import parts
from scenelang.reference.samples import sample_points
from scenelang.reference.solid.field import OPAQUE, Field
from scenelang.reference.solid.image import TILE, facing, seen_along, ways


def graph_outputs(graph: Graph, brought: Brought | None = None) -> Outputs:
    """All outputs that a lowered graph has.

    Args:
        brought: shapes of elements.

    Raises:
        ValueError: as `reference_image`.
    """
    check_shapes(graph, brought)
    width, height = graph.canvas
    found = np.zeros((6, height, width))  # depth, normal, object and alpha
    if graph.stage is None:
        for node, rows, columns in parts(graph.root, graph.canvas, brought):
            part = slice(rows.start, rows.stop), slice(columns.start, columns.stop)
            p = sample_points(graph.canvas, rows, 1, columns)
            d, owner = evaluate(node, p, owners=True, brought=brought)
            found[4][part] = np.where(d < 0, owner[:, 0], 0).reshape(len(rows), len(columns))
            covered = evaluate(node, sample_points(graph.canvas, rows, 2, columns), brought=brought)[0] < 0
            found[5][part] = covered.reshape(len(rows), 2, len(columns), 2).mean((1, 3))
        return Outputs(object=found[4].astype(np.int32), alpha=found[5].astype(np.float32))
    step = max(1, TILE // (4 * width))
    field = Field(graph.root, brought)
    for top in range(0, height, step):
        rows = range(top, min(top + step, height))
        centres = _shown(field, graph.stage, ways(graph.stage, graph.canvas, rows, 1))
        alpha = _covered(field, graph.stage, ways(graph.stage, graph.canvas, rows, 2))
        found[:5, rows.start : rows.stop] = centres.reshape(-1, len(rows), width)
        found[5, rows.start : rows.stop] = alpha.reshape(len(rows), 2, width, 2).mean((1, 3))
    depth, normal, owner, alpha = found[0], np.moveaxis(found[1:4], 0, 2), found[4], found[5]
    return Outputs(
        depth.astype(np.float32), normal.astype(np.float32), owner.astype(np.int32), alpha.astype(np.float32)
    )


def _covered(field: Field, stage: Stage, d: Array) -> Array:
    """How much of what is behind objects hide along unit directions d (3, M)."""
    _, end, changes = seen_along(field, stage, d)
    hit = changes.after == OPAQUE
    end[changes.ray[hit]] = changes.t[hit]
    covered = (changes.last == OPAQUE).astype(float)
    ray, enter, leave = changes.media(end)
    depth = np.bincount(ray, leave - enter, len(end))
    return 1.0 - (1.0 - covered) * np.exp(-EXTINCTION * depth)


def _shown(field: Field, stage: Stage, d: Array) -> Array:
    """Depth, normal and object (5, M) along unit directions d (3, M)."""
    o, end, changes = seen_along(field, stage, d)
    forward = np.asarray(stage.camera.axes()[0])
    out = np.zeros((5, len(end)))
    out[2, end < np.inf] = 1.0
    hit = changes.after == OPAQUE
    ray = changes.ray[hit]
    end[ray] = changes.t[hit]
    inside, enter, leave = changes.media(end)
    inside, first = np.unique(inside, return_index=True)
    t = np.minimum((enter[first] + leave[first]) / 2.0, enter[first] + DEEP)
    out[4, inside] = field.at(o[:, inside] + t * d[:, inside]).owner
    p = o[:, ray] + end[ray] * d[:, ray]
    state, out[1:4, ray] = facing(field, p, d[:, ray])
    out[4, ray] = state.owner
    out[0] = np.where(end < np.inf, (forward @ d) * np.where(end < np.inf, end, 1.0), np.inf)
    return out
