"""What names of outputs ask for."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenelang.output.frames import TargetError, find_target, is_animation


@pytest.mark.parametrize(
    ("out", "kind"),
    [("a.gif", "gif"), ("a.WEBP", "webp"), ("a.apng", "apng"), ("a.mp4", "video"), ("a.webm", "video")],
)
def test_suffixes(tmp_path: Path, out: str, kind: str) -> None:
    found = find_target(str(tmp_path / out))
    assert (found.kind, found.path) == (kind, tmp_path / out)
    assert found.work.parent == tmp_path
    assert found.work.name.startswith(".")


@pytest.mark.parametrize(
    ("pattern", "name"),
    [
        ("f-%04d.png", "f-0012.png"),
        ("%d.jpg", "12.jpg"),
        ("100%%-%3d.png", "100%- 12.png"),
        ("a%03d.webp", "a012.webp"),
    ],
)
def test_patterns(tmp_path: Path, pattern: str, name: str) -> None:
    found = find_target(str(tmp_path / pattern))
    assert found.kind == "sequence"
    assert found.file(12) == tmp_path / name


def test_folders(tmp_path: Path) -> None:
    assert find_target(f"{tmp_path}/new/", "a%b").file(3) == tmp_path / "new/a%b-0003.png"
    assert find_target(str(tmp_path), "a").file(12345) == tmp_path / "a-12345.png"


@pytest.mark.parametrize(
    "out", ["a.png", "a", "a%d%d.png", "a%d.xyz", "%x-%d.png", "none/a.gif", "none/%d.png"]
)
def test_what_holds_no_animation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, out: str) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(TargetError):
        find_target(out)


def test_a_percent_is_no_pattern() -> None:
    assert not is_animation("100%.png")
    assert not is_animation("a%%d.png")
    assert is_animation("a%%%d.png")
