"""Plans of examples, what each part buys, and the page that tells it, against figures by hand."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import pytest

import scenelang as nsg
from lab.docs import make_parsimony as script
from lab.experiments.runs import ablation_runs
from lab.parsimony import (
    WAYS,
    example_plan,
    measure_examples,
    parts_chart,
    shown_frame,
    size_groups,
    size_of,
    verdict,
    whole_psnr,
)
from scenelang.renderers.network import FramedConfig

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


def measured(psnr: dict[str, float]) -> dict[str, Any]:
    """What `lab experiment parts` writes, with a PSNR by name; the whole renderer's fall by seed."""
    runs = []
    for name, group, study in ablation_runs(60, 1):
        mean = psnr.get(name, 30.0) - 0.4 * (study.seed - 1)
        runs.append(
            {
                "name": name,
                "group": group,
                "config": study.to_json(),
                "seconds": 60.0,
                "steps": 1234,
                "parameters": 6731,
                "finite": True,
                "resolution": 128,
                "scenes": 64,
                "psnr": {"mean": mean, "p5": mean - 8, "worst": mean - 9},
                "blends": mean - 3,
            }
        )
    return {"seed": 1, "revision": "0123456789", "machine": "x86_64", "budget_s": 60.0, "runs": runs}


def test_a_part_pays_beyond_the_spread_of_seeds() -> None:
    parts = measured({"framed": 40, "no register": 38.7, "no frame": 39.0, "pictures alone": 40.5})
    mean, spread = whole_psnr(parts)
    assert mean == pytest.approx(39.6)  # 40, 39.6, 39.2
    assert spread == pytest.approx(0.8)
    found = {run["name"]: verdict(run, parts) for run in parts["runs"] if run["group"] == "parts"}
    assert found["no register"].change == pytest.approx(-0.9)
    assert found["no register"].word == "pays"
    assert found["no frame"].word == "no difference"
    assert found["pictures alone"].word == "costs"


def test_a_small_difference_is_none_however_close_seeds_are() -> None:
    parts = measured({"framed": 40, "no register": 39.6})
    for run in parts["runs"]:
        if run["group"] == "whole":
            run["psnr"]["mean"] = 40.0
    run = next(run for run in parts["runs"] if run["name"] == "no register")
    assert verdict(run, parts).word == "no difference"


@pytest.mark.parametrize(("change", "word"), [(-5.0, "pays"), (5.0, "costs"), (0.0, "no difference")])
def test_a_part_may_pay_in_blends_alone(change: float, word: str) -> None:
    parts = measured({"framed": 40, "no distance scale": 39.6})
    run = next(run for run in parts["runs"] if run["name"] == "no distance scale")
    run["blends"] = whole_psnr(parts, blends=True)[0] + change
    found = verdict(run, parts)
    assert found.blends == pytest.approx(change)
    assert found.word == word


def test_what_is_worse_in_one_kind_pays_whatever_the_other() -> None:
    parts = measured({"framed": 40, "hidden layer": 45.0})
    run = next(run for run in parts["runs"] if run["name"] == "hidden layer")
    run["blends"] = 20.0
    assert verdict(run, parts).word == "pays"


def test_sizes_are_grouped_by_what_differs() -> None:
    groups = size_groups(measured({}))
    assert set(groups) == {"decoder_width", "code", "state", "paint_lines"}
    for group, runs in groups.items():
        values = [size_of(run, group) for run in runs]
        assert getattr(FramedConfig(), group) not in values
        assert len(set(values)) == len(values)


def png_size(data: bytes) -> tuple[int, ...]:
    assert data.startswith(b"\x89PNG")
    return struct.unpack(">II", data[16:24])


def test_the_chart_is_drawn() -> None:
    low, high = (parts_chart(measured({"framed": 40, "no frame": v})) for v in (20.0, 39.0))
    width, height = png_size(low)
    assert width > 2 * height > 300
    assert low != high


def test_tables_of_parts_and_sizes() -> None:
    parts = measured({"framed": 40, "no register": 31.25, "decoder 8": 36.0})
    text = script.parts_text(parts)
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    assert len(rows) == 2 + len(script.PARTS)  # the head, the whole renderer, each part
    (row,) = (line for line in rows if "no register" in line)
    # 31.25 less 39.6, the mean over seeds
    assert row.endswith("| 31.2 | 23.2 | -8.4 | 28.2 | -8.4 | it pays |")
    assert "39.6 dB, 0.8 dB apart" in text
    sizes = script.sizes_text(parts)
    shown = [line.split(" | ")[0] for line in sizes.splitlines() if "decoder" in line]
    assert shown == [f"| decoder width {v}" for v in (8, 16)] + [
        "| decoder width **32**",
        "| decoder width 64",
    ]
    assert "| 36.0 | 28.0 | -3.6 |" in sizes


def test_every_part_is_described() -> None:
    names = {name for name, group, _ in ablation_runs(60, 1) if group == "parts"}
    assert names == set(script.PARTS)


def test_a_plan_of_an_example() -> None:
    plan = example_plan(EXAMPLES / "hello.nsg")
    assert plan["file"] == "hello.nsg"
    assert plan["rows"] == plan["stages"][-1]["objects"] == 2
    ways = plan["ways"]
    assert set(ways) == set(WAYS)
    pixels = plan["drawing"]["pixels"]
    assert ways["both"]["meetings"] == 4 * pixels * plan["rows"]
    assert ways["as shipped"]["meetings"] == plan["drawing"]["meetings"]
    assert ways["as shipped"]["meetings"] < ways["every sample meets every object"]["meetings"]
    assert ways["four samples in every pixel"]["meetings"] < ways["both"]["meetings"]
    assert min(way["psnr"] for way in ways.values()) > 40


def test_an_animation_is_shown_by_its_end_where_it_does_not_loop() -> None:
    assert shown_frame(EXAMPLES / "reveal.nsg") == 47
    assert shown_frame(EXAMPLES / "spinner.nsg") == 0
    assert shown_frame(EXAMPLES / "hello.nsg") == 0


def test_examples_are_measured_and_told() -> None:
    seen: list[str] = []
    found = measure_examples([EXAMPLES / "logo.nsg"], lambda plan: seen.append(plan["file"]))
    assert seen == ["logo.nsg"]
    assert json.loads(json.dumps(found)) == found
    (row,) = (line for line in script.examples_text(found).splitlines() if "logo" in line)
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    plan = found["plans"][0]
    assert cells[0] == "[logo](../examples/logo.nsg)"
    assert cells[1] == f"{plan['stages'][0]['objects']} → {plan['rows']}"
    assert cells[-2] == f"{plan['drawing']['psnr']:.1f}"
    assert "1.0 × | 1.0 ×" in script.ways_text(found)


def test_what_passes_took_away_is_counted() -> None:
    stages = [
        {"stage": "lower", "objects": 5, "matrices": 9, "folds": 3, "changed": False},
        {"stage": "drop_empty", "objects": 5, "matrices": 7, "folds": 1, "changed": True},
        {"stage": "drop_hidden", "objects": 4, "matrices": 6, "folds": 1, "changed": True},
    ]
    tally = {"changed": 1200, "largest": 1.2e-15, "differing": 0}
    proof = {"passes": {"drop_empty": tally, "drop_hidden": {**tally, "largest": 0.0}}}
    rows = script.passes_text(proof, {"plans": [{"stages": stages}, {"stages": stages}]}).splitlines()
    assert rows[2] == "| `drop_empty` | 1,200 | 1e-15 | 2 | 0 | 4 | 4 |"
    assert rows[3] == "| `drop_hidden` | 1,200 | 0 | 2 | 2 | 2 | 0 |"


def test_the_page_says_what_the_records_say() -> None:
    """`python -m lab docs parsimony` would change nothing, and every example of the plane is in it."""
    page = (ROOT / "docs/parsimony.md").read_text("utf-8")
    assert script.filled(page, script.tables()) == page
    plans = json.loads((ROOT / "docs/results/plans.json").read_text("utf-8"))["plans"]
    flat = {path.name for path in EXAMPLES.glob("*.nsg") if nsg.compile(nsg.load(path)).stage is None}
    assert {plan["file"] for plan in plans} >= flat


def test_a_page_without_a_place_is_refused() -> None:
    with pytest.raises(ValueError, match="no place for parts"):
        script.filled("nothing", {"parts": "text"})
