"""Direct light of lamps by fixed steps and many points, in float64 numpy over the exact field.

Each lamp is a cloud of points on its sphere; materials have the density and glow of the object that owns a
point. It shares with the renderer the exact field and the stage alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from scenelang.compiler.graph import Fold
from scenelang.compiler.spaces import Light, Stage
from scenelang.drawing.exact.solid import OPAQUE, ExactField, march

SIGMA, STEP = 3.0, 0.01


def sphere_points(count: int) -> np.ndarray:
    """Points (3, count) evenly on the unit sphere, by a Fibonacci spiral."""
    at = np.arange(count) + 0.5
    y, angle = 1 - 2 * at / count, np.pi * (1 + 5**0.5) * at
    return np.array([np.cos(angle) * np.sqrt(1 - y * y), y, np.sin(angle) * np.sqrt(1 - y * y)])


class Oracle:
    """A graph's root under a stage; ``density`` and ``glow`` are those of objects in order."""

    def __init__(
        self,
        root: Fold,
        stage: Stage,
        density: Sequence[float] = (),
        glow: Sequence[tuple[float, float, float]] = (),
        points: int = 2000,
    ) -> None:
        self.field, self.stage, self.points = ExactField(root), stage, points
        count = len(self.field.bodies)
        self.density = np.array([0.0, *(density or [SIGMA] * count)])
        self.glow = np.array([(0.0, 0.0, 0.0), *(glow or [(0.0, 0.0, 0.0)] * count)]).T

    def along(self, o: np.ndarray, d: np.ndarray, begin: float, end: float, step: float = STEP) -> Any:
        """Middles of steps (3, K) of one ray, their length, the state there, and extinction (K,)."""
        count = max(2, int(np.ceil((end - begin) / step)))
        dt = (end - begin) / count
        p = o[:, None] + (begin + (np.arange(count) + 0.5) * dt) * d[:, None]
        state = self.field.at(p)
        inside = (state.d < 0) & (state.medium > 0)
        return p, dt, state, np.where(inside, self.density[state.owner], 0.0)

    def transmittance(self, p: np.ndarray, to: np.ndarray) -> np.ndarray:
        """From a point (3,) to points (3, K)."""
        way = to - p[:, None]
        r = np.linalg.norm(way, axis=0)
        way = way / r
        changes = march(self.field, np.repeat(p[:, None], len(r), 1), way, r)
        clear = (changes.last != OPAQUE).astype(float)
        if self.field.media:
            for at in np.flatnonzero(clear):
                near = min(r[at], 8.0)
                sigma, dt = (self.along(p, way[:, at], 0.0, near)[i] for i in (3, 1))
                clear[at] *= np.exp(-sigma.sum() * dt)
        return np.asarray(clear)

    def arriving(self, lamp: Light, p: np.ndarray, n: np.ndarray | None) -> float:
        """What a lamp of power gives to a point (3,) of a surface with a normal (3,), or of a medium."""
        at, s, rho = np.array(lamp.position), lamp.power, lamp.radius
        if rho == 0.0:
            way = at - p
            r = np.linalg.norm(way)
            facing = 0.25 if n is None else max(0.0, n @ way / r)
            off = p if n is None else p + 1e-4 * n
            return float(s * facing / r**2 * self.transmittance(off, at[:, None])[0]) if facing else 0.0
        if np.linalg.norm(at - p) <= rho:
            return 0.0
        out = sphere_points(self.points)
        to = at[:, None] + rho * out
        way = to - p[:, None]
        r2 = (way * way).sum(0)
        way /= np.sqrt(r2)
        leaving = -(way * out).sum(0)
        facing = np.full(self.points, np.pi / 4 / np.pi) if n is None else (n @ way).clip(0)
        weight = 4 * np.pi * rho**2 / self.points * leaving.clip(0) * facing / r2 * s / rho**2 / np.pi
        some = np.flatnonzero(weight)
        if not len(some):
            return 0.0
        off = p if n is None else p + 1e-4 * n
        return float(weight[some] @ self.transmittance(off, to[:, some]))

    def received(self, p: np.ndarray, n: np.ndarray | None) -> np.ndarray:
        """Light (3,) at a point, with the ambient of a stage without a sky."""
        ambient = 0.12 + (0.06 * n[1] if n is not None else 0.0)
        return np.asarray(
            ambient + sum(self.arriving(lamp, p, n) * np.array(lamp.rgb) for lamp in self.stage.lights)
        )

    def radiance(self, d: np.ndarray) -> np.ndarray:
        """Linear light (3,) that comes to the eye along a unit direction (3,)."""
        stage, o = self.stage, np.array(self.stage.camera.eye, float)
        end, horizon = np.inf, np.array(stage.horizon)
        seen = horizon + (np.array(stage.zenith) - horizon) * np.clip(d[1] / 0.5, 0, 1)
        if stage.ground is not None and d[1] < 0:
            end = (stage.ground.y - o[1]) / d[1]
        changes = march(self.field, o[:, None], d[:, None], np.array([end]), exact=True)
        opaque = changes.after == OPAQUE
        if opaque.any():
            end = float(changes.t[opaque][0])
            p = o + end * d
            state = self.field.at((p + 1e-7 * d)[:, None], gradient=True)
            n = state.slope[:, 0] / np.linalg.norm(state.slope[:, 0])
            n = -n if n @ d > 0 else n
            seen = np.reshape(state.rgb, 3) * self.received(p, n) + self.glow[:, np.ravel(state.owner)[0]]
        elif np.isfinite(end):
            p = o + end * d
            fade = np.exp(-(p[0] ** 2 + p[2] ** 2) / 64)
            lit = np.array(stage.ground.rgb) * self.received(p, np.array([0.0, 1.0, 0.0]))  # type: ignore[union-attr]
            seen = fade * lit + (1 - fade) * horizon
        if not self.field.media:
            return np.asarray(seen)
        p, dt, state, sigma = self.along(o, d, 0.0, min(end, 12.0))
        total, clear = np.zeros(3), 1.0
        colours = np.broadcast_to(state.rgb, p.shape)
        for at in np.flatnonzero(sigma):
            lit = colours[:, at] * self.received(p[:, at], None) + self.glow[:, state.owner[at]]
            here = np.exp(-sigma[at] * dt)
            total, clear = total + clear * (1 - here) * lit, clear * here
        return np.asarray(total + clear * seen)
