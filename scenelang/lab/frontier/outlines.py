"""Outlines of the plane's objects as polygons, for rasterisers: the reference's chains run forwards."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.graph.geometries import SECTORS
from scenelang.graph.nodes import Fold, Graph, Leaf, Node
from scenelang.graph.steps import Affine, Step, Warp

Points = npt.NDArray[np.float64]
TOLERANCE: Final = 0.02
"""Pixels that a polygon may be away from its outline."""
_COARSE: Final = 8  # points of an edge that tell how many it needs
_SPARE: Final = 2.0  # an estimate by second differences, which are larger between its points
_TURNS: Final = 30  # at most, of Newton's method


class Outline(NamedTuple):
    """An object's polygon (2, M) in pixels, x right and y down, and its colour (3,) in [0, 1]."""

    points: Points
    colour: tuple[float, float, float]


def outlines(graph: Graph) -> list[Outline]:
    """The objects of a union, those that hide others last.

    Args:
        graph: from `lower`.

    Raises:
        ValueError: an operator is not a union, or a bend folds an object over itself.
    """
    width, height = graph.canvas
    unit = min(width, height) / 2
    middle = np.array([[width / 2], [height / 2]])
    made = []
    for leaf, steps in _leaves(graph.root, ()):
        corners = _corners(leaf.geometry)
        coarse = _placed(corners, np.full(corners.shape[1], _COARSE), steps) * unit
        edges = coarse.reshape(2, -1, _COARSE)
        ends = np.concatenate([edges, np.roll(edges[..., :1], -1, 1)], -1)
        sag = np.hypot(*np.diff(ends, 2)).max(-1) / 8  # of a chord, by how its neighbours turn
        count = np.ceil(_COARSE * np.sqrt(_SPARE * sag / TOLERANCE)).clip(1, 10_000).astype(int)
        points = _placed(corners, count, steps) * unit
        red, green, blue = leaf.look.colour()
        made.append(Outline(middle + points * [[1], [-1]], (red, green, blue)))
    return made


def _leaves(node: Node, outer: tuple[Step, ...]) -> Iterator[tuple[Leaf, tuple[Step, ...]]]:
    steps = (*(move.step for move in node.moves), *outer)
    if isinstance(node, Leaf):
        yield node, steps
        return
    assert isinstance(node, Fold)
    for index, link in enumerate(node.links):
        if index and link.op != "union":
            raise ValueError(f"`{link.op}` is not drawn by painting over")
        yield from _leaves(link.node, steps)


def _corners(geometry: str) -> Points:
    """Corners (2, M) of a leaf in its own space, in order."""
    n, phase, outer, inner = SECTORS[geometry]
    straight = math.isclose(inner, outer * math.cos(math.pi / n))  # an edge from corner to corner
    angles = phase + np.arange(n if straight else 2 * n) * (2 if straight else 1) * math.pi / n
    radii = np.full(len(angles), outer)
    if not straight:
        radii[1::2] = inner
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)])


def _placed(corners: Points, count: npt.NDArray[np.int_], steps: Sequence[Step]) -> Points:
    """Points of all edges, ``count`` (M,) of each from its corner on, in the world."""
    edge = np.repeat(np.arange(len(count)), count)
    along = (np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)) / count[edge]
    p = corners[:, edge] + along * (np.roll(corners, -1, 1) - corners)[:, edge]
    for step in steps:
        if isinstance(step, Affine):
            rows = np.reshape(step.rows, (3, 4))
            p = rows[:2, :2] @ p + rows[:2, 3:]
        elif isinstance(step, Warp):
            p = _unwound(step, p)
    return p


def _unwound(warp: Warp, q: Points) -> Points:
    """Where the points p lie that a warp carries back to q: both are as far from the middle.

    The angle a that they are turned by answers ``a = twirl |q| + bend . R(-a) q``.
    """
    (x, y), (bend_x, bend_y) = q, warp.bend
    turned = warp.twirl * np.hypot(x, y)
    if warp.bend == (0.0, 0.0):
        angle = turned
    elif math.hypot(*warp.bend) * np.hypot(x, y).max() >= 1:
        raise ValueError("a bend folds the object over itself")
    else:
        angle = turned.copy()
        for _ in range(_TURNS):
            cos, sin = np.cos(angle), np.sin(angle)
            px, py = cos * x - sin * y, sin * x + cos * y
            step = (angle - turned - bend_x * px - bend_y * py) / (1 + bend_x * py - bend_y * px)
            angle -= step
            if abs(step).max() < 1e-9:
                break
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * x - sin * y, sin * x + cos * y])
