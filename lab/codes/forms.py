"""Forms: what so many numbers give of one picture or solid, where nothing is shared with others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt
import torch
from scipy.fft import dctn, idctn

Array = npt.NDArray[np.float32]
REACH: Final = 0.1  # radii from its surface within which a solid's distances count
_FITTED: Final = 2 * REACH  # and within which balls are fitted
_MOST_BALLS: Final = 256
_STEPS, _RATE, _POINTS = 400, 0.02, 2048  # of fitting balls


def cosines(true: Array, d: int) -> Array:
    """The d / 2 cosines (DCT-II) of largest energy: the place of each counts as a number too."""
    found = dctn(true, norm="ortho").reshape(-1)
    found[np.argsort(-abs(found), kind="stable")[d // 2 :]] = 0
    return np.asarray(idctn(found.reshape(true.shape), norm="ortho"), np.float32)


def nodes(true: Array, d: int) -> Array:
    """At most d numbers at nodes, as many along each axis, linear between them, fitted by least squares.

    Of pictures (h, w, 3) colours, or greys where there are fewer than four of these.
    """
    colours = 3 if true.shape[-1] == 3 else 1
    if colours * 4 > d and colours == 3:
        return np.repeat(nodes(true.mean(-1), d)[..., None], 3, -1)
    axes = true.ndim - (colours == 3)
    side = int((d / colours) ** (1 / axes) + 1e-9)
    for axis in range(axes):
        at = np.linspace(0, side - 1, true.shape[axis])
        hats = np.maximum(1 - abs(at[:, None] - np.arange(side)), 0)
        fitted = np.tensordot(hats @ np.linalg.pinv(hats), true, (1, axis))
        true = np.moveaxis(fitted.astype(np.float32), 0, axis)
    return np.ascontiguousarray(true)


def balls(true: Array, d: int) -> Array:
    """Distances (n, n, n) to a union of d / 4 balls, of under 4 numbers a ball about the origin, by Adam."""
    torch.manual_seed(1)
    free, count = d >= 4, max(d // 4, 1)
    axis = torch.linspace(-1, 1, len(true))
    points = torch.cartesian_prod(axis, axis, axis)
    distances = torch.from_numpy(true.reshape(-1))
    inside, near = (torch.nonzero(m)[:, 0] for m in (distances < 0, abs(distances) < _FITTED))
    first = inside[torch.randint(len(inside), (count,))]
    centres = (points[first] * free).requires_grad_(free)
    radii = (-distances[first] if free else torch.tensor([0.5])).requires_grad_()
    adam = torch.optim.Adam([centres, radii] if free else [radii], _RATE)

    def union(p: torch.Tensor) -> torch.Tensor:
        apart: torch.Tensor = torch.linalg.vector_norm(p[:, None] - centres, dim=2) - radii
        return apart.amin(1)

    for step in range(_STEPS):
        adam.param_groups[0]["lr"] = _RATE * (1 - step / _STEPS)
        some = near[torch.randint(len(near), (_POINTS,))]
        loss = (union(points[some]).clamp(-_FITTED, _FITTED) - distances[some]).abs().mean()
        adam.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        adam.step()
    with torch.no_grad():
        found = torch.cat([union(p) for p in torch.split(points, _POINTS)])
    return np.asarray(found.reshape(true.shape).numpy(), np.float32)


FORMS: Final[dict[str, Callable[[Array, int], Array]]] = {"cosines": cosines, "nodes": nodes, "balls": balls}


def off(found: Array, true: Array) -> float:
    """How far an array is off: root mean square of colours; of distances the mean near the surface."""
    if true.shape[-1] == 3:
        return float(np.sqrt(np.square(found.clip(0, 1) - true, dtype=np.float64).mean()))
    near = abs(true) < REACH
    return float(abs(found[near].clip(-REACH, REACH) - true[near]).mean(dtype=np.float64))


def best_form(true: Array, d: int) -> tuple[str, Array]:
    """The form of d numbers that is nearest to a picture (h, w, 3) or to a solid's distances (n, n, n)."""
    fewest = {"cosines": 2, "nodes": 1, "balls": 1}
    if true.shape[-1] != 3:
        fewest["nodes"] = 8  # the corners of a cube
    known = [name for name in FORMS if d >= fewest[name]]
    if true.shape[-1] == 3 or d > 4 * _MOST_BALLS:
        known.remove("balls")
    found = {name: FORMS[name](true, d) for name in known}
    return min(found.items(), key=lambda one: off(one[1], true))
