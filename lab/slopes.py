"""Proofs of how fast learned distances change, by which the renderer rules out blocks of pixels.

    python -m lab.slopes shapes2d shapes2d-w16 shapes2d-w8

For a decoder's distance f over the disc that it sees, `proved_slack` finds s, by place and by radius, with

    |f(p) - f(q)| <= STEEP sqrt(|p - q|^2 + NODE^2) + s    for all p in a cell and q within the radius of p.

A Lipschitz constant would be of no use: where two units of a trained network open a ten-thousandth of a leaf
unit apart, its slope is 68, though it rises by a tenth only. So f is compared with g, bilinear between f's
values at nodes `NODE` apart: s is twice the most by which they differ near the cell, and the most by which
values at nodes near p and near q differ beyond `STEEP` times their distance. All pairs of nodes are compared.

- That f differs from g by no more is proved by branch and bound. Within a box, intervals of the units' inputs
  say which units are surely open or surely shut; what is left gives intervals of f's derivatives, and the
  mean value theorem one of f - g. Boxes whose interval is too wide are cut in four.
- g at a point is a mean of f at the corners of its cell, weighted so that the mean of the corners is the
  point. The means in cells at p and q are |p - q| apart, and corners vary about them by NODE^2 at most; so
  the mean distance of corners of one and of the other is at most the root above.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from safetensors.numpy import save

from scenelang.assets.files import write_whole
from scenelang.drawing.arrays import Layers
from scenelang.drawing.neural.files import load_arrays, slopes_path
from scenelang.drawing.neural.network import CELLS, NODE, RADII, RADIUS, STEEP, FramedArrays

Floats = npt.NDArray[np.float64]
ROUNDING = 1e-5  # leaf units: of float32, in which nodes are compared
_FINEST = 1e-7  # leaf units: smaller boxes are not cut
_BATCH = 1 << 15  # boxes at a time


def distances(layers: Layers, p: Floats) -> Floats:
    """Distances (M,) of a decoder at points (M, 2)."""
    (w1, b1), (w2, b2), (w3, b3) = layers
    x = np.maximum(p @ w1.T + b1, 0.0)
    result: Floats = np.maximum(x @ w2.T + b2, 0.0) @ w3[0] + b3[0]
    return result


def proved_slack(layers: Layers, near: float = 0.0015, slack: float = 1.25) -> Floats:
    """s (radii, cells, cells), as `Slopes` takes it, of a decoder with three layers and one output.

    f and g may differ by ``near`` anywhere, or by ``slack`` times the most that was seen at a node's cell.
    """
    layers = [(np.asarray(w, np.float64), np.asarray(b, np.float64)) for w, b in layers]
    side = round(2 * RADIUS / NODE)
    axis = np.linspace(-RADIUS, RADIUS, side + 1)
    points = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    nodes = distances(layers, points).reshape(side + 1, -1)
    error = _error(layers, nodes, axis, near, slack)
    # nodes of cells that the disc meets
    seen = np.hypot(*points.T).reshape(nodes.shape) <= RADIUS + 2**0.5 * NODE
    excess, result = np.zeros(nodes.shape, np.float32), []
    values = np.where(seen, nodes, np.nan).astype(np.float32)
    inner = 0.0
    for radius in RADII:
        outer = radius + 2 * 2**0.5 * NODE
        _compare(values, excess, inner, outer)
        inner = outer
        rim = int(np.ceil(radius / NODE)) + 1
        cells = np.maximum(
            np.maximum(excess[1:, 1:], excess[:-1, :-1]), np.maximum(excess[1:, :-1], excess[:-1, 1:])
        )
        result.append(_pooled(cells) + _pooled(error) + _pooled(_spread(error, rim)) + ROUNDING)
    return np.stack(result)


def _compare(
    values: npt.NDArray[np.float32], excess: npt.NDArray[np.float32], inner: float, outer: float
) -> None:
    """Raise excesses of values (y, x) over the slope between nodes from ``inner`` up to ``outer`` apart."""
    most = int(outer / NODE)
    for y in range(most + 1):
        for x in range(-most if y else 1, most + 1):
            length = NODE * np.hypot(x, y)
            if not inner < length <= outer:
                continue
            here = (slice(None, -y or None), slice(max(0, -x), min(0, -x) or None))
            there = (slice(y, None), slice(max(0, x), min(0, x) or None))
            more = abs(values[there] - values[here])
            more -= np.float32(STEEP * length)
            for part in (here, there):
                np.fmax(excess[part], more, out=excess[part])


def _spread(values: Floats, rim: int) -> Floats:
    """The largest within so many rows and columns."""
    for axis in (0, 1):
        result, reach = values, 1
        while reach <= rim:  # windows of twice the reach, and of what is left
            step = min(reach, rim + 1 - reach)
            ahead, behind = np.copy(result), np.copy(result)
            cut = [slice(None)] * 2
            keep = [slice(None)] * 2
            cut[axis], keep[axis] = slice(step, None), slice(None, -step)
            ahead[tuple(keep)] = np.maximum(result[tuple(keep)], result[tuple(cut)])
            behind[tuple(cut)] = np.maximum(result[tuple(cut)], result[tuple(keep)])
            result, reach = np.maximum(ahead, behind), reach + step
        values = result
    return values


def _pooled(values: npt.NDArray[np.floating]) -> Floats:
    """The largest of the nodes' cells within each cell of `Slopes`."""
    result: Floats = values.reshape(CELLS, len(values) // CELLS, CELLS, -1).max((1, 3)).astype(np.float64)
    return result


def _error(layers: Layers, nodes: Floats, axis: Floats, near: float, slack: float) -> Floats:
    """Bounds of |f - g| in the nodes' cells (y, x)."""
    at = np.arange(len(axis) - 1)
    cells = np.stack(np.meshgrid(at, at), -1).reshape(-1, 2)
    low = axis[cells]
    nearest = np.maximum(np.maximum(low, -(low + NODE)), 0.0)
    cells = cells[(nearest**2).sum(1) <= RADIUS**2]
    centres = axis[cells] + NODE / 2
    seen = np.zeros(len(cells))
    for dx, dy in ((0, 0), (0.3, 0.3), (-0.3, 0.3), (0.3, -0.3), (-0.3, -0.3)):
        p = centres + NODE * np.array([dx, dy])
        seen = np.maximum(seen, abs(distances(layers, p) - _bilinear(nodes, cells, p, axis)[0]))
    result = np.zeros((len(at), len(at)))
    seen_at = np.zeros_like(result)
    seen_at[cells[:, 1], cells[:, 0]] = seen

    def wide(cells: npt.NDArray[np.intp], p: Floats, half: float) -> npt.NDArray[np.bool_]:
        place = cells[:, 1], cells[:, 0]
        here, most = _differ(layers, nodes, cells, p, half, axis)
        np.maximum.at(seen_at, place, here)
        left: npt.NDArray[np.bool_] = most > np.maximum(near, slack * seen_at[place])
        left &= half > _FINEST
        np.maximum.at(result, (place[0][~left], place[1][~left]), most[~left])
        return left

    bounded(cells, centres, NODE / 2, wide)
    return result


def bounded(
    cells: npt.NDArray[np.intp],
    centres: Floats,
    half: float,
    wide: Callable[[npt.NDArray[np.intp], Floats, float], npt.NDArray[np.bool_]],
) -> None:
    """Branch and bound: ask of boxes, each within a cell, which are too wide, and then of their quarters."""
    while len(centres):
        parts = [slice(first, first + _BATCH) for first in range(0, len(centres), _BATCH)]
        kept = np.concatenate([wide(cells[part], centres[part], half) for part in parts])
        half /= 2
        quarters = half * np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]])
        centres = (centres[kept][:, None] + quarters).reshape(-1, 2)
        cells = np.repeat(cells[kept], 4, 0)


def _bilinear(nodes: Floats, cells: npt.NDArray[np.intp], p: Floats, axis: Floats) -> tuple[Floats, ...]:
    """g at points (M, 2) of cells, its derivatives there, and how much each changes by the other's axis."""
    x, y = cells.T
    a, b, c, d = nodes[y, x], nodes[y, x + 1], nodes[y + 1, x], nodes[y + 1, x + 1]
    u, v = ((p - axis[cells]) / NODE).T
    twist = a - b - c + d
    slopes = np.stack([b - a + v * twist, c - a + u * twist], 1) / NODE
    return a + (b - a) * u + (c - a) * v + twist * u * v, slopes, abs(twist) / NODE**2


def _differ(
    layers: Layers, nodes: Floats, cells: npt.NDArray[np.intp], p: Floats, half: float, axis: Floats
) -> tuple[Floats, Floats]:
    """|f - g| at points p, and bounds of it over boxes about them, each within a cell."""
    answer, slope, doubt = answered(layers, p, half)
    value, flat, twist = _bilinear(nodes, cells, p, axis)
    here = abs(answer - value)
    return here, here + half * (abs(slope - flat) + doubt + half * twist[:, None]).sum(1)


def answered(layers: Layers, p: Floats, half: float) -> tuple[Floats, Floats, Floats]:
    """A decoder's distances (M,), and derivatives (M, 2) over boxes: a middle, and a spread about it."""
    (w1, b1), (w2, b2), (w3, b3) = layers
    first = p @ w1.T + b1
    mean, spread = _open(first, abs(w1).sum(1) * half)
    # derivatives (M, 2, units) of what goes into the second layer: within a radius about a middle
    middle = (mean[:, None] * w1.T) @ w2.T
    radius = (spread[:, None] * abs(w1.T)) @ abs(w2).T
    second = np.maximum(first, 0.0) @ w2.T + b2
    mean, spread = _open(second, (abs(middle) + radius).sum(1) * half)
    slope = (mean[:, None] * middle) @ w3[0]
    doubt = (spread[:, None] * abs(middle) + (mean + spread)[:, None] * radius) @ abs(w3[0])
    return np.maximum(second, 0.0) @ w3[0] + b3[0], slope, doubt


def _open(inputs: Floats, radius: Floats) -> tuple[Floats, Floats]:
    """Bounds on how open units are for inputs within a radius: a middle, and a spread about it."""
    sure = (inputs >= radius) | (inputs <= -radius)
    return np.where(sure, inputs > 0, 0.5), np.where(sure, 0.0, 0.5)


def short(values: Floats, end: float) -> npt.NDArray[np.float16]:
    """Numbers in 16 bits, rounded towards an infinite end."""
    result = values.astype(np.float16)
    past = np.sign(end) * (values - result) > 0
    return np.where(past, np.nextafter(result, np.float16(end)), result)


def slopes_file(model: str) -> bytes:
    """The file of a shipped model: s of its geometries (geometries, radii, cells, cells), rounded up."""
    network, digest = load_arrays(model)
    result = []
    assert isinstance(network, FramedArrays)
    for code in network.codes:  # one by one, as their weights are mixed where one is drawn alone
        layers = [(w[0], b[0]) for w, b in network.decoder_weights(code[None]).layers]
        result.append(proved_slack(layers))
    header = {"weights": digest, "node": NODE, "steep": STEEP}
    data: bytes = save(
        {"cells": short(np.stack(result), np.inf)}, {"scenelang": json.dumps({"format": 1, **header})}
    )
    return data


if __name__ == "__main__":
    for name in sys.argv[1:]:
        write_whole(slopes_path(name), slopes_file(name))
