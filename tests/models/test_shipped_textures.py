"""The textures that ship are those which their script draws, and tell how they are turned."""

from __future__ import annotations

import numpy as np
import pytest

from lab.docs.make_textures import drawn
from scenelang.elements.picture import pixels
from scenelang.models.manifest import ROOT, load_manifest, load_textures

MANIFEST = load_manifest("textures2d")
COLOURS = {
    name: np.frombuffer(pixels(element), np.uint8).reshape(256, 256, 3)
    for name, element in load_textures(MANIFEST).items()
}


@pytest.mark.parametrize("name", ["arrows", "checker", "noise", "plaid", "stripes", "zigzag"])
def test_textures_are_drawn_again(name: str) -> None:
    """Within a step of 8 bits, which another library of sines may take."""
    assert abs(drawn(name).astype(int) - COLOURS[name]).max() <= 1


def test_most_textures_show_flips_and_turns() -> None:
    """Half of them at least are not themselves mirrored, turned, or mirrored and shifted by half a period."""
    assert sorted(COLOURS) == list(MANIFEST.textures)
    assert len(COLOURS) == 16
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


def test_the_whole_model_is_small() -> None:
    files = [path for path in (ROOT / "textures2d").iterdir() if path.suffix == ".safetensors"]
    assert len(files) == 3  # tensors, what is proved of them, textures
    assert sum(path.stat().st_size for path in files) < 1_000_000
