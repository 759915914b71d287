"""Every shipped model is trained, draws what its manifest says, and states what it measured."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from lab.docs.make_textures import drawn
from scenelang.assets.element_file import TEXTURES_FILE, load_textures
from scenelang.assets.picture import pixels
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import ROOT, Manifest, available, load_manifest
from scenelang.drawing.torch_backend import draw_program, open_model
from scenelang.language.words import TEXTURES

MODELS = [name for name in available() if load_manifest(name).dimension == 2]


def test_manifests() -> None:
    for name in available():
        manifest = load_manifest(name)
        assert manifest.name == name
        assert manifest.limits.keys() <= {"canvas", "inner_warps", "outer_warps"}, name
        assert all(low <= high for low, high in manifest.trained.values()), name


def test_damaged_manifests() -> None:
    data = (ROOT / "shapes2d" / "manifest.json").read_bytes()
    changes = (
        (b'"format": 1', b'"format": 2'),
        (b'"renderer"', b'"drawer"'),
        (b'"texels": [', b'"texels": [1, '),
    )
    for damaged in (b"", b"[]", b"\xff", data[:-100], *(data.replace(*change) for change in changes)):
        with pytest.raises(ValueError, match="not a model manifest of format 1"):
            Manifest.from_json(damaged)


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
    assert {"scenes", "psnr", "psnr_worst", "flip"} <= manifest.measured["sets"]["shapes2d"].keys()
    assert 0 < manifest.flip() < 1


def test_textures_are_drawn_again() -> None:
    """Within a step of 8 bits, which another library of sines may take."""
    textures = load_textures()
    assert tuple(sorted(textures)) == TEXTURES
    assert len(textures) == 16
    assert TEXTURES_FILE.stat().st_size < 100_000
    for name in ("arrows", "checker", "noise", "plaid", "stripes", "zigzag"):
        colours = np.frombuffer(pixels(textures[name]), np.uint8).reshape(256, 256, 3)
        assert abs(drawn(name).astype(int) - colours).max() <= 1
