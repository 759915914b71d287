"""Frames that are compared together, and noise that no values would take away."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from scenelang.drawing.image import decoded, encoded
from scenelang.inverse.fit import problems_of
from scenelang.inverse.problem import Moment, Together
from scenelang.inverse.search import space_of, target_of
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source

TEXT = """
canvas(40, 40); background(#ffffff); animate(seconds = 1s, fps = 4); param x = 0 in -0.5..0.5;
square { scale(0.5); translate(x, u); material flat { color(#000000); } }
"""


def problem(targets: dict[int, np.ndarray]) -> Together:
    """The last comparison with targets by frame."""
    source = Source(text=SourceFile("a.nsg", TEXT)).parsed(Diagnostics())
    moments = [Moment(source, frame) for frame in targets]
    evaluation, scene = moments[0].evaluated({})
    goals = [target_of(target, scene.canvas) for target in targets.values()]
    return problems_of(moments, goals, space_of(evaluation), scene.canvas)[-1]


def flat(level: float) -> np.ndarray:
    return np.full((40, 40, 3), level)


def test_errors_of_frames_are_averaged() -> None:
    u = np.array([0.5])
    both = problem({0: flat(1.0), 2: flat(0.5)})(u)
    parts = [problem({frame: flat(level)})(u) for frame, level in ((0, 1.0), (2, 0.5))]
    assert both is not None
    assert both @ both == pytest.approx(np.mean([part @ part for part in parts if part is not None]))


def test_a_target_out_of_focus_is_told_by_how_much() -> None:
    """Whose noise is as large as the blur's error."""
    for sigma in (0.0, 1.0, 2.0):
        u, last = np.array([0.3]), problem({0: flat(1.0)})
        pictures = last.pictures(u)
        assert pictures is not None
        seen = encoded(ndimage.gaussian_filter(decoded(pictures[0]), (sigma, sigma, 0), mode="nearest"))
        target = seen + np.random.default_rng(3).normal(0.0, 0.05, (40, 40, 3))
        assert problem({0: target}).blur(pictures) == pytest.approx(sigma, abs=0.51 * sigma)


def test_what_is_left_is_noise_or_is_not() -> None:
    """A blot of 3 x 3 pixels is enough."""
    for blot, noise in ((0, True), (3, False)):
        u, last = np.array([0.3]), problem({0: flat(1.0)})
        pictures = last.pictures(u)
        assert pictures is not None
        target = pictures[0] + np.random.default_rng(3).normal(0.0, 0.03, (40, 40, 3))
        target[20 : 20 + blot, 30 : 30 + blot] = 0.5
        assert problem({0: target}).noise(u) is noise
