"""Scenes of solids as Mitsuba 3 takes them, and its picture of them.

Unions of leaves under affine maps, as meshes with normals of their own. Mitsuba knows neither our ambient
light nor the ground's fade nor a sky that lights nothing: it draws without them, over black. A point light of
intensity π s on a surface of reflectance C gives C s/r²; in a medium of albedo C with an isotropic phase
C s/(4 r²).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from scenelang.compiler.graph import Fold, Leaf
from scenelang.compiler.spaces import EXTINCTION, Stage

SCALAR, VECTORS = "scalar_rgb", "llvm_ad_rgb"
mi.set_variant(SCALAR)
LEAST_LLVM = (16,)

Surface = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""From parameters in [0, 2π] and [0, π], (M,) each, to points and normals (3, M)."""

NO_BSDF = {"type": "null"}


def by_vectors() -> str:
    """Draw scenes to come by vectors where there is an LLVM of at least 16 (older ones crash); says how."""
    mi.set_variant(VECTORS)
    try:
        version: tuple[int, ...] = dr.detail.llvm_version()
    except RuntimeError:
        version = ()
    if version < LEAST_LLVM:
        mi.set_variant(SCALAR)
        return f"Mitsuba {mi.__version__}, {SCALAR}"
    return f"Mitsuba {mi.__version__}, {VECTORS}, LLVM {version[0]}"


def ball(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    p = np.stack([np.sin(v) * np.cos(u), np.cos(v), np.sin(v) * np.sin(u)])
    return p, p


def ring(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    n = np.stack([np.cos(2 * v) * np.cos(u), np.sin(2 * v), np.cos(2 * v) * np.sin(u)])
    return 0.3 * n + 0.7 * np.stack([np.cos(u), 0 * u, np.sin(u)]), n


def capsule(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    p, _ = ball(u, v)
    return 0.5 * p + 0.5 * np.sign(np.pi / 2 - v) * np.array([[0], [1], [0]]), p


def octahedron(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    p, _ = ball(u, v)
    return p / np.abs(p).sum(0), p


def lathed(*corners: tuple[float, float]) -> Surface:
    """What straight lines between four places (r, y) sweep around the axis; turns have no area."""
    ends = np.array(corners)
    along = np.diff(ends, axis=0)
    normals = np.stack([-along[:, 1], along[:, 0]], 1) / np.linalg.norm(along, axis=1)[:, None]

    def surface(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        part = np.minimum((v * 3 / np.pi).astype(int), 2)
        t = np.clip((v * 3 / np.pi - part) * 1.05 - 0.025, 0.0, 1.0)[:, None]
        p, n = (ends[part] + t * along[part]).T, normals[part].T
        return tuple(np.stack([a[0] * np.cos(u), a[1], a[0] * np.sin(u)]) for a in (p, n))  # type: ignore[return-value]

    return surface


_SIDE, _RIM = 0.5**0.5, 0.75**0.5
SURFACES: dict[str, Surface] = {
    "sphere": ball,
    "torus": ring,
    "capsule": capsule,
    "octahedron": octahedron,
    "cylinder": lathed((0, _SIDE), (_SIDE, _SIDE), (_SIDE, -_SIDE), (0, -_SIDE)),
    "cone": lathed((0, 1), (_RIM / 2, 0.25), (_RIM, -0.5), (0, -0.5)),
}


def diffuse(rgb: tuple[float, ...]) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(rgb)}}


def worn(leaf: Leaf) -> dict[str, Any]:
    """What a shape with the look of a leaf is made of."""
    colour = leaf.look.colour()
    if leaf.look.material == "diffuse":
        return {"bsdf": {"type": "twosided", "bsdf": diffuse(colour)}}
    medium: dict[str, Any] = {"type": "homogeneous", "sigma_t": leaf.look.density or EXTINCTION}
    medium |= {"albedo": {"type": "rgb", "value": list(colour)}, "phase": {"type": "isotropic"}}
    return {"bsdf": NO_BSDF, "interior": medium}


def mesh(surface: Surface, matrix: np.ndarray, leaf: Leaf) -> Any:
    """A surface under a 4 x 4 matrix as 200,000 triangles, with the look of a leaf."""
    u, v = (a.ravel() for a in np.mgrid[0 : math.tau : 501j, 0 : math.pi : 201j])
    p, n = surface(u, v)
    p, n = matrix[:3, :3] @ p + matrix[:3, 3:], np.linalg.inv(matrix[:3, :3]).T @ n
    i, j = (a.ravel() for a in np.mgrid[0:500, 0:200])
    a, b, c, d = i * 201 + j, (i + 1) * 201 + j, (i + 1) * 201 + j + 1, i * 201 + j + 1
    k = len(a) // 2 + 100  # a triangle in the middle; corners run to the left about the normal
    if np.linalg.det(np.stack([p[:, b[k]] - p[:, a[k]], p[:, c[k]] - p[:, a[k]], n[:, a[k]]])) < 0.0:
        b, d = d, b
    properties = mi.Properties()
    for name, part in worn(leaf).items():
        properties[name] = mi.load_dict(part)
    smooth = leaf.geometry != "octahedron"
    made = mi.Mesh("surface", len(u), 2 * len(a), has_vertex_normals=smooth, props=properties)
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = p.T.ravel()
    if smooth:
        parameters["vertex_normals"] = (n / np.linalg.norm(n, axis=0)).T.ravel()
    parameters["faces"] = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).ravel()
    parameters.update()
    return made


def solids(root: Fold) -> dict[str, Any]:
    """The leaves of a union."""
    found = {}
    for index, link in enumerate(root.links):
        leaf: Any = link.node
        matrix = np.eye(4)
        for step in leaf.steps:
            matrix = np.vstack([np.reshape(step.rows, (3, 4)), (0, 0, 0, 1)]) @ matrix
        found[f"leaf{index}"] = mesh(ball if leaf.geometry == "sphere" else ring, matrix, leaf)
    return found


def sensor(stage: Stage, canvas: tuple[int, int], **sampler: Any) -> dict[str, Any]:
    """The camera; samples lie anywhere in their pixel and count the same."""
    camera, (width, height) = stage.camera, canvas
    film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
    look = mi.ScalarTransform4f().look_at(camera.eye, camera.target, [0, 1, 0])
    fov = {"fov": math.degrees(camera.fov_rad), "fov_axis": "smaller"}
    return {"type": "perspective", "to_world": look, "film": film, "sampler": sampler} | fov


def exported(objects: dict[str, Any], stage: Stage, canvas: tuple[int, int], samples: int) -> Any:
    """A scene as Mitsuba renders it; samples of a pixel, a square number."""
    light, ground = stage.lights[0], stage.ground
    scene = {
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": 2, "rr_depth": 100},
        "sensor": sensor(stage, canvas, type="stratified", sample_count=samples),
        "light": {
            "type": "point",
            "position": light.position,
            "intensity": {"type": "rgb", "value": [light.power * math.pi * c for c in light.rgb]},
        },
        **objects,
    }
    if ground is not None:
        flat = mi.ScalarTransform4f().translate([0, ground.y, 0]).rotate([1, 0, 0], -90).scale(200.0)
        scene["ground"] = {"type": "rectangle", "to_world": flat, "bsdf": diffuse(ground.rgb)}
    return mi.load_dict(scene)


def picture(scene: Any, seed: int = 0, samples: int = 0) -> np.ndarray:
    """Linear light (H, W, 3); samples of a pixel, by default those of the scene."""
    return np.array(mi.render(scene, seed=mi.UInt32(seed), spp=samples))[..., :3]
