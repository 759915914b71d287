"""Scenes under a sky as Mitsuba 3 takes them.

Unions of leaves under affine maps, whose media are apart. The sky is an environment map, a lamp of a radius
an emitting ball, which blocks, and ground fades by a mask, through which a little of what is below is seen.
"""

from __future__ import annotations

import math
from typing import Any

import mitsuba as mi
import numpy as np

from lab.bench.mitsuba_scenes import SURFACES, diffuse, mesh, sensor, worn
from scenelang.compiler.graph import Graph, Leaf, leaves
from scenelang.compiler.spaces import Stage
from scenelang.compiler.steps import Affine, composed
from scenelang.drawing.exact.field import placed_leaves

_ROWS = 1024  # of the environment map
_FAR = 24.0  # world units: so far goes the ground


def _rgb(values: Any) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(v) for v in values]}


def _shape(leaf: Leaf, steps: tuple[Any, ...]) -> Any:
    assert all(isinstance(step, Affine) for step in steps)
    matrix = np.vstack([np.reshape(composed(steps), (3, 4)), (0, 0, 0, 1)])
    if leaf.geometry != "box":
        return mesh(SURFACES[leaf.geometry], matrix, leaf)
    cube = mi.ScalarTransform4f(matrix @ np.diag([1 / math.sqrt(3)] * 3 + [1.0]))
    return {"type": "cube", "to_world": cube} | worn(leaf)


def exported(graph: Graph, guides: bool = False) -> Any:
    """A graph as Mitsuba renders it, in the variant that is set; with ``guides`` colours and normals too."""
    stage, root = graph.stage, graph.root
    assert stage is not None
    media = any(leaf.look.material == "volumetric" for leaf in leaves(root))
    scene: dict[str, Any] = {"type": "scene"} | _lit(stage)
    integrator = {"type": "volpath" if media else "path", "max_depth": 512, "rr_depth": 16}
    if guides:
        integrator = {"type": "aov", "aovs": "albedo:albedo,normal:sh_normal", "light": integrator}
    scene |= {"integrator": integrator, "sensor": sensor(stage, graph.canvas, type="multijitter")}
    if stage.ground is not None:
        x = (np.arange(512) + 0.5) / 256 - 1
        fade = np.exp(-(_FAR**2) * (x * x + (x * x)[:, None]) / stage.ground.fade**2)[..., None].astype(
            np.float32
        )
        mask = {"type": "mask", "bsdf": diffuse(stage.ground.rgb)}
        mask["opacity"] = {"type": "bitmap", "bitmap": mi.Bitmap(fade), "raw": True, "wrap_mode": "clamp"}
        flat = mi.ScalarTransform4f().translate([0, stage.ground.y, 0]).rotate([1, 0, 0], -90).scale(_FAR)
        scene["ground"] = {"type": "rectangle", "to_world": flat, "bsdf": mask}
    for at, (leaf, steps, _) in enumerate(placed_leaves(root)):
        scene[f"leaf{at}"] = _shape(leaf, steps)
    return mi.load_dict(scene)


def _lit(stage: Stage) -> dict[str, Any]:
    assert stage.sky is not None
    up = np.cos((np.arange(_ROWS) + 0.5) / _ROWS * math.pi)[:, None, None]
    low, high = np.array(stage.sky.horizon), np.array(stage.sky.zenith)
    rows = stage.sky.power * (low + (high - low) * np.clip(up / 0.5, 0.0, 1.0))
    pixels = np.repeat(rows, 8, 1).astype(np.float32)
    found: dict[str, Any] = {"sky": {"type": "envmap", "bitmap": mi.Bitmap(pixels), "scale": 1.0}}
    for at, lamp in enumerate(stage.lights):
        colour = np.array(lamp.rgb) * lamp.power
        if lamp.radius:
            glow = {"type": "area", "radiance": _rgb(colour / lamp.radius**2)}
            ball = {"type": "sphere", "center": lamp.position, "radius": lamp.radius, "emitter": glow}
            found[f"lamp{at}"] = ball | {"bsdf": diffuse((0.0, 0.0, 0.0))}
        else:
            point = {"type": "point", "position": lamp.position, "intensity": _rgb(math.pi * colour)}
            found[f"lamp{at}"] = point
    return found
