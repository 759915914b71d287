"""`python -m lab frontier`: a small run of the whole measurement, and what it refuses."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from lab.frontier import measure, verify, ways
from lab.frontier.measure import Case, median_interval
from lab.frontier.record import Errors, Frontier, between
from tests.cli.conftest import Folder
from tests.cli.conftest import folder as folder
from tests.cli.test_choosing import ladder
from tests.cli.test_choosing import shipped as shipped
from tests.lab.conftest import run
from tests.work import lines_run


@pytest.fixture
def measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Frontier:
    """Of two scenes, without the paper's full-size renderer, which takes seconds a frame."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(ways, "_paper", lambda base: iter(()))
    monkeypatch.setattr(ways, "available", lambda: ["shapes2d"])
    monkeypatch.setattr(measure, "CASES", (measure.CASES[0], Case("32 x 32", "", (32, 32), 0.5)))
    monkeypatch.setattr(measure, "CONVERGED", 1)
    result = run("frontier", "shapes2d", "-o", "out", "--scenes", "2", "--seed", "5")
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
        "shapes2d, draft",
        "shapes2d, nothing skipped",
        "shapes2d, nothing skipped, four samples",
        "exact field",
        "exact field, four samples",
        "exact field, nothing skipped",
        "exact field, nothing skipped, four samples",
        "exact field, one sample",
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
    for savings in ("", ", four samples", ", nothing skipped", ", nothing skipped, four samples"):
        ratio = measured.ratio(f"shapes2d{savings}", f"exact field{savings}")
        assert ratio is not None
        assert (ratio.scenes, ratio.mean > 0) == (2, True)
    for name in ("frontier.html", "frontier.png"):
        assert Path("out", name).stat().st_size > 10_000
    page = Path("out/frontier.html").read_text("utf-8")
    data = json.loads(page.partition('id="data">')[2].partition("</script>")[0])
    assert [len(p["pictures"]) for p in data["points"]] == [2] * 14


def test_the_interval_of_a_median_covers_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(3)
    for n in (9, 40, 120):
        ends = np.array([median_interval(rng.exponential(size=n)) for _ in range(2000)])
        covered = np.mean((ends[:, 0] <= np.log(2)) & (np.log(2) <= ends[:, 1]))
        assert 0.94 <= covered <= 0.985, n
    assert median_interval([3.0]) == (3.0, 3.0)


def test_nothing_is_kept_between_frames() -> None:
    """A scene that was drawn before takes as many lines of Python again."""
    scenes = [nsg.loads(f"canvas(96, 96); {'star { scale(0.4); twirl(1); }' * n} square;") for n in (2, 1)]
    for way in (way for way in ways.ways_of("shapes2d", 1) if way.renderer in ("framed", "exact field")):
        counts = [lines_run(way.prepare(scene)) for scene in [*scenes, scenes[1]]]
        assert counts[1] == counts[2] > 500, way.name


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("nothing",), "no model `nothing`; there are "),
        (("shapes2d", "--promises", "shipped.json"), "--promises goes with --verify"),
        (("shapes2d", "--verify", "--seed", "1"), "seed 1 made the promises"),
        (("shapes2d", "--scenes", "0"), "0 is not in the range"),
    ],
)
def test_frontier_refuses(shipped: Folder, options: tuple[str, ...], words: str) -> None:
    result = run("frontier", *options)
    assert result.exit_code == 2
    assert words in result.stderr


def test_verify_counts_kept_promises(shipped: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    """A promise of little is kept in all scenes, one of nothing in none."""
    monkeypatch.setattr(verify, "CASES", (Case("small", "", (64, 64), 1.0),))
    good = ladder()
    points = [p for p in good.points if p.name in ("shapes2d", "exact reference, 4 spp")]
    wide = replace(good, points=tuple(replace(p, flip=Errors(0.5, 0.5, 0.5, 0.5)) for p in points))
    Path("wide.json").write_text(wide.to_json(), "utf-8")
    result = run("frontier", "shapes2d", "--verify", "--promises", "wide.json", "--scenes", "2")
    assert result.exit_code == 0, result.output
    found = json.loads(Path("out/verified.json").read_text())
    assert found["held"] is True
    assert found["cases"]["small"]["shapes2d"]["scenes"] == 2
    assert found["cases"]["small"]["shapes2d"]["kept"] == 1.0
    tight = replace(good, points=tuple(replace(p, flip=Errors(1e-9, 0, 0, 0)) for p in points))
    Path("tight.json").write_text(tight.to_json(), "utf-8")
    result = run("frontier", "shapes2d", "--verify", "--promises", "tight.json", "--scenes", "2")
    assert result.exit_code == 1
    assert json.loads(Path("out/verified.json").read_text())["held"] is False
    assert "not every promise is kept" in result.stdout
