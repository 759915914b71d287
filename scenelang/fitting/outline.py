"""Outlines as flat shapes: read from drawings and pictures, put into the unit disc, and asked for distances.

Needs svgelements, which reads drawings, contourpy, which traces pictures, and scipy. A shape is a union of
layers: filled areas, and strokes as wide as they are drawn, with round joins and ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from scenelang.elements.groups import Painted
from scenelang.fitting.looks import Points
from scenelang.fitting.mesh import FitError, needed, outer
from scenelang.fitting.picture import opened

MOST_EDGES: Final = 200_000
MOST_PIXELS: Final = 16_000_000
PIECE: Final = 0.004  # leaf units: longer edges are cut, so that the nearest middle is of a near piece
_STRIP: Final = 64  # points of neighbouring heights
_TOGETHER: Final = 10_000  # edges that are asked at a time
_BESIDE: Final = 1e-4  # leaf units from an edge to where its sides are asked
Edges = npt.NDArray[np.float64]  # (E, 2, 2): edges, ends, coordinates
Inside = Callable[[Points], npt.NDArray[np.bool_]]


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """What lies on one side of edges, or near them.

    Args:
        edges: (E, 2, 2).
        inside: tells of points (M, 2) whether the layer covers them; None of a stroke.
        half: of a stroke's width.
        color: sRGB, 0 to 1; empty where it has none.
    """

    edges: Edges
    inside: Inside | None
    half: float = 0.0
    color: Painted = ()

    def touches(self, other: Layer) -> bool:
        """Whether the boxes around both share a point."""
        boxes = [
            (layer.edges.min((0, 1)) - layer.half, layer.edges.max((0, 1)) + layer.half)
            for layer in (self, other)
        ]
        return bool((boxes[0][0] <= boxes[1][1]).all() and (boxes[1][0] <= boxes[0][1]).all())

    def pieces(self) -> Edges:
        """Edges cut to `PIECE`, of a filled area those with just one side in it."""
        length = np.linalg.norm(self.edges[:, 1] - self.edges[:, 0], axis=1)
        counts = np.maximum(1, np.ceil(length / PIECE)).astype(int)
        if counts.sum() > 20 * MOST_EDGES:
            raise FitError("its outline is too long")
        at = np.repeat(np.arange(len(counts)), counts)
        step = np.arange(len(at)) - np.repeat(np.cumsum(counts) - counts, counts)
        a, b = self.edges[at, 0], self.edges[at, 1]
        ends = [a + ((step + k) / counts[at])[:, None] * (b - a) for k in (0, 1)]
        found = np.stack(ends, 1)
        if self.inside is None:
            return found
        middle, beside = found.mean(1), _BESIDE * _normals(found)
        return np.asarray(found[self.inside(middle + beside) != self.inside(middle - beside)])


def _normals(edges: Edges) -> Points:
    along = edges[:, 1] - edges[:, 0]
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    return np.asarray(np.stack([along[:, 1], -along[:, 0]], 1) / length)


class Outline:
    """A flat shape in the unit disc: the midpoint of its bounding box is the origin, its farthest point at 1.

    Raises:
        FitError: the layers cover nothing.
    """

    dimension = 2

    def __init__(self, layers: list[Layer], notes: tuple[str, ...] = ()) -> None:
        from scipy.spatial import cKDTree

        self.notes, self._source = notes, layers
        if not layers or sum(len(layer.edges) for layer in layers) == 0:
            raise FitError("it draws nothing")
        if sum(len(layer.edges) for layer in layers) > MOST_EDGES:
            raise FitError(f"an outline of more than {MOST_EDGES:,} edges")
        ends = np.concatenate([layer.edges.reshape(-1, 2) for layer in layers])
        halves = np.concatenate([np.full(2 * len(layer.edges), layer.half) for layer in layers])[:, None]
        low, high = (ends - halves).min(0), (ends + halves).max(0)
        if not np.isfinite([low, high]).all():
            raise FitError("a point is not finite")
        middle = (low + high) / 2
        self.size = float((np.linalg.norm(ends - middle, axis=1) + halves[:, 0]).max())
        self.centre = (float(middle[0]), float(middle[1]))
        if not self.size > 1e-12 * (1 + abs(middle).max()):
            raise FitError("all of it lies at one point")
        self._layers = []
        for layer in layers:
            moved = replace(
                layer,
                edges=(layer.edges - middle) / self.size,
                inside=None if layer.inside is None else _moved(layer.inside, middle, self.size),
                half=layer.half / self.size,
            )
            if len(pieces := moved.pieces()):
                self._layers.append((moved, pieces, cKDTree(pieces.mean(1))))
        if not self._layers:
            raise FitError("it covers nothing")

    def painted(self) -> list[tuple[Painted, list[Layer]]]:
        """Its colours in the order of painting, and the layers of each, as they lay in the file.

        A layer joins earlier ones of its colour where nothing that was painted since touches it.
        """
        found: list[tuple[Painted, list[Layer]]] = []
        for layer in self._source:
            for color, layers in reversed(found):
                if color == layer.color:
                    layers.append(layer)
                    break
                if any(layer.touches(other) for other in layers):
                    found.append((layer.color, [layer]))
                    break
            else:
                found.append((layer.color, [layer]))
        return found

    def distances(self, p: Points) -> Points:
        """Signed distances (M,) of points (M, 2), negative inside."""
        found = np.full(len(p), np.inf)
        for layer, pieces, tree in self._layers:
            _, near = tree.query(p, k=min(4, len(pieces)))
            ends = pieces[near.reshape(len(p), -1)]  # (M, k, 2, 2)
            a, along = ends[:, :, 0], ends[:, :, 1] - ends[:, :, 0]
            share = ((p[:, None] - a) * along).sum(2) / np.maximum((along * along).sum(2), 1e-30)
            away = np.linalg.norm(a + share.clip(0, 1)[..., None] * along - p[:, None], axis=2).min(1)
            if layer.inside is None:
                away -= layer.half
            else:
                away[layer.inside(p)] *= -1
            found = np.minimum(found, away)
        return found

    def surface(self, count: int) -> tuple[Points, Points, float]:
        """Points (K, 2) spread evenly on the outline, K at most ``count``, and outward normals.

        Also the share of the outline that has no inside on either side.

        Raises:
            FitError: nothing is thick enough to have an outline.
        """
        random, points, normals = np.random.default_rng(1), [], []
        for layer, pieces, _ in self._layers:
            way = _normals(pieces)
            sides = (1, -1) if layer.inside is None else (1,)
            for side in sides:
                points.append(pieces.mean(1) + side * layer.half * way)
                normals.append(side * way)
        all_points, all_normals = np.concatenate(points), np.concatenate(normals)
        chosen = random.choice(len(all_points), min(count, len(all_points)), replace=False)
        found, out, thin = outer(self.distances, all_points[chosen], all_normals[chosen], _BESIDE)
        if not len(found):
            raise FitError(f"it is nowhere thicker than {_BESIDE:g} of its radius")
        return found, out, thin


def _moved(inside: Inside, middle: Points, size: float) -> Inside:
    return lambda p: inside(p * size + middle)


def winding(edges: Edges, odd: bool) -> Inside:
    """Whether points lie within closed polygons, by the rule ``nonzero`` or ``evenodd``."""

    low, high = edges[..., 1].min(1), edges[..., 1].max(1)

    def inside(p: Points) -> npt.NDArray[np.bool_]:
        total, order = np.zeros(len(p), np.int64), np.argsort(p[:, 1])
        for first in range(0, len(p), _STRIP):  # points of a strip, and the edges that reach into it
            at = order[first : first + _STRIP]
            x, y = p[at].T[..., None]
            reach = edges[(low <= y[-1]) & (high >= y[0])]
            for part in (reach[k : k + _TOGETHER] for k in range(0, len(reach), _TOGETHER)):
                (ax, ay), (bx, by) = part.swapaxes(0, 1).swapaxes(1, 2)
                up, down = (ay <= y) & (by > y), (ay > y) & (by <= y)
                left = (bx - ax) * (y - ay) - (x - ax) * (by - ay) > 0
                total[at] += (up & left).sum(1) - (down & ~left).sum(1)
        return np.asarray(total % 2 != 0 if odd else total != 0)

    return inside


def traced(data: bytes) -> tuple[list[Layer], tuple[str, ...]]:
    """The outline of the dark or opaque part of a picture in the bytes of a file."""
    with opened(data, MOST_PIXELS) as file:
        pixels = np.asarray(file.convert("RGBA"), float) / 255
    opaque = bool((pixels[..., 3] < 0.5).any())
    luma = pixels[..., :3] @ (0.2126, 0.7152, 0.0722)
    value = pixels[..., 3] if opaque else 1 - luma
    value = np.pad(value, 1)[::-1]  # y up, and nothing outside
    note = "its opaque part" if opaque else "its dark part"
    with needed("contourpy"):
        from contourpy import contour_generator
    lines: Any = contour_generator(z=value).lines(0.5)
    edges = np.concatenate([np.zeros((0, 2, 2)), *(np.stack([line[:-1], line[1:]], 1) for line in lines)])
    return [Layer(edges, winding(edges, odd=True))], (note,)
