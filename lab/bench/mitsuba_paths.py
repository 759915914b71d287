"""Compare the path tracer with Mitsuba 3: ``python -m lab bench mitsuba_paths [SCENES]``.

Unions of spheres and boxes under affine maps, without ground, whose fade Mitsuba does not know, and whose
media are apart. A sky of power 1 is an environment map, a lamp of a radius an emitting ball, which blocks.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import mitsuba as mi
import numpy as np

from lab.bench.mitsuba_scenes import NO_BSDF, diffuse
from lab.light.families import Rng
from lab.light.field import world_of
from lab.light.measure import scene_of
from lab.light.paths import traced_picture
from scenelang.compiler.graph import Fold, Graph, Leaf, leaves
from scenelang.compiler.spaces import EXTINCTION, Stage
from scenelang.compiler.steps import Affine, composed
from scenelang.drawing.exact.field import placed_leaves
from scenelang.drawing.image import encoded
from scenelang.drawing.metrics import psnr

_ROWS = 1024  # of the environment map


def _rgb(values: Any) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(v) for v in values]}


def _shape(leaf: Leaf, steps: tuple[Any, ...]) -> dict[str, Any]:
    assert all(isinstance(step, Affine) for step in steps)
    matrix = np.vstack([np.reshape(composed(steps), (3, 4)), (0, 0, 0, 1)])
    look, rgb = leaf.look, leaf.look.colour()
    if leaf.geometry == "box":
        matrix = matrix @ np.diag([1 / math.sqrt(3)] * 3 + [1.0])
    kind = {"sphere": "sphere", "box": "cube"}[leaf.geometry]
    shape: dict[str, Any] = {"type": kind, "to_world": mi.ScalarTransform4f(matrix)}
    if look.material == "volumetric":
        medium = {"type": "homogeneous", "sigma_t": look.density or EXTINCTION, "albedo": _rgb(rgb)}
        return shape | {"bsdf": NO_BSDF, "interior": medium | {"phase": {"type": "isotropic"}}}
    if look.roughness < 0.0:
        rough = {
            "type": "roughconductor",
            "material": "none",
            "distribution": "ggx",
            "alpha": look.roughness**2,
        }
        return shape | {"bsdf": rough | {"specular_reflectance": _rgb(rgb)}}
    glow = {"emitter": {"type": "area", "radiance": _rgb(look.glow)}} if max(look.glow) else {}
    return shape | {"bsdf": diffuse(rgb)} | glow


def picture(graph: Graph, samples: int, seed: int = 0) -> np.ndarray[Any, Any]:
    """Linear light (H, W, 3) of a graph, of ``samples`` at the centre of each pixel, nearly."""
    mi.set_variant("scalar_rgb")
    stage = graph.stage
    assert stage is not None
    assert stage.ground is None
    root: Fold = graph.root
    media = any(leaf.look.material == "volumetric" for leaf in leaves(root))
    scene: dict[str, Any] = {"type": "scene"} | _lit(stage)
    scene["integrator"] = {"type": "volpath" if media else "path", "max_depth": 512, "rr_depth": 16}
    camera, (width, height) = stage.camera, graph.canvas
    film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
    look = mi.ScalarTransform4f().look_at(camera.eye, camera.target, [0, 1, 0])
    fov = {"fov": math.degrees(camera.fov_rad), "fov_axis": "smaller"}
    sampler = {"type": "independent", "sample_count": samples}
    scene["sensor"] = {"type": "perspective", "to_world": look, "film": film, "sampler": sampler} | fov
    for at, (leaf, steps, _) in enumerate(placed_leaves(root)):
        scene[f"leaf{at}"] = _shape(leaf, steps)
    return np.array(mi.render(mi.load_dict(scene), seed=seed, spp=samples))[..., :3]


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


KINDS = "sky", "soft", "mist", "glow", "metal"


def scene_text(rng: Rng, kind: str) -> str:
    """A floor and two solids, of 24 pixels a side."""

    def row(low: float, high: float) -> str:
        return str(rng.uniform(low, high, 3).round(3).tolist())

    def solid(x: float) -> str:
        own = {
            "mist": f"density({rng.uniform(1, 9):.3f});",
            "metal": f"roughness({rng.uniform(0.25, 0.8):.3f});",
        }
        own |= {"glow": "glow(#fc8, 3);" if x > 0 else ""}
        name = {"mist": "volumetric", "metal": "metal"}.get(kind, "diffuse")
        turned = f"rotate({rng.uniform(0, 360):.1f}deg, axis = {row(-1, 1)});"
        box = f"box {{ scale({rng.uniform(0.3, 0.7):.3f}); {turned}"
        leaf = (box, f"sphere {{ scale({rng.uniform(0.2, 0.6):.3f});")[int(rng.integers(2))]
        material = f"material {name} {{ color({row(0.1, 0.95)}); {own.get(kind, '')} }}"
        return f"{leaf} translate({x}, {rng.uniform(-0.3, 0.3):.3f}, 0); {material} }}\n"

    place = f"[{rng.uniform(-3, 3):.3f}, 4, {rng.uniform(1, 4):.3f}], {rng.uniform(5, 25):.3f}"
    lamp = "none" if kind in ("sky", "glow") else f"{place}, #fff, {0.0 if kind == 'mist' else 0.2}"
    text = f"nsg 1; canvas(24, 24); ground(none); light({lamp}); sky(1, {row(0.1, 0.9)}, {row(0.1, 0.9)});\n"
    floor = "box { scale(6, 0.2, 6); translate(0, -1.1, 0); material diffuse { color([0.7, 0.7, 0.6]); } }\n"
    return text + floor + solid(-0.75) + solid(0.75)


def main(scenes: int = 40) -> None:
    rng, found = np.random.default_rng(3), []
    for index in range(scenes):
        kind = KINDS[index % len(KINDS)]
        graph = scene_of(scene_text(rng, kind))[1]
        assert graph.stage is not None
        theirs = picture(graph, 2048, index)
        traced = traced_picture(world_of(graph), graph.stage, graph.canvas, per_side=4, paths=256)
        ours = np.moveaxis(traced.mean[:3], 0, 2)
        ratio, near = float(ours.mean() / theirs.mean()), psnr(encoded(ours), encoded(theirs))
        found.append(ratio)
        print(
            f"{index:2} {kind:5} mean {ratio:.4f} of theirs, {near:.1f} dB; own noise {traced.decibels:.1f}"
        )
    print(f"all: {np.mean(found):.4f}, from {min(found):.4f} to {max(found):.4f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
