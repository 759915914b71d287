"""The smallest grid of colours in which the surface of a mesh looks as it should.

Nodes next to the surface start with the colour of its nearest point. SIRT (Gilbert 1972) then corrects them
by the errors at points of the surface between them. The other nodes copy the nearest of these.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from scenelang.assets.colours import Grid, packed, unpacked
from scenelang.assets.element import Element, Facts
from scenelang.drawing.exact.mesh import Mesh
from scenelang.inverse.grids import corners

SIDES: Final = 17, 25, 33, 49, 65, 97, 129, 193  # nodes along an axis; the last only where an error is asked
NEAR: Final = 0.025  # root mean square of channels off, 0 to 1, that is near enough
MOST_BYTES: Final = 150_000  # of a grid that is tried where that is not met
SAMPLES: Final = 20_000
_COVER: Final = 60  # points for each cell of a grid's face, which find the nodes next to the surface
_EACH: Final = 4  # points for each of these nodes, by which it is corrected
_TIMES: Final = 8  # rounds of corrections
_HOLD: Final = 0.3  # added to a node's weights, so that a node with little evidence moves little


def fit_colours(
    mesh: Mesh,
    name: str,
    *,
    max_error: float | None = None,
    budget_s: float = np.inf,
    steps: int | None = None,
    about: Facts | None = None,
    report: Callable[[int, int, float], None] = lambda side, size, error: None,
) -> Element:
    """Fit the smallest grid that gives a mesh the look in its file, or the best of at most `MOST_BYTES`.

    Errors are root mean squares of channels off at the surface, 0 to 1. No further grid is begun after so
    many seconds or ``steps``. ``report`` is called with nodes along an axis, bytes and the error of each.
    """
    assert mesh.look is not None
    started, asked = time.monotonic(), max_error or NEAR
    fine = round(min(255, max(8, 1 / asked)))  # steps of luma, whose rounding is half of the error asked
    at, share = mesh.spread(SAMPLES, 1)
    points, true = mesh.points(at, share), mesh.look.at(at, share)
    best: Element | None = None
    for count, side in enumerate(SIDES if max_error else SIDES[:-1]):
        late = time.monotonic() - started > budget_s if steps is None else count >= steps
        if best is not None and late:
            break
        element = packed(name, *_grid(mesh, side), {}, fine)
        drawn = _weights(points, side) @ unpacked(element).reshape(3, -1).T
        error = float(np.sqrt(np.square(drawn - true).mean()))
        report(side, len(element.data), error)
        if best is not None and len(element.data) > MOST_BYTES:
            break
        said = {**(about or {}), "error": error}
        best = Element(name, "colours", element.sizes, element.coding, element.data, said)
        if error <= asked:
            break
    assert best is not None
    return best


def _weights(points: npt.NDArray[np.float64], side: int) -> Any:
    """Weights of a grid's nodes at points (M, 3) between them, as a sparse matrix (M, n³)."""
    from scipy.sparse import csr_matrix

    columns, values = zip(*corners(points, side), strict=True)
    start = np.arange(0, 8 * len(points) + 1, 8)
    result = np.stack(values, 1).astype(np.float32).ravel(), np.stack(columns, 1).ravel(), start
    return csr_matrix(result, shape=(len(points), side**3))


def _grid(mesh: Mesh, side: int) -> tuple[Grid, npt.NDArray[np.bool_]]:
    """Colours (3, n, n, n), and a mask (n, n, n) of the nodes next to the surface."""
    from scipy.ndimage import distance_transform_edt

    assert mesh.look is not None
    near = np.zeros((side,) * 3, bool)
    for node, _ in corners(mesh.points(*mesh.spread(_COVER * side * side, 2)), side):
        near.reshape(-1)[node] = True
    nodes = np.argwhere(near)
    colours = mesh.look.at(*mesh.touched(nodes * np.float64(2 / (side - 1)) - 1)).astype(np.float32)
    at, share = mesh.spread(_EACH * len(nodes), 3)
    weights = _weights(mesh.points(at, share), side)[:, np.flatnonzero(near)]
    back, true = weights.T.tocsr(), mesh.look.at(at, share).astype(np.float32)
    whole = np.asarray(weights.sum(0), np.float32).reshape(-1, 1) + np.float32(_HOLD)
    for _ in range(_TIMES):
        colours += back @ (true - weights @ colours) / whole
    grid = np.zeros((3, *near.shape), np.float32)
    grid[:, near] = colours.clip(0, 1).T
    nearest = distance_transform_edt(~near, return_distances=False, return_indices=True)
    return np.ascontiguousarray(grid[:, *nearest]), near
