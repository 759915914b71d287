"""Every shipped model is trained, draws what its manifest says, and states what it measured."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from lab.docs.make_textures import drawn
from scenelang.assets.picture import pixels
from scenelang.assets.zoo import TEXTURES_FILE, load_textures
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import available, load_manifest
from scenelang.drawing.torch_backend import draw_program, open_model
from scenelang.language.words import TEXTURES

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


COLOURS = {
    name: np.frombuffer(pixels(element), np.uint8).reshape(256, 256, 3)
    for name, element in load_textures().items()
}


@pytest.mark.parametrize("name", ["arrows", "checker", "noise", "plaid", "stripes", "zigzag"])
def test_textures_are_drawn_again(name: str) -> None:
    """Within a step of 8 bits, which another library of sines may take."""
    assert abs(drawn(name).astype(int) - COLOURS[name]).max() <= 1


def test_most_textures_show_flips_and_turns() -> None:
    """Half of them at least are not themselves mirrored, turned, or mirrored and shifted by half a period."""
    assert tuple(sorted(COLOURS)) == TEXTURES
    assert len(COLOURS) == 16
    assert TEXTURES_FILE.stat().st_size < 100_000
    shows = 0
    for colours in COLOURS.values():
        others = [colours[:, ::-1], colours[::-1], colours[::-1, ::-1], np.rot90(colours)]
        others += [
            np.roll(other, (128 * i, 128 * j), (0, 1))
            for other in others
            for i, j in ((0, 1), (1, 0), (1, 1))
        ]
        off = [abs(other.astype(int) - colours).mean() for other in others]
        shows += min(off) > 2
    assert shows >= 8


@pytest.mark.parametrize("shading", ["", "diffuse ", "volumetric "])
def test_solids_wear_them(shading: str) -> None:
    text = f"canvas(24, 24); torus {{ rotate(90deg, axis = X); material {shading}checker {{ scale(0.5); }} }}"
    program = nsg.compile(nsg.loads(text))
    assert (program.model, [paint.element.name for paint in program.palette]) == ("solids3d", ["checker"])
    picture, plain = nsg.render(program), nsg.render(nsg.loads(text.replace("scale(0.5);", "")))
    assert np.abs(np.asarray(picture) - np.asarray(plain)).max() > 0.1
