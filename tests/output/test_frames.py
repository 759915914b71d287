"""What names of outputs ask for; ranges of frames, and delays that neither grow nor shrink."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenelang.output.frames import (
    FrameRange,
    FramesError,
    TargetError,
    delays,
    find_target,
    is_animation,
    runs,
)


def test_suffixes_patterns_and_folders(tmp_path: Path) -> None:
    for out, kind in (("a.gif", "gif"), ("a.WEBP", "webp"), ("a.apng", "apng"), ("a.webm", "video")):
        found = find_target(str(tmp_path / out))
        assert (found.kind, found.path) == (kind, tmp_path / out)
        assert found.work.parent == tmp_path
        assert found.work.name.startswith(".")
    for pattern, name in (
        ("f-%04d.png", "f-0012.png"),
        ("%d.jpg", "12.jpg"),
        ("100%%-%3d.png", "100%- 12.png"),
    ):
        found = find_target(str(tmp_path / pattern))
        assert found.kind == "sequence"
        assert found.file(12) == tmp_path / name
    assert find_target(f"{tmp_path}/new/", "a%b").file(3) == tmp_path / "new/a%b-0003.png"
    assert find_target(str(tmp_path), "a").file(12345) == tmp_path / "a-12345.png"


def test_what_holds_no_animation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for out in ("a.png", "a", "a%d%d.png", "a%d.xyz", "%x-%d.png", "none/a.gif", "none/%d.png"):
        with pytest.raises(TargetError):
            find_target(out)
    assert not is_animation("100%.png")
    assert not is_animation("a%%d.png")
    assert is_animation("a%%%d.png")


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
    assert runs("aabca", [1, 2, 0, 3, 4]) == [("a", 3), ("c", 3), ("a", 4)]  # neighbours are shown once
