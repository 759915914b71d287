"""Workers that give what this machine does: who is told apart, and what is sent to them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from scenelang.drawing.how import RenderError
from scenelang.output import workers
from scenelang.output.workers import GivenUp, Link, by_workers
from tests.output.machines import started


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with started(tmp_path_factory.mktemp("cluster"), 2) as (found, _):
        yield found


def test_workers_that_would_give_something_else(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Their library, weights or code differ, or a package that this work needs besides."""
    compare, others = workers.differences, ("scipy", "no-such-library")
    for what in ("numpy", "weights of shapes2d", "scenelang's code", "no-such-library"):
        monkeypatch.setattr(workers, "differences", lambda a, b, what=what: compare({**a, what: "another"}, b))
        with pytest.raises(RenderError, match=rf"worker tcp\S+ has {what} \S+, where another is here"):
            Link(address, others)
    here = workers.fingerprint()
    assert here.keys().isdisjoint(others)
    assert workers.fingerprint(others)["no-such-library"] == "none"
    assert compare(here, here) == ([], [])
    assert compare(here, {**here, "python": "3.9"}) == ([], [f"python 3.9, where {here['python']} is here"])


def test_nobody_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "WAIT_S", 0.5)
    with pytest.raises(RenderError, match=r"no scheduler with workers at `tcp://127\.0\.0\.1:9`"):
        Link("tcp://127.0.0.1:9")


def test_each_item_has_a_result_or_an_error_of_its_own(address: str) -> None:
    """More of them than are under way at once; one is no number."""
    items = [(word, word) for word in ["4", "9", "16", "x", "25", "36", "49", "64", "81", "100"]]
    found, wrong = {}, []
    for word, result in by_workers(address, float, items):
        try:
            found[word] = result()
        except ValueError:
            wrong.append(word)
    assert found == {word: float(word) for word, _ in items if word != "x"}
    assert wrong == ["x"]


@pytest.mark.slow
def test_what_ends_workers_is_given_up(tmp_path: Path) -> None:
    with started(tmp_path, 4) as (address, _):
        for _, result in by_workers(address, os._exit, [("bad", 3)]):
            with pytest.raises(GivenUp, match="4 workers ended over it"):
                result()
