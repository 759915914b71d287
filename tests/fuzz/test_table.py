"""The page on fuzzing shows the records there are; each of the five readers was fuzzed for an hour."""

from __future__ import annotations

import re
import subprocess

import pytest

from fuzz.runner import ROOT
from fuzz.table import PAGE, page, records

HOURS = ("parse", "evaluate", "scene_json", "program", "weights")


def test_tables_are_those_of_the_records() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert page(text) == text, "run python -m fuzz --table"


@pytest.mark.parametrize("name", HOURS)
def test_an_hour_is_recorded_and_the_last_run_found_nothing(name: str) -> None:
    runs = [run for run in records() if run["target"] == name]
    assert any(run["wall_s"] >= 3600 for run in runs)
    assert sum(run["executions"] for run in runs) > 10_000
    assert runs[-1]["findings"] == []


def test_commits_of_what_was_mended_exist() -> None:
    commits = re.findall(r"\| `([0-9a-f]{7})` \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(commits) > 10
    asked = ["git", "rev-parse", "--is-shallow-repository"]
    told = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, check=False)
    if told.stdout.strip() != "false":
        pytest.skip("no checkout with its history")
    for commit in commits:
        asked = ["git", "cat-file", "-e", f"{commit}^{{commit}}"]
        assert subprocess.run(asked, cwd=ROOT, capture_output=True, check=False).returncode == 0, commit
