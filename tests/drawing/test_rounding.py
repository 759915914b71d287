"""Proofs where numbers leave float64 few digits, or none: less is proved, and nothing that is wrong."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.graph import Look
from scenelang.compiler.lifting import inverse_frame
from scenelang.compiler.spaces import PLANE
from scenelang.compiler.steps import IDENTITY, Affine, compose
from scenelang.drawing.exact.field import carry_back
from scenelang.drawing.proof import TAME, Written
from tests.drawing.extremes import wild_scene
from tests.drawing.test_picture import broken

HUGE = {
    "a bend": """intersect { triangle { rotate(-357deg);
        matrix([[0.39, 0.08, 0, -0.47], [0.4, 0.74, 0, -0.11], [0, 0, 1, 0], [0, 0, 0, 1]]);
        bend(1e20); } square { twirl(-0.03); } }""",
    "another": "background(none); square { scale(0.25, 1.02); bend(1e15); rotate(-169.4deg); }",
    "a way": """smooth { star { translate(0.29, 1e20); rotate(1e20deg); }
        square { material flat { color(#9b187c); } } pentagon { bend(-1.34); } scale(1e6, 0.67); }""",
    "there and back": "star { translate(1e14, 0); rotate(20deg); rotate(-20deg); translate(-1e14, 0.2); }",
    "turns": "square { twirl(1e9); twirl(-1e9); rotate(30deg); scale(0.7); }",
    "textures": """square { material checker { translate(1e13, 0); translate(-1e13, 0.3); scale(0.2); } }
        star { scale(0.3); material dots { hue(1e13turn); hue(0.1turn); } }""",
}


@pytest.mark.parametrize("text", HUGE.values(), ids=HUGE)
def test_nothing_wrong_is_proved(text: str) -> None:
    scene = nsg.loads(f"canvas(24, 24);\n{text}")
    for redraw in (False, True):
        assert broken(scene, *nsg.prove(scene, redraw=redraw)) == 0


def judged(seeds: range, low: float, high: float) -> tuple[int, float]:
    """How many of the wild scenes were drawn, and the mean share of their pixels that was proved."""
    shares = []
    for seed in seeds:
        try:
            scene = nsg.loads(wild_scene(seed, low, high))
            image, proof = nsg.prove(scene)
        except (nsg.SceneError, nsg.RenderError):
            continue
        assert broken(scene, image, proof) == 0, seed
        assert broken(scene, *nsg.prove(scene, image, redraw=True)) == 0, seed
        shares.append(proof.share)
    return len(shares), float(np.mean(shares))


@pytest.mark.parametrize(("low", "high", "least"), [(0, 6, 0.8), (6, 12, 0.6), (12, 20, 0.4)])
def test_wild_scenes(low: float, high: float, least: float) -> None:
    drawn, share = judged(range(50), low, high)
    assert drawn > 10
    assert share > least


@pytest.mark.slow
@pytest.mark.parametrize(("low", "high"), [(0, 6), (3, 9), (6, 12), (12, 20)])
def test_hunt(low: float, high: float) -> None:
    judged(range(1000, 2500), low, high)


def test_misplaced_bounds_what_is_lost() -> None:
    """Exact arithmetic tells how far chains of maps, applied one by one or composed, are off in float64."""
    rng, tight = random.Random(5), []
    for _ in range(300):
        steps, rows = [], IDENTITY
        for _ in range(rng.randrange(1, 6)):
            size = 10 ** rng.uniform(-4, 4)
            own = [rng.uniform(-1, 1) * rng.choice([1, size]) for _ in range(6)]
            fitted = (*own[:2], 0.0, own[2], *own[3:5], 0.0, own[5], 0.0, 0.0, 1.0, 0.0)
            if PLANE.usable(fitted) and PLANE.usable(compose(fitted, rows)):
                steps.append(Affine(fitted))
                rows = compose(fitted, rows)
        p = [rng.uniform(-1, 1), rng.uniform(-1, 1)]
        exact: Any = [Fraction(c) for c in p]
        for step in reversed(steps):
            a, b, _, x, c, d, _, y = map(Fraction, step.rows[:8])
            u, v = exact[0] - x, exact[1] - y
            exact = [(d * u - b * v) / (a * d - b * c), (a * v - c * u) / (a * d - b * c)]
        frame = np.reshape(inverse_frame(rows, 2), (2, 3))
        found = [carry_back(steps, p), frame[:, :2] @ p + frame[:, 2]]
        off = max(
            abs(float(Fraction(float(c)) - true)) for q in found for c, true in zip(q, exact, strict=True)
        )
        reach = float(np.hypot(*map(float, exact)))
        bound = Written(Look("flat"), tuple(steps)).misplaced(reach, 2**0.5) - TAME
        assert off <= bound
        tight.append(bound / (off + 1e-16 * reach))
    assert np.median(tight) < 1e5
