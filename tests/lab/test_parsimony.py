"""Plans of examples, and the page that tells them, against figures by hand."""

from __future__ import annotations

import json
from pathlib import Path

import scenelang as nsg
from lab.docs import parsimony as script
from lab.parsimony import WAYS, example_plan, shown_frame

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


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


def test_every_example_of_the_plane_is_in_the_plans() -> None:
    plans = json.loads((ROOT / "docs/results/plans.json").read_text("utf-8"))["plans"]
    flat = {path.name for path in EXAMPLES.glob("*.nsg") if nsg.compile(nsg.load(path)).stage is None}
    assert {plan["file"] for plan in plans} >= flat
