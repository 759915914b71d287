"""`python -m lab` as a command line: trainings, benchmarks, scripts."""

from __future__ import annotations

import json
from pathlib import Path

import click
import pytest

from lab.cli import command as lab
from lab.training.config import CONFIGS
from tests.lab.conftest import run


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)


def write(name: str, text: str) -> str:
    Path(name).write_text(text)
    return name


def test_help_names_every_command_and_every_script() -> None:
    context = click.Context(lab)
    assert isinstance(lab, click.Group)
    for name in lab.list_commands(context):
        assert f"  {name} " in run("--help").stdout
        assert run(name, "--help").exit_code == 0
    assert "floor" in run("bench", "--help").stdout
    assert run("bench", "none").exit_code == 2
    assert "results" in run("docs", "--help").stdout


def test_scripts_get_their_arguments() -> None:
    assert "usage: python -m lab bench compile" in run("bench", "compile", "--help").stdout


def tiny_config(**changes: object) -> str:
    config = json.loads((CONFIGS / "shapes2d.json").read_text())
    config["phases"] = [{"objects": 2, "iterations": 6, "streams": 2}]
    config["scenes"]["points"] = 16
    return write("tiny.json", json.dumps({**config, **changes}))


@pytest.fixture
def one_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was trained is measured on one scene of each set, not on many."""
    monkeypatch.setattr("lab.sets.scenes.RECORDED", 1)


@pytest.mark.usefixtures("one_scene")
def test_train() -> None:
    arguments = ("train", tiny_config(), "-o", "run", "--device", "cpu", "--every", "2")
    result = run(*arguments)
    assert result.exit_code == 0
    assert result.stderr.startswith("starting the training of shapes2d at step 0 of 6, on cpu, in run\n")
    assert "2 of 6 steps" in result.stderr
    assert result.stdout.startswith("done, mean loss ")
    weights = Path("run/weights.safetensors").read_bytes()
    again = run(*arguments)
    assert again.exit_code == 0
    assert again.stderr == "going on with the training of shapes2d at step 6 of 6, on cpu, in run\n"
    assert Path("run/weights.safetensors").stat().st_size == len(weights)


@pytest.mark.usefixtures("one_scene")
def test_train_stops_at_its_budget() -> None:
    arguments = ("train", tiny_config(), "-o", "run", "--device", "cpu")
    result = run(*arguments, "--budget", "1e-9")
    assert result.exit_code == 0
    assert result.stdout.startswith("out of time")
    assert not Path("run/weights.safetensors").exists()
    assert run(*arguments).stdout.startswith("done")


@pytest.mark.usefixtures("one_scene")
def test_train_usage() -> None:
    name = tiny_config(nonsense=1)
    assert "nonsense" in run("train", name, "-o", "run").stderr
    assert run("train", "none.json", "-o", "run").exit_code == 2
    run("train", tiny_config(), "-o", "run", "--device", "cpu")
    other = run("train", tiny_config(seed=7), "-o", "run", "--device", "cpu")
    assert other.exit_code == 2
    assert "another configuration" in other.stderr
