"""Experiments from configuration to table: what is trained, that runs are shared, and what tables say."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import pytest
import torch
from click.testing import CliRunner
from PIL import Image

from lab.experiments import paper
from lab.experiments.experiment import Settings, run_experiment, run_one, unseen
from lab.experiments.runs import EXPERIMENTS, SIDE
from lab.experiments.tables import table_of
from scenelang.cli.main import cli


@pytest.mark.parametrize("name", list(EXPERIMENTS))
def test_runs_have_folders_of_their_own(name: str) -> None:
    runs = EXPERIMENTS[name](60.0, 1)
    assert len({run.folder for run in runs}) == len(runs)
    assert all(run.study.seconds in (20.0, 60.0) for run in runs)


def test_the_same_run_of_two_experiments_is_trained_once() -> None:
    known = {run.folder: run.study for run in EXPERIMENTS["compare"](60.0, 1)}
    for name in ("table2", "table4", "table3"):
        runs = EXPERIMENTS[name](60.0, 1)
        shared = [run for run in runs if run.folder in known]
        assert shared
        assert all(known[run.folder] == run.study for run in shared)
    (spread,) = [run for run in EXPERIMENTS["seeds"](20.0, 1) if run.folder == "framed-exact-20s-seed1"]
    assert known[spread.folder] == spread.study


def test_an_experiment_is_trained_measured_and_drawn(tmp_path: Path) -> None:
    arguments = ["lab", "experiment", "table2", "-o", str(tmp_path), "--budget", "0.01", "--scenes", "8"]
    first = CliRunner().invoke(cli, arguments)
    assert first.exit_code == 0, first.output
    found = json.loads((tmp_path / "table2.json").read_text("utf-8"))
    assert [run["name"] for run in found["runs"]] == ["streaming+learned", "framed+exact"]
    for run in found["runs"]:
        assert run["finite"]
        assert run["seconds"] >= 0.6
        assert run["steps"] > 0
        assert 0 < run["psnr"]["worst"] <= run["psnr"]["mean"] <= 50
        with Image.open(tmp_path / run["strip"]) as strip:
            assert strip.size == (8 * SIDE, SIDE)
    # trained once, measured again
    again = run_experiment("table2", 0.6, 1, Settings(tmp_path, 8))
    assert [run["steps"] for run in again["runs"]] == [run["steps"] for run in found["runs"]]
    assert [run["psnr"] for run in again["runs"]] == [run["psnr"] for run in found["runs"]]
    drawn = CliRunner().invoke(cli, ["lab", "chart", str(tmp_path)])
    assert drawn.exit_code == 0, drawn.output
    for suffix in (".md", ".png", "-strips.png"):
        assert (tmp_path / f"table2{suffix}").stat().st_size > 100


def test_parts_are_also_measured_where_all_is_blended(tmp_path: Path) -> None:
    """The same scenes, joined by smooth unions alone; no other experiment draws them."""
    plain, blended = (unseen(12, 16, "cpu", blends)[0] for blends in (False, True))
    assert (blended.tokens == torch.tensor([0, 1, 1, 1])).all()
    assert torch.equal(plain.affine, blended.affine)
    assert not torch.equal(plain.tokens, blended.tokens)
    run = dataclasses.replace(EXPERIMENTS["parts"](0.1, 1)[0], side=16)
    assert 0 < run_one(run, Settings(tmp_path, 8))["blends"] <= 50
    assert not any(run.blends for name in EXPERIMENTS if name != "parts" for run in EXPERIMENTS[name](1.0, 1))


def result(name: str, group: str, psnr: float, **more: Any) -> dict[str, Any]:
    spread = {"mean": psnr, "p5": psnr, "worst": psnr - 1}
    return {
        "name": name,
        "group": group,
        "config": {"seconds": 1.0, "fixed": 0},
        "seconds": 1.0,
        "steps": 10,
        "parameters": 5,
        "finite": True,
        "resolution": 32,
        "psnr": spread,
        "ssim": {"mean": 0.9},
        "flip": {"mean": 0.1},
        "lpips": None,
        **more,
    }


def test_the_papers_figures_stand_beside_ours() -> None:
    runs = [result("streaming+learned", "", 20.0), result("framed+exact", "", 21.0)]
    ours, without = table_of({"experiment": "table2", "runs": runs}).splitlines()[2:]
    assert "| 20.00 |" in ours
    assert f"| {paper.SHAPES.psnr:.2f} |" in ours
    assert without.endswith("| – | – | – | – |")


def test_the_gain_of_a_larger_budget_is_told() -> None:
    runs = [result("a+b", "1 s", 20.0), result("c+d", "1 s", 19.0), result("a+b", "3 s", 22.5)]
    table = table_of({"experiment": "compare", "runs": [*runs, result("c+d", "3 s", 19.5)]})
    assert "| a+b | 5 | **20.00** | 0.100 | **22.50** | 0.100 | +2.50 |" in table
    assert "| c+d | 5 | 19.00 | 0.100 | 19.50 | 0.100 | +0.50 |" in table


def test_a_seed_that_diverged_is_told() -> None:
    runs = [result("a", "seed 1", 20.0), result("a", "seed 2", 21.0, finite=False)]
    assert "| a | 20.00, 21.00 | 20.50 | 1.00 | YES |" in table_of({"experiment": "seeds", "runs": runs})


def test_what_is_not_there_is_refused(tmp_path: Path) -> None:
    unknown = CliRunner().invoke(cli, ["lab", "experiment", "nothing", "-o", str(tmp_path), "--budget", "1"])
    assert unknown.exit_code == 2
    assert "no experiment `nothing`" in unknown.output
    empty = CliRunner().invoke(cli, ["lab", "chart", str(tmp_path)])
    assert empty.exit_code == 2
    assert "no experiments in" in empty.output
