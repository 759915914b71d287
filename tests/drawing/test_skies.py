"""Skies over nothing at all, and over random scenes with the ends of every range."""

from __future__ import annotations

import os

import numpy as np
import pytest

import scenelang as nsg
from fuzz.targets.skies import check, drawn
from fuzz.text import encode

NOTHING = (
    "camera(eye = [-1, -0.5, 5]); background(none);",
    "light([1000, 0, 1.5], 45, #fff, 0.5); light([-2, 2.6, 1.5], 20);",
    "camera(eye = [0.001, 1e-9, 3], target = [-1e6, 0.04, 0], fov = 71deg); ground(none);",
    "camera(eye = [1e4, 3, 1e4]); sphere { translate(0, -5, 0); } torus { translate(0, -3, 1); }",
)


@pytest.mark.parametrize("text", NOTHING)
def test_a_sky_over_nothing_is_drawn(text: str) -> None:
    """Nodes were shared among objects by the last of their sums, of which there was none."""
    scene = nsg.loads(f"sky(); canvas(16, 12); {text}")
    drawn, exact = (np.asarray(nsg.render(scene, backend=backend)) for backend in ("neural", "reference"))
    assert abs(drawn - exact).max() < 4 / 255


def test_blends_under_a_sky_warn_of_nothing() -> None:
    """Nodes were placed where numbers beyond float32 warned, which users saw."""
    text = "sky(); canvas(8, 8); chain { box; smooth sphere { translate(1, 0, 0); } subtract cone; }"
    nsg.render(nsg.loads(text), backend="exact")


@pytest.mark.parametrize("seed", [8, 12, 30, 32, 36, 43, 49, 63, 68, 118, 126, 130, 148, 1749])
def test_a_random_sky_is_drawn(seed: int) -> None:
    check(encode(drawn(seed)))


@pytest.mark.slow
def test_two_thousand_random_skies_are_drawn() -> None:
    """All are drawn before those that fail are told; ``SKIES=first,last`` draws others."""
    first, last = map(int, os.environ.get("SKIES", "0,2000").split(","))
    failed = []
    for seed in range(first, last):
        try:
            check(encode(drawn(seed)))
        except Exception as error:
            failed.append(f"{seed}: {error!r}")
    assert not failed, "\n".join(failed)
