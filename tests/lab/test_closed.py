"""The rival that draws solids by formulas: what it draws is exact but for how the renderer marches."""

from __future__ import annotations

import pytest

import scenelang as nsg
from scenelang.lab.frontier.closed import ClosedForms
from scenelang.renderers.draw import draw_objects
from tests.pictures import premultiplied, psnr_db

SCENES = {
    "solids": (
        85,
        """sphere { scale(0.6); translate(0, 0.6, 0); material diffuse { color(#e8c060); } }
        torus { scale(1.2, 1.2, 0.4); rotate(70deg, axis = X); material diffuse { color(#48f); } }
        sphere { scale(0.15); translate(0.5, 0.02, 0.6); }
        sphere { scale(0.3); translate(-0.8, -0.7, 0.5); }""",
    ),
    "warped": (
        85,
        """torus { displace(0.05, 7); twirl(0.6); scale(0.9, 0.7, 0.8); bend(0.5); rotate(1rad, axis = X); }
        sphere { twist(0.8); scale(0.3, 0.6, 0.5); twirl(0.5); twist(0.4); translate(0.6, 0.2, 0.6); }
        sphere { scale(0.25); translate(0.9, 0, 0); twirl(2); } background(none);""",
    ),
    "media": (
        60,
        """sphere { scale(0.6); translate(-0.4, 0.2, 0); material volumetric { color(#48f); } }
        torus { scale(0.6); rotate(60deg, axis = X); translate(0.6, 0, 0.2); material volumetric; }
        sphere { scale(0.3); translate(0.2, 0.3, -1); }""",
    ),
    "lit from within": (
        75,
        """sphere { scale(0.8, 0.7, 0.6); translate(0.2, 0, 0); material volumetric { color(#48f); } }
        sphere { scale(0.2); translate(-0.6, 0.6, 0.5); } light(position = [0.4, 0.3, 0.2], power = 1);""",
    ),
    "blended": (
        85,
        """chain { sphere { scale(0.5); translate(-0.4, 0, 0); material diffuse { color(#e8c060); } }
        smooth(k = 0.5) torus { scale(0.6); rotate(70deg, axis = X); translate(0.4, 0, 0); }
        smooth(k = 0.3) sphere { scale(0.3); translate(0, 0.8, 0); material diffuse { color(#48f); } } }""",
    ),
    "every operator": (
        56,
        """chain {
        sphere { scale(0.8); twirl(0.6); material diffuse { color(#e8c060); } }
        smooth torus { scale(0.8); bend(0.5); rotate(70deg, axis = X); material volumetric { color(#48f); } }
        subtract sphere { scale(0.4); translate(0.3, 0.5, 0.5); }
        intersect sphere { displace(0.02, 5); scale(0.9); }
        torus { scale(0.5); translate(0.7, 0, 0.5); material volumetric; } }""",
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_formulas_draw_the_exact_picture(name: str) -> None:
    """So it is what the network learned that errs where its picture does, and not the march or the light."""
    least_db, objects = SCENES[name]
    light = "" if "light(" in objects else "light(position = [1.5, 2.5, 1.5], power = 16, color = #fc8);"
    scene = nsg.loads(f"nsg 1; canvas(64, 64); {light} {objects}")
    program, exact = nsg.compile(scene), nsg.render(scene, backend="reference")
    image = draw_objects(ClosedForms("solids3d"), program, samples="four").image
    drawn, exact = premultiplied(image), premultiplied(exact)
    print(f"{psnr_db(drawn, exact):.1f} dB")
    assert psnr_db(drawn, exact) > least_db
