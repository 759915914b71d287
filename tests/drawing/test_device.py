"""Pictures by torch on a GPU, where there is one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.gpu
@pytest.mark.torch
@pytest.mark.parametrize("name", ["chain", "tangram", "snowman"])
def test_pictures_are_those_of_the_processor(name: str) -> None:
    scene = nsg.load(EXAMPLES / f"{name}.nsg")
    here = nsg.render(scene, size=(96, 96), device="cpu")
    there = nsg.render(scene, size=(96, 96), device="cuda")
    np.testing.assert_allclose(there, here, atol=2 / 255)
