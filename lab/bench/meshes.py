"""Meshes of examples drawn again by ray casting, beside the pictures that they were made of.

    python -m lab bench meshes [--resolution N] [--show FOLDER] [NAME ...]

Each mesh is lit as the scene is, with flat triangles, four samples a pixel and the same camera, lamps, ground
and sky; rays are libigl's. PSNR at a shorter side of 256 pixels against the renderer's own picture, uncapped,
of an animation's first frame. FOLDER gets the two pictures and four times their difference.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

import scenelang as nsg
from lab import ROOT
from scenelang.compiler.spaces import Stage
from scenelang.drawing.image import decoded, encoded
from scenelang.drawing.metrics import UNCAPPED_DB, psnr
from scenelang.output.mesh import TriangleMesh
from scenelang.output.shapes import RESOLUTION

Floats = npt.NDArray[np.float64]
NAMES = (
    *(
        "bitten",
        "bracket",
        "castle",
        "caterpillar",
        "chess",
        "die",
        "floor",
        "icecream",
        "knot",
        "lamp",
        "lotus",
    ),
    *("robot", "saturn", "snowman", "turned"),
)
SHORTER = 256  # pixels
LIFT = 1e-4  # world units: from a surface to where its ray to a light starts


def unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True).clip(1e-30))


class Caster:
    """A mesh that rays meet."""

    def __init__(self, mesh: TriangleMesh) -> None:
        import igl

        self.vertices, self.triangles = mesh.vertices, mesh.triangles.astype(np.int64)
        a, b, c = self.vertices[self.triangles].swapaxes(0, 1)
        self.normals, self.colours = unit(np.cross(b - a, c - a)), decoded(mesh.colours)
        self._tree: Any = igl.AABB()
        self._tree.init(self.vertices, self.triangles)

    def first(self, start: Floats, way: Floats) -> tuple[Any, Floats, Floats]:
        """Triangles (M,) that rays (M, 3) meet first, -1 for none, how far away, and weights (M, 3) there."""
        rays = np.ascontiguousarray(start), np.ascontiguousarray(way)
        at, t, uv = self._tree.intersect_ray_first(self.vertices, self.triangles, *rays)
        at, uv = at.ravel(), uv.reshape(-1, 2)
        t = np.where(at >= 0, t.ravel(), np.inf)
        return at, t, np.column_stack([1 - uv.sum(1), uv])

    def colour(self, at: Any, weights: Floats) -> Floats:
        return np.asarray((self.colours[self.triangles[at]] * weights[..., None]).sum(1))


def drawn(mesh: TriangleMesh, stage: Stage, size: tuple[int, int]) -> Floats:
    """A picture (H, W, 3), sRGB in [0, 1]."""
    caster, (wide, high) = Caster(mesh), size
    j, i = np.meshgrid(np.arange(wide), np.arange(high))
    total = np.zeros((high * wide, 3))
    for right in (-0.25, 0.25):
        for up in (-0.25, 0.25):
            x = (j + 0.5 + right - wide / 2) * 2 / min(size)
            y = (high / 2 - i - 0.5 + up) * 2 / min(size)
            total += sample(caster, stage, x.reshape(-1, 1), y.reshape(-1, 1)) / 4
    return np.asarray(encoded(total.clip(0, 1)).reshape(high, wide, 3))


def sample(caster: Caster, stage: Stage, x: Floats, y: Floats) -> Floats:
    """Linear light (M, 3) at points of the picture's plane (M, 1)."""
    camera, ground = stage.camera, stage.ground
    eye, (ahead, right, above) = np.array(camera.eye), np.array(camera.axes())
    way = unit(ahead / np.tan(camera.fov_rad / 2) + x * right + y * above)
    horizon = np.array(stage.horizon)
    result = horizon + (np.array(stage.zenith) - horizon) * (way[:, 1:2] / 0.5).clip(0, 1)
    at, t, weights = caster.first(np.broadcast_to(eye, way.shape), way)
    seen, fade = at >= 0, np.ones(len(way))
    p, n, colour = (np.zeros_like(way) for _ in range(3))
    p[seen] = eye + t[seen, None] * way[seen]
    n[seen], colour[seen] = caster.normals[at[seen]], caster.colour(at[seen], weights[seen])
    if ground is not None:
        far = (ground.y - eye[1]) / np.where(way[:, 1] < 0, way[:, 1], np.nan)
        on = (far > 0) & (far < t)
        p[on], n[on], colour[on] = eye + far[on, None] * way[on], (0, 1, 0), ground.rgb
        fade[on] = np.exp(-(p[on, 0] ** 2 + p[on, 2] ** 2) / 64)
        seen |= on
    p, n, fade = p[seen], n[seen], fade[seen, None]
    n = np.where((n * way[seen]).sum(1, keepdims=True) > 0, -n, n)
    light = (0.12 + 0.06 * n[:, 1:2]) * np.ones(3)
    for lamp in stage.lights:
        to = np.array(lamp.position) - p
        r = np.linalg.norm(to, axis=1).clip(1e-3)
        facing = (n * to).sum(1) / r
        lit = np.flatnonzero(facing > 0)
        clear = lit[caster.first(p[lit] + LIFT * n[lit], unit(to[lit]))[1] > r[lit]]
        light[clear] += (lamp.power * facing[clear] / r[clear] ** 2)[:, None] * np.array(lamp.rgb)
    result[seen] = fade * colour[seen] * light + (1 - fade) * horizon
    return np.asarray(result)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--resolution", type=int, default=RESOLUTION, metavar="N")
    parser.add_argument("--show", type=Path, metavar="FOLDER")
    given = parser.parse_args()
    for name in given.names or NAMES:
        path = ROOT / "examples" / f"{name}.nsg"
        scene = nsg.load(path, frame=0) if "animate(" in path.read_text() else nsg.load(path)
        wide, high = (round(side * SHORTER / min(scene.canvas)) for side in scene.canvas)
        exact = np.asarray(nsg.render(scene, size=(wide, high)))[..., :3]
        started, found = time.process_time(), nsg.Diagnostics()
        mesh = nsg.to_mesh(scene, resolution=given.resolution, diagnostics=found)
        seconds, stage = time.process_time() - started, nsg.compile(scene).stage
        assert stage is not None
        again = drawn(mesh, stage, (wide, high))
        thin = ", with parts thinner than a cell" * any(one.code == "W0552" for one in found)
        print(
            f"{name}: {psnr(again, exact, UNCAPPED_DB):.1f} dB, {len(mesh.triangles):,} triangles, "
            f"{seconds:.1f} s{thin}",
            flush=True,
        )
        if given.show:
            given.show.mkdir(parents=True, exist_ok=True)
            sheet = np.concatenate([exact, again, (4 * abs(again - exact)).clip(0, 1)], 1)
            Image.fromarray((255 * sheet + 0.5).astype(np.uint8)).save(given.show / f"{name}.png")


if __name__ == "__main__":
    main()
