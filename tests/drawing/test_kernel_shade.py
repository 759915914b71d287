"""Direct light by the kernel, against the same light over arrays and the exact reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.spaces import Camera, Ground, Light, Stage
from scenelang.drawing.closed import field_of
from scenelang.drawing.kernel import load_kernel
from scenelang.drawing.solid.draw import Lighting, directions
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.tables import stage_rows
from scenelang.language.evaluation import load
from tests.drawing.solids import Object, field, scaled

ROOT = Path(__file__).parents[2]
KERNEL = load_kernel()
NAMES = ("armillary", "bracket", "castle", "chess", "robot", "saturn", "snowman", "stones")
SIDE = 48


def lit(name: str) -> tuple[Lighting, np.ndarray]:
    """An example's light, and ways of rays through pixels (3, H, W)."""
    program = compile_scene(load(ROOT / f"examples/{name}.nsg"))
    assert program.stage is not None
    net = field_of(program, False)
    solids = SolidField(net, program.vectors, program.tokens, program.brought(), program.paints())  # type: ignore[arg-type]
    x = np.arange(SIDE) + 0.5
    return Lighting(solids, program.stage), directions(program.stage.camera, (SIDE, SIDE), x, x[:, None])


@pytest.mark.parametrize("name", NAMES)
def test_light_is_that_over_arrays(name: str) -> None:
    """But at edges, where the surface that is met is another."""
    lighting, way = lit(name)
    found, work = lighting.field.shade(lighting.rows, way)
    shade = lighting.shade(way.reshape(3, -1))
    off = abs(found[:3].reshape(3, -1) - shade.radiance).max(0)
    assert np.median(off) < 1e-6
    assert (off > 2e-3).mean() < 4e-3
    assert (found[3].reshape(-1) == shade.alpha).all()
    assert work.lights == pytest.approx(shade.work.lights, rel=0.1)
    assert work.met == pytest.approx(shade.work.met, rel=0.1)
    assert (work.rays, work.lost) == (SIDE * SIDE, 0)


def test_rays_do_not_depend_on_those_beside() -> None:
    """The same bytes in any order, in rows or not, and by processors with AVX2 and AVX-512."""
    lighting, way = lit("robot")
    whole = lighting.field.shade(lighting.rows, way)[0].reshape(4, -1)
    order = np.random.default_rng(0).permutation(SIDE * SIDE)
    for shape in ((SIDE, SIDE), (SIDE * SIDE // 4, 4), (1, SIDE * SIDE)):
        mixed = way.reshape(3, -1)[:, order].reshape(3, *shape)
        found = lighting.field.shade(lighting.rows, mixed)[0].reshape(4, -1)
        assert found.tobytes() == np.ascontiguousarray(whole[:, order]).tobytes()


def test_variants_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    lighting, way = lit("bracket")
    whole = lighting.field.shade(lighting.rows, way)[0]
    newest = KERNEL.variant
    for variant in range(newest):
        monkeypatch.setattr(KERNEL, "variant", variant)
        other = lighting.field.shade(lighting.rows, way)[0]
        assert (abs(other - whole).max(0) > 1 / 255).mean() < 2e-3
        if variant:
            assert other.tobytes() == whole.tobytes()


def test_a_ball_that_glows_over_the_ground() -> None:
    """By closed forms: what it gives off, ambient light and that of two lamps, and the ground's fade."""
    light, other = Light((0.0, 0.0, 9.0), 30.0, (1.0, 0.5, 0.2)), Light((0.0, 3.0, 3.0), 9.0)
    stage = Stage(Camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0)), (light, other), Ground(-3.0, (0.5, 0.4, 0.3)))
    solids = field([Object("sphere", (scaled(0.8),), rgb=(0.6, 0.7, 0.2))])
    way = np.float32([[0, 0, -1], [0, -0.6, -0.8], [0, 0.6, -0.8]]).T[:, None]
    found = solids.shade(stage_rows(stage, 0.009, False), way)[0][:, 0]
    p, n = np.array([0.0, 0.0, 0.8]), np.array([0.0, 0.0, 1.0])
    exact = 0.12 * np.array([0.6, 0.7, 0.2])
    for lamp in stage.lights:
        to = np.array(lamp.position) - p
        r = np.linalg.norm(to)
        exact += lamp.power * np.array(lamp.rgb) * np.array([0.6, 0.7, 0.2]) * (n @ to) / r**3
    assert found[:3, 0] == pytest.approx(exact, rel=2e-3)
    at = np.array([0.0, -3.0, 2.0])
    kept = np.exp(-(at[2] ** 2) / 64)
    floor, level = kept * np.array([0.5, 0.4, 0.3]), np.array([0.0, 1.0, 0.0])
    exact = floor * 0.18 + (1 - kept) * np.array(stage.horizon)
    for lamp in stage.lights:
        to = np.array(lamp.position) - at
        r = np.linalg.norm(to)
        clear = np.linalg.norm(np.cross(to, -at)) / r > 0.8 or to @ -at < 0
        exact += clear * lamp.power * np.array(lamp.rgb) * floor * (level @ to) / r**3
    assert found[:3, 1] == pytest.approx(exact, rel=1e-3)
    assert found[:3, 2] == pytest.approx(np.array(stage.zenith), rel=1e-5)


def test_without_a_background_what_is_met_covers() -> None:
    scene = (
        "nsg 1; canvas(32, 24); background(none); ground(none); sphere { material diffuse { glow(#0f0); } }"
    )
    picture = np.asarray(nsg.render(nsg.loads(scene)))
    exact = np.asarray(nsg.render(nsg.loads(scene), backend="reference"))
    assert picture.shape == (24, 32, 4)
    assert abs(picture - exact).max() < 0.02
