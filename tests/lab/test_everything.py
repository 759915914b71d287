"""`scenelang lab all`: it names all that there is, goes on behind what fails, and runs."""

from __future__ import annotations

import importlib
import json
import re
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from scenelang.lab import everything
from scenelang.lab.commands import TABLE
from scenelang.lab.commands.all import command
from scenelang.lab.everything import ELSEWHERE, ROOT, STEPS, Step, command_lines


def test_every_command_and_every_benchmark_that_a_page_cites_is_run() -> None:
    run = {step.line.split()[1 if step.line.startswith("lab ") else 0] for step in STEPS}
    assert set(TABLE) - {"all"} <= run
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
    cited = {name for page in pages for name in re.findall(r"benchmarks[./](\w+)", page.read_text("utf-8"))}
    assert {f"benchmarks.{name}" for name in cited - {"py", *ELSEWHERE}} <= run
    assert not {f"benchmarks.{name}" for name in ELSEWHERE} & run


@pytest.mark.parametrize("scenes", [1, 1000])
def test_the_command_lines_are_understood(tmp_path: Path, scenes: int) -> None:
    (tmp_path / "experiments").mkdir()
    for words, _ in command_lines(tmp_path, 0.5, scenes):
        assert "{" not in "".join(words)
        if words[0] == "lab":
            made = importlib.import_module(f"scenelang.lab.commands.{words[1]}").command
            assert isinstance(made, click.Command)
            made.make_context(words[1], words[2:])
        else:
            assert (ROOT / f"{words[0].replace('.', '/')}.py").is_file()


def test_it_goes_on_behind_what_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steps = Step("lab nothing"), Step("lab chart {out}", needs=("no_such_program",)), Step("lab --help")
    monkeypatch.setattr(everything, "STEPS", steps)
    result = CliRunner().invoke(command, ["-o", str(tmp_path)])
    assert result.exit_code == 1
    assert result.stderr.splitlines()[-1] == "failed: scenelang lab nothing"
    failed, left, done = json.loads((tmp_path / "all.json").read_text())["steps"]
    assert (failed["exit"], left["needs"], done["exit"]) == (2, ["no_such_program"], 0)


@pytest.mark.slow
def test_everything_runs_at_its_smallest(tmp_path: Path) -> None:
    result = CliRunner().invoke(command, ["-o", str(tmp_path)])
    assert result.exit_code == 0, result.stderr
    record = json.loads((tmp_path / "all.json").read_text())
    assert len(record["steps"]) == len(STEPS)
