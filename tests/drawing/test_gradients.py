"""Gradients against formulas in float64, sample by sample: in the plane, on surfaces and in media."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.drawing.image import decoded, encoded
from tests.pictures import psnr_db

Stops = tuple[tuple[float, tuple[float, ...]], ...]
HARD: Stops = (
    (0.13, (1.0, 0.2, 0.0)),
    (0.41, (0.0, 0.9, 0.3)),
    (0.41, (0.1, 0.0, 0.8)),
    (0.83, (1.0, 1.0, 0.2)),
)
SOFT: Stops = ((0.0, (0.9, 0.1, 0.1)), (1.0, (0.1, 0.1, 0.9)))
HALF = 3**-0.5  # of a box's side
BACKENDS: tuple[dict[str, str], ...] = ({}, {"device": "cpu"}, {"backend": "exact"}, {"backend": "reference"})


def written(name: str, stops: Stops, moves: str = "") -> str:
    lines = [f"stop({offset}, [{', '.join(map(str, rgb))}]);" for offset, rgb in stops]
    return f"{name} {{ {' '.join(lines)} {moves} }}"


def mixed(stops: Stops, s: float) -> list[float]:
    """The colour at an offset; of equal offsets the last has been passed."""
    passed = [at for at, (offset, _) in enumerate(stops) if offset <= s]
    if not passed:
        return list(stops[0][1])
    if passed[-1] == len(stops) - 1:
        return list(stops[-1][1])
    (begin, a), (end, b) = stops[passed[-1] : passed[-1] + 2]
    share = (s - begin) / (end - begin)
    return [x + share * (y - x) for x, y in zip(a, b, strict=True)]


def samples(side: int) -> Any:
    """Pixels and the world's x and y of their four samples."""
    for i, j in np.ndindex(side, side):
        for down, right in ((-0.25, -0.25), (-0.25, 0.25), (0.25, -0.25), (0.25, 0.25)):
            yield i, j, (j + 0.5 + right) * 2 / side - 1, 1 - (i + 0.5 + down) * 2 / side


@pytest.mark.parametrize("how", BACKENDS)
@pytest.mark.parametrize(("name", "stops"), [("linear", HARD), ("radial", HARD), ("linear", SOFT)])
def test_pixels_of_the_plane(how: Any, name: str, stops: Stops) -> None:
    """Moves place it: the way back turns by -30 degrees, then undoes the scale; the leaf is scaled by 2."""
    moves = "scale(0.4, 0.7); flip(); rotate(30deg); grayscale(0.5);"
    text = f"nsg 1; canvas(24, 24); square {{ scale(2); material flat {written(name, stops, moves)} }}"
    expected = np.zeros((24, 24, 3))
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    for i, j, x, y in samples(24):
        x, y = x / 2, y / 2
        u, v = -(c * x + s * y) / 0.4, (c * y - s * x) / 0.7
        rgb = np.array(mixed(stops, (u + 1) / 2 if name == "linear" else math.hypot(u, v)))
        expected[i, j] += (rgb + 0.5 * (rgb @ (0.2126, 0.7152, 0.0722) - rgb)) / 4
    np.testing.assert_allclose(nsg.render(nsg.loads(text), **how), expected, atol=2e-5)


@pytest.mark.parametrize("how", BACKENDS)
@pytest.mark.parametrize("name", ["linear", "radial"])
def test_pixels_on_a_sphere(how: Any, name: str) -> None:
    """Without the lamp a surface shows its linear colour times 0.12 + 0.06 n.y; stops mix as linear light."""
    side, eye = 20, np.array([0.0, 0.0, 6.0])
    text = (
        f"camera(eye = [0, 0, 6]); light(power = 0); ground(none); canvas({side}, {side});"
        f"sphere {{ material {written(name, HARD)} }}"
    )
    stops = tuple((offset, tuple(map(float, decoded(np.array(rgb))))) for offset, rgb in HARD)
    expected, hits = np.zeros((side, side, 3)), np.zeros((side, side), int)
    for i, j, x, y in samples(side):
        way = np.array([x / 3, y / 3, -1.0]) / math.sqrt(1 + (x * x + y * y) / 9)
        inside = (eye @ way) ** 2 - 35
        if inside > 0.05:
            p = eye + (-(eye @ way) - math.sqrt(inside)) * way
            s = (p[0] + 1) / 2 if name == "linear" else math.hypot(p[0], p[1])
            expected[i, j] += np.array(mixed(stops, s)) * (0.12 + 0.06 * p[1]) / 4
            hits[i, j] += 1
    found = np.asarray(nsg.render(nsg.loads(text), **how))[hits == 4]
    assert len(found) > 60
    assert psnr_db(found, encoded(expected)[hits == 4]) > 50
    assert np.median(abs(found - encoded(expected)[hits == 4])) < 1e-3


@pytest.mark.parametrize("how", BACKENDS)
def test_a_floor_has_a_checker_by_the_worlds_x_and_z(how: Any) -> None:
    """A box seen from above, where up is -z; its squares are half a unit of (u, v)."""
    side, dark, light = 24, (0.165, 0.498, 0.486), (0.957, 0.925, 0.847)
    text = f"""
        camera(eye = [0, 6, 0]); light(power = 0); ground(none); canvas({side}, {side});
        let top = HALF;
        box {{ scale(2, 1, 1.6); translate(0, -top, 0);
          material checker {{
            scale(0.3, 0.6, 9); translate(0, 0.15); rotate(90deg, axis = X); scale(1, 7, 1 / 1.6);
          }}
        }}
    """
    expected, alike = np.zeros((side, side, 3)), np.ones((side, side), bool)
    for i, j, x, y in samples(side):
        x, z = 2 * x, -2 * y  # at the box's top, which is as far from the eye as the target
        u, v = x / 0.3, z / 0.3 - 0.5  # carried back, in squares
        shown = dark if (math.floor(u) + math.floor(v)) % 2 else light
        alike[i, j] &= max(abs(x) / 2, abs(z) / 1.6) < 0.95 * HALF
        alike[i, j] &= min(abs(u - round(u)), abs(v - round(v))) > 0.05
        expected[i, j] += decoded(np.array(shown)) * 0.18 / 4
    found = np.asarray(nsg.render(nsg.loads(text.replace("HALF", str(HALF))), **how))[alike]
    assert len(found) > 60
    np.testing.assert_allclose(found, encoded(expected)[alike], atol=4e-3)


BRICKS = "material bricks { scale(0.6); rotate(90deg, axis = X); }"
CHECKS = "material checker { rotate(70deg, axis = [1, 0.2, 0.1]); shear(xz = 0.3); }"
RINGS = written("radial", HARD, "translate(0, 0, 0.3); rotate(60deg, axis = Y);")
MIST = written("linear", HARD, "rotate(70deg, axis = Y);")
TILTED = {
    "floor": f"box {{ scale(2, 0.1, 2); translate(0, -0.8, 0); {BRICKS} }}",
    "top": f"cylinder {{ scale(0.8, 0.6, 0.8); {CHECKS} }}",
    "gradient": f"torus {{ rotate(40deg, axis = X); material {RINGS} }}",
    "mist": f"sphere {{ material volumetric {MIST} }}",
}


@pytest.mark.parametrize("name", TILTED)
@pytest.mark.parametrize("how", BACKENDS[:2])
def test_textures_of_space_are_those_of_the_reference(how: Any, name: str) -> None:
    begin, (leaf, looks) = "canvas(48, 48); camera(eye = [1, 3, 5]);", TILTED[name].split("material")
    turned, still = (f"{begin} {leaf} material {re.sub(what, '', looks)}" for what in ("-", "rotate[^;]*;"))
    exact = np.asarray(nsg.render(nsg.loads(turned), backend="reference"))
    assert psnr_db(np.asarray(nsg.render(nsg.loads(turned), **how)), exact) > 40
    assert psnr_db(np.asarray(nsg.render(nsg.loads(still), backend="reference")), exact) < 35


def test_mist_is_that_of_the_reference() -> None:
    text = "canvas(20, 20); sphere { material volumetric " + written("linear", HARD, "rotate(70deg);") + " }"
    scene = nsg.loads(text)
    exact = np.asarray(nsg.render(scene, backend="reference"))
    assert psnr_db(np.asarray(nsg.render(scene)), exact) > 45


def test_a_proof_holds_at_hard_edges() -> None:
    scene = nsg.loads("canvas(32, 32); square { scale(2); material " + written("radial", HARD) + " }")
    picture, proof = nsg.prove(scene)
    error = abs(np.asarray(picture) - np.asarray(nsg.render(scene, backend="reference"))).max(-1)
    assert (error <= proof.bound).all()
    assert np.median(proof.bound) < 1e-5
