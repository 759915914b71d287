"""Compare the path tracer with Mitsuba 3: ``python -m lab bench mitsuba_paths [SCENES]``.

Unions of spheres and boxes under affine maps, without ground, whose fade Mitsuba does not know, and whose
media are apart. A sky of power 1 is an environment map, a lamp of a radius an emitting ball, which blocks.
Glossy and metal are a BSDF written for it, of Mitsuba's own microfacets and warps.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lab.bench.mitsuba_scenes import NO_BSDF, SCALAR, diffuse
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


class Reflecting(mi.BSDF):
    """GGX with separable Smith masking and Schlick's Fresnel; glossy has a diffuse base below 1 - F(n.v)."""

    def __init__(self, props: Any) -> None:
        mi.BSDF.__init__(self, props)
        self.rgb = mi.Color3f(props["red"], props["green"], props["blue"])
        self.metal = props["metal"]
        self.facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, props["alpha"])
        self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
        self.m_flags = self.m_components[0]

    def fresnel(self, cosine: Any) -> Any:
        f0 = self.rgb if self.metal else mi.Color3f(0.04)
        return f0 + (1.0 - f0) * (1.0 - cosine) ** 5

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        wi = si.wi
        if not active or wi.z <= 0.0 or wo.z <= 0.0:
            return mi.Color3f(0.0)
        m = dr.normalize(wi + wo)
        lobe = self.facets.eval(m) * self.facets.G(wi, wo, m) * self.fresnel(dr.dot(wi, m)) / (4.0 * wi.z)
        return lobe if self.metal else lobe + (1.0 - self.fresnel(wi.z)) * self.rgb * (wo.z / math.pi)

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        if not active or si.wi.z <= 0.0 or wo.z <= 0.0:
            return 0.0
        m = dr.normalize(si.wi + wo)
        odds = self.facets.pdf(si.wi, m) / (4.0 * dr.dot(wo, m))
        return odds if self.metal else 0.5 * (odds + mi.warp.square_to_cosine_hemisphere_pdf(wo))

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def sample(self, ctx: Any, si: Any, which: float, uv: Any, active: Any = True) -> Any:
        found = mi.BSDFSample3f()
        if self.metal or which < 0.5:
            found.wo = mi.reflect(si.wi, self.facets.sample(si.wi, uv)[0])
        else:
            found.wo = mi.warp.square_to_cosine_hemisphere(uv)
        found.pdf, found.eta = self.pdf(ctx, si, found.wo, active), 1.0
        found.sampled_type = int(mi.BSDFFlags.GlossyReflection)
        found.sampled_component = 0
        if not found.pdf:
            return found, mi.Color3f(0.0)
        return found, self.eval(ctx, si, found.wo, active) / found.pdf

    def to_string(self) -> str:
        return f"Reflecting[metal = {self.metal}]"


mi.register_bsdf("reflecting", Reflecting)


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
    if look.roughness:
        own = {"type": "reflecting", "metal": look.roughness < 0.0, "alpha": look.roughness**2}
        return shape | {"bsdf": own | {"red": rgb[0], "green": rgb[1], "blue": rgb[2]}}
    glow = {"emitter": {"type": "area", "radiance": _rgb(look.glow)}} if max(look.glow) else {}
    return shape | {"bsdf": diffuse(rgb)} | glow


def picture(graph: Graph, samples: int, seed: int = 0) -> np.ndarray[Any, Any]:
    """Linear light (H, W, 3) of a graph, of ``samples`` at the centre of each pixel, nearly."""
    mi.set_variant(SCALAR)
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


KINDS = "sky", "soft", "mist", "glow", "metal", "glossy"


def scene_text(rng: Rng, kind: str) -> str:
    """A floor and two solids, of 24 pixels a side."""

    def row(low: float, high: float) -> str:
        return str(rng.uniform(low, high, 3).round(3).tolist())

    def solid(x: float) -> str:
        own = {
            "mist": f"density({rng.uniform(1, 9):.3f});",
        }
        own |= dict.fromkeys(("metal", "glossy"), f"roughness({rng.uniform(0.25, 0.8):.3f});")
        own |= {"glow": "glow(#fc8, 3);" if x > 0 else ""}
        name = {"mist": "volumetric", "metal": "metal", "glossy": "glossy"}.get(kind, "diffuse")
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
