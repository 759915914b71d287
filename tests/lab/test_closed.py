"""The rival that draws solids by formulas: what it draws is exact but for how the renderer marches."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from scenelang.lab.frontier.closed import ClosedForms
from scenelang.renderers.draw import draw_objects
from tests.pictures import psnr_db

SCENES = {
    "solids": """
      sphere { scale(0.6); translate(0, 0.6, 0); material diffuse { color(#e8c060); } }
      torus { scale(1.2, 1.2, 0.4); rotate(70deg, axis = X); material diffuse { color(#48f); } }""",
    "every operator": """chain {
      sphere { scale(0.8); twirl(0.6); material diffuse { color(#e8c060); } }
      smooth torus { scale(0.8); bend(0.5); rotate(70deg, axis = X); material volumetric { color(#48f); } }
      subtract sphere { scale(0.4); translate(0.3, 0.5, 0.5); }
      intersect sphere { displace(0.02, 5); scale(0.9); }
      torus { scale(0.5); translate(0.7, 0, 0.5); material volumetric; } }""",
}


@pytest.mark.parametrize("name", SCENES)
def test_formulas_draw_the_exact_picture(name: str) -> None:
    scene = nsg.loads(f"nsg 1; canvas(64, 64); {SCENES[name]}")
    program, exact = nsg.compile(scene), nsg.render(scene, backend="reference")
    assert psnr_db(np.asarray(draw_objects(ClosedForms("solids3d"), program).image), exact) > 50
