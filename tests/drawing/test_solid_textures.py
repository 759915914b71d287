"""Textures of solids and of media, against the reference, closed forms and the other library."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.assets.picture import painted
from scenelang.compiler.program import Paint
from scenelang.compiler.spaces import Camera, Light, Stage
from scenelang.compiler.steps import Affine, Warp
from scenelang.drawing.exact.solid import Field, solid_image
from scenelang.drawing.neural.load import Solids
from scenelang.drawing.solid import light
from scenelang.drawing.solid.draw import draw_solids
from tests.assets.shapes import noise
from tests.drawing.solids import MIXED, Object, field, graph, moved, network, psnr, scaled, turned, weights
from tests.drawing.test_renderers_solids import everywhere

STEPS = (("hue", 0.2), ("grayscale", 0.3), ("color", 0.9, 0.6, 1.0))
COARSE, FINE, SPACE = noise(7, 5), noise(96, 96, seed=1), noise(5, 5, 5)
MOVED = (Affine((0.5, 0.3, 0, 0.2, -0.4, 0.7, 0, 0.1, 0, 0, 1, 0)),)


def torch_network() -> Solids:
    import torch

    net = Solids(network().config, 2, 2)
    net.load_state_dict({name: torch.tensor(value) for name, value in weights().items()})
    return net


@pytest.mark.parametrize("library", ["numpy", "torch"])
@pytest.mark.parametrize("element", [COARSE, SPACE], ids=["picture", "space"])
def test_the_field_has_the_colours_of_the_reference(library: str, element) -> None:
    """At points in objects of every kind, blended and cut, with moves of pictures."""
    moves = MOVED if element is COARSE else ()
    objects = [o._replace(paint=Paint(element, STEPS), texture=moves) for o in MIXED]
    objects[1] = MIXED[1]._replace(paint=Paint(element))
    solids = field(objects, torch_network() if library == "torch" else None)
    p = np.random.default_rng(2).uniform(-1, 1, (3, 4000)).astype(np.float32)
    exact = Field(graph(objects)).at(p.astype(float))
    like = solids.xp.array(p, solids.network.codes)
    with solids.xp.inference():
        if library == "numpy":
            found = everywhere(solids, like).register[:3]
        else:  # one object alone
            found = solids.xp.to_numpy(solids.worn(solids.xp.whole(like[0] * 0), like))
            exact = Field(graph(objects[:1])).at(p.astype(float))
    inside = exact.d < -0.02
    assert inside.sum() > 100
    error = abs(found - exact.rgb)[:, inside]
    assert error.max() < 0.05  # in blends, whose shares are learned
    assert np.median(error) < 1e-4
    assert np.ptp(exact.rgb[:, inside], axis=1).min() > 0.2


SCENES = {
    "surfaces": (
        [
            Object("torus", (scaled(1.1, 1.1, 1.1), turned(0.8)), paint=Paint(COARSE, STEPS), texture=MOVED),
            Object("sphere", (scaled(0.6, 0.4, 0.6), moved(1, 0, 0.6)), token="smooth", paint=Paint(SPACE)),
            Object("sphere", (scaled(0.4, 0.4, 0.4), moved(-0.8, 0.5, 0.4)), token="subtract"),
        ],
        44,
    ),
    "warped": (
        [Object("torus", (Warp(0.9, (0.3, 0.0)), turned(1.2)), paint=Paint(COARSE))],
        44,
    ),
    "media": (
        [
            Object("sphere", (turned(0.5),), "volumetric", paint=Paint(COARSE, STEPS)),
            Object("torus", (scaled(0.5, 0.5, 0.5), moved(1.3, 0, 0.5)), "volumetric", paint=Paint(SPACE)),
            Object("sphere", (scaled(0.5, 0.5, 0.5), moved(-1.2, 0, 0.5)), "volumetric", (0.1, 0.3, 0.9)),
        ],
        46,
    ),
    "solids in media": (
        [
            Object("sphere", (), "volumetric", (0.9, 0.9, 1.0)),
            Object("torus", (scaled(0.94, 0.94, 0.94), turned(0.6)), paint=Paint(COARSE)),
        ],
        40,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_pictures_are_those_of_the_reference(name: str) -> None:
    objects, least = SCENES[name]
    exact = solid_image(graph(objects), Stage(), (48, 48))
    found, _ = draw_solids(field(objects), Stage(), (48, 48))
    assert psnr(found, exact) > least
    plain, _ = draw_solids(field([o._replace(paint=None) for o in objects]), Stage(), (48, 48))
    assert psnr(plain, exact) < psnr(found, exact) - 6
    other, _ = draw_solids(field(objects, torch_network()), Stage(), (48, 48))
    assert abs(np.asarray(other) - found).max() < 2 / 255


def test_textures_are_looked_up_four_times_without_four_rays() -> None:
    objects = [Object("sphere", paint=Paint(FINE)), Object("torus", (turned(1.0),), paint=Paint(FINE))]
    solids = field(objects)
    four, _ = draw_solids(solids, Stage(), (64, 64), samples="four")
    some, work = draw_solids(solids, Stage(), (64, 64))
    one, _ = draw_solids(solids, Stage(), (64, 64), samples="one")
    assert psnr(one, four) < 25
    assert psnr(some, four) > 38
    plain = draw_solids(field([o._replace(paint=None) for o in objects]), Stage(), (64, 64))[1]
    assert work.refined < 1.2 * plain.refined


def test_many_lookups_are_made_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    objects = [Object("sphere", paint=Paint(FINE)), Object("torus", (), "volumetric", paint=Paint(COARSE))]
    whole, _ = draw_solids(field(objects), Stage(), (32, 32))
    for name in ("PIXELS", "CHUNK"):
        monkeypatch.setattr(light, name, 17)
    np.testing.assert_allclose(draw_solids(field(objects), Stage(), (32, 32))[0], whole, rtol=0, atol=1e-5)


def test_light_in_a_medium_of_two_colours_is_the_sum_of_both_ways() -> None:
    """Seen along the axis on which they change: near and far half have closed forms of their own."""
    dark = (0.0, 0.0, 0.0)
    stage = Stage(
        camera=Camera((0.0, 0.0, 6.0), dark), light=Light(power=0.0), ground=None, horizon=dark, zenith=dark
    )
    halves = np.zeros((2, 1, 3), np.uint8)
    halves[0, 0, 0] = halves[1, 0, 1] = 255  # red over green, along the leaf's y
    paint = Paint(painted("halves", np.repeat(halves, 256, 0)))
    # the leaf's y along the world's z
    upright = Affine((1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0))
    image, _ = draw_solids(field([Object("sphere", (upright,), "volumetric", paint=paint)]), stage, (65, 65))
    linear = ((np.asarray(image)[32, 32] + 0.055) / 1.055) ** 2.4
    near, far = 0.12 * (1 - np.exp(-3)), 0.12 * (np.exp(-3) - np.exp(-6))
    assert linear[:2] == pytest.approx([near, far], abs=1e-3)


def test_a_paint_on_what_is_taken_away_changes_nothing() -> None:
    cut = [MIXED[0], MIXED[2]]
    same = [MIXED[0], MIXED[2]._replace(paint=Paint(COARSE))]
    a, b = (draw_solids(field(objects), Stage(), (32, 32))[0] for objects in (cut, same))
    np.testing.assert_array_equal(a, b)
