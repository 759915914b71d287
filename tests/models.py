"""A model in space for tests: one as `language.md` has it, where the shipped ones are flat."""

from __future__ import annotations

from dataclasses import replace

from scenelang.models.manifest import Manifest

SOLIDS = Manifest(
    name="solids3d",
    summary="sphere and torus under a point light",
    dimension=3,
    renderer="solid",
    lifting="exact",
    geometries=("sphere", "torus"),
    materials=("diffuse", "volumetric"),
    default_material="diffuse",
    transforms=("translate", "rotate", "scale", "shear", "matrix", "twirl", "bend", "twist", "displace"),
    material_ops=("color", "grayscale", "hue"),
    limits={"canvas": 2048, "inner_warps": 2, "outer_warps": 2},
    trained={"twist": (-4, 4), "displace": (0, 0.3), "thickness": (0.03, 0.3), "width": (0, 1.2)},
    measured={},
    layout="solid",
    any_blend=True,
)
STUDIO = replace(SOLIDS, name="solids3d-studio", set="solids3d", fixed_stage=True, any_blend=False)
"""One whose camera, light, ground and sky are its own."""
