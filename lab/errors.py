"""Proofs of how far learned distances are from exact ones, by which pictures are proved.

    python -m lab.errors shapes2d

For a decoder's distance f and a leaf's exact distance e, `proved_errors` finds between which numbers f - e
lies, cell by cell of the disc that the decoder sees, by branch and bound. In a box f has an interval of
derivatives (`lab.slopes`), and so has e. The mean value theorem makes one of f - e of both. Boxes
whose interval reaches farther than what was seen in their cell are cut in four.

Within half a sector (`SECTORS` of `scenelang.compiler.geometries`) e is the distance to one segment, with a
sign; the disc's is the distance to its centre. Its gradient is the segment's normal beside the segment.
Elsewhere it is the direction from the nearest point. As p less its nearest point of a convex set changes by
no more than p does, that direction changes by at most 2 r / (2 d - r) within r of where the distance is d.
Where a box meets more half sectors, it may be any's.
"""

from __future__ import annotations

import json
import math
import sys

import numpy as np
import numpy.typing as npt
from safetensors.numpy import save

from lab.slopes import Floats, answered, bounded, short
from scenelang.assets.files import write_whole
from scenelang.compiler.geometries import SECTORS
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.arrays import Layers
from scenelang.drawing.exact.field import leaf_distance
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.network import RADIUS, FramedArrays
from scenelang.drawing.proof import CELLS, errors_path, layers_of

_FINEST = 1e-6  # leaf units: smaller boxes are not cut
_UNSEEN = 6e4  # leaf units: a bound of what is beyond the disc


def proved_errors(
    layers: Layers, geometry: str, near: float = 2e-5, slack: float = 0.1
) -> tuple[Floats, Floats]:
    """The least and the most (CELLS, CELLS) that a decoder answers above a leaf's exact distance.

    Bounds may lie ``near`` beyond what was seen in a cell, and ``slack`` times its differences.
    """
    at, side = np.arange(CELLS), 2 * RADIUS / CELLS
    cells = np.stack(np.meshgrid(at, at), -1).reshape(-1, 2)
    corner = cells * side - RADIUS
    nearest = np.maximum(np.maximum(corner, -(corner + side)), 0.0)
    cells = cells[np.hypot(*nearest.T) <= RADIUS + 1e-9]
    seen = np.full((2, CELLS, CELLS), np.inf)  # the least of f - e, and of e - f
    result = -seen

    def wide(cells: npt.NDArray[np.intp], p: Floats, half: float) -> npt.NDArray[np.bool_]:
        place = cells[:, 1], cells[:, 0]
        f, middle, doubt = answered(layers, p, half)
        low, high = gradients(geometry, p, half)
        off = f - leaf_distance(geometry, p.T)
        most = half * (np.maximum(abs(middle - low), abs(middle - high)) + doubt).sum(1)
        for own, value in zip(seen, (off, -off), strict=True):
            np.minimum.at(own, place, value)
        least = np.stack([off, -off]) - most
        room = near - slack * (seen[0] + seen[1])[place]
        left: npt.NDArray[np.bool_] = (least < seen[:, place[0], place[1]] - room).any(0) & (half > _FINEST)
        for own, value in zip(result, -least, strict=True):
            np.maximum.at(own, (place[0][~left], place[1][~left]), value[~left])
        return left

    bounded(cells, (cells + 0.5) * side - RADIUS, side / 2, wide)
    low, high = np.where(np.isfinite(result), result, _UNSEEN)
    return -low, high


def gradients(geometry: str, p: Floats, half: float) -> tuple[Floats, Floats]:
    """The least and the most of the exact distance's derivatives (M, 2) over boxes about points (M, 2)."""
    r = half * 2**0.5
    if geometry not in SECTORS:  # a disc: away from the origin
        return _turning(p, r)
    order, first, outer, inner = SECTORS[geometry]
    width = math.pi / order
    length, angle = np.hypot(*p.T), np.arctan2(p[:, 1], p[:, 0])
    least, most = np.full(p.shape, np.inf), np.full(p.shape, -np.inf)
    for index in range(2 * order):
        begin = first + index * width
        off = abs((angle - begin - width / 2 + math.pi) % math.tau - math.pi) - width / 2
        here = np.flatnonzero(length * np.sin(off.clip(0.0, math.pi / 2)) <= r * (1 + 1e-6) + 1e-12)
        ends = [
            radius * np.array([math.cos(a), math.sin(a)])
            for a, radius in ((begin, (outer, inner)[index % 2]), (begin + width, (inner, outer)[index % 2]))
        ]
        low, high = _beside(p[here], r, *ends)
        least[here], most[here] = np.minimum(least[here], low), np.maximum(most[here], high)
    return least, most


def _turning(gap: Floats, r: float) -> tuple[Floats, Floats]:
    """Directions of ways (M, 2) whose ends move by up to r."""
    d = np.hypot(*gap.T)
    spread = np.where(d > r, 2 * r / (2 * d - r).clip(1e-300), 2.0)[:, None]
    middle = gap / d.clip(1e-300)[:, None]
    return (middle - spread).clip(-1.0, 1.0), (middle + spread).clip(-1.0, 1.0)


def _beside(p: Floats, r: float, a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Derivatives of the signed distance to a segment, within r of points."""
    along = (b - a) / np.hypot(*(b - a))
    normal = np.array([along[1], -along[0]])  # outwards, as the ends come anticlockwise
    place, side = (p - a) @ along, (p - a) @ normal
    gap = p - a - place.clip(0.0, np.hypot(*(b - a)))[:, None] * along
    d = np.hypot(*gap.T)
    straight = (place >= r) & (place <= np.hypot(*(b - a)) - r)
    sure = (d > r) & (abs(side) > r)  # of the sign too
    middle = np.where(straight[:, None], normal, gap * (np.sign(side) / d.clip(1e-300))[:, None])
    spread = np.where(straight, 0.0, np.where(sure, 2 * r / (2 * d - r).clip(1e-300), 2.0))[:, None]
    return (middle - spread).clip(-1.0, 1.0), (middle + spread).clip(-1.0, 1.0)


def errors_file(model: str) -> bytes:
    """The file of a shipped model, bounds (geometries, CELLS, CELLS) rounded outwards."""
    network, digest = load_arrays(model)
    assert isinstance(network, FramedArrays)
    names = load_manifest(model).geometries
    low, high = zip(
        *(proved_errors(layers_of(network, i), name) for i, name in enumerate(names)), strict=True
    )
    arrays = {"low": short(np.stack(low), -np.inf), "high": short(np.stack(high), np.inf)}
    data: bytes = save(arrays, {"scenelang": json.dumps({"format": 1, "weights": digest})})
    return data


if __name__ == "__main__":
    for name in sys.argv[1:]:
        write_whole(errors_path(name), errors_file(name))
