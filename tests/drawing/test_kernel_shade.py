"""Direct light by the kernel, against the same light over arrays and the exact reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.spaces import Camera, Ground, Light, Stage
from scenelang.drawing.closed import field_of
from scenelang.drawing.image import decoded, from_light
from scenelang.drawing.kernel import load_kernel
from scenelang.drawing.solid.draw import Lighting, _band, draw_solids
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import CAREFUL, MARCH_SETTINGS
from scenelang.drawing.tables import stage_rows
from scenelang.language.evaluation import load
from tests.drawing.solids import Object, field, scaled

ROOT = Path(__file__).parents[2]
KERNEL = load_kernel()
PLAIN = ("armillary", "bracket", "castle", "chess", "robot", "saturn", "snowman", "stones")
TEXTURES, MEDIA, SOFT = ("turned", "floor", "lantern"), ("clouds", "icecream"), ("teatime",)
SIDE = 48


def example(name: str) -> tuple[SolidField, Stage]:
    program = compile_scene(load(ROOT / f"examples/{name}.nsg"))
    assert program.stage is not None
    net = field_of(program, False)
    solids = SolidField(net, program.vectors, program.tokens, program.brought(), program.paints())  # type: ignore[arg-type]
    return solids, program.stage


@pytest.mark.parametrize("samples", ["one", "adaptive"])
@pytest.mark.parametrize("name", [*PLAIN, *TEXTURES, *MEDIA, *SOFT])
def test_light_is_that_over_arrays(name: str, samples: str) -> None:
    """But at edges, where the surface that is met is another."""
    solids, stage = example(name)
    found, work = draw_solids(solids, stage, (SIDE, SIDE), samples=samples)
    light, others = _band(
        Lighting(solids, stage, MARCH_SETTINGS[samples]), (SIDE, SIDE), range(SIDE), samples, 4
    )
    exact = from_light(light, stage.transparent)
    off = abs(np.asarray(found) - np.asarray(exact)).max(2)
    assert np.median(off) < 2e-6
    assert (off > 4e-3).mean() < 4e-3
    assert work.refined == pytest.approx(others.refined, abs=2)
    assert work.lost == 0


@pytest.mark.parametrize("name", ["robot", "clouds", "floor", "teatime"])
def test_rows_do_not_depend_on_bands(name: str) -> None:
    """The same bytes however rows are cut, in threads, and by processors with AVX2 and AVX-512."""
    solids, stage = example(name)
    whole, work = draw_solids(solids, stage, (SIDE, SIDE))
    assert work.refined > 50
    for cuts in ({"split": 5}, {"threads": 3}, {"split": SIDE}):
        assert draw_solids(solids, stage, (SIDE, SIDE), **cuts)[0].tobytes() == whole.tobytes()  # type: ignore[arg-type]


def test_variants_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    solids, stage = example("bracket")
    whole = draw_solids(solids, stage, (SIDE, SIDE))[0]
    newest = KERNEL.variant
    for variant in range(newest):
        monkeypatch.setattr(KERNEL, "variant", variant)
        other = draw_solids(solids, stage, (SIDE, SIDE))[0]
        assert (abs(other - whole).max(2) > 1 / 255).mean() < 2e-3
        if variant:
            assert other.tobytes() == whole.tobytes()


@pytest.mark.parametrize("count", [4, 9, 400])
def test_samples_are_means_over_their_pixels(count: int) -> None:
    """Of a sky that brightens upwards, whose light is 1 in the middle at most, over every pixel."""
    stage = Stage(Camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0)), (), None, (0.1, 0.2, 0.3), (0.9, 0.4, 0.1))
    solids, side = field([Object("sphere", (scaled(0.01),))]), 8
    row, _kept = stage_rows(stage, (side, side), CAREFUL, count, True)
    found = decoded(solids.shade(row, range(side))[0][:3, :2])
    n = int(np.sqrt(count))
    places = (np.arange(side * n) + 0.5) / n - side / 2
    half, px = np.tan(stage.camera.fov_rad / 2), 2 / side
    x, y = np.meshgrid(places * px * half, -places * px * half)
    high = np.clip(2 * y / np.sqrt(1 + x * x + y * y), 0, 1).reshape(side, n, side, n).mean((1, 3))[:3, :2]
    low, top = np.array(stage.horizon), np.array(stage.zenith)
    assert found == pytest.approx(low + (top - low) * high[..., None], abs=1e-5)


def test_a_ball_that_glows_over_the_ground() -> None:
    """By closed forms: what it gives off, ambient light and that of two lamps, and the ground's fade."""
    light, other = Light((0.0, 0.0, 9.0), 30.0, (1.0, 0.5, 0.2)), Light((0.0, 3.0, 3.0), 9.0)
    camera = Camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0), 2 * np.arctan(0.375))
    stage = Stage(camera, (light, other), Ground(-3.0, (0.5, 0.4, 0.3)))
    solids = field([Object("sphere", (scaled(0.8),), rgb=(0.6, 0.7, 0.2))])
    # three pixels, whose rays go along (0, 0.6, -0.8), (0, 0, -1) and (0, -0.6, -0.8)
    row, _kept = stage_rows(stage, (1, 3), CAREFUL)
    top, middle, bottom = decoded(solids.shade(row, range(3))[0][:, 0])
    p, n = np.array([0.0, 0.0, 0.8]), np.array([0.0, 0.0, 1.0])
    exact = 0.12 * np.array([0.6, 0.7, 0.2])
    for lamp in stage.lights:
        to = np.array(lamp.position) - p
        r = np.linalg.norm(to)
        exact += lamp.power * np.array(lamp.rgb) * np.array([0.6, 0.7, 0.2]) * (n @ to) / r**3
    assert middle == pytest.approx(exact, rel=2e-3)
    at = np.array([0.0, -3.0, 2.0])
    kept = np.exp(-(at[2] ** 2) / 64)
    floor, level = kept * np.array([0.5, 0.4, 0.3]), np.array([0.0, 1.0, 0.0])
    exact = floor * 0.18 + (1 - kept) * np.array(stage.horizon)
    for lamp in stage.lights:
        to = np.array(lamp.position) - at
        r = np.linalg.norm(to)
        clear = np.linalg.norm(np.cross(to, -at)) / r > 0.8 or to @ -at < 0
        exact += clear * lamp.power * np.array(lamp.rgb) * floor * (level @ to) / r**3
    assert bottom == pytest.approx(exact, rel=1e-3)
    assert top == pytest.approx(np.array(stage.zenith), rel=1e-5)


def test_without_a_background_what_is_met_covers() -> None:
    scene = (
        "nsg 1; canvas(32, 24); background(none); ground(none); sphere { material diffuse { glow(#0f0); } }"
    )
    picture = np.asarray(nsg.render(nsg.loads(scene)))
    exact = np.asarray(nsg.render(nsg.loads(scene), backend="reference"))
    assert picture.shape == (24, 32, 4)
    assert abs(picture - exact).max() < 0.02
