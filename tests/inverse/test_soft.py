"""Soft pictures: smooth where samples jump, and right in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.inverse.problem import Moment, Problem
from scenelang.inverse.search import Target, space_of
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source

TEXT = """
canvas(32, 32); background(#ffffff); param x = 0 in -0.5..0.5; param s = 0.5 in 0.2..0.8;
square { scale(s); translate(x, 0); material flat { color(#000000); } }
"""


def problem(soft: bool) -> Problem:
    source = Moment(Source(text=SourceFile("a.nsg", TEXT)).parsed(Diagnostics()))
    white = Target(np.ones((32, 32, 3)), np.ones((32, 32)))
    return Problem(source, space_of(source.evaluated({})[0]), white, (32, 32), soft=soft, samples="four")


def change(drawn: Problem, axis: int, step: float) -> np.ndarray:
    ends = [np.array([0.43, 0.52]) for _ in range(2)]
    ends[0][axis] -= step
    ends[1][axis] += step
    low, high = (drawn.picture(u) for u in ends)
    assert low is not None
    assert high is not None
    return (high - low) / (2 * step)


def test_a_soft_picture_changes_where_samples_stay_as_they_are() -> None:
    """And its differences hardly hang on their step."""
    fine, coarse = (change(problem(True), 0, step) for step in (0.0005, 0.002))
    assert np.linalg.norm(fine - coarse) < 0.1 * np.linalg.norm(coarse)
    assert not change(problem(False), 0, 0.0005).any()


def test_covered_area_changes_as_the_square_does() -> None:
    """A square of radius s covers s² / 2 of the canvas, whose sides are 2; corners are cut a little."""
    size = 0.2 + 0.52 * 0.6
    assert -change(problem(True), 1, 0.02).mean() == pytest.approx(0.6 * size, rel=0.06)
