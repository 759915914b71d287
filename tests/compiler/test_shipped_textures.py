"""The textures that ship are those which their script draws, and tell how they are turned."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from lab.docs.make_textures import drawn
from scenelang.assets.picture import pixels
from scenelang.assets.zoo import TEXTURES_FILE, load_textures
from scenelang.language.words import TEXTURES

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
