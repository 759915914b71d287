"""`python -m lab all`: it names all that there is, goes on behind what fails, and runs."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from lab import ROOT, everything
from lab.cli import command
from lab.everything import ELSEWHERE, STEPS, Step, command_lines


def test_every_command_and_every_benchmark_that_a_page_cites_is_run() -> None:
    run = {tuple(step.line.split()[1:3]) for step in STEPS}
    assert set(command.commands) - {"all", "docs"} <= {name for name, _ in run}
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
    cited = {name for page in pages for name in re.findall(r"-m lab bench (\w+)", page.read_text("utf-8"))}
    assert {("bench", name) for name in cited - {*ELSEWHERE}} <= run
    assert not {("bench", name) for name in ELSEWHERE} & run


@pytest.mark.parametrize("scenes", [1, 1000])
def test_the_command_lines_are_understood(tmp_path: Path, scenes: int) -> None:
    (tmp_path / "experiments").mkdir()
    for words, _ in command_lines(tmp_path, 0.5, scenes):
        assert "{" not in "".join(words)
        command.commands[words[1]].make_context(words[1], words[2:])


def test_it_goes_on_behind_what_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steps = Step("lab nothing"), Step("lab chart {out}", needs=("no_such_program",)), Step("lab --help")
    monkeypatch.setattr(everything, "STEPS", steps)
    result = CliRunner().invoke(command, ["all", "-o", str(tmp_path)])
    assert result.exit_code == 1
    assert result.stderr.splitlines()[-1] == "failed: python -m lab nothing"
    failed, left, done = json.loads((tmp_path / "all.json").read_text())["steps"]
    assert (failed["exit"], left["needs"], done["exit"]) == (2, ["no_such_program"], 0)


@pytest.mark.slow
def test_everything_runs_at_its_smallest(tmp_path: Path) -> None:
    result = CliRunner().invoke(command, ["all", "-o", str(tmp_path)])
    assert result.exit_code == 0, result.stderr
    record = json.loads((tmp_path / "all.json").read_text())
    assert len(record["steps"]) == len(STEPS)
