"""From geometry vectors to frames: where a world point lies in each object's own space.

The inverse reading of `scenelang.lifting.exact`'s layout. All of it is linear algebra and turns by an
angle; nothing here is learned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from scenelang.lifting import exact
from scenelang.program.program import ProgramError

Warp = tuple[float, float, float]  # twirl, bend x, bend y
Frame = tuple[float, float, float, float, float, float]  # a b c, d e f

FAR = 1e15  # leaf units: where points lie that float32 cannot follow; out of reach of everything
TAME = 1e8  # frames of smaller numbers cannot lead a point out of float32
MOST = 1e31  # the compiler keeps maps and deformations below this
BLEND_REACH = 0.3  # world units: farther objects cannot change a blend (2 k for the trained k = 0.15)


@dataclass(frozen=True, slots=True)
class ObjectFrame:
    """An object's way back to its leaf, outermost first.

    Args:
        steps: frames and warps in the order a world point meets them; identities are left out.
        scale: world distance per leaf distance, the smallest singular value of the composed map.
        stretch: how much faster than one world unit per world unit a distance can change at most.
        centre: world point about which the object lies.
        half: half extents (x, y) of the world box that holds a leaf disc of radius r: half[0] r + half[1].
        wild: whether points may leave float32 on the way, which costs a detour through float64.
    """

    steps: tuple[Frame | Warp, ...]
    scale: float
    stretch: float
    centre: tuple[float, float]
    half: tuple[tuple[float, float], tuple[float, float]]
    wild: bool

    @property
    def growth(self) -> float:
        """How many leaf units a point moves at most as it moves by a world unit."""
        return self.stretch / self.scale

    def box(self, radius: float) -> tuple[float, float, float, float]:
        """World box (xmin, ymin, xmax, ymax) outside which leaf coordinates are longer than ``radius``."""
        dx, dy = (slope * radius + more for slope, more in self.half)
        x, y = self.centre
        return x - dx, y - dy, x + dx, y + dy


def read_frame(g: np.ndarray) -> ObjectFrame:
    """The frame of one geometry vector (32,).

    Raises:
        ProgramError: it leads from the world to no leaf, which no compiled scene has.
    """
    g = g.astype(np.float64)
    largest = float(np.abs(g[exact.FRAME.start :]).max())
    last, middle = g[exact.FRAME], g[exact.MIDDLE]
    outer, inner = g[exact.OUTER].reshape(-1, 3), g[exact.INNER].reshape(-1, 3)
    # from the leaf through the middle map, and on into the world; warps keep the distance to the origin
    middle_linear, middle_shift = _invert(middle)
    last_linear, last_shift = _invert(last)
    reach, moved = float(np.linalg.norm(middle_linear, 2)), float(np.hypot(*middle_shift))
    steps: list[Frame | Warp] = []
    stretch = 1.0
    for frame, warps, radius in ((last, outer, reach + moved), (middle, inner, 1.0)):
        if not np.array_equal(frame, (1, 0, 0, 0, 1, 0)):
            steps.append(tuple(frame.tolist()))
        for twirl, x, y in warps.tolist():
            if twirl or x or y:
                steps.append((twirl, x, y))
                stretch *= 1.0 + radius * (abs(twirl) + float(np.hypot(x, y)))
    total = last_linear @ middle_linear
    rows = np.linalg.norm(last_linear if outer.any() else total, axis=1).tolist()
    if outer.any():
        centre, half = last_shift, tuple((r * reach, r * moved) for r in rows)
    else:
        centre, half = last_linear @ middle_shift + last_shift, tuple((r, 0.0) for r in rows)
    scale = float(np.linalg.svd(total, compute_uv=False)[1])
    if not (largest < MOST and 1 / MOST < scale < MOST):
        raise ProgramError("a frame beyond float32")
    at = float(centre[0]), float(centre[1])
    wild = largest > TAME or not 1 / TAME < scale < TAME
    return ObjectFrame(tuple(steps), scale, min(stretch, MOST), at, (half[0], half[1]), wild)


def _invert(frame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear part (2, 2) and shift (2,) of the map that a frame (6,) is the inverse of."""
    try:
        linear = np.linalg.inv(frame.reshape(2, 3)[:, :2])
    except np.linalg.LinAlgError:
        raise ProgramError("a frame without an inverse") from None
    if not np.abs(linear).max() < MOST:  # before squares of it overflow
        raise ProgramError("a frame beyond float32")
    return linear, -linear @ frame[[2, 5]]


def local_points(frame: ObjectFrame, x: Tensor, y: Tensor) -> tuple[Tensor, Tensor]:
    """Leaf coordinates of world points, any shape."""
    if frame.wild:
        x, y = x.double(), y.double()
    for step in frame.steps:
        if len(step) == 6:
            a, b, c, d, e, f = step
            x, y = (x * a).add_(y, alpha=b).add_(c), (x * d).add_(y, alpha=e).add_(f)
        else:
            twirl, bend_x, bend_y = step
            angle = x * bend_x
            if bend_y:
                angle.add_(y, alpha=bend_y)
            if twirl:
                angle.add_(torch.hypot(x, y), alpha=twirl)
            cos, sin = angle.cos(), angle.sin()
            x, y = (x * cos).addcmul_(y, sin), (y * cos).addcmul_(x, sin, value=-1.0)
    if frame.wild:
        return x.clamp(-FAR, FAR).float(), y.clamp(-FAR, FAR).float()
    return x, y
