"""The reference of solid scenes against Mitsuba 3 (the extra ``oracles``): diffuse ones, and one scattering.

Mitsuba knows neither our ambient light nor the ground's fade, so both are off, and all is seen over black.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from scenelang.graph.stage import Camera, Ground, Light, Stage
from scenelang.measure.metrics import flip, psnr
from scenelang.reference.solid import image as exact
from tests.reference.solid_scenes import fold, leaf, moved, scaled, turned

mi = pytest.importorskip("mitsuba")
pytestmark = pytest.mark.oracle

SIZE = 64
GOLD, BLUE = (0.8, 0.53, 0.12), (0.2, 0.4, 0.9)
STAGE = Stage(
    camera=Camera(eye=(-1.5, 1.6, 4.5), target=(0.1, -0.1, 0.0), fov_rad=0.7),
    light=Light((1.5, 3.0, 2.0), 16.0),
    ground=Ground(-0.8, (0.5, 0.6, 0.4)),
    horizon=(0.0, 0.0, 0.0),
    zenith=(0.0, 0.0, 0.0),
)


def ring(matrix: np.ndarray) -> Any:
    """A torus as 200,000 triangles with normals of its own."""
    u, v = (a.ravel() for a in np.mgrid[0 : math.tau : 501j, 0 : math.tau : 201j])
    n = np.stack([np.cos(v) * np.cos(u), np.sin(v), np.cos(v) * np.sin(u)])
    p = 0.3 * n + 0.7 * np.stack([np.cos(u), 0 * u, np.sin(u)])
    n = np.linalg.inv(matrix[:3, :3]).T @ n
    i, j = (a.ravel() for a in np.mgrid[0:500, 0:200])
    a, b, c, d = i * 201 + j, (i + 1) * 201 + j, (i + 1) * 201 + j + 1, i * 201 + j + 1
    bsdf = mi.load_dict({"type": "twosided", "bsdf": diffuse(BLUE)})
    properties = mi.Properties()
    properties["bsdf"] = bsdf
    mesh = mi.Mesh("ring", len(u), 2 * len(a), has_vertex_normals=True, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = (matrix[:3, :3] @ p + matrix[:3, 3:]).T.ravel()
    parameters["vertex_normals"] = (n / np.linalg.norm(n, axis=0)).T.ravel()
    parameters["faces"] = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).ravel()
    parameters.update()
    return mesh


def diffuse(rgb: tuple[float, float, float]) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(rgb)}}


def mitsuba_picture(objects: dict[str, Any], samples: int) -> np.ndarray:
    """Linear light (H, W, 3) of the objects on our stage."""
    camera, light, ground = STAGE.camera, STAGE.light, STAGE.ground
    flat = mi.ScalarTransform4f().translate([0, ground.y, 0]).rotate([1, 0, 0], -90).scale(200.0)
    scene = {
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": 2, "rr_depth": 100},
        "sensor": {
            "type": "perspective",
            "fov": math.degrees(camera.fov_rad),
            "to_world": mi.ScalarTransform4f().look_at(camera.eye, camera.target, [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}},
            "sampler": {"type": "stratified", "sample_count": samples},
        },
        "light": {"type": "point", "position": light.position, "intensity": light.power * math.pi},
        "ground": {"type": "rectangle", "to_world": flat, "bsdf": diffuse(ground.rgb)},
        **objects,
    }
    return np.array(mi.render(mi.load_dict(scene)))[..., :3]


def compared(root: Any, picture: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> tuple[float, float]:
    """PSNR and FLIP of Mitsuba's picture."""
    monkeypatch.setattr(exact, "AMBIENT", (0.0, 0.0))
    monkeypatch.setattr(exact, "FADE", 1e30)
    ours = np.asarray(exact.solid_image(root, STAGE, (SIZE, SIZE), per_side=8))
    found = psnr(exact.encoded(picture), ours), flip(exact.encoded(picture), ours)
    print("PSNR {:.1f} dB, FLIP {:.4f}".format(*found))
    return found


def test_diffuse_with_shadows(monkeypatch: pytest.MonkeyPatch) -> None:
    mi.set_variant("scalar_rgb")
    steps = (scaled(0.9, 0.9, 0.5), turned(1.1, 1, 0, 0), moved(-0.2, -0.1, 0.2))
    matrix = np.eye(4)
    for step in steps:
        matrix = np.vstack([np.reshape(step.rows, (3, 4)), (0, 0, 0, 1)]) @ matrix
    root = fold(
        leaf("sphere", "diffuse", GOLD, scaled(0.5), moved(0.4, 0.2, 0.1)),
        leaf("torus", "diffuse", BLUE, *steps),
    )
    ball = {"type": "sphere", "center": [0.4, 0.2, 0.1], "radius": 0.5, "bsdf": diffuse(GOLD)}
    picture = mitsuba_picture({"ball": ball, "ring": ring(matrix)}, 256)
    decibels, difference = compared(root, picture, monkeypatch)
    assert decibels > 46
    assert difference < 0.005


def test_single_scattering(monkeypatch: pytest.MonkeyPatch) -> None:
    mi.set_variant("scalar_rgb")
    root = fold(
        leaf("sphere", "volumetric", BLUE, scaled(0.7), moved(-0.1, 0.0, 0.0)),
        leaf("sphere", "diffuse", GOLD, scaled(0.3), moved(0.5, 0.6, 0.5)),
    )
    medium = {
        "type": "homogeneous",
        "sigma_t": 3.0,
        "albedo": {"type": "rgb", "value": list(BLUE)},
        "phase": {"type": "isotropic"},
    }
    mist = {
        "type": "sphere",
        "center": [-0.1, 0, 0],
        "radius": 0.7,
        "bsdf": {"type": "null"},
        "interior": medium,
    }
    ball = {"type": "sphere", "center": [0.5, 0.6, 0.5], "radius": 0.3, "bsdf": diffuse(GOLD)}
    picture = mitsuba_picture({"mist": mist | {"bsdf": {"type": "null"}}, "ball": ball}, 1024)
    decibels, difference = compared(root, picture, monkeypatch)
    assert decibels > 46
    assert difference < 0.005
