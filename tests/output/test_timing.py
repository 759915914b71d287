"""Frames and delays: ranges as in the language, and time that neither grows nor shrinks."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenelang.output.frames import FrameRange, FramesError, delays, runs


def test_ranges() -> None:
    for text, numbers in (
        ("0..3", [0, 1, 2, 3]),
        ("2..<4", [2, 3]),
        ("7", [7]),
        ("8..", [8, 9]),
        (" 1 .. 1 ", [1]),
        ("9", [9]),
    ):
        assert list(FrameRange.parse(text).among(10)) == numbers


def test_what_is_no_range() -> None:
    for text in ("", "a", "1...3", "3..2", "4..<4", "-1..2", "1.5", "..3", "2..<", "1e3"):
        with pytest.raises(FramesError, match="range"):
            FrameRange.parse(text)


def test_frames_that_are_not_there() -> None:
    for text, named in (("10", 10), ("0..10", 10), ("12..", 12)):
        with pytest.raises(FramesError, match=f"frame {named} is outside 0..9"):
            FrameRange.parse(text).among(10)


@given(count=st.integers(1, 200), fps=st.sampled_from([1, 7, 12, 23.976, 24, 25, 29.97, 30, 48, 50, 60, 144]))
def test_errors_of_delays_do_not_add_up(count: int, fps: float) -> None:
    """After each frame the clock is within half a tick, or one shortest delay where frames are left out."""
    found = delays(count, fps, 100, 2)
    assert all(delay == 0 or delay >= 2 for delay in found)
    exact = count * 100 / Fraction(fps)
    assert abs(sum(found) - exact) <= Fraction(1, 2) or sum(found) == 2
    if fps <= 50:
        shown = 0
        for index, delay in enumerate(found):
            shown += delay
            assert delay > 0
            assert abs(shown - (index + 1) * 100 / Fraction(fps)) <= Fraction(1, 2) or count == 1
    else:
        assert count < 3 or 0 in found


def test_neighbours_that_are_equal_are_shown_once() -> None:
    assert runs("aabca", [1, 2, 0, 3, 4]) == [("a", 3), ("c", 3), ("a", 4)]
    assert runs("aba", [1, 0, 2]) == [("a", 3)]
