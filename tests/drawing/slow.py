"""What the framed renderer should answer, slowly: float64 numpy, every object at four samples of every pixel.

Written from docs/architecture.md, docs/language.md and the weights file alone: it shares no code with the
package but that which reads the texels of a file.
"""

from __future__ import annotations

import colorsys
import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load_file

import scenelang
from scenelang.assets.picture import texels as texels_of
from scenelang.compiler.program import Paint
from tests.pictures import Array


class Slow:
    """A model's weights in float64."""

    def __init__(self, model: str = "shapes2d") -> None:
        path = Path(scenelang.__file__).parent / "compiler/models" / model / "weights.safetensors"
        self.w = {name: array.astype(np.float64) for name, array in load_file(path).items()}

    def distance(self, code: Array, q: Array) -> Array:
        """What the decoder answers at leaf coordinates (P, 2)."""
        hidden = np.maximum(code @ self.w["lift_w"] + self.w["lift_b"], 0)
        one = np.concatenate([code, hidden, [1]])
        lines, r = np.tensordot(one, self.w["lines"], 1), one @ self.w["radius"]
        x, y = q.T
        radius = np.hypot(x, y)
        features = [radius, abs(x), abs(y), y]
        for n in (3, 5, 6):  # the angle to the nearest of n directions, the first of which is +y
            turn = math.tau / n
            angle = abs((np.arctan2(x, y) + turn / 2) % turn - turn / 2)
            features += [radius * np.cos(angle), radius * np.sin(angle)]
        levels = np.tensordot(lines, np.stack([*features, 0 * x + 1]), 1).reshape(-1, 3, len(x))
        notch, units, inner = levels[0], levels[1:-1], levels[-1]
        length = np.linalg.norm(np.maximum(units, 0), axis=1).max(0)
        return np.asarray(
            length + np.minimum(inner.max(0), 0) - np.linalg.norm(np.maximum(notch, 0), axis=0) - r
        )

    def colour(self, m: Array) -> Array:
        """The colour (3,) that a material vector (32,) shows."""
        albedo = m[20:32] @ self.w["albedo"][:-1] + self.w["albedo"][-1]
        return np.clip(m[8:20].reshape(3, 4) @ np.append(albedo, 1), 0, 1)

    def at(
        self, vectors: Array, tokens: Array, points: Array, paints: Sequence[Paint | None] | None = None
    ) -> tuple[Array, Array, list[Array]]:
        """Distance (P,) and colour (P, 3) after a stream at world points (P, 2), and objects' distances."""
        state, shown, alone = np.ones(len(points)), np.zeros((len(points), 3)), []
        paints = paints or [None] * len(tokens)
        for vector, t, paint in zip(vectors.astype(np.float64), tokens, paints, strict=True):
            q = way_back(vector, points)
            d = self.distance(vector[:4], q) * scale(vector)
            alone.append(d)
            lines = self.w["cell_lines"][t] * np.exp(self.w["cell_gain"][t])
            levels = np.clip(np.stack([d, state], 1) @ lines + self.w["cell_bias"][t], 0, 1)
            take, gate = levels[:, 0], levels[:, 1:].max(1)[:, None]
            bump = self.w["bump"][t, 0] / np.exp(self.w["cell_gain"][t, 0])
            candidate = np.clip(self.w["candidate"][t, 0, 0], -1, 1) * d
            state = state + take * (candidate - state) - bump * take * (1 - take)
            colour = self.colour(vector[32:]) if paint is None else painted(paint, vector[32:38], q)
            shown = shown + gate * (colour - shown)
        return state, shown, alone

    def samples(self, vectors: Array, tokens: Array, canvas: tuple[int, int], paints: Any = None) -> Array:
        """Premultiplied colour and coverage (H, W, 4 samples, 4)."""
        state, shown, _ = self.at(vectors, tokens, sample_points(canvas).reshape(-1, 2), paints)
        coverage = np.clip(0.5 - state * np.exp(self.w["read_slope"]) / 4, 0, 1)[:, None]
        return np.concatenate([shown * coverage, coverage], 1).reshape(canvas[1], canvas[0], 4, 4)

    def picture(self, vectors: Array, tokens: Array, canvas: tuple[int, int], paints: Any = None) -> Array:
        """Premultiplied (H, W, 4)."""
        return self.samples(vectors, tokens, canvas, paints).mean(2)


def painted(paint: Paint, frame: Array, points: Array, *, light: bool = False) -> Array:
    """Colours (P, 3) of a paint at leaf coordinates (P, d), point by point, after docs/language.md."""
    texels = np.array(
        [[linear(v) if light else v for v in c] for c in texels_of(paint.element).reshape(-1, 3).tolist()]
    ).reshape(texels_of(paint.element).shape)
    found = []
    for p in points.tolist():
        if texels.ndim == 4:
            colour = trilinear(texels, p)
        else:
            a, b, c, d, e, f = frame
            colour = bilinear(texels, a * p[0] + b * p[1] + c, d * p[0] + e * p[1] + f)
        for name, *numbers in paint.steps:
            if name == "color":
                colour = colour * numbers
            elif name == "grayscale":
                colour = colour + numbers[0] * (colour @ [0.2126, 0.7152, 0.0722] - colour)
            else:
                h, s, v = colorsys.rgb_to_hsv(*colour)
                colour = np.array(colorsys.hsv_to_rgb((h + numbers[0]) % 1, s, v))
            colour = np.clip(colour, 0, 1)
        found.append(colour)
    return np.array(found)


def bilinear(texels: Array, u: float, v: float) -> Array:
    """The colour at (u, v): texels' centres lie evenly in [-1, 1]², the first row at the top."""
    height, width = texels.shape[:2]
    x, y = (u + 1) / 2 * width - 0.5, (1 - v) / 2 * height - 0.5
    left, top = math.floor(x), math.floor(y)
    total = np.zeros(3)
    for i, j in itertools.product((left, left + 1), (top, top + 1)):
        total += (1 - abs(x - i)) * (1 - abs(y - j)) * texels[j % height, i % width]
    return total


def trilinear(nodes: Array, p: Sequence[float]) -> Array:
    """The colour at a point of [-1, 1]³, or at the nearest one of that; nodes lie on its faces too."""
    n = len(nodes)
    at = [min(max((c + 1) / 2, 0), 1) * (n - 1) for c in p]
    total = np.zeros(3)
    for corner in itertools.product(*({math.floor(c), min(math.floor(c) + 1, n - 1)} for c in at)):
        total += np.prod([max(0, 1 - abs(c - i)) for c, i in zip(at, corner, strict=True)]) * nodes[corner]
    return total


def linear(v: float) -> float:
    """Of an sRGB-encoded value."""
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4


def sample_points(canvas: tuple[int, int]) -> Array:
    """World coordinates (H, W, 4, 2) of the samples: a quarter of a pixel from the centre both ways."""
    width, height = canvas
    px = 2 / min(canvas)
    points = np.empty((height, width, 4, 2))
    for i, (right, up) in enumerate([(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)]):
        points[..., i, 0] = (np.arange(width) + 0.5 - width / 2 + right)[None] * px
        points[..., i, 1] = (height / 2 - np.arange(height) - 0.5 + up)[:, None] * px
    return points


def way_back(g: Array, points: Array) -> Array:
    """World points (P, 2) in the leaf's space: affine map, outer warps, affine map, inner warps."""
    for frame, warps in ((g[5:11], g[11:20]), (g[20:26], g[26:32])):
        a, b, c, d, e, f = frame
        x, y = points.T
        x, y = a * x + b * y + c, d * x + e * y + f
        for twirl, bend_x, bend_y in warps.reshape(-1, 3):
            angle = twirl * np.hypot(x, y) + bend_x * x + bend_y * y
            x, y = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
        points = np.stack([x, y], 1)
    return points


def scale(g: Array) -> float:
    """World distance per leaf distance: the least stretch of the affine maps together."""
    last, middle = (np.linalg.inv(g[at : at + 6].reshape(2, 3)[:, :2]) for at in (5, 20))
    return float(np.linalg.svd(last @ middle, compute_uv=False)[-1])


def distances_of_edges(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Signed distances (M,) at points (M, 2) of closed lines by the starts and ends (E, 2) of their edges:
    the nearest of all edges, and negative where the turns of the way around a point are not 0.
    """
    result = []
    for point in p:
        (ax, ay), (bx, by) = (a - point).T, (b - point).T
        ex, ey = bx - ax, by - ay
        share = (-(ax * ex + ay * ey) / np.maximum(ex * ex + ey * ey, 1e-300)).clip(0, 1)
        away = np.hypot(ax + share * ex, ay + share * ey).min()
        turns = np.arctan2(ax * by - ay * bx, ax * bx + ay * by).sum() / (2 * np.pi)
        result.append(-away if round(turns) else away)
    return np.array(result)
