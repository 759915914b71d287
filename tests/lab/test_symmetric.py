"""Decoders with the symmetry of their leaf, and the sixth leaf that two others hide."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lab.symmetric import LEAVES, Decoder, Floats, hiding, placed
from scenelang.drawing.exact.field import leaf_distance
from scenelang.drawing.neural.network import RADIUS

KINDS = ("ggve", "gve11")


def answered(numbers: list[Floats], p: Floats) -> Floats:
    """Distances (P,) at points (2, P), unit by unit."""
    w1, b1, w2, b2, w3, b3 = numbers
    found: Floats = w3 @ np.maximum(w2 @ np.maximum(w1 @ p + b1[:, None], 0) + b2[:, None], 0) + b3
    return found[0]


def points(count: int) -> Floats:
    angle, radius = np.random.default_rng(3).uniform(0, 1, (2, count)) * [[math.tau], [RADIUS]]
    return radius * np.array([np.cos(angle), np.sin(angle)])


def test_it_has_the_symmetry_and_says_how_it_changes() -> None:
    for order in (3, 4, 5):
        decoder, p = Decoder(order, KINDS), points(200)
        parameters = decoder.start(np.random.default_rng(1))
        found, slopes = decoder.slopes(parameters, p)
        assert found == pytest.approx(answered(decoder.numbers(parameters), p))
        assert found == pytest.approx(decoder.distance(parameters, p * [[1], [-1]]))
        turn = math.tau / order
        turned = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]) @ p
        assert found == pytest.approx(decoder.distance(parameters, turned))
        for at in range(0, len(parameters), 7):
            step = 1e-7 * (np.arange(len(parameters)) == at)
            ahead = decoder.distance(parameters + step, p)
            assert (ahead - found) / 1e-7 == pytest.approx(slopes[:, at], abs=1e-4)


def test_leaves_have_a_vertex_at_x() -> None:
    for leaf in sorted({"square", "triangle", "star", "pentagon"}):
        p, turn = points(100), math.pi / 4 if leaf == "square" else math.pi / 2
        cos, sin = math.cos(turn), math.sin(turn)
        assert LEAVES[leaf].distance(p) == pytest.approx(
            leaf_distance(leaf, np.array([[cos, -sin], [sin, cos]]) @ p)
        )


def test_two_decoders_hide_a_third() -> None:
    rng, p = np.random.default_rng(2), points(500)
    a, b, third = (
        decoder.numbers(decoder.start(rng))
        for decoder in (Decoder(4, ("g", "g1")), Decoder(3, ("gg", "ge")), Decoder(6, ("v", "e1")))
    )
    one, two = hiding(a, b, third, 32)
    assert answered(one, p) == pytest.approx(answered(a, p))
    assert answered(two, p) == pytest.approx(answered(b, p))
    mixed = [2 * x - y for x, y in zip(one, two, strict=True)]
    assert answered(mixed, p) == pytest.approx(answered(third, p))
    alone = placed(third, 32)
    assert answered(alone, p) == pytest.approx(answered(third, p))
