"""What failures are called, and inputs that fail, made smaller."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from fuzz.__main__ import main
from fuzz.minimise import failure_of, minimise
from fuzz.target import Target, hold, load_target
from scenelang.language.values import divide


def check(data: bytes) -> None:
    """Fails in three ways, one of them inside the library."""
    hold(b"a" not in data, "no a", len(data))
    if b"b" in data:
        divide(1.0, 0.0)
    if b"c" in data:
        raise ZeroDivisionError(str(len(data)))


TARGET = Target("letters", "no letters", check, lambda: [b""], lambda data, generator: data)


def test_minimise_leaves_what_matters() -> None:
    data = bytes(Random(1).choices(b"xyz", k=300)) + b"a" + bytes(Random(2).choices(b"xyz", k=300)) + b"b"
    assert minimise(data, lambda d: b"a" in d and b"b" in d) == b"ab"

    def shows(data: bytes) -> bool:
        return failure_of(TARGET, data) == "no a"

    assert minimise(data, shows) == b"a"
    assert minimise(b"a", shows) == b"a"
    assert len(minimise(data, shows, tries=3)) > 1


@pytest.mark.parametrize(
    ("data", "signature"),
    [
        (b"a", "no a"),
        (b"b", "Problem in language/values.py:divide"),
        (b"c1", "ZeroDivisionError in outside"),
        (b"", None),
    ],
)
def test_failures_are_told_apart(data: bytes, signature: str | None) -> None:
    assert failure_of(TARGET, data) == signature


def test_the_command_minimises(tmp_path: Path) -> None:
    path = tmp_path / "input"
    path.write_bytes(b"square;")
    assert main(["parse", "--replay", str(path)]) == 0
    assert main(["parse", "--minimise", str(path)]) == 2  # it does not fail


def test_unknown_targets_are_refused() -> None:
    with pytest.raises(KeyError):
        load_target("os")
