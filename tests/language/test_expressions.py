"""Expressions against values worked out elsewhere."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tests.language.cases import run_text, transform, value

TABLE = [
    line.rpartition(" = ")
    for line in (Path(__file__).parent / "expressions.nsgs").read_text("utf-8").splitlines()
    if line and not line.startswith("# ")
]


@pytest.mark.parametrize(("expression", "expected"), [(e, float(v)) for e, _, v in TABLE])
def test_value(expression: str, expected: float) -> None:
    assert value(expression) == pytest.approx(expected, rel=1e-14, abs=1e-15)


def test_constant_and_running_evaluation_agree() -> None:
    """An expression of literals is folded; the same over loop variables is not."""
    for expression, _, expected in TABLE:
        hidden = f"for (zero in [0]) {{ square {{ translate(zero + ({expression}), 0); }} }}"
        x = transform(run_text(hidden).good()).x
        assert x == pytest.approx(float(expected), rel=1e-14, abs=1e-15), expression


def test_rand_is_splitmix64() -> None:
    """SplitMix64 of the bits of 1.0 and 2.0, by the published recurrence in exact integers."""

    def by_hand(bits: int) -> float:
        z = (bits + 0x9E3779B97F4A7C15) % 2**64
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB % 2**64
        return ((z ^ (z >> 31)) >> 11) / 2**53

    for seed, bits in ((1, 0x3FF0000000000000), (2, 0x4000000000000000), (0, 0)):
        scene = run_text(f"square {{ translate(rand({seed}), 0); }}").good()
        assert transform(scene).x == by_hand(bits)


def test_rand_is_even() -> None:
    text = "for (i in 0..<4000) { square { translate(rand(i), 0); } }"
    xs = [node.transforms[0].x for node in run_text(text).good().nodes]  # type: ignore[union-attr]
    assert all(0.0 <= x < 1.0 for x in xs)
    for k in range(8):
        share = sum(k / 8 <= x < (k + 1) / 8 for x in xs) / len(xs)
        assert abs(share - 1 / 8) < 0.02


@pytest.mark.parametrize(
    ("text", "rad"),
    [
        ("30deg", math.pi / 6),
        ("0.5turn", math.pi),
        ("2rad", 2.0),
        ("0", 0.0),
        ("1turn * 1 / 3", math.tau / 3),
        ("-90deg", -math.pi / 2),
    ],
)
def test_angles_reach_the_scene_in_radians(text: str, rad: float) -> None:
    scene = run_text(f"square {{ rotate({text}); }}").good()
    assert transform(scene).angle == pytest.approx(rad, rel=1e-15)


def test_long_sums_and_deep_parentheses() -> None:
    assert value(" + ".join(["1"] * 190)) == 190
    assert value("(" * 190 + "1" + ")" * 190) == 1
