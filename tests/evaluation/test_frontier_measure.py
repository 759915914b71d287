"""A small run of the whole measurement, from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scenelang.evaluation import frontier_measure, frontier_ways
from scenelang.evaluation.frontier import Frontier, between
from tests.cli.conftest import Folder
from tests.cli.conftest import folder as folder


@pytest.fixture
def measured(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> Frontier:
    """Of two scenes, without the paper's full-size renderer, which takes seconds a frame."""
    monkeypatch.setattr(frontier_ways, "_paper", lambda base, threads: iter(()))
    monkeypatch.setattr(frontier_ways, "available", lambda: ["shapes2d"])
    monkeypatch.setattr(frontier_measure, "SIDES", (32,))
    monkeypatch.setattr(frontier_measure, "FITTED", 1)
    monkeypatch.setattr(frontier_measure, "CONVERGED", 1)
    monkeypatch.setattr(frontier_measure, "REPEATS", 1)
    result = folder.run("frontier", "shapes2d", "-o", "out", "--scenes", "2", "--seed", "5")
    assert result.exit_code == 0, result.output
    assert "points lie between the fastest and the nearest" in result.stdout
    return Frontier.from_json(Path("out/frontier.json").read_bytes())


@pytest.mark.slow
def test_a_small_run(measured: Frontier) -> None:
    points = {p.name: p for p in measured.points}
    assert points.keys() == {
        "shapes2d",
        "shapes2d, four samples",
        "shapes2d, one sample",
        "shapes2d, nothing skipped",
        "exact reference, 1 spp",
        "exact reference, 4 spp",
        "exact reference, 16 spp",
    }
    assert [p.ms.median for p in measured.points] == sorted(p.ms.median for p in measured.points)
    exact = points["exact reference, 4 spp"]
    assert exact.flip is not None
    assert (exact.flip.worst, exact.on_front) == (0.0, True)
    for p in measured.points:
        assert p.flip is not None
        assert p.psnr is not None
        assert p.scenes == 2
        assert p.offered == (p.cost is not None) == (p.command is not None) == (p.why_not is None)
        assert p.flip.mean <= p.flip.worst <= p.flip.bound
        assert p.offered or not p.on_front
    plain, one = points["shapes2d"], points["shapes2d, one sample"]
    assert plain.psnr is not None
    assert one.psnr is not None
    assert plain.psnr.mean > 45 > one.psnr.mean > 25
    assert measured.converged["exact reference, 16 spp"] < measured.converged["exact reference, 4 spp"]
    assert between(measured.points) >= 1
    for name in ("frontier.html", "frontier.png", "frontier.svg"):
        assert Path("out", name).stat().st_size > 10_000
    page = Path("out/frontier.html").read_text("utf-8")
    data = json.loads(page.partition('id="data">')[2].partition("</script>")[0])
    assert [len(p["pictures"]) for p in data["points"]] == [2] * 7
