"""Every shipped model is trained, draws what its manifest says, and states what it measured."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import available, load_manifest
from scenelang.drawing.torch_backend import draw_program, open_model

MODELS = [name for name in available() if load_manifest(name).dimension == 2]


@pytest.mark.parametrize("name", MODELS)
def test_colours_and_places_show(name: str) -> None:
    """A large red square on the left is red on the left and not on the right."""
    manifest = load_manifest(name)
    canvas = manifest.sizes[0] if manifest.sizes else (32, 32)
    text = "square { scale(0.5); translate(-0.5, 0); material flat { color([0.9, 0.1, 0.1]); } }"
    scene = nsg.loads(text).model_copy(update={"canvas": canvas})
    picture = np.asarray(draw_program(compile_scene(scene, model=name), open_model(name)).image)
    middle = picture[canvas[1] // 2]
    left, right = middle[: canvas[0] // 2].mean(0), middle[canvas[0] // 2 :].mean(0)
    assert left.min() < right.min()


@pytest.mark.parametrize("name", MODELS)
def test_the_manifest_states_its_error(name: str) -> None:
    figures = load_manifest(name).measured["sets"]["shapes2d"]
    assert {"scenes", "psnr", "psnr_worst", "flip"} <= figures.keys()
    assert 0 < load_manifest(name).flip() < 1
