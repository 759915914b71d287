"""The rival that draws by formulas: exact but for how the renderer marches, and which samples it takes."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.geometries import SECTORS
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.closed import closed_forms, exact_units
from scenelang.drawing.exact.field import leaf_distance
from scenelang.drawing.how import Samples
from scenelang.drawing.neural.draw import draw_objects
from scenelang.drawing.neural.units import LeafUnits
from tests.compiler.random_scenes import blob_scene, random_scene
from tests.pictures import premultiplied, psnr_db

PLANE = """chain {
  square { scale(0.8); translate(-0.2, 0); material flat { color(#d33); } }
  smooth(k = 0.3) pentagon { twirl(0.6); scale(0.5); rotate(30deg); translate(0.3, 0.3); }
  subtract star { scale(0.3); translate(0.1, 0.1); }
}"""
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
    image = draw_objects(closed_forms("solids3d"), program, samples="four").image
    drawn, exact = premultiplied(image), premultiplied(exact)
    print(f"{psnr_db(drawn, exact):.1f} dB")
    assert psnr_db(drawn, exact) > least_db


def test_shapes_of_the_plane_are_the_reference_s() -> None:
    p = np.random.default_rng(1).normal(0, 1.5, (2, 20_000))
    for geometry in ("disc", *SECTORS):
        shape = LeafUnits(NUMPY, exact_units(geometry))
        np.testing.assert_allclose(shape.distance(p), leaf_distance(geometry, p), rtol=0, atol=1e-12)


def test_formulas_draw_the_exact_picture_of_the_plane() -> None:
    """All tokens, warps and widths of blends; a sample may lie within rounding of an outline."""
    field, seen, off = closed_forms("shapes2d"), set(), 0
    for seed in range(30):
        scene = (random_scene if seed % 3 else blob_scene)(seed).model_copy(update={"canvas": (72, 56)})
        try:
            program = nsg.compile(scene)
        except nsg.SceneError:
            continue
        seen |= {*(program.tokens & 3).tolist()}
        drawn, exact = (
            premultiplied(image)
            for image in (
                draw_objects(field, program, samples="four").image,
                nsg.render(scene, backend="reference"),
            )
        )
        off += int((abs(drawn - exact).max(-1) > 1 / 255).sum())
    assert seen == {0, 1, 2, 3}
    assert off <= 4


@pytest.mark.parametrize("samples", ["four", "adaptive"])
def test_users_can_ask_for_formulas(samples: Samples) -> None:
    """What differs from the exact picture is then the march and the samples, and no network."""
    for text, least_db in ((PLANE, 90 if samples == "four" else 55), (SCENES["solids"][1], 45)):
        scene = nsg.loads(f"canvas(64, 48); {text}")
        exact = nsg.render(scene, backend="reference")
        drawn = nsg.render(scene, backend="exact", samples=samples)
        assert psnr_db(drawn, exact) > least_db
        again = nsg.render(nsg.compile(scene), backend="exact", samples=samples)
        assert np.array_equal(drawn, again)
    near, far = (psnr_db(nsg.render(scene, backend=b), exact) for b in ("exact", "neural"))
    assert near > far - 1


def test_outputs_by_formulas() -> None:
    scene = nsg.loads("canvas(48, 48); sphere { scale(0.5, 0.7, 0.4); }")
    depth = {
        b: nsg.render_outputs(scene, ("depth",), backend=b).depth for b in ("neural", "exact", "reference")
    }
    seen = np.isfinite(depth["reference"]) & np.isfinite(depth["exact"]) & np.isfinite(depth["neural"])
    assert abs(depth["exact"][seen] - depth["reference"][seen]).max() < 1e-3
    assert not np.array_equal(depth["exact"], depth["neural"])


def test_what_has_no_formulas_is_refused() -> None:
    scene = nsg.loads('model "shapes2d-reading"; square { scale(0.5); }')
    with pytest.raises(nsg.RenderError, match="no frames that formulas could answer in"):
        nsg.render(scene, backend="exact")
    with pytest.raises(nsg.RenderError, match="by numpy"):
        nsg.render(nsg.loads("square {}"), backend="exact", device="cuda")
