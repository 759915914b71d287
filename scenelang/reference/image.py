"""The exact picture of a scene, in float64: the definition that accuracy is measured against.

It is drawn from the graph as written (`scenelang.graph.lower`), before any pass, so that it checks the
compiler too. No renderer imports it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scenelang.graph.nodes import Graph, leaves
from scenelang.image import Image, from_samples
from scenelang.reference.field import Brought, evaluate
from scenelang.reference.near import parts
from scenelang.reference.samples import sample_points
from scenelang.reference.solid.image import solid_image


def reference_image(
    graph: Graph,
    *,
    per_side: int = 2,
    brought: Brought | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Image:
    """Draw the exact picture of a lowered graph.

    Args:
        graph: from `lower`; passes keep its picture.
        per_side: samples along each side of a pixel; 2 is the definition (4 spp).
        brought: shapes of elements.
        progress: called with the share done, in [0, 1].

    Returns:
        (H, W, 3), or (H, W, 4) with straight alpha where the background is none.

    Raises:
        ValueError: the eye is inside something opaque, or a shape is known only by what was made of it.
    """
    check_shapes(graph, brought)
    if graph.stage is not None:
        return solid_image(
            graph.root, graph.stage, graph.canvas, per_side=per_side, brought=brought, progress=progress
        )
    width, height = graph.canvas
    colour = np.empty((height, width, 3))
    alpha = np.empty((height, width))
    done = 0
    for node, rows, columns in parts(graph.root, graph.canvas, brought):
        d, c = evaluate(node, sample_points(graph.canvas, rows, per_side, columns), brought=brought)
        inside = (d < 0).reshape(len(rows), per_side, len(columns), per_side)
        shown = np.where(inside[..., None], c.reshape(*inside.shape, 3), 0.0)
        part = slice(rows.start, rows.stop), slice(columns.start, columns.stop)
        colour[part] = shown.mean((1, 3))
        alpha[part] = inside.mean((1, 3))
        done += len(rows) * len(columns)
        progress(done / (width * height))
    if graph.background is None:
        return from_samples(colour, alpha)
    return from_samples(colour + (1 - alpha)[..., None] * np.asarray(graph.background), None)


def check_shapes(graph: Graph, brought: Brought | None) -> None:
    """Raise `ValueError` where a graph shows an element whose true shape is not given."""
    unknown = graph.elements.keys() - (brought or {}).keys()
    name = next((leaf.geometry for leaf in leaves(graph.root) if leaf.geometry in unknown), None)
    if name is not None:
        raise ValueError(f"the exact shape of `{name}` is not known")
