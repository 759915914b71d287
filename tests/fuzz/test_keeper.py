"""The runner's own parts: findings once each, the smallest input of each, and inputs made smaller."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random

import pytest

from fuzz.keeper import Keeper, minimise, shows_signature, signature_of
from fuzz.target import Failure, Target, hold, load_target
from scenelang.evaluate.values.operators import divide
from scenelang.evaluate.values.value import Problem


def check(data: bytes) -> None:
    """Fails in three ways, one of them inside the library."""
    hold(b"a" not in data, "no a", len(data))
    if b"b" in data:
        divide(1.0, 0.0)
    if b"c" in data:
        raise ZeroDivisionError(str(len(data)))


TARGET = Target("letters", "no letters", check, lambda: [b""], lambda data, generator: data)


def test_findings_are_told_apart_and_their_smallest_inputs_kept(tmp_path: Path) -> None:
    keeper = Keeper(TARGET, tmp_path)
    for data in (b"xxaxx", b"xa", b"xxxa", b"b", b"xc", b"", b"c1"):
        keeper.run(data)
    keeper.write()
    findings = keeper.state.findings
    assert {(f.kind, f.signature, f.times, f.bytes) for f in findings.values()} == {
        ("oracle", "no a", 3, 2),
        ("crash", "Problem in evaluate/values/operators.py:divide", 1, 1),
        ("crash", "ZeroDivisionError in outside", 2, 2),
    }
    assert (tmp_path / "findings" / findings["no a"].file).read_bytes() == b"xa"
    told = json.loads((tmp_path / "state.json").read_text(encoding="utf-8"))
    assert told["executions"] == 7
    assert told["findings"]["no a"]["error"] == "Failure: no a: 2"


def test_what_is_slow_is_a_finding(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fuzz.keeper.SLOW_S", 0.0)
    keeper = Keeper(TARGET, tmp_path)
    keeper.run(b"x")
    assert [finding.kind for finding in keeper.state.findings.values()] == ["slow"]
    assert keeper.state.slowest.bytes == 1


def test_minimise_leaves_what_matters() -> None:
    data = bytes(Random(1).choices(b"xyz", k=300)) + b"a" + bytes(Random(2).choices(b"xyz", k=300)) + b"b"
    assert minimise(data, lambda d: b"a" in d and b"b" in d) == b"ab"
    assert minimise(data, shows_signature(TARGET, "no a")) == b"a"
    assert minimise(b"a", shows_signature(TARGET, "no a")) == b"a"
    assert len(minimise(data, shows_signature(TARGET, "no a"), tries=3)) > 1


def test_signatures_name_the_innermost_place_in_the_library() -> None:
    with pytest.raises(Problem) as caught:
        check(b"b")
    assert signature_of(caught.value) == ("crash", "Problem in evaluate/values/operators.py:divide")
    assert signature_of(Failure("an oracle", "detail")) == ("oracle", "an oracle")


def test_unknown_targets_are_refused() -> None:
    with pytest.raises(KeyError):
        load_target("os")
