"""The exact picture of a scene, in float64: the definition that accuracy is measured against.

It is drawn from the graph as written (`scenelang.graph.lower`), before any pass, so that it checks the
compiler too. No renderer imports it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scenelang.graph.nodes import Fold, Graph, Leaf, Node
from scenelang.graph.steps import Affine, Step
from scenelang.image import Image, from_samples
from scenelang.reference.distance import carry_back_affine, carry_back_warp, leaf_distance
from scenelang.reference.fold import combine

TOKENS = {"union": 0, "smooth": 1, "subtract": 2, "intersect": 3}
TILE = 1 << 18  # samples at a time

Array = npt.NDArray[np.float64]


def distance_scale(steps: tuple[Step, ...]) -> float:
    """The smallest singular value of the plane's linear part of the affine steps composed in order."""
    linear = np.eye(2)
    for step in steps:
        if isinstance(step, Affine):
            r = step.rows
            linear = np.array([[r[0], r[1]], [r[4], r[5]]]) @ linear
    return float(np.linalg.svd(linear, compute_uv=False)[1])


def carry_back(steps: tuple[Step, ...], x: Array, y: Array) -> tuple[Array, Array]:
    """World points to leaf coordinates: from the last step to the first."""
    for step in reversed(steps):
        if isinstance(step, Affine):
            r = step.rows
            linear = np.linalg.inv([[r[0], r[1]], [r[4], r[5]]])
            moved = -linear @ [r[3], r[7]]
            frame = ((linear[0, 0], linear[0, 1], moved[0]), (linear[1, 0], linear[1, 1], moved[1]))
            x, y = carry_back_affine(frame, x, y)
        else:
            x, y = carry_back_warp(step.twirl, *step.bend, x, y)
    return x, y


def evaluate(node: Node, x: Array, y: Array, outer: tuple[Step, ...] = ()) -> tuple[Array, Array]:
    """Distance D (M,) and colour C (M, 3) of a node at world points (M,).

    Args:
        node: a leaf or a fold.
        x, y: world points.
        outer: steps of the folds around it, nearest first.
    """
    steps = (*(move.step for move in node.moves), *outer)
    if isinstance(node, Leaf):
        qx, qy = carry_back(steps, x, y)
        d = leaf_distance(node.geometry, qx, qy) * distance_scale(steps)
        return d, np.broadcast_to(np.asarray(node.look.colour(), np.float64), (*d.shape, 3))
    big_d = np.full(x.shape, np.inf)
    big_c = np.zeros((*x.shape, 3))
    for index, link in enumerate(node.links):
        d, c = evaluate(link.node, x, y, steps)
        empty = isinstance(link.node, Fold) and not link.node.links
        if index == 0:
            big_d, big_c = d, c
        elif not (empty and link.op == "smooth"):  # nothing blends with the empty set
            with np.errstate(invalid="ignore"):
                big_d, big_c = combine(big_d, big_c, d, c, TOKENS[link.op])
    return big_d, big_c


def sample_points(canvas: tuple[int, int], rows: range, per_side: int) -> tuple[Array, Array]:
    """World coordinates of the samples of some pixel rows, (len(rows) per_side, W per_side) each."""
    width, height = canvas
    unit = min(width, height) / 2
    x = ((np.arange(width * per_side) + 0.5) / per_side - width / 2) / unit
    fine = np.arange(rows.start * per_side, rows.stop * per_side)
    y = (height / 2 - (fine + 0.5) / per_side) / unit
    shape = (len(y), len(x))
    return np.broadcast_to(x[None, :], shape), np.broadcast_to(y[:, None], shape)


def reference_image(graph: Graph, *, per_side: int = 2) -> Image:
    """Draw the exact picture of a lowered 2D graph.

    Args:
        graph: from `lower`; passes keep its picture.
        per_side: samples along each side of a pixel; 2 is the definition (4 spp).

    Returns:
        (H, W, 3), or (H, W, 4) with straight alpha where the background is none.
    """
    width, height = graph.canvas
    step = max(1, TILE // (width * per_side * per_side))
    colour = np.empty((height, width, 3))
    alpha = np.empty((height, width))
    for top in range(0, height, step):
        rows = range(top, min(top + step, height))
        x, y = sample_points(graph.canvas, rows, per_side)
        d, c = evaluate(graph.root, x.ravel(), y.ravel())
        inside = (d < 0).reshape(len(rows), per_side, width, per_side)
        shown = np.where(inside[..., None], c.reshape(*inside.shape, 3), 0.0)
        colour[top : rows.stop] = shown.mean((1, 3))
        alpha[top : rows.stop] = inside.mean((1, 3))
    if graph.background is None:
        return from_samples(colour, alpha)
    return from_samples(colour + (1 - alpha)[..., None] * np.asarray(graph.background), None)
