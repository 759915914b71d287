"""`camera(exposure = e)`: the picture is what it was as linear light, times e, clamped and encoded."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.program import program_bytes
from scenelang.compiler.spaces import Camera, Sky, Stage, read_stage, stage_data
from scenelang.drawing.exact.picture import sky_light
from scenelang.drawing.exact.solid import solid_image
from scenelang.drawing.image import decoded, encoded
from scenelang.language.diagnostics import Diagnostics

SCENE = """canvas(24, 18); light(power = 9); sphere { scale(0.8); material diffuse { color(#b55); } }
torus { translate(1.2, 0.3, 0); material volumetric; } box { scale(0.4); translate(-1, 0, 1); }"""
TIMES = 0.4, 1.15


def scene(e: float, more: str) -> nsg.Scene:
    return nsg.loads(f"{SCENE} {more} camera(exposure = {e});")


@pytest.mark.parametrize("more", ["", "background(#345);", "background(none);", "sky(power = 0.3);"])
@pytest.mark.parametrize("backend", ["neural", "torch", "reference"])
def test_exposure_multiplies_linear_light(backend: str, more: str) -> None:
    how: dict[str, Any] = {"samples": "four"}
    if backend != "neural" and "sky" in more:
        return  # which the kernel alone draws, and the reference in the next test
    if backend == "torch":
        how |= {"device": "cpu"}
    elif backend == "reference":
        how = {"backend": backend, "size": (8, 6)}
    usual = np.asarray(nsg.render(scene(1.0, more), **how), float)
    for e in TIMES:
        found = np.asarray(nsg.render(scene(e, more), **how), float)
        assert abs(found[..., :3] - encoded(e * decoded(usual[..., :3])))[usual[..., :3] < 0.9].max() < 1e-4
        assert np.array_equal(found[..., 3:], usual[..., 3:])
    white = np.asarray(nsg.render(scene(1e6, more), **how))
    assert white[..., :3].max() <= 1.0
    assert (white[..., :3] > 0.99999).mean() > 0.3


def test_exposure_multiplies_traced_light() -> None:
    graph = lower(scene(1.0, "sky();"), load_manifest("solids3d"), None, Diagnostics())
    usual, long = Stage(sky=Sky()), Stage(Camera(exposure=1.15), sky=Sky())
    light = partial(sky_light, paths=2)
    one, other = (np.asarray(solid_image(graph.root, s, (6, 4), light=light), float) for s in (usual, long))
    assert abs(other - encoded(1.15 * decoded(one)))[one < 0.9].max() < 1e-4
    assert (one < 0.9).mean() > 0.3


def test_pixels_are_sampled_by_how_bright_they_become() -> None:
    """In the kernel and over arrays: what is nearly black shows its edges under a long exposure."""
    text = """canvas(32, 24); light(none); ground(none); background(#000); camera(exposure = 2000);
    for (i in 0..<4) {
      sphere { scale(0.4); translate(i - 1.5, 0, 0); material diffuse { glow(#010101); } }
    }"""
    for device in ("auto", "cpu"):
        quick, full = (
            np.asarray(nsg.render(nsg.loads(text), samples=samples, device=device))
            for samples in ("adaptive", "four")
        )
        assert full.max() > 0.5
        assert abs(quick - full).max() < 0.05


def test_a_camera_without_exposure_is_written_as_before(tmp_path: Path) -> None:
    assert stage_data(Stage())["camera"].keys() == {"eye", "target", "fov_rad"}
    assert (
        repr(Camera()) == f"Camera(eye=(0.0, 1.2, 6.0), target=(0.0, 0.0, 0.0), fov_rad={Camera().fov_rad!r})"
    )
    usual = nsg.compile(nsg.loads(SCENE))
    assert program_bytes(nsg.compile(nsg.loads(SCENE + "camera(exposure = 1);"))) == program_bytes(usual)
    long = Stage(camera=Camera(exposure=3.0))
    assert read_stage(json.loads(json.dumps(stage_data(long)))) == long
    nsg.compile(scene(3.0, "")).save(tmp_path / "long.nsgp")
    kept = nsg.load_program(tmp_path / "long.nsgp")
    assert kept.stage is not None
    assert kept.stage.camera.exposure == 3.0
    with pytest.raises(ValueError, match="exposure"):
        nsg.Camera(exposure=0.0)


def test_a_scene_keeps_its_exposure() -> None:
    made = nsg.Scene(nodes=(nsg.Object("sphere"),), camera=nsg.Camera(exposure=2.5))
    for copy in (nsg.loads(made.to_nsg()), nsg.Scene.from_json(made.to_json())):
        assert copy.camera == made.camera
    depths = [nsg.render_outputs(scene(e, ""), ["depth"]).depth for e in (1.0, 5.0)]
    assert np.array_equal(depths[0], depths[1])  # type: ignore[arg-type]
