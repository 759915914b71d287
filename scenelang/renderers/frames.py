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

Warp = tuple[float, float, float]  # twirl, bend x, bend y
Frame = tuple[float, float, float, float, float, float]  # a b c, d e f

BLEND_REACH = 0.3  # world units: farther objects cannot change a blend (2 k for the trained k = 0.15)


@dataclass(frozen=True, slots=True)
class ObjectFrame:
    """An object's way back to its leaf, outermost first.

    Args:
        steps: frames and warps in the order a world point meets them; identities are left out.
        scale: world distance per leaf distance, the smallest singular value of the composed map.
        stretch: how much faster than one world unit per world unit a distance can change at most.
    """

    steps: tuple[Frame | Warp, ...]
    scale: float
    stretch: float

    @property
    def growth(self) -> float:
        """How many leaf units a point moves at most as it moves by a world unit."""
        return self.stretch / self.scale


def read_frame(g: np.ndarray) -> ObjectFrame:
    """The frame of one geometry vector (32,)."""
    g = g.astype(np.float64)
    last, middle = g[exact.FRAME], g[exact.MIDDLE]
    outer, inner = g[exact.OUTER].reshape(-1, 3), g[exact.INNER].reshape(-1, 3)
    linear = _linear(middle) @ _linear(last)
    singular = np.linalg.svd(linear, compute_uv=False)
    steps: list[Frame | Warp] = []
    stretch = 1.0
    # radius within which the leaf lies, seen from the frame that the warps turn about
    unit = 1.0
    middle_inverse = np.linalg.inv(_linear(middle))
    spread = float(np.linalg.norm(middle_inverse, 2) + np.linalg.norm(middle_inverse @ middle[[2, 5]]))
    for frame, warps, radius in ((last, outer, spread), (middle, inner, unit)):
        if not np.array_equal(frame, (1, 0, 0, 0, 1, 0)):
            steps.append(tuple(frame.tolist()))
        for twirl, x, y in warps.tolist():
            if twirl or x or y:
                steps.append((twirl, x, y))
                stretch *= 1.0 + radius * (abs(twirl) + float(np.hypot(x, y)))
    return ObjectFrame(tuple(steps), float(1.0 / singular[0]), stretch)


def _linear(frame: np.ndarray) -> np.ndarray:
    return frame.reshape(2, 3)[:, :2]


def local_points(frame: ObjectFrame, x: Tensor, y: Tensor) -> tuple[Tensor, Tensor]:
    """Leaf coordinates of world points, any shape."""
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
    return x, y
